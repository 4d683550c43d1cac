"""Pictures of moving arms: the frames of a video, and a motion as one picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from armblocks.pictures.numbers import axis_number
from armblocks.pictures.picture import Picture, Polyline, Text
from armblocks.pictures.style import SMALL_SIZE, TEXT_SIZE, Tone
from armblocks.rendering.arm_drawing import (
    RASTER_SCALE,
    Stage,
    arm_raster,
    floor_marks,
    grid_note,
    path_marks,
    position_text,
)
from armblocks.rendering.camera import AZIMUTH, ELEVATION
from armblocks.robot import Robot

_Array = NDArray[np.float64]

FRAMED_POSES = 60
"""Maximum number of poses from which the camera of a motion is placed."""
FILM_RASTER_SCALE = 1.0
"""Rendered pixels of the bodies per px of a frame: videos have one pixel per px."""
_NARROW = 420.0
"""Frames narrower than this, px, show the time without the position of the tool."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ArmMotion:
    """A motion of one robot: ``time`` (N,) s ascending, ``poses`` (N, L+2, 4, 4) of base, links and tool."""

    robot: Robot
    time: _Array
    poses: _Array

    @cached_property
    def path(self) -> _Array:
        """The path of the tool in the world, (N, 3) m."""
        return self.poses[:, -1, :3, 3]

    def nearest(self, time: float) -> int:
        """The index of the sample nearest to a time (s)."""
        after = int(np.searchsorted(self.time, time))
        if after == 0:
            return 0
        if after == len(self.time):
            return after - 1
        return after if self.time[after] - time < time - self.time[after - 1] else after - 1


@dataclass(frozen=True, eq=False)
class MotionView:
    """The pictures of one motion by one camera, which shows the whole motion."""

    motion: ArmMotion
    stage: Stage
    floor: list[Polyline]

    @classmethod
    def of(
        cls,
        motion: ArmMotion,
        width: float,
        height: float,
        *,
        view: tuple[float, float] = (AZIMUTH, ELEVATION),
        raster_scale: float = RASTER_SCALE,
    ) -> MotionView:
        """The view of a motion in ``width`` x ``height`` px; ``view``: azimuth and elevation, degrees."""
        samples = spread(len(motion.time), FRAMED_POSES)
        stage = Stage.framing(
            motion.robot,
            motion.poses[samples],
            motion.path,
            width,
            height,
            margin=26.0,
            view=view,
            raster_scale=raster_scale,
        )
        return cls(motion, stage, floor_marks(stage))

    def frame(self, time: float) -> Picture:
        """The arm at a time (s), the path of its tool, and the time as text."""
        k = self.motion.nearest(time)
        picture = self._panel(f"{self.motion.robot.name} at {axis_number(time)} s")
        meshes = self.stage.meshes(self.motion.poses[k])
        body = self.stage.render(meshes)
        picture.add(arm_raster(self.stage, meshes, body, None))
        picture.extend(path_marks(self.stage, body, self.motion.path, k))
        picture.add(Text(8, 20, f"t = {time:.2f} s", size=TEXT_SIZE, bold=True))
        if self.stage.width >= _NARROW:
            self._add_position(picture, k)
        return picture

    def still(self) -> Picture:
        """The last pose, the first pose (transparent), and the path of the tool."""
        last = len(self.motion.time) - 1
        picture = self._panel(f"Motion of {self.motion.robot.name}")
        start, end = (position_text(self.motion.path[k]) for k in (0, last))
        picture.description = f"The tool goes from {start} to {end}; pale: the pose at the start."
        first_body = self.stage.render(self.stage.meshes(self.motion.poses[0]))
        meshes = self.stage.meshes(self.motion.poses[last])
        body = self.stage.render(meshes)
        picture.add(arm_raster(self.stage, meshes, body, first_body if last else None))
        picture.extend(path_marks(self.stage, body, self.motion.path, last))
        return picture

    def _panel(self, title: str) -> Picture:
        picture = Picture(width=self.stage.width, height=self.stage.height, title=title)
        picture.extend(self.floor)
        picture.add(grid_note(self.stage))
        return picture

    def _add_position(self, picture: Picture, k: int) -> None:
        text = position_text(self.motion.path[k])
        picture.add(
            Text(self.stage.width - 8, 20, text, size=SMALL_SIZE, tone=Tone.MUTED, anchor="end"),
        )


@dataclass(frozen=True, eq=False)
class FilmView:
    """The frames of a video: one panel for each motion, side by side, at the same time."""

    views: tuple[MotionView, ...]

    @classmethod
    def of(
        cls,
        motions: Sequence[ArmMotion],
        width: int,
        height: int,
        *,
        view: tuple[float, float] = (AZIMUTH, ELEVATION),
    ) -> FilmView:
        """A video of ``width`` x ``height`` px; the motions share the width."""
        panel_width = width // len(motions)
        return cls(
            tuple(
                MotionView.of(motion, panel_width, height, view=view, raster_scale=FILM_RASTER_SCALE)
                for motion in motions
            )
        )

    def frame(self, time: float) -> Picture:
        """All arms at a time (s)."""
        pictures = [view.frame(time) for view in self.views]
        if len(pictures) == 1:
            return pictures[0]
        picture = Picture(
            width=sum(panel.width for panel in pictures), height=pictures[0].height, title=pictures[0].title
        )
        left = 0.0
        for panel, view in zip(pictures, self.views):
            picture.place(panel, left, 0.0)
            name = Text(left + 8, 36, view.motion.robot.name, size=SMALL_SIZE, tone=Tone.MUTED)
            picture.add(name)
            if left:
                ends = [(left, 0.0), (left, panel.height)]
                picture.add(Polyline(ends, stroke=Tone.HAIRLINE, sharp=True))
            left += panel.width
        return picture


def spread(count: int, most: int) -> NDArray[np.intp]:
    """At most ``most`` evenly spaced indices below ``count``, including the first and the last."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).astype(np.intp))


def resampled(robot: Robot, time: _Array, q: _Array, times: _Array) -> _Array:
    """Coordinates (K, nq) at other times (K,) s, linear between the rows of ``q`` (N, nq) at ``time`` (N,).

    The quaternions of a ball joint change their sign between two rows if this reduces their distance. The
    interpolated quaternions are not normalised.
    """
    rows = q.copy()
    first = 0
    for joint in robot.joints:
        for motion in joint.motions:
            count = len(motion.positions)
            if motion.speeds != motion.positions:
                quaternion = rows[:, first : first + count]
                turned = (quaternion[1:] * quaternion[:-1]).sum(axis=1) < 0
                quaternion[1:][np.cumsum(turned) % 2 == 1] *= -1.0
            first += count
    columns: list[_Array] = [np.interp(times, time, column) for column in rows.T]
    return np.stack(columns, axis=1)

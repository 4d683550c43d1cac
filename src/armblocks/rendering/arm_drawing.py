"""Drawings of an arm: one pose, or several poses of a motion with the path of the tool."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import counted
from armblocks.pictures.numbers import axis_number, nice_step
from armblocks.pictures.picture import Disc, Picture, Polyline, Raster, Rectangle, Text
from armblocks.pictures.style import FIGURE_WIDTH, SMALL_SIZE, TEXT_SIZE, Theme, Tone
from armblocks.pictures.svg import svg_file
from armblocks.rendering.camera import AZIMUTH, ELEVATION, Camera
from armblocks.rendering.render import Rendering, composite, crop, render, shadow, with_opacity
from armblocks.robot import Robot
from armblocks.robot.geometry import Body, link_frames, reach, robot_bodies
from armblocks.robot.rod_bars import RodBar, rod_bars, with_bars
from armblocks.robot.shapes import Housing, Material
from armblocks.robot.triangles import TriangleMesh, triangles

_Array = NDArray[np.float64]

RASTER_SCALE = 2.0
"""Rendered pixels of the bodies per px of the figure."""
START_POSE_OPACITY = 0.26
"""Opacity of the start pose."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Stage:
    """The common data of all panels of a figure: bodies, bars of rods, floor, camera, panel size in px."""

    bodies: tuple[Body, ...]
    bars: tuple[RodBar, ...]
    pedestal: tuple[TriangleMesh, ...]
    camera: Camera
    floor: float
    grid: tuple[float, float, float, float, float]
    """Spacing, then minimum x, maximum x, minimum y, maximum y of the floor grid, m."""
    width: float
    height: float
    raster_scale: float = RASTER_SCALE
    """Rendered pixels of the bodies per px of the figure."""

    @classmethod
    def framing(
        cls,
        robot: Robot,
        poses: _Array,
        path: _Array,
        width: float,
        height: float,
        *,
        margin: float = 10.0,
        view: tuple[float, float] = (AZIMUTH, ELEVATION),
        raster_scale: float = RASTER_SCALE,
    ) -> Stage:
        """A stage with a camera that shows all ``poses`` (K, L+2, 4, 4) and the ``path`` (N, 3) m.

        ``view``: azimuth and elevation of the camera, degrees.
        """
        bodies, bars = robot_bodies(robot), rod_bars(robot)
        corner_points = [
            body.mesh.corners.reshape(-1, 3) @ pose[body.row, :3, :3].T + pose[body.row, :3, 3]
            for pose in (with_bars(bars, pose) for pose in poses)
            for body in bodies
        ]
        points = np.concatenate([*corner_points, path])
        low, high = points.min(axis=0), points.max(axis=0)
        spacing = nice_step(float((high - low).max()) / 8)
        feet = [c for c, body in zip(corner_points, bodies) if body.row == 0]
        base_height = float(np.concatenate(feet)[:, 2].min()) if feet else float(low[2])
        # The arm is on the floor, or on a pedestal if a pose reaches below its base.
        floor = base_height
        if low[2] < base_height - 0.02 * reach(robot):
            floor = math.floor(float(low[2]) / (spacing / 2)) * (spacing / 2)
        x0, y0 = ((math.floor(float(v) / spacing) - 8) * spacing for v in low[:2])
        x1, y1 = ((math.ceil(float(v) / spacing) + 8) * spacing for v in high[:2])
        floor_corners = np.array([(x, y, floor) for x in (low[0], high[0]) for y in (low[1], high[1])])
        # The camera also shows the part of the floor below the arm.
        camera = Camera.framing(
            np.concatenate([points, floor_corners]),
            width,
            height,
            margin=margin,
            azimuth=view[0],
            elevation=view[1],
        )
        return cls(
            bodies=bodies,
            bars=bars,
            pedestal=_pedestal(robot, base_height, floor),
            camera=camera,
            floor=floor,
            grid=(spacing, x0, x1, y0, y1),
            width=width,
            height=height,
            raster_scale=raster_scale,
        )

    def meshes(self, pose: _Array) -> list[TriangleMesh]:
        """The bodies and the pedestal in world coordinates, for one pose (L+2, 4, 4) of the links."""
        all_poses = with_bars(self.bars, pose)
        return [*(body.mesh.moved(all_poses[body.row]) for body in self.bodies), *self.pedestal]

    def render(self, meshes: Sequence[TriangleMesh]) -> Rendering:
        """Bodies in the world, shaded."""
        return render(meshes, self.camera, self.width, self.height, self.raster_scale)


def pose_sequence_picture(
    robot: Robot, time: _Array, poses: _Array, *, count: int = 6, columns: int = 3
) -> Picture:
    """The robot at equally spaced times of a run, with the tool's path; the start pose is transparent.

    ``time`` (N,) s, ``poses`` (N, L+2, 4, 4): base, links and tool in the world.
    """
    sample_times: _Array = np.linspace(float(time[0]), float(time[-1]), count)
    samples = [int(np.argmin(np.abs(time - sample_time))) for sample_time in sample_times.tolist()]
    path = poses[:, -1, :3, 3]
    gap = 12.0
    width = (FIGURE_WIDTH - gap * (columns - 1)) / columns
    width = math.floor(width)
    height, caption = round(width * 0.84), 34.0
    stage = Stage.framing(robot, poses[samples], path, width, height, margin=16.0)
    start_pose = stage.render(stage.meshes(poses[samples[0]]))
    floor = floor_marks(stage)
    rows = math.ceil(count / columns)
    picture = Picture(
        width=FIGURE_WIDTH,
        height=rows * (height + caption) + (rows - 1) * gap + 22,
        title=f"{robot.name} at {counted(count, 'time')}",
        description=(
            f"The arm {robot.name} at "
            + ", ".join(f"{axis_number(float(time[k]))} s" for k in samples)
            + f"; the tool goes from {position_text(path[samples[0]])} to {position_text(path[samples[-1]])}."
        ),
    )
    for number, k in enumerate(samples):
        left = (number % columns) * (width + gap)
        top = (number // columns) * (height + caption + gap)
        panel = Picture(width=width, height=height + caption, title="")
        panel.add(Rectangle(0.5, 0.5, width - 1, height - 1, radius=6, fill=Tone.SUNKEN))
        panel.extend(floor)
        meshes = stage.meshes(poses[k])
        body = start_pose if number == 0 else stage.render(meshes)
        panel.add(arm_raster(stage, meshes, body, None if number == 0 else start_pose))
        panel.extend(path_marks(stage, body, path, k))
        panel.add(
            Text(2, height + 16, f"t = {axis_number(float(time[k]))} s", size=TEXT_SIZE, bold=True),
            Text(
                width - 2, height + 16, position_text(path[k]), size=SMALL_SIZE, tone=Tone.MUTED, anchor="end"
            ),
        )
        picture.place(panel, left, top)
    note = f"Floor grid {axis_number(stage.grid[0])} m, floor at z = {axis_number(stage.floor, 3)} m"
    if len(samples) > 1:
        note += "; pale: the pose at the start"
    picture.add(Text(2, picture.height - 6, note, size=SMALL_SIZE, tone=Tone.MUTED))
    return picture


def arm_picture(
    robot: Robot,
    q: Sequence[float],
    *,
    width: float = 420.0,
    height: float = 340.0,
    view: tuple[float, float] = (AZIMUTH, ELEVATION),
) -> Picture:
    """The robot at joint coordinates ``q`` (nq,) rad or m, on its floor.

    ``view``: azimuth and elevation of the camera, degrees.
    """
    poses = link_frames(robot, q)
    stage = Stage.framing(robot, poses[None], poses[None, -1, :3, 3], width, height, view=view)
    picture = Picture(
        width=width,
        height=height,
        title=robot.name,
        description=f"The arm {robot.name} with its tool at {position_text(poses[-1, :3, 3])}.",
    )
    picture.extend(floor_marks(stage))
    meshes = stage.meshes(poses)
    picture.add(arm_raster(stage, meshes, stage.render(meshes), None), grid_note(stage))
    return picture


def grid_note(stage: Stage) -> Text:
    """The spacing of the floor grid, at the lower left corner."""
    text = f"grid {axis_number(stage.grid[0])} m"
    return Text(8, stage.height - 8, text, size=SMALL_SIZE, tone=Tone.MUTED)


def arm_picture_svg(
    robot: Robot, q: Sequence[float], size: tuple[float, float] = (420.0, 340.0), theme: Theme | None = None
) -> str:
    """:func:`arm_picture` as an SVG document; ``theme`` ``None`` follows the reader's preference."""
    return svg_file(arm_picture(robot, q, width=size[0], height=size[1]), theme=theme)


def arm_raster(
    stage: Stage, meshes: Sequence[TriangleMesh], body: Rendering, start_pose: Rendering | None
) -> Raster:
    """Shadow, start pose and body as one image in the panel, without its empty margin."""
    scale = stage.raster_scale
    rows, columns = round(stage.height * scale), round(stage.width * scale)
    canvas = np.zeros((rows, columns, 4), dtype=np.uint8)
    half = scale / 2
    shadow_pixels = shadow(meshes, stage.camera, stage.floor, stage.width, stage.height, half)
    doubled = np.repeat(np.repeat(shadow_pixels, 2, axis=0), 2, axis=1)[:rows, :columns]
    canvas[: doubled.shape[0], : doubled.shape[1]] = doubled
    for layer, strength in ((start_pose, START_POSE_OPACITY), (body, 1.0)):
        if layer is None:
            continue
        pixels = layer.pixels if strength == 1.0 else with_opacity(layer.pixels, strength)
        window = canvas[layer.top : layer.top + pixels.shape[0], layer.left : layer.left + pixels.shape[1]]
        window[:] = composite(pixels, window)
    pixels, left, top = crop(canvas)
    return Raster(
        left / scale,
        top / scale,
        pixels.shape[1] / scale,
        pixels.shape[0] / scale,
        pixels,
    )


def floor_marks(stage: Stage) -> list[Polyline]:
    """The floor grid up to the panel's edge."""
    spacing, x0, x1, y0, y1 = stage.grid
    xs = [x0 + k * spacing for k in range(round((x1 - x0) / spacing) + 1)]
    ys = [y0 + k * spacing for k in range(round((y1 - y0) / spacing) + 1)]
    ends = [*(((x, y0), (x, y1)) for x in xs), *(((x0, y), (x1, y)) for y in ys)]
    marks: list[Polyline] = []
    for a, b in ends:
        line = stage.camera.to_pixels(np.array([(*a, stage.floor), (*b, stage.floor)]))
        shown = _clipped(line, stage.width, stage.height)
        if shown is not None:
            marks.append(Polyline(shown, stroke=Tone.HAIRLINE, width=0.7, sharp=True))
    return marks


def _clipped(line: _Array, width: float, height: float) -> _Array | None:
    """The part of a line segment (2, 2) inside the panel; None if it is outside (Liang and Barsky 1984)."""
    start, step = line[0], line[1] - line[0]
    enter, leave = 0.0, 1.0
    for axis, limit in ((0, width), (1, height)):
        inset = 1.0
        if step[axis] == 0:
            if not inset <= start[axis] <= limit - inset:
                return None
            continue
        t0, t1 = sorted(((inset - start[axis]) / step[axis], (limit - inset - start[axis]) / step[axis]))
        enter, leave = max(enter, float(t0)), min(leave, float(t1))
    return np.stack([start + enter * step, start + leave * step]) if enter < leave else None


def path_marks(stage: Stage, body: Rendering, path: _Array, current: int) -> list[Polyline | Disc]:
    """The future path as a dotted line; the past path fades with age and is dim behind bodies."""
    x, y, inverse_depth = stage.camera.project(path)
    points = np.column_stack([x, y])
    hidden = body.inverse_depth_at(x, y) > inverse_depth * 1.01
    marks: list[Polyline | Disc] = []
    if current < len(path) - 1:
        marks.append(
            Polyline(_thinned(points[current:]), stroke=Tone.MUTED, width=1.0, dash=(1.5, 3.0), opacity=0.8)
        )
    segment_count = 14
    bounds = np.unique(np.linspace(0, current, segment_count + 1).astype(int))
    for first, last in pairwise(bounds.tolist()):
        age = 1.0 - last / max(current, 1)
        for a, b, behind in _runs(hidden, first, last):
            opacity = (0.18 if behind else 1.0) * (1.0 - 0.62 * age)
            marks.append(
                Polyline(_thinned(points[a : b + 1]), stroke=Tone.TRACE_0, width=2.0, opacity=opacity)
            )
    (x0, y0), (x1, y1) = points[0].tolist(), points[current].tolist()
    marks.append(Disc(x0, y0, 3.0, fill=Tone.SURFACE, stroke=Tone.TRACE_0, stroke_width=1.5))
    marks.append(Disc(x1, y1, 3.6, fill=Tone.TRACE_0, stroke=Tone.SURFACE, stroke_width=1.0))
    return marks


def _runs(flags: NDArray[np.bool_], first: int, last: int) -> list[tuple[int, int, bool]]:
    """Maximal index ranges ``a..b`` of equal flags within ``first..last``; neighbours share an index."""
    runs: list[tuple[int, int, bool]] = []
    start = first
    for k in range(first, last):
        if k + 1 == last or flags[k + 1] != flags[start]:
            runs.append((start, k + 1, bool(flags[start])))
            start = k + 1
    return runs


def _thinned(points: _Array, tolerance: float = 0.6) -> _Array:
    """One point for every ``4 * tolerance`` px of the line, with the first and the last point."""
    if len(points) < 3:
        return points
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    indices = np.unique(np.searchsorted(length, np.arange(0.0, length[-1], 4 * tolerance)))
    return points[np.unique(np.concatenate([[0], indices, [len(points) - 1]]))]


def _pedestal(robot: Robot, base_height: float, floor: float) -> tuple[TriangleMesh, ...]:
    """A column from the robot's base down to the floor, if there is a gap and the base is upright."""
    gap = base_height - floor
    if gap < 0.01 * reach(robot) or robot.base.rotation[2][2] < 0.7:
        return ()
    r = 0.06 * reach(robot)
    x, y, _ = robot.base.translation
    column = _cone(1.15 * r, 1.05 * r, gap)
    plate = _cone(1.9 * r, 1.8 * r, 0.15 * r)
    placement = np.eye(4)
    placement[:3, 3] = (x, y, floor)
    return tuple(triangles(shape).moved(placement) for shape in (column, plate))


def _cone(lower: float, upper: float, length: float) -> Housing:
    start, end = (lower, lower), (upper, upper)
    return Housing(start=start, end=end, length=length, roundness=1.0, material=Material.BASE)


def position_text(p: _Array) -> str:
    """A position (3,) m as text with two decimals."""
    x, y, z = (axis_number(round(float(v), 2) + 0.0) for v in p)
    return f"x {x}  y {y}  z {z} m"

"""Pictures and videos of arms as files, without a browser: ``save=`` of ``Arm.plot`` and ``Arm.animate``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.errors import InputError, UnknownNameError, counted
from armblocks.face.arm_functions import ConfigurationFunction
from armblocks.files import write_atomically
from armblocks.pictures.film import (
    FILM_SUFFIXES,
    FilmProgress,
    check_film,
    exact_rate,
    frame_times,
    write_film,
)
from armblocks.pictures.style import Theme
from armblocks.rendering.arm_drawing import arm_picture
from armblocks.rendering.arm_film import ArmMotion, FilmView, MotionView, resampled, spread
from armblocks.rendering.camera import AZIMUTH, ELEVATION
from armblocks.robot import Robot
from armblocks.robot.fields import numbers
from armblocks.robot.geometry import link_frames

if TYPE_CHECKING:
    from armblocks.pictures.picture import Picture

Array = NDArray[np.float64]

PICTURE_SUFFIXES = (".png", ".svg", ".pdf")
PICTURE_SIZE = (640, 480)
FILM_SIZE = (960, 720)
"""Default width and height, px."""
MIN_SIDE, MAX_PICTURE_SIDE, MAX_FILM_SIDE = 64, 1600, 1920
"""Limits of width and height, px. A picture has two pixels for each px, a video has one."""
MAX_PATH_POINTS = 2000
"""Maximum number of points of the tool's path in a picture."""
MAX_ROWS = 200_000
"""Maximum number of configurations of a motion."""
TOOLBOX_INTERVAL = 0.05
"""Interval between the rows of a motion without times, s; the same as in the Python toolbox."""


class ShownArm(Protocol):
    """The part of :class:`Arm` that views use."""

    @property
    def robot(self) -> Robot:
        """The description of the arm."""
        ...

    @property
    def name(self) -> str:
        """The robot's name."""
        ...

    @property
    def nq(self) -> int:
        """The number of coordinates."""
        ...

    def neutral(self) -> Array:
        """The coordinates (nq,) without joint motion."""
        ...

    @cached_property
    def link_poses(self) -> ConfigurationFunction:
        """The poses (L+2, 4, 4) of base, links and tool."""
        ...


@dataclass(frozen=True, kw_only=True)
class Appearance:
    """The appearance of a picture or video: theme, ``size`` in px, azimuth and elevation of the camera,
    degrees."""

    theme: Theme | None = None
    size: tuple[int, int] | None = None
    view: tuple[float, float] = (AZIMUTH, ELEVATION)

    @classmethod
    def checked(cls, theme: object, size: object, view: object, where: str) -> Appearance:
        """The arguments of a call. Raises ``UnknownNameError`` and ``InputError``."""
        if theme not in ("light", "dark", None):
            raise UnknownNameError("theme", str(theme), ("light", "dark"), where=where)
        camera = (AZIMUTH, ELEVATION) if view is None else _pair(view, "view", where)
        if not -90.0 <= camera[1] <= 90.0:
            raise InputError(
                f"the elevation of the camera is {camera[1]:g} degrees",
                where=f"view of {where}",
                allowed="-90 to 90 degrees",
                fix="give view=(azimuth, elevation) in degrees",
            )
        sides = None if size is None else _pair(size, "size", where)
        pixels = None if sides is None else (round(sides[0]), round(sides[1]))
        return cls(theme="dark" if theme == "dark" else "light" if theme else None, size=pixels, view=camera)

    def sides(self, default: tuple[int, int], most: int, where: str) -> tuple[int, int]:
        """Width and height, px. Raises ``InputError`` out of the limits."""
        size = self.size or default
        if not all(MIN_SIDE <= side <= most for side in size):
            raise InputError(
                f"size is {size[0]} x {size[1]} px",
                where=where,
                allowed=f"{MIN_SIDE} to {most} px on each side",
                fix=f"give size=({default[0]}, {default[1]})",
            )
        return size


def _pair(value: object, name: str, where: str) -> tuple[float, float]:
    pair = numbers(cast("ArrayLike", value), where=f"{name} of {where}")
    if pair.shape != (2,) or not np.isfinite(pair).all():
        raise InputError(
            f"{name} is {value!r}",
            where=where,
            allowed="two finite numbers",
            fix="give (width, height) in px" if name == "size" else "give (azimuth, elevation) in degrees",
        )
    return float(pair[0]), float(pair[1])


def checked_rows(arm: ShownArm, q: ArrayLike | None, where: str) -> Array:
    """Configurations (N, nq): of one configuration (nq,), of several, or the neutral one for ``None``.

    Raises ``InputError`` for a wrong shape, numbers that are not finite, and quaternions of zeros.
    """
    rows = arm.neutral() if q is None else numbers(q, where=f"q of {where}")
    if rows.ndim == 1:
        rows = rows[None]
    if rows.ndim != 2 or rows.shape[1] != arm.nq or not len(rows):
        raise InputError(
            f"q has the shape {np.shape(rows if q is None else q)}",
            where=where,
            allowed=f"({arm.nq},) for a configuration, (N, {arm.nq}) for a motion",
            fix=f"give {counted(arm.nq, 'coordinate')} for each configuration",
        )
    finite = np.isfinite(rows).all(axis=1)
    if not finite.all():
        raise InputError(
            f"row {int(np.argmin(finite))} of q is not finite",
            where=where,
            allowed="finite coordinates, rad or m",
            fix="remove the rows that are NaN or infinite",
        )
    if len(rows) > MAX_ROWS:
        raise InputError(
            f"q has {len(rows)} rows",
            where=where,
            allowed=f"at most {MAX_ROWS} rows",
            fix="give every k-th row, q[::k]",
        )
    return rows


def checked_times(t: ArrayLike | None, count: int, where: str) -> Array:
    """The times (N,) s of a motion: given times, or a number for the interval between rows."""
    given = numbers(TOOLBOX_INTERVAL if t is None else t, where=f"dt of {where}")
    if given.ndim == 0 and np.isfinite(given) and given > 0:
        return float(given) * np.arange(count, dtype=np.float64)
    if given.shape != (count,) or not np.isfinite(given).all() or not (np.diff(given) > 0).all():
        raise InputError(
            f"dt = {float(given):g}" if given.ndim == 0 else f"dt has the shape {given.shape}",
            where=where,
            allowed=f"a positive number of s between two rows, or {counted(count, 'ascending time')}",
            fix="give dt=0.05",
        )
    return given


def poses_of(arm: ShownArm, rows: Array, where: str) -> Array:
    """Poses (N, L+2, 4, 4) of base, links and tool. Raises ``InputError`` for quaternions of zeros."""
    few = len(rows) <= 60  # compiling the poses takes longer
    poses = np.stack([link_frames(arm.robot, q) for q in rows.tolist()]) if few else arm.link_poses(rows)
    finite = np.isfinite(poses).all(axis=(1, 2, 3))
    if not finite.all():
        raise InputError(
            f"row {int(np.argmin(finite))} of q has a quaternion of zeros",
            where=where,
            allowed="quaternions w x y z with a direction",
            fix="begin with arm.neutral(), whose quaternions are 1 0 0 0",
        )
    return poses


def save_picture(arm: ShownArm, rows: Array, path: str | PathLike[str], look: Appearance) -> Path:
    """Draw a configuration, or a motion as its last pose with the path of the tool, into a file."""
    where = f"plot of robot '{arm.name}'"
    width, height = look.sides(PICTURE_SIZE, MAX_PICTURE_SIDE, where)
    target = Path(path)
    _check_suffix(target, PICTURE_SUFFIXES)
    if len(rows) == 1:
        poses_of(arm, rows, where)
        q = rows[0].tolist()
        picture = arm_picture(arm.robot, q, width=width, height=height, view=look.view)
    else:
        poses = poses_of(arm, rows[spread(len(rows), MAX_PATH_POINTS)], where)
        motion = ArmMotion(robot=arm.robot, time=np.arange(float(len(poses))), poses=poses)
        picture = MotionView.of(motion, width, height, view=look.view).still()
    write_atomically(target, picture_encoder(target)(picture, look.theme))
    return target


def _check_suffix(path: Path, suffixes: tuple[str, ...]) -> None:
    if path.suffix.lower() not in suffixes:
        raise UnknownNameError("format of pictures", path.suffix, suffixes, where=str(path))


def picture_encoder(path: Path) -> Callable[[Picture, Theme | None], bytes]:
    """The function that writes a picture in the format of the suffix, which is in ``PICTURE_SUFFIXES``."""
    match path.suffix.lower():
        case ".svg":
            from armblocks.pictures.svg import svg_file

            return lambda picture, theme: svg_file(picture, theme=theme).encode()
        case ".pdf":
            from armblocks.pictures.pdf import picture_pdf

            return lambda picture, theme: picture_pdf(picture, theme=theme or "light")
        case _:
            from armblocks.pictures.png import picture_png

            return lambda picture, theme: picture_png(picture, theme=theme or "light")


def save_animation(
    arm: ShownArm,
    rows: Array,
    time: Array,
    path: str | PathLike[str],
    look: Appearance,
    *,
    rate: float,
    speed: float,
    progress: FilmProgress | None,
) -> Path:
    """Write a motion as a video, or as one picture with the path of the tool."""
    where = f"animate of robot '{arm.name}'"
    target = Path(path)
    if target.suffix.lower() not in FILM_SUFFIXES:
        _check_suffix(target, (*FILM_SUFFIXES, *PICTURE_SUFFIXES))
        return save_picture(arm, rows, path, look)
    checked_rate(rate, speed, where)
    width, height = look.sides(FILM_SIZE, MAX_FILM_SIDE, where)
    rate = exact_rate(target, rate)
    times = frame_times(float(time[0]), float(time[-1]), rate, speed)
    check_film(target, len(times), (width, height))
    coordinates = resampled(arm.robot, time, rows, times)
    motion = ArmMotion(robot=arm.robot, time=times, poses=poses_of(arm, coordinates, where))
    return write_arm_film(target, [motion], times, (width, height), look, rate, progress)


def write_arm_film(
    path: Path,
    motions: list[ArmMotion],
    times: Array,
    size: tuple[int, int],
    look: Appearance,
    rate: float,
    progress: FilmProgress | None,
) -> Path:
    """Draw and encode the frames at ``times`` (s) of motions that are shown side by side."""
    from armblocks.pictures.png import picture_pixels

    film = FilmView.of(motions, *size, view=look.view)
    theme: Theme = look.theme or "light"
    seconds = times.tolist()
    return write_film(
        path,
        lambda k: picture_pixels(film.frame(seconds[k]), theme=theme, scale=1.0),
        len(seconds),
        rate,
        progress,
    )


def checked_rate(rate: float, speed: float, where: str) -> None:
    """Check the frames per second and the speed of a video. Raises ``InputError``."""
    if not 0.1 <= rate <= 60.0:
        raise InputError(
            f"rate = {rate:g}", where=where, allowed="0.1 to 60 frames per second", fix="give rate=25"
        )
    if not 1e-6 <= speed <= 1e6:
        raise InputError(
            f"speed = {speed:g}",
            where=where,
            allowed="a positive number: 2 plays the motion twice as fast",
            fix="give speed=1",
        )

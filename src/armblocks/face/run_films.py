"""Videos of runs: the arms of a diagram in motion."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Literal

import numpy as np

from armblocks.diagram import Diagram
from armblocks.errors import InputError, check_type, counted
from armblocks.face.arm_pictures import (
    FILM_SIZE,
    MAX_FILM_SIDE,
    Appearance,
    checked_rate,
    write_arm_film,
)
from armblocks.face.model import CompiledDiagram, given_diagram
from armblocks.pictures.film import FilmProgress, check_film, exact_rate, frame_times
from armblocks.rendering.arm_film import ArmMotion, resampled
from armblocks.robot.geometry import link_frames
from armblocks.simulation import SimulationResult

MAX_ARMS = 4
"""Maximum number of arms in a video."""


def write_film(
    path: str | PathLike[str],
    diagram: Diagram | CompiledDiagram | str | PathLike[str],
    result: SimulationResult,
    *,
    rate: float = 25.0,
    speed: float = 1.0,
    theme: Literal["light", "dark"] = "light",
    size: tuple[int, int] = FILM_SIZE,
    view: tuple[float, float] | None = None,
    progress: FilmProgress | None = None,
) -> Path:
    """Write a video of the arms of a run, side by side, as a ``.mp4`` or ``.gif`` file; returns the path.

    The video shows the arms of the report: one for each signal of joint coordinates, at most four.

    - ``rate``: frames per second.
    - ``speed``: 2 plays the run twice as fast.
    - ``theme``: ``"light"`` or ``"dark"``.
    - ``size``: width and height, px.
    - ``view``: azimuth and elevation of the camera, degrees.
    - ``progress(done, all)`` is called after each frame. The file is replaced when the video is complete;
      Ctrl-C leaves an existing file unchanged.

    Raises InputError if the diagram has no moving arm and for values out of range, UnknownNameError for
    another suffix, MissingLibraryError without the extra ``film``, FormatError if the file cannot be written.
    """
    from armblocks.report.motion import moving_arms

    diagram = given_diagram(diagram, "write_film")
    check_type(result, SimulationResult, "the result of simulate", where="write_film")
    where = f"video of '{diagram.name}'"
    look = Appearance.checked(theme, size, view, where)
    target = Path(path)
    rate = exact_rate(target, rate) if rate > 0 else rate
    checked_rate(rate, speed, where)
    sides = look.sides(FILM_SIZE, MAX_FILM_SIDE, where)
    arms = moving_arms(diagram, result) if len(result.time) else ()
    if not arms:
        raise InputError(
            "the run has no moving arm",
            where=where,
            allowed="a diagram with a robot block whose joint coordinates q are recorded",
            fix="add a Robot Plot to the diagram",
        )
    if len(arms) > MAX_ARMS:
        raise InputError(
            f"the run has {counted(len(arms), 'arm')}",
            where=where,
            allowed=f"at most {MAX_ARMS} arms in a video",
            fix="write a video of each arm with Arm.animate",
        )
    times = frame_times(float(result.time[0]), float(result.time[-1]), rate, speed)
    check_film(target, len(times), sides)
    motions: list[ArmMotion] = []
    for arm in arms:
        q = resampled(arm.robot, result.time, np.asarray(result[arm.q]), times)
        poses = np.stack([link_frames(arm.robot, row) for row in q.tolist()])
        motions.append(ArmMotion(robot=arm.robot, time=times, poses=poses))
    return write_arm_film(target, motions, times, sides, look, rate, progress)

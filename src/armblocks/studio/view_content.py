"""The contents of views of an arm: its bodies, a configuration with sliders, or a motion."""

from __future__ import annotations

import hashlib
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import ArmblocksError
from armblocks.rendering.arm_drawing import arm_picture_svg
from armblocks.robot import Robot
from armblocks.robot.geometry import link_frames
from armblocks.studio.protocol.frames import sample_frame
from armblocks.studio.robots.scene import scene_of

Array = NDArray[np.float64]

PATH = "arm"
"""The block path under which the front end finds the poses of a motion."""
MAX_VIEW_ROWS = 5000
"""Maximum number of poses of a motion in a view; of longer motions, every k-th pose is shown."""
DRAWING_SIZE = (480, 360)
"""Width and height of the static drawing for browsers without WebGL, px."""
LENGTH_RANGE = 1.0
"""Range of the slider of a prismatic joint without limits, ± m."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ViewContent:
    """The content of a view: a JSON object, a binary frame of samples, the robot of the sliders."""

    title: str
    shown: dict[str, Any]
    frame: bytes
    robot: Robot
    q: Array


def arm_content(robot: Robot, q: Array) -> ViewContent:
    """The content of a view with one configuration and a slider for each coordinate."""
    shown: dict[str, Any] = {
        "key": robot.name,
        "run": None,
        "scopes": False,
        "arm": _arm(robot, q),
        "joints": {"sliders": _sliders(robot), "q": q.tolist()},
        "play": False,
    }
    return ViewContent(title=f"Robot {robot.name}", shown=shown, frame=b"", robot=robot, q=q)


def motion_content(robot: Robot, q: Array, time: Array, poses: Array) -> ViewContent:
    """The content of a view of a motion; the playback starts automatically."""
    step = -(-len(time) // MAX_VIEW_ROWS)
    time, poses = time[::step], poses[::step]
    columns = np.ascontiguousarray(poses.reshape(len(time), -1).T)
    signal = f"{PATH}/poses"
    run = {
        "stopTime": float(time[-1]),
        "channels": [
            {
                "name": signal,
                "shape": list(poses.shape[1:]),
                "unit": "",
                "entries": [],
                "title": "",
            }
        ],
        "views": [{"block": PATH, "kind": "robot", "signals": ["poses"], "labels": [], "title": ""}],
        "aliases": {signal: signal},
    }
    key = hashlib.sha256(time.tobytes() + columns.tobytes()).hexdigest()[:16]
    shown: dict[str, Any] = {
        "key": key,
        "run": run,
        "scopes": False,
        "arm": _arm(robot, q[0]),
        "joints": None,
        "play": True,
    }
    frame = sample_frame(key, 0, time, columns)
    return ViewContent(title=f"Motion of {robot.name}", shown=shown, frame=frame, robot=robot, q=q[-1])


def moved(robot: Robot, before: Array, q: Array) -> tuple[Array, list[list[list[float]]]]:
    """Coordinates and poses after the sliders were moved from ``before`` to ``q``, both (nq,).

    Closed loops stay closed: the moved joints keep their coordinates, all other joints follow. Where this is
    impossible, the arm stays at ``before``. Quaternions get the length 1.
    """
    q = _normalised(robot, before, q)
    if robot.closures:
        q = _assembled(robot, before, q)
    return q, link_frames(robot, q.tolist()).tolist()


def _arm(robot: Robot, q: Array) -> dict[str, Any]:
    numbers = q.tolist()
    return {
        "path": PATH,
        "scene": asdict(scene_of(robot)),
        "rest": link_frames(robot, numbers).tolist(),
        "drawing": arm_picture_svg(robot, numbers, DRAWING_SIZE),
    }


def _sliders(robot: Robot) -> list[dict[str, Any]]:
    """Name, unit and range of each coordinate: its limits, else one turn, ± 1 m, or ± 1 of a quaternion."""
    default = {"rad": np.pi, "m": LENGTH_RANGE}
    rows: list[dict[str, Any]] = []
    for entry, (low, high) in zip(robot.positions, robot.qlim.tolist()):
        most = default.get(entry.unit, 1.0)
        rows.append(
            {
                "name": entry.name,
                "unit": entry.unit,
                "low": low if np.isfinite(low) else min(-most, high - most),
                "high": high if np.isfinite(high) else max(most, low + most),
            }
        )
    return rows


def _normalised(robot: Robot, before: Array, q: Array) -> Array:
    """The coordinates with quaternions of length 1; ``before`` replaces a quaternion of zeros."""
    q, first = q.copy(), 0
    for joint in robot.joints:
        for motion in joint.motions:
            part = slice(first, first + len(motion.positions))
            first = part.stop
            if motion.speeds != motion.positions:
                length = float(np.linalg.norm(q[part]))
                q[part] = q[part] / length if length > 1e-6 else before[part]
    return q


def _assembled(robot: Robot, before: Array, q: Array) -> Array:
    """The configuration with closed loops near ``q``, in which the moved joints keep their coordinates."""
    from armblocks.face.assembly import assemble

    first, locked = 0, list[str]()
    for name, joint in zip(robot.joint_names, robot.joints):
        part = slice(first, first + joint.nq)
        first = part.stop
        if (q[part] != before[part]).any():
            locked.append(name)
    try:
        return assemble(robot, q, None, locked).q
    except ArmblocksError:
        return before

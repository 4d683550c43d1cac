"""Joint coordinates that follow a dragged tool: small steps of inverse kinematics from the present pose."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import InputError, counted
from armblocks.face.arm import Arm
from armblocks.face.ikine_result import IkineResult
from armblocks.face.toolbox_trajectories import ctraj
from armblocks.robot.geometry import reach
from armblocks.spatial import Transform
from armblocks.studio.protocol.messages.teaching import Reached

Array = NDArray[np.float64]

LARGEST_STEP = 0.05
"""Largest translation of one step, relative to the reach of the arm."""
LARGEST_TURN = 0.15
"""Largest rotation of one step, rad."""
LARGEST_CHANGE = 0.8
"""Change of an angle in one step, rad, from which the solution belongs to another configuration."""
MAX_STEPS = 400
MAX_FAILURES = 12
"""Number of steps out of reach after which the motion ends."""
FARTHEST = 1e6
"""Largest distance of a target from the origin in each direction, m."""
CLOSE = 1e-6
"""Distance to a limit from which a coordinate is at its limit, relative to its range."""
_DIRECTIONS = ("move along x", "move along y", "move along z", "turn about x", "turn about y", "turn about z")
_SAMPLES = 12
_FULL_RANK = 1e-4


class Directions(NamedTuple):
    """The directions of the tool that the joints can follow: a mask of ``ikine``, and its axes."""

    mask: tuple[int, ...]
    axes: str

    @property
    def missing(self) -> list[str]:
        """The directions that the joints cannot follow, as phrases such as "turn about x"."""
        return [word for word, used in zip(_DIRECTIONS, self.mask) if not used]


@lru_cache(maxsize=16)
def followed_directions(arm: Arm) -> Directions:
    """The largest set of directions that the joints can follow independently.

    Sets with all translations are preferred, then rotations in the axes of the tool, about x
    and y before z, because these keep the direction of the tool.
    """
    rng = np.random.default_rng(0)
    low, high = arm.robot.qlim.T
    low, high = np.where(np.isfinite(low), low, -1.0), np.where(np.isfinite(high), high, 1.0)
    q = low + (high - low) * rng.random((_SAMPLES, arm.robot.nq))
    world = arm.jacob0(q)
    world[:, :3] /= reach(arm.robot)
    R = arm.fkine(q)[:, :3, :3].transpose(0, 2, 1)
    tool = np.concatenate([R @ world[:, :3], R @ world[:, 3:]], axis=1)
    choices = [(mask, axes) for mask in product((1, 0), repeat=6) for axes in ("tool", "world") if any(mask)]
    for mask, axes in sorted(choices, key=_preference):
        if sum(mask) > arm.robot.n:
            continue
        J = (tool if axes == "tool" else world)[:, np.array(mask, dtype=bool)]
        values = np.linalg.svd(J, compute_uv=False)
        if len(values[0]) == sum(mask) and np.median(values[:, -1] / values[:, 0]) > _FULL_RANK:
            return Directions(mask, axes)
    return Directions((0,) * 6, "world")


def _preference(choice: tuple[tuple[int, ...], str]) -> tuple[int, int, bool, tuple[int, ...]]:
    mask, axes = choice
    return -sum(mask), -sum(mask[:3]), axes == "world", tuple(-entry for entry in mask)


def reached(arm: Arm, q: Sequence[float], target: Sequence[float]) -> Reached:
    """The configuration nearest to the pose ``target`` (16,), row by row in the world, m.

    The tool moves from its pose at ``q`` to the target in small steps. Each step is solved from the result of
    the previous step, so that the configuration (elbow, wrist) does not change. Out of reach and at limits,
    the result is the nearest pose.
    """
    start = _coordinates(arm, q)
    goal = _pose(arm, target)
    directions = followed_directions(arm)
    first = Transform.from_matrix(arm.fkine(start))
    steps = _step_count(arm, first, goal)
    present, why = start, ""
    failures = 0
    for k in range(1, steps + 1):
        result = solved(arm, _between(first, goal, k / steps), present, directions)
        why = "" if result.success else _reason(result)
        if not same_configuration(arm, present, result.q):
            why = why or "the next pose needs another configuration of the arm (elbow or wrist)"
            break
        # For poses out of reach, the arm takes the nearest poses.
        present = result.q
        failures += not result.success
        if failures == MAX_FAILURES:
            break
    T = arm.fkine(present)
    if why:
        rest = Transform.from_matrix(T).inverse() @ goal
        distance = float(np.linalg.norm(rest.translation))
        why += f"; the target is {distance:.3g} m and {math.degrees(_angle(rest)):.3g}° away"
    return Reached(
        q=present.tolist(),
        poses=arm.link_poses(present).tolist(),
        reached=not why,
        why=why,
        at_limit=coordinates_at_limits(arm, present),
        missing=directions.missing,
        tool=T.ravel().tolist(),
    )


def coordinates_at_limits(arm: Arm, q: Array) -> list[str]:
    """The names of the coordinates at or beyond a limit."""
    low, high = arm.robot.qlim.T
    close = CLOSE * np.where(np.isfinite(high - low), high - low, 1.0)
    at = (q <= low + close) | (q >= high - close)
    return [entry.name for entry, is_at in zip(arm.robot.positions, at.tolist()) if is_at]


def solved(arm: Arm, pose: Transform, q: Array, directions: Directions) -> IkineResult:
    """The configuration near ``q`` (nq,) whose tool has the pose in these directions."""
    if all(directions.mask):
        return arm.ikine(pose, q0=q, restarts=0, tolerance=1e-8)
    return arm.ikine(pose, q0=q, restarts=0, tolerance=1e-8, mask=directions.mask, axes=directions.axes)


def same_configuration(arm: Arm, before: Array, after: Array) -> bool:
    """Whether no angle has jumped between two steps."""
    angular = np.array([entry.unit == "rad" for entry in arm.robot.positions])
    return bool((np.abs(after - before)[angular] <= LARGEST_CHANGE).all())


def _step_count(arm: Arm, first: Transform, goal: Transform) -> int:
    distance = math.dist(first.translation, goal.translation) / (LARGEST_STEP * reach(arm.robot))
    angle = _angle(first.inverse() @ goal) / LARGEST_TURN
    return min(max(1, math.ceil(distance), math.ceil(angle)), MAX_STEPS)


def _angle(turn: Transform) -> float:
    """The angle of a rotation, rad."""
    return math.acos(min(1.0, max(-1.0, (float(np.trace(turn.R)) - 1.0) / 2.0)))


def _reason(result: IkineResult) -> str:
    """The reason why there is no solution, without a distance."""
    if result.reason == "out of reach":
        return "out of reach"
    if result.reason == "limits":
        names = [name for name, excess in zip(result.names, result.excess) if excess > 0.0]
        return f"{' and '.join(names)} would be beyond {'its limit' if len(names) == 1 else 'their limits'}"
    return result.explain()


def _between(first: Transform, goal: Transform, s: float) -> Transform:
    """The pose on the straight line, with a rotation about one axis."""
    return Transform.from_matrix(ctraj(first, goal, [s])[0])


def _pose(arm: Arm, target: Sequence[float]) -> Transform:
    if len(target) != 16:
        raise InputError(
            f"the target of the tool has {counted(len(target), 'number')}",
            where=f"robot '{arm.name}'",
            allowed="16, the rows of a 4 x 4 matrix",
            fix="give a pose",
        )
    pose = Transform.from_matrix(np.reshape(target, (4, 4)))
    farthest = max(map(abs, pose.translation))
    if farthest > FARTHEST:
        raise InputError(
            f"the target of the tool is {farthest:.3g} m from the origin",
            where=f"robot '{arm.name}'",
            allowed=f"up to {FARTHEST:g} m in each direction",
            fix="give a pose near the arm; lengths are in m",
        )
    return pose


def _coordinates(arm: Arm, q: Sequence[float]) -> Array:
    values = np.array(q, dtype=np.float64)
    if values.shape != (arm.robot.nq,):
        raise InputError(
            f"q has {counted(len(values), 'number')}",
            where=f"robot '{arm.name}'",
            allowed=f"{arm.robot.nq}, one for each coordinate",
            fix="give one number for each coordinate",
        )
    return values

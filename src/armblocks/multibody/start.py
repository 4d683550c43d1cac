"""The start of a drawn mechanism: positions, then speeds, that satisfy the closures and the targets."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks.diagram.passes.netlist import Netlist
from armblocks.dynamics.mechanism import mechanism
from armblocks.errors import AssemblyError, DiagramError, RobotError
from armblocks.multibody.assembly import DrawnMechanism, PlacedJoint
from armblocks.multibody.coupled_start import check_coupled_targets, write_coupled_targets
from armblocks.multibody.drives import check_number_of_drives, start_of_input
from armblocks.multibody.motion_sequence import reversed_motions
from armblocks.robot.joints import AxisMotion, Motion

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Start:
    """Coordinates q (nq,) and speeds qd (nv,) of the robot at the start."""

    q: Array
    qd: Array


def start_of(net: Netlist, drawn: DrawnMechanism) -> Start:
    """The start of a mechanism, assembled near the targets of its joints.

    Targets of high priority are satisfied exactly. Raises ``DiagramError`` that names the joints if this is
    impossible, or if the mechanism cannot be assembled.
    """
    robot = drawn.robot
    q, qd = robot.neutral, np.zeros(robot.nv)
    for joint in drawn.joints:
        targets = joint.part.targets
        positions = slice(joint.position, joint.position + joint.part.nq)
        speeds = slice(joint.speed, joint.speed + joint.part.nv)
        if targets.position_priority != "none":
            q[positions] = _of_tree(joint, targets.q)
        if targets.velocity_priority != "none":
            qd[speeds] = _speeds_of_tree(joint)
    write_coupled_targets(net, drawn, q, qd)
    if not robot.closures:
        check_coupled_targets(net, drawn, q, qd)
        return Start(q, qd)
    functions = mechanism(robot)
    moved = _start_of_motion_inputs(net, drawn, q)
    locked = [
        joint.path
        for joint in drawn.joints
        if joint.path in moved or joint.part.targets.position_priority == "high"
    ]
    try:
        q = functions.assembled(q, locked)
    except AssemblyError as error:
        if moved:
            with suppress(AssemblyError):  # then the loops cannot be assembled with any motion
                check_number_of_drives(net, drawn, functions.assembled(q))
        _refuse_positions(net, drawn, locked, moved, error)
    locked = [
        joint.path
        for joint in drawn.joints
        if joint.part.targets.velocity_priority == "high" and not joint.part.has_motion_input
    ]
    try:
        qd = functions.consistent_speeds(q, qd, locked)
    except RobotError as error:
        raise DiagramError(
            f"the velocity targets of high priority, at {_listed(locked)}, disagree: {error.what}",
            where=net.label(locked[0]),
            allowed="velocity targets of high priority that do not contradict each other",
            fix="give fewer joints a velocity target of high priority: one for each degree of freedom",
        ) from error
    check_coupled_targets(net, drawn, q, qd)
    return Start(q, qd)


def _start_of_motion_inputs(net: Netlist, drawn: DrawnMechanism, q: Array) -> list[str]:
    """Write the start of motion inputs into ``q`` (nq,), and return the joints that must not move.

    These are the joints all of whose coordinates are inputs. If the start of an input is not known before
    the run, the position target of the joint stands for it.
    """
    moved: list[str] = []
    for joint in drawn.joints:
        driven = joint.part.driven_positions()
        if not driven:
            continue
        drawn_q = list(joint.part.targets.q)
        given = start_of_input(net, joint)
        for place, value in zip(driven, given or ()):
            drawn_q[place] = value
        q[joint.position : joint.position + joint.part.nq] = _of_tree(joint, drawn_q)
        if len(driven) == joint.part.nq:
            moved.append(joint.path)
    return moved


def _refuse_positions(
    net: Netlist,
    drawn: DrawnMechanism,
    locked: Sequence[str],
    moved: Sequence[str],
    error: AssemblyError,
) -> None:
    worst = next(
        (name for name in (*drawn.closed, *(j.path for j in drawn.joints)) if f"'{name}'" in error.what), ""
    )
    gap = f"; the largest gap is {error.gaps[worst]}" if worst in error.gaps else ""
    what = f"the mechanism cannot be assembled: its loop does not close at this joint{gap}"
    if moved:
        raise DiagramError(
            f"the loops of the mechanism cannot reach the start of the motion input at {_listed(moved)}{gap}",
            where=net.label(moved[0]),
            allowed="motion inputs that start where all joints of the loops can be assembled",
            fix="let the motion start elsewhere, correct the transforms of the loop, or start with targets "
            "of the other joints nearer to the assembled pose",
        ) from error
    if locked:
        what = f"the position targets of high priority, at {_listed(locked)}, cannot be met together{gap}"
    raise DiagramError(
        what,
        where=net.label(worst or locked[0]),
        allowed="lengths and targets with which all joints of the loops can be assembled",
        fix="correct the transforms of the loop, start with targets nearer to the assembled pose, or give "
        "fewer targets high priority",
    ) from error


def _listed(paths: Sequence[str]) -> str:
    return ", ".join(f"'{path}'" for path in paths)


def _split(motions: Sequence[Motion], values: Sequence[float], *, speeds: bool) -> list[list[float]]:
    parts: list[list[float]] = []
    rest = list(values)
    for motion in motions:
        count = len(motion.speeds if speeds else motion.positions)
        parts.append(rest[:count])
        rest = rest[count:]
    return parts


def _of_tree(joint: PlacedJoint, q: Sequence[float]) -> list[float]:
    """The coordinates of the tree from the coordinates of the drawn joint."""
    parts = _split(joint.part.motions, q, speeds=False)
    if not joint.reversed:
        return [value for part in parts for value in part]
    for motion, part in zip(joint.part.motions, parts):
        if not isinstance(motion, AxisMotion):
            part[1:] = [0.0 - value for value in part[1:]]
    return [value for part in reversed(parts) for value in part]


def drawn_start(joint: PlacedJoint, start: Start) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """The start of a drawn joint, coordinates and speeds, from the start of the tree."""
    q = start.q[joint.position : joint.position + joint.part.nq].tolist()
    qd = start.qd[joint.speed : joint.speed + joint.part.nv].tolist()
    if not joint.reversed:
        return tuple(q), tuple(qd)
    backwards = reversed_motions(joint.part.motions)
    coordinates = _split(backwards, q, speeds=False)
    speeds = _split(backwards, qd, speeds=True)
    for motion, part, speed in zip(backwards, coordinates, speeds):
        if not isinstance(motion, AxisMotion):
            part[1:] = [0.0 - value for value in part[1:]]
            speed[:] = (-_rotation(part).T @ np.array(speed)).tolist()
    return (
        tuple(value for part in reversed(coordinates) for value in part),
        tuple(value for part in reversed(speeds) for value in part),
    )


def _speeds_of_tree(joint: PlacedJoint) -> list[float]:
    part = joint.part
    speeds = _split(part.motions, part.targets.qd, speeds=True)
    if not joint.reversed:
        return [value for entry in speeds for value in entry]
    coordinates = _split(part.motions, part.targets.q, speeds=False)
    for motion, q, speed in zip(part.motions, coordinates, speeds):
        if not isinstance(motion, AxisMotion):
            speed[:] = (-_rotation(q) @ np.array(speed)).tolist()
    return [value for entry in reversed(speeds) for value in entry]


def _rotation(quaternion: Sequence[float]) -> Array:
    w, x, y, z = np.array(quaternion) / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )

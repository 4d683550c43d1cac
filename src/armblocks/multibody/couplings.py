"""Gears and racks of a drawn mechanism: linear relations between joints with one axis.

A coupling is drawn between a frame on one body and a frame on another. A common third body, the carrier,
carries a joint to each of them. The coupling relates the motions of both joints relative to the carrier, each
about or along the z axis of its frame of the coupling. Mechanisms with couplings have independent and
dependent joints (:mod:`armblocks.robot.coordinate_map`); only independent joints have states.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from armblocks.diagram.passes.netlist import Netlist
from armblocks.errors import DiagramError, InputError
from armblocks.multibody.frames import Frames, Groups
from armblocks.multibody.parts import (
    BASE,
    FOLLOWER,
    AxisOfCoupling,
    CouplingLaw,
    CouplingPart,
    JointPart,
    Part,
)
from armblocks.robot import Coupling
from armblocks.robot.joints import AxisMotion
from armblocks.spatial import Transform

Array = NDArray[np.float64]
PARALLEL_TOLERANCE = 1e-9
"""Largest sine of the angle between the axis of a joint and the z axis of the coupling's frame."""
SMALLEST_FACTOR = 1e-8
"""Smallest factor of a coupling, and the inverse of the largest; the unit is rad/rad, m/rad or m/m."""
ROUNDING = 1e-9
"""Coefficients below this fraction of the largest coefficient of a coupling count as zero."""


@dataclass(frozen=True)
class Relation:
    """The relation of one coupling: the sum of ``factors`` times coordinates of joints is ``constant``."""

    path: str
    factors: tuple[tuple[str, float], ...]
    constant: float

    @property
    def joints(self) -> tuple[str, ...]:
        """The paths of the joints."""
        return tuple(joint for joint, _ in self.factors)


@dataclass(frozen=True)
class Combination:
    """A coordinate as a sum of ``factors`` times independent coordinates, plus a constant.

    ``path``: one of the couplings from which it follows.
    """

    path: str
    factors: Mapping[str, float]
    constant: float

    def at(self, values: Mapping[str, float], *, constant: bool = True) -> float:
        """The coordinate, or without the constant the speed, for values of the independent joints."""
        total = sum(factor * values[joint] for joint, factor in self.factors.items())
        return total + self.constant if constant else total


def coupling_relations(
    net: Netlist, parts: Mapping[str, Part], frames: Frames, groups: Groups
) -> tuple[Relation, ...]:
    """The relations of all couplings of a network. Raises ``DiagramError`` that names the coupling."""
    return tuple(
        _relation(net, parts, frames, groups, path, part)
        for path, part in sorted(parts.items())
        if isinstance(part, CouplingPart)
    )


def _relation(
    net: Netlist,
    parts: Mapping[str, Part],
    frames: Frames,
    groups: Groups,
    path: str,
    part: CouplingPart,
) -> Relation:
    found = {
        port: _joints_at(parts, frames, groups, frames.at(path, port), kind)
        for port, kind in zip((BASE, FOLLOWER), part.joints)
    }
    pairs = [
        (one, other)
        for one in found[BASE]
        for other in found[FOLLOWER]
        if one.carrier == other.carrier and one.path != other.path
    ]
    if len(pairs) != 1:
        _refuse_pairs(net, path, part, [(one.path, other.path) for one, other in pairs])
    ((one, other),) = pairs
    base, base_sign = _axis(net, path, parts, frames, groups, one, BASE)
    follower, follower_sign = _axis(net, path, parts, frames, groups, other, FOLLOWER)
    law = cast("CouplingLaw", cast("Any", net.blocks[path]))
    try:
        factor = law.follower_per_base(base, follower)
    except InputError as error:
        raise DiagramError(error.what, where=net.label(path), allowed=error.allowed, fix=error.fix) from error
    if not SMALLEST_FACTOR <= abs(factor) <= 1.0 / SMALLEST_FACTOR:
        raise DiagramError(
            f"the motion of F per motion of B is {factor:g}",
            where=net.label(path),
            allowed=f"factors between {SMALLEST_FACTOR:g} and {1.0 / SMALLEST_FACTOR:g}, of either sign",
            fix="correct the ratio or the radius",
        )
    factors = ((other.path, follower_sign), (one.path, -factor * base_sign))
    return Relation(path, factors, part.offset)


@dataclass(frozen=True)
class _CarriedJoint:
    """A joint between the body of a coupling's frame and a carrier, a rigid group.

    ``reversed``: the carrier is at the follower of the joint.
    """

    path: str
    carrier: int
    reversed: bool


def _joints_at(
    parts: Mapping[str, Part], frames: Frames, groups: Groups, frame: int, kind: str
) -> list[_CarriedJoint]:
    """The joints of a kind, ``revolute`` or ``prismatic``, at the body of a frame."""
    body = groups.of_frame[frame]
    joints: list[_CarriedJoint] = []
    for path, part in sorted(parts.items()):
        if isinstance(part, JointPart) and _kind(part) == kind:
            base, follower = (groups.of_frame[frames.at(path, port)] for port in (BASE, FOLLOWER))
            if follower == body:
                joints.append(_CarriedJoint(path, base, reversed=False))
            if base == body:
                joints.append(_CarriedJoint(path, follower, reversed=True))
    return joints


def _kind(part: JointPart) -> str:
    if len(part.motions) != 1 or not isinstance(motion := part.motions[0], AxisMotion) or motion.offset:
        return ""
    return {(1.0, 0.0): "revolute", (0.0, 1.0): "prismatic"}.get((motion.angular, motion.linear), "")


def _axis(
    net: Netlist,
    path: str,
    parts: Mapping[str, Part],
    frames: Frames,
    groups: Groups,
    joint: _CarriedJoint,
    port: str,
) -> tuple[AxisOfCoupling, float]:
    """The z axis of the coupling's frame in the carrier, and the sign of the joint's motion about it."""
    part = parts[joint.path]
    assert isinstance(part, JointPart) and isinstance(part.motions[0], AxisMotion)
    near, far = (FOLLOWER, BASE) if joint.reversed else (BASE, FOLLOWER)
    at_carrier = groups.pose[frames.at(joint.path, near)]
    at_body = groups.pose[frames.at(joint.path, far)]
    frame: Transform = at_carrier @ at_body.inverse() @ groups.pose[frames.at(path, port)]
    z, axis = frame.R[:, 2], at_carrier.R @ np.array(part.motions[0].axis, dtype=float)
    if float(np.linalg.norm(np.cross(z, axis))) > PARALLEL_TOLERANCE:
        raise DiagramError(
            f"the z axis of frame {port} is not parallel to the axis of joint '{joint.path}'",
            where=net.label(path),
            allowed="frames whose z axes are parallel to the axes of the coupled joints",
            fix="add a Rigid Transform that turns the z axis of the frame to the axis of the joint",
        )
    sign = 1.0 if float(z @ axis) > 0.0 else -1.0
    point = frame.p
    if _kind(part) == "revolute":
        point = at_carrier.p + float((frame.p - at_carrier.p) @ z) * z
    return AxisOfCoupling(point=point, direction=z), -sign if joint.reversed else sign


def _refuse_pairs(net: Netlist, path: str, part: CouplingPart, pairs: Sequence[tuple[str, str]]) -> None:
    base, follower = part.joints
    if pairs:
        listed = "; ".join(f"'{one}' and '{other}'" for one, other in pairs)
        what = f"several pairs of joints connect frames B and F with one body: {listed}"
        fix = "connect B and F with bodies that only one joint each connects with the carrier"
    else:
        what = (
            f"no body carries both a {base} joint to the body of frame B and a {follower} joint to the body "
            "of frame F"
        )
        fix = "connect B and F with the bodies that the two joints move, and both joints with one body"
    raise DiagramError(
        what,
        where=net.label(path),
        allowed=f"a {base} joint to B and a {follower} joint to F on one common body, such as a housing, a "
        "planet carrier, or the world",
        fix=fix,
    )


# -- independent and dependent joints


def eliminated(
    relations: Sequence[Relation], rank: Callable[[str], tuple[float, ...]], label: Callable[[str], str]
) -> dict[str, Combination]:
    """The dependent joints of relations, as combinations of the independent joints.

    Joints of high ``rank`` are independent where the relations permit it; joints of equal rank in the order
    of their paths. Redundant relations have no effect. Raises ``DiagramError`` with the ``label`` of a
    coupling that contradicts others, or with which a joint cannot move.

    Method: reduced row echelon form, with pivots in the columns of low rank first. The columns without pivot
    are then a set of independent joints with the largest ranks (greedy algorithm for matroids).
    """
    joints = sorted({joint for relation in relations for joint in relation.joints}, reverse=True)
    joints.sort(key=rank)
    A = np.array([[dict(relation.factors).get(joint, 0.0) for joint in joints] for relation in relations])
    b = np.array([relation.constant for relation in relations])
    scale = np.abs(A).max(axis=1, initial=0.0)
    A[:] = A / scale[:, None]
    b[:] = b / scale
    pivots: dict[int, int] = {}
    for column in range(len(joints)):
        rows = [row for row in range(len(relations)) if row not in pivots]
        row = max(rows, key=lambda row: abs(A[row, column]), default=-1)
        if row < 0 or abs(A[row, column]) <= ROUNDING:
            continue
        A[row], b[row] = A[row] / A[row, column], b[row] / A[row, column]
        for other in range(len(relations)):
            if other != row:
                b[other] -= A[other, column] * b[row]
                A[other] -= A[other, column] * A[row]
        pivots[row] = column
    result: dict[str, Combination] = {}
    for row, relation in enumerate(relations):
        if row not in pivots:
            if abs(b[row]) > ROUNDING * max(1.0, float(np.abs(b).max())):
                _refuse_locked("the coupling contradicts others", label(relation.path))
            continue
        column = pivots[row]
        others = [k for k in range(len(joints)) if k != column and abs(A[row, k]) > ROUNDING]
        if not others:
            _refuse_locked(f"joint '{joints[column]}' cannot move", label(relation.path))
        factors = {joints[k]: -float(A[row, k]) for k in others}
        result[joints[column]] = Combination(relation.path, factors, float(b[row]))
    return result


def _refuse_locked(what: str, where: str) -> None:
    raise DiagramError(
        f"the couplings of the mechanism lock it: {what}",
        where=where,
        allowed="couplings that leave each joint a motion; around a circle of gears, the product of all "
        "ratios must be 1",
        fix="correct the ratios and offsets, or remove one of the couplings",
    )


def robot_couplings(dependent: Mapping[str, Combination]) -> tuple[Coupling, ...]:
    """The constraints of the robot that determine the dependent joints."""
    return tuple(
        Coupling(
            name=f"coupling of {joint}",
            terms=((joint, 1.0), *((other, -factor) for other, factor in combination.factors.items())),
            constant=combination.constant,
        )
        for joint, combination in dependent.items()
    )


def independence(parts: Mapping[str, Part]) -> Callable[[str], tuple[float, ...]]:
    """The rank of joints in the choice of independent joints: motion inputs, then exact targets."""

    def rank(path: str) -> tuple[float, ...]:
        part = parts[path]
        assert isinstance(part, JointPart)
        targets = part.targets
        high = [kind == "high" for kind in (targets.position_priority, targets.velocity_priority)]
        return (float(part.has_motion_input), *map(float, high))

    return rank


def check_motion_inputs(
    net: Netlist, parts: Mapping[str, Part], dependent: Mapping[str, Combination]
) -> None:
    """Raise ``DiagramError`` for a motion input at a joint whose motion follows from other inputs."""
    for joint, combination in dependent.items():
        part = parts[joint]
        if isinstance(part, JointPart) and part.has_motion_input:
            others = ", ".join(f"'{other}'" for other in combination.factors)
            raise DiagramError(
                f"coupling '{combination.path}' determines the motion of the joint from {others}, so that it "
                "can have no motion input",
                where=net.label(joint),
                allowed="motion inputs at joints that move independently of each other",
                fix="set the actuation of one of these joints to none",
            )

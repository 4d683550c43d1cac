"""The start of a mechanism with couplings: the targets of all coupled joints, and those that remain."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from armblocks.diagram.passes.netlist import Netlist
from armblocks.errors import DiagramError
from armblocks.multibody.assembly import DependentJoint, DrawnMechanism, PlacedJoint
from armblocks.multibody.couplings import Relation, eliminated
from armblocks.multibody.parts import Targets

Array = NDArray[np.float64]
TARGET_TOLERANCE = 1e-9
"""Largest difference of a start from a target of high priority: rad, m, or per second.

It is multiplied by the size of the target where that is above 1."""
_PRIORITIES = {"none": 0.0, "low": 1.0, "high": 3.0}


def write_coupled_targets(net: Netlist, drawn: DrawnMechanism, q: Array, qd: Array) -> None:
    """Write the start of the coupled joints into ``q`` (nq,) and ``qd`` (nv,) of the robot.

    Targets of high priority come first, then targets other than 0 of low priority, then the others, each in
    the order of the paths of the joints. Raises ``DiagramError`` if a target of high priority of a dependent
    joint contradicts the targets of others, or depends on a motion input.
    """
    if not drawn.relations:
        return
    places = {joint.path: joint for joint in drawn.joints}
    for is_speed in (False, True):
        targets = {
            joint.path: _target(joint.part.targets, is_speed) for joint in (*drawn.joints, *drawn.dependents)
        }
        relations = [_rate_of(relation) if is_speed else relation for relation in drawn.relations]
        determined = eliminated(relations, _rank(targets, drawn.joints), net.label)
        coupled = {joint for relation in relations for joint in relation.joints}
        values = {joint: targets[joint][0] for joint in coupled if joint not in determined}
        values |= {joint: combination.at(values) for joint, combination in determined.items()}
        for path in coupled:
            if path in places:
                place = places[path]
                (qd if is_speed else q)[place.speed if is_speed else place.position] = values[path]


def check_coupled_targets(net: Netlist, drawn: DrawnMechanism, q: Array, qd: Array) -> None:
    """Raise ``DiagramError`` for a target of high priority of a coupled joint that the start misses.

    ``q``, ``qd``: the start of the robot.
    """
    if not drawn.relations:
        return
    driven = {joint.path for joint in drawn.joints if joint.part.has_motion_input}
    coupled = {joint for relation in drawn.relations for joint in relation.joints}
    found: dict[str, tuple[float, float]] = {
        joint.path: (float(q[joint.position]), float(qd[joint.speed]))
        for joint in drawn.joints
        if joint.path in coupled and joint.path not in driven
    }
    dependents = {joint.path: joint for joint in drawn.dependents}
    found |= {path: motion_of_dependent(joint, q, qd) for path, joint in dependents.items()}
    parts = {joint.path: joint.part for joint in (*drawn.joints, *drawn.dependents)}
    for path, motion in sorted(found.items()):
        sources = _sources(drawn, dependents[path]) if path in dependents else []
        for value, is_speed in zip(motion, (False, True)):
            target, priority = _target(parts[path].targets, is_speed)
            if priority != "high":
                continue
            of = "velocity" if is_speed else "position"
            if given := [source for source in sources if source in driven]:
                _refuse(
                    net,
                    path,
                    f"the {of} of the joint follows from the motion input of '{given[0]}', to which it is "
                    f"coupled, so that it can have no {of} target of high priority",
                )
            if not abs(value - target) <= TARGET_TOLERANCE * max(1.0, abs(target)):
                _refuse(
                    net,
                    path,
                    f"the {of} target {target:g} of high priority cannot be met: the couplings and the other "
                    f"targets give {value:g}",
                )


def motion_of_dependent(joint: DependentJoint, q: Array, qd: Array) -> tuple[float, float]:
    """The coordinate and the speed of a dependent joint, from those of the robot."""
    position, speed = joint.offset, 0.0
    for at, rate, factor in joint.factors:
        position += factor * float(q[at])
        speed += factor * float(qd[rate])
    return position, speed


def _sources(drawn: DrawnMechanism, joint: DependentJoint) -> list[str]:
    """The independent joints from which the motion of a dependent joint follows."""
    positions = {position for position, _, _ in joint.factors}
    return [other.path for other in drawn.joints if other.position in positions]


def _target(targets: Targets, is_speed: bool) -> tuple[float, str]:
    """The first target and its priority; 0 without a target."""
    priority = targets.velocity_priority if is_speed else targets.position_priority
    values = targets.qd if is_speed else targets.q
    return (0.0 if priority == "none" else values[0]), priority


def _rate_of(relation: Relation) -> Relation:
    return Relation(relation.path, relation.factors, 0.0)


def _rank(
    targets: Mapping[str, tuple[float, str]], joints: Sequence[PlacedJoint]
) -> Callable[[str], tuple[float, ...]]:
    driven = {joint.path for joint in joints if joint.part.has_motion_input}

    def rank(path: str) -> tuple[float, ...]:
        value, priority = targets[path]
        return (float(path in driven), _PRIORITIES[priority] + (priority == "low" and value != 0.0))

    return rank


def _refuse(net: Netlist, path: str, what: str) -> None:
    raise DiagramError(
        what,
        where=net.label(path),
        allowed="targets of high priority that the couplings permit together",
        fix="change one of the targets, or give it low priority",
    )

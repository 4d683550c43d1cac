"""Motion inputs of a drawn mechanism: checks, the start of the inputs, and reasons of failed runs."""

from __future__ import annotations

import numpy as np
from casadi import DM, SX
from numpy.typing import NDArray

from armblocks.diagram import Block, PortRef
from armblocks.diagram.flat_values import tunable_slots
from armblocks.diagram.passes.netlist import Netlist
from armblocks.dynamics.constrained import independent_relations
from armblocks.dynamics.drawn_drives import drives_are_independent
from armblocks.errors import DiagramError, counted
from armblocks.multibody.assembly import DrawnMechanism, PlacedJoint
from armblocks.multibody.mechanism import driven_speeds

Array = NDArray[np.float64]

MAX_DEPTH = 12
"""Maximum number of blocks in series that are evaluated to find the start of a motion input."""


def check_drives(net: Netlist, drawn: DrawnMechanism, q: Array) -> None:
    """Raise ``DiagramError`` if the loops do not permit independent motions of the driven joints.

    ``q`` (nq,): the assembled coordinates at the start.
    """
    driven = [k for joint in drawn.joints for k in driven_speeds(joint)]
    if not driven or not drawn.robot.closures:
        return
    check_number_of_drives(net, drawn, q)
    if drives_are_independent(drawn.robot, q, driven):
        return
    paths = driven_paths(drawn)
    raise DiagramError(
        f"the loops do not permit independent motions of the joints with motion inputs, {_listed(paths)}",
        where=net.label(paths[-1]),
        allowed="joints that move independently of each other where the motion starts",
        fix="give other joints a motion input, or start where the mechanism is not at a dead point",
    )


def check_number_of_drives(net: Netlist, drawn: DrawnMechanism, q: Array) -> None:
    """Raise ``DiagramError`` if there are more motion inputs than degrees of freedom; ``q``: assembled."""
    count = sum(len(driven_speeds(joint)) for joint in drawn.joints)
    freedom = drawn.robot.nv - len(independent_relations(drawn.robot, q))
    if count <= freedom:
        return
    paths = driven_paths(drawn)
    raise DiagramError(
        f"the motion inputs at {_listed(paths)} give {counted(count, 'coordinate')}, but the loops leave the "
        f"mechanism {counted(freedom, 'degree', 'degrees')} of freedom",
        where=net.label(paths[-1]),
        allowed="at most one motion input for each degree of freedom; the loops determine the others",
        fix="set the actuation of some of these joints to none",
    )


def _listed(paths: list[str]) -> str:
    return ", ".join(f"'{path}'" for path in paths)


def driven_paths(drawn: DrawnMechanism) -> list[str]:
    """The paths of the joints with motion inputs."""
    return [joint.path for joint in drawn.joints if joint.part.has_motion_input]


def unreachable_positions(drawn: DrawnMechanism) -> str:
    """The reason why signals of a mechanism with motion inputs can be NaN; empty without loops."""
    paths = driven_paths(drawn)
    if not paths or not drawn.robot.closures:
        return ""
    return (
        f"the loops of the mechanism cannot follow the motion input at {_listed(paths)}: its position cannot "
        "be reached, or it jumps, or the mechanism is at a dead point"
    )


def start_of_input(net: Netlist, joint: PlacedJoint) -> tuple[float, ...] | None:
    """The values at t = 0 of the motion input of a joint; ``None`` if they are not known before the run.

    They are known for sources, and for blocks without states whose inputs are known.
    """
    value = _start_of_signal(net, PortRef(joint.path, "motion"), MAX_DEPTH)
    count = len(joint.part.driven_positions())
    column = np.zeros(0) if value is None else np.asarray(value.full(), dtype=float).ravel()
    if len(column) not in (1, count):
        return None
    numbers = np.broadcast_to(column, (count,))
    return tuple(numbers.tolist()) if np.isfinite(numbers).all() else None


def _start_of_signal(net: Netlist, port: PortRef, depth: int) -> DM | None:
    """The value at t = 0 of the signal at an input port; ``None`` if it is not known."""
    source = net.drivers.get(port)
    block = None if source is None else net.blocks.get(source.block)
    if source is None or block is None or depth == 0 or not _is_function_of_inputs(block):
        return None
    inputs: dict[str, SX] = {}
    for entry in block.input_ports():
        known = _start_of_signal(net, PortRef(source.block, entry.name), depth - 1)
        if known is None:
            return None
        inputs[entry.name] = SX(known)
    p = {
        slot.name: SX(DM(np.asarray(block.parameter_value(slot.name), dtype=float)))
        for slot in tunable_slots(block)
    }
    outputs = block.outputs(SX(0.0), block.initial_states(p), inputs, p)
    if source.port not in outputs:
        return None
    value = SX(outputs[source.port])
    return DM(value) if value.is_constant() else None


def _is_function_of_inputs(block: Block) -> bool:
    """Whether the outputs depend on time, parameters, inputs and continuous states only."""
    shapes = {port.name: port.shape or () for port in block.input_ports()}
    others = (block.modes(shapes), block.conditions(shapes), block.delay_lines(shapes))
    special = (block.virtual, block.sampled, block.called, block.implicit_outputs, block.time_derivatives)
    return not any((*others, *special, block.differentiated_inputs, block.discrete_states(shapes)))

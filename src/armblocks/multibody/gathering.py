"""Pass: bodies, joints and force elements are replaced by mechanisms.

Input: the blocks of the family ``mechanics``, and the frame lines between them, of all levels.

Result: for each network of connected frames, a block with its equations of motion in the place of its World
Frame; each joint, each body and each force element is a block with states, an inertia or loads under its own
path. Signals, states and parameters thus have the paths of the drawn blocks.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from typing import cast

from armblocks.diagram import Block, PortRef
from armblocks.diagram.passes.netlist import Netlist, Replacements
from armblocks.dynamics.base_parameters import regrouped
from armblocks.dynamics.coupled_motion import coordinate_without_inertia
from armblocks.dynamics.forward import check_accelerations_exist
from armblocks.errors import DiagramError, RobotError
from armblocks.multibody.assembly import DrawnMechanism, drawn_mechanism, world_block
from armblocks.multibody.body_inertias import BodyInertias
from armblocks.multibody.dependent_joints import DependentJointStates
from armblocks.multibody.driven_joints import DrivenJointStates
from armblocks.multibody.drives import check_drives, unreachable_positions
from armblocks.multibody.element_states import ElementLoads
from armblocks.multibody.frames import frames_of_parts, networks
from armblocks.multibody.joint_states import JointStates
from armblocks.multibody.mechanism import Mechanism, driven_speeds, port_of
from armblocks.multibody.moving_masses import every_joint_moves_mass
from armblocks.multibody.parts import JointPart, Part, Targets
from armblocks.multibody.start import Start, drawn_start, start_of
from armblocks.robot.tree import KinematicTree


def gather_mechanisms(net: Netlist) -> Netlist:
    """The netlist with mechanisms in place of bodies, joints and force elements. Raises ``DiagramError``."""
    parts = {
        path: cast("Part", block.part())
        for path, block in net.blocks.items()
        if type(block).gathers is gather_mechanisms
    }
    for path in parts:
        _check_always_active(net, path)
    frames = frames_of_parts(net, parts)
    gathered = _Gathered(net)
    for network in networks(net, parts, frames):
        mechanism = drawn_mechanism(net, parts, frames, network)
        if mechanism is not None:
            gathered.add(world_block(parts, network), mechanism)
        gathered.remove(path for path in network if path not in gathered.blocks)
    return dataclasses.replace(
        net,
        blocks={**net.blocks, **gathered.blocks},
        drivers={**net.drivers, **gathered.drivers},
        replaced={**net.replaced, **gathered.replaced},
    )


class _Gathered:
    """The blocks and connections in place of the drawn blocks."""

    def __init__(self, net: Netlist) -> None:
        self.net = net
        self.blocks: dict[str, Block] = {}
        self.drivers: dict[PortRef, PortRef] = {}
        self.replaced: dict[str, Replacements] = {}

    def add(self, world: str, drawn: DrawnMechanism) -> None:
        """Add the blocks of a mechanism. Raises ``DiagramError``."""
        self._check_inertia(drawn)
        start = start_of(self.net, drawn)
        check_drives(self.net, drawn, start.q)
        closed = bool(drawn.robot.closures)
        near = tuple(start.q.tolist()) if closed else ()
        plant = Mechanism(
            mechanism=_without_targets(drawn),
            robot=drawn.robot,
            near=near,
            unreachable=unreachable_positions(drawn),
        )
        self.blocks[world] = plant
        for joint in drawn.joints:
            self._add_joint(world, drawn, joint.path, start)
        for joint in drawn.dependents:
            self.blocks[joint.path] = DependentJointStates(
                joint=self.net.blocks[joint.path],
                place=joint.part,
                closed=True,
                unreachable=unreachable_positions(drawn),
            )
            for port, quantity in (("mechanism qdd", "qdd"), ("mechanism q", "q"), ("mechanism qd", "qd")):
                self._connect(world, joint.path, port, quantity)
            self._drive(world, joint.path, "generalised force", "force")
        for path in dict.fromkeys(body.path for body in drawn.bodies):
            self.blocks[path] = BodyInertias(body=self.net.blocks[path])
            self._drive(world, path, "inertia", "inertia")
        for element in drawn.elements:
            path = element.path
            self.blocks[path] = ElementLoads(element=self.net.blocks[path], place=element.part)
            self._connect(world, path, "frame motion", "motion")
            if element.part.accelerations:
                self._connect(world, path, "frame acceleration", "acceleration")
            if element.part.exerts:
                self._drive(world, path, "loads", "loads")

    def _add_joint(self, world: str, drawn: DrawnMechanism, path: str, start: Start) -> None:
        joint = next(joint for joint in drawn.joints if joint.path == path)
        closed = drawn.constrained
        q, qd = drawn_start(joint, start)
        driven = joint.part.has_motion_input
        states = (DrivenJointStates if driven else JointStates)(
            joint=self.net.blocks[path],
            place=joint.part if closed else _with_tunable_targets(joint.part),
            closed=closed,
            start_q=q if closed else (),
            start_qd=qd if closed else (),
            unreachable=unreachable_positions(drawn),
        )
        self.blocks[path] = states
        inputs = {port.name for port in states.input_ports()}
        for port, quantity in (
            ("mechanism qdd", "qdd"),
            ("mechanism q", "q"),
            ("mechanism qd", "qd"),
            ("q rates", "q rates"),
            ("qd rates", "qd rates"),
            ("mechanism drive", "drive"),
        ):
            if port in inputs:
                self._connect(world, path, port, quantity)
        for port, quantity in (
            ("state q", "state q"),
            ("state qd", "state qd"),
            ("generalised force", "force"),
            *((("given qdd", "given qdd"),) if driven else ()),
        ):
            self._drive(world, path, port, quantity)

    def remove(self, paths: Iterable[str]) -> None:
        """Remove blocks that have no equations of their own."""
        for path in paths:
            self.replaced[path] = {}

    def _connect(self, world: str, path: str, port: str, quantity: str) -> None:
        """Connect an output of the mechanism to an input of a joint or element."""
        self.drivers[PortRef(path, port)] = PortRef(world, port_of(path, quantity))

    def _drive(self, world: str, path: str, port: str, quantity: str) -> None:
        """Connect an output of a joint or element to an input of the mechanism."""
        self.drivers[PortRef(world, port_of(path, quantity))] = PortRef(path, port)

    def _check_inertia(self, drawn: DrawnMechanism) -> None:
        """Raise ``DiagramError`` for a joint beyond which no mass moves."""
        if every_joint_moves_mass(drawn.robot):
            return
        try:
            tree = regrouped(KinematicTree.of(drawn.robot))
            driven = {k for joint in drawn.joints for k in driven_speeds(joint)}
            free = [k for k in range(drawn.robot.nv) if k not in driven]
            if drawn.robot.couplings:
                self._check_coupled_inertia(drawn, tree, free)
                return
            check_accelerations_exist(tree, free)
        except RobotError as error:
            paths = (joint.path for joint in drawn.joints)
            path = next((path for path in paths if error.where.endswith(f", link '{path}'")), "")
            where = self.net.label(path) if path in self.net.blocks else error.where
            raise _no_inertia(where) from error

    def _check_coupled_inertia(self, drawn: DrawnMechanism, tree: KinematicTree, free: Sequence[int]) -> None:
        """Raise ``DiagramError`` if no mass moves with a joint, its dependent joints included."""
        without = coordinate_without_inertia(drawn.robot, tree, free)
        if without is not None:
            joint = next(j for j in drawn.joints if j.speed <= without < j.speed + j.part.nv)
            raise _no_inertia(self.net.label(joint.path))


def _no_inertia(where: str) -> DiagramError:
    return DiagramError(
        "no body with mass moves with the joint, so that its acceleration is undefined",
        where=where,
        allowed="mass, and for a rotation inertia, beyond every joint",
        fix="add a solid to a frame beyond the joint, or replace the joint by a Weld Joint",
    )


def _without_targets(drawn: DrawnMechanism) -> DrawnMechanism:
    """The mechanism without the targets of its joints, on which its equations do not depend."""
    none = Targets(q=(), qd=())
    joints, dependents = (
        tuple(
            dataclasses.replace(joint, part=dataclasses.replace(joint.part, targets=none)) for joint in group
        )
        for group in (drawn.joints, drawn.dependents)
    )
    return dataclasses.replace(drawn, joints=joints, dependents=dependents)


def _with_tunable_targets(part: JointPart) -> JointPart:
    """The part of a joint outside of loops: its targets are parameters, except the coordinates of balls."""
    q = part.targets.q if part.nq != part.nv else (0.0,) * part.nq
    return dataclasses.replace(part, targets=dataclasses.replace(part.targets, q=q, qd=(0.0,) * part.nv))


def _check_always_active(net: Netlist, path: str) -> None:
    if net.gates.get(path):
        raise DiagramError(
            "the block is in a conditional subsystem, but the motion of bodies cannot be switched off",
            where=net.label(path),
            allowed="bodies, joints and force elements outside of conditional subsystems",
            fix="move the mechanism out of the conditional subsystem",
        )

"""The equations of motion of a drawn mechanism in a flat diagram.

The joints have the states; the mechanism computes their accelerations from the states and the generalised
forces of all joints, from the inertias of the bodies and from the loads of the force elements. All ports are
internal.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import ClassVar

import numpy as np
from casadi import SX, mtimes, vertcat

from armblocks.diagram import Block, ParameterKind, Port, Signals, View, ViewKind, parameter
from armblocks.diagram.parameter import Value
from armblocks.dynamics.ball_joints import normalised, position_rates, rotation_of
from armblocks.dynamics.drawn_drives import DrawnDrives
from armblocks.dynamics.drawn_motion import DrawnMotion, Load
from armblocks.dynamics.frame_motions import FramesOfTree
from armblocks.dynamics.joint_motion import entries
from armblocks.multibody.assembly import DrawnMechanism, PlacedElement, PlacedJoint
from armblocks.multibody.body_inertias import INERTIA_SIZE
from armblocks.multibody.parts import JointPart
from armblocks.robot import Attachment, Robot
from armblocks.robot.joints import AxisMotion, Motion
from armblocks.robot.tree import BASE, Frame
from armblocks.spatial import Transform

KINEMATICS_SIZE = 18
"""Numbers that describe the motion of a frame: rotation 9, position, velocity, angular velocity."""
ACCELERATION_SIZE = 6
"""Acceleration and angular acceleration of a frame."""


def port_of(path: str, quantity: str) -> str:
    """The name of the port for a quantity of a block; paths of ports have no slashes after the block."""
    return f"{quantity} of {path.replace('/', '.')}"


@dataclass(frozen=True, kw_only=True)
class Mechanism(Block):
    """The equations of motion of the bodies, joints and force elements of one network."""

    title: ClassVar[str] = "Mechanism"

    mechanism: DrawnMechanism = parameter(
        kind=ParameterKind.DIAGRAM, of_type=DrawnMechanism, doc="the robot, its joints and force elements"
    )
    robot: Robot = parameter(kind=ParameterKind.ROBOT, of_type=Robot, doc="the robot of the mechanism")
    near: tuple[float, ...] = parameter((), kind=ParameterKind.DIAGRAM, doc="assembled coordinates (nq,)")
    unreachable: str = parameter("", kind=ParameterKind.DIAGRAM, doc="reason of values that are not finite")

    # -- the masses of the robot are not in the equations

    def parameter_value(self, name: str) -> Value:
        if name == "robot":
            return _without_masses(self.robot)
        if name == "mechanism":
            return replace(self.mechanism, robot=_without_masses(self.robot))
        return super().parameter_value(name)

    def _motion(self) -> DrawnMotion:
        """The equations of the mechanism."""
        bodies = tuple(body.at for body in self.mechanism.bodies)
        return drawn_motion(_without_masses(self.robot), self.near, bodies)

    def _drives(self) -> DrawnDrives:
        """The equations of the mechanism with given motions."""
        return drawn_drives(self._motion(), self.near, self.driven)

    def _inertias(self, u: Signals) -> list[SX]:
        return [body.fraction * u[port_of(body.path, "inertia")] for body in self.mechanism.bodies]

    # -- ports

    def input_ports(self) -> tuple[Port, ...]:
        return self._inputs

    @cached_property
    def _inputs(self) -> tuple[Port, ...]:
        ports = [
            _port(joint.path, quantity, shape)
            for joint in self.mechanism.joints
            for quantity, shape in (
                ("state q", joint.part.nq),
                ("state qd", joint.part.nv),
                ("force", joint.part.nv),
                *((("given qdd", joint.part.nv),) if joint.part.has_motion_input else ()),
            )
        ]
        ports += [_port(joint.path, "force", 1) for joint in self.mechanism.dependents]
        loads = [element for element in self.mechanism.elements if element.part.exerts]
        ports += [_port(element.path, "loads", 6 * len(element.frames)) for element in loads]
        bodies = dict.fromkeys(body.path for body in self.mechanism.bodies)
        return (*ports, *(_port(path, "inertia", INERTIA_SIZE) for path in bodies))

    def output_ports(self) -> tuple[Port, ...]:
        return self._outputs

    @cached_property
    def _outputs(self) -> tuple[Port, ...]:
        ports: list[Port] = []
        for joint in self.mechanism.joints:
            ports.append(_port(joint.path, "qdd", joint.part.nv))
            if self._has_coordinates(joint):
                ports.append(_port(joint.path, "q", joint.part.nq))
                ports.append(_port(joint.path, "q rates", joint.part.nq))
            if self.mechanism.constrained:
                ports.append(_port(joint.path, "qd", joint.part.nv))
                ports.append(_port(joint.path, "qd rates", joint.part.nv))
            if joint.part.has_motion_input:
                ports.append(_port(joint.path, "drive", joint.part.nv))
        for joint in self.mechanism.dependents:
            ports += [_port(joint.path, quantity, 1) for quantity in ("qdd", "q", "qd")]
        for element in self.mechanism.elements:
            count = len(element.frames)
            ports.append(_port(element.path, "motion", KINEMATICS_SIZE * count))
            if element.part.accelerations:
                ports.append(_port(element.path, "acceleration", ACCELERATION_SIZE * count))
        return (*ports, *self._joint_ports())

    def _joint_ports(self) -> tuple[Port, ...]:
        """The coordinates, speeds and accelerations of all joints, from which reports draw the motion."""
        robot = self.robot
        positions = tuple(entry.name for entry in robot.positions)
        speeds = tuple(entry.name for entry in robot.speeds)
        ports = (
            Port("q", "coordinates of all joints", "", (robot.nq,), positions),
            Port("qd", "speeds of all joints", "", (robot.nv,), speeds),
            Port("qdd", "accelerations of all joints", "", (robot.nv,), speeds),
        )
        return ports if self.mechanism.animated else ()

    def _has_coordinates(self, joint: PlacedJoint) -> bool:
        return self.mechanism.constrained or joint.part.nq != joint.part.nv

    def record_ports(self) -> tuple[Port, ...]:
        if not self.mechanism.animated:
            return ()
        doc = "world poses of the base, every body in order, and the tool"
        return (Port("poses", doc, shape=(len(self.robot.links) + 2, 4, 4)),)

    def views(self) -> tuple[View, ...]:
        if not self.mechanism.animated:
            return ()
        return (View(kind=ViewKind.ROBOT, signals=("poses",), title=self.robot.name, subject=self.robot),)

    # -- equations

    def known_dependences(self) -> Mapping[str, Collection[str]]:
        """Coordinates and frames depend on the state, in loops also on inertias; all others on all inputs."""
        if self.robot.closures:
            self._motion()  # raises the errors of loops
        inputs = tuple(port.name for port in self.input_ports())
        of_state = ("motion of ", "q of ", "q rates of ", "qd of ")
        of_inputs = ("state q of ", "state qd of ", *(("inertia of ",) if self.robot.closures else ()))
        state = tuple(name for name in inputs if name.startswith(of_inputs))
        known = {
            port.name: state if port.name.startswith(of_state) else inputs for port in self.output_ports()
        }
        return known | {port.name: inputs for port in self.record_ports()}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        equations, robot = self._motion(), self.robot
        q, qd = self._state(u)
        consistent_q, consistent_qd = self._consistent(q, qd, u)
        frames = equations.frames(consistent_q, consistent_qd)
        tau = SX.zeros(robot.nv)
        for joint in self.mechanism.joints:
            tau[_speeds(joint)] = _tree_forces(joint, q, u[port_of(joint.path, "force")])
        at_dependents = self._forces_of_dependents(u)
        tau = tau if at_dependents is None else tau + at_dependents
        loads, inertias = list(self._loads(u)), self._inertias(u)
        drives = tau
        if self.driven:
            given = self._given_accelerations(q, u)
            qdd, drives = self._drives().accelerations(
                consistent_q, consistent_qd, tau, given, loads, inertias
            )
            drives = drives if at_dependents is None else drives - at_dependents
        else:
            qdd = equations.accelerations(consistent_q, consistent_qd, tau, loads, inertias)
        if robot.closures:
            _, q_rates, qd_rates = equations.rates(q, qd, (consistent_q, consistent_qd), qdd)
        else:
            q_rates, qd_rates = SX(vertcat(*position_rates(robot, entries(q), entries(qd)))), qdd
        values: dict[str, SX] = {"q": consistent_q, "qd": consistent_qd, "qdd": qdd}
        for joint in self.mechanism.joints:
            positions, speeds = _positions(joint), _speeds(joint)
            of_joint = {
                "qdd": _drawn_speeds(joint, consistent_q, qdd[speeds]),
                "q": _drawn_coordinates(joint, consistent_q[positions]),
                "q rates": _drawn_coordinates(joint, q_rates[positions]),
                "qd": _drawn_speeds(joint, consistent_q, consistent_qd[speeds]),
                "qd rates": _drawn_speeds(joint, q, qd_rates[speeds]),
                "drive": _drawn_speeds(joint, q, drives[speeds]),
            }
            values |= {port_of(joint.path, name): value for name, value in of_joint.items()}
        values |= self._dependent_motions(consistent_q, consistent_qd, qdd)
        moving: FramesOfTree | None = None
        for element in self.mechanism.elements:
            values[port_of(element.path, "motion")] = self._kinematics(frames, element)
            if element.part.accelerations:
                moving = moving or equations.frames(consistent_q, consistent_qd, qdd)
                values[port_of(element.path, "acceleration")] = self._frame_accelerations(moving, element)
        return {port.name: values[port.name] for port in self.output_ports()}

    def records(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        if not self.mechanism.animated:
            return {}
        equations = self._motion()
        q, qd = self._consistent(*self._state(u), u)
        frames = equations.frames(q, qd)
        places = [Frame(body=BASE, pose=Transform()), *equations.tree.links, equations.tree.tool]
        return {"poses": SX(vertcat(*(frames.pose(place).matrix() for place in places)))}

    def _state(self, u: Signals) -> tuple[SX, SX]:
        """The coordinates and speeds of the robot, from the coordinates and speeds of the drawn joints."""
        q, qd = SX.zeros(self.robot.nq), SX.zeros(self.robot.nv)
        for joint in self.mechanism.joints:
            coordinates = u[port_of(joint.path, "state q")]
            q[_positions(joint)] = _tree_coordinates(joint, coordinates)
            qd[_speeds(joint)] = _tree_speeds(joint, coordinates, u[port_of(joint.path, "state qd")])
        return q, qd

    @property
    def driven(self) -> tuple[int, ...]:
        """The indices in qd of the speeds whose motion is an input."""
        return tuple(k for joint in self.mechanism.joints for k in driven_speeds(joint))

    def reason_of_invalid_values(self) -> str:
        return self.unreachable

    def _given_accelerations(self, q: SX, u: Signals) -> SX:
        """The accelerations (nv, 1) that motion inputs give; the others are 0."""
        given = SX.zeros(self.robot.nv)
        for joint in self.mechanism.joints:
            if joint.part.has_motion_input:
                drawn_q = u[port_of(joint.path, "state q")]
                given[_speeds(joint)] = _tree_speeds(joint, drawn_q, u[port_of(joint.path, "given qdd")])
        return given

    def _consistent(self, q: SX, qd: SX, u: Signals) -> tuple[SX, SX]:
        if self.robot.closures and self.driven:
            return self._drives().state(q, qd)
        if self.robot.closures:
            return self._motion().state(q, qd, self._inertias(u))
        is_unit = self.robot.nq == self.robot.nv
        return (q if is_unit else SX(vertcat(*normalised(self.robot, entries(q))))), qd

    def _forces_of_dependents(self, u: Signals) -> SX | None:
        """The generalised forces (nv, 1) of the forces at dependent joints; None without such joints."""
        if not self.mechanism.dependents:
            return None
        forces = SX.zeros(self.robot.nv)
        for joint in self.mechanism.dependents:
            for _, speed, factor in joint.factors:
                forces[speed] = forces[speed] + factor * u[port_of(joint.path, "force")]
        return forces

    def _dependent_motions(self, q: SX, qd: SX, qdd: SX) -> dict[str, SX]:
        """Coordinates, speeds and accelerations of the dependent joints, by port."""
        values: dict[str, SX] = {}
        for joint in self.mechanism.dependents:
            sums = [SX(joint.offset), SX(0.0), SX(0.0)]
            for position, speed, factor in joint.factors:
                terms = (q[position], qd[speed], qdd[speed])
                sums = [total + factor * term for total, term in zip(sums, terms)]
            for quantity, value in zip(("q", "qd", "qdd"), sums):
                values[port_of(joint.path, quantity)] = value
        return values

    def _loads(self, u: Signals) -> Iterator[Load]:
        for element in self.mechanism.elements:
            if not element.part.exerts:
                continue
            column = u[port_of(element.path, "loads")]
            for k, (_, at) in enumerate(element.frames):
                fx, fy, fz, nx, ny, nz = (column[6 * k + i] for i in range(6))
                yield Load(at, (fx, fy, fz), (nx, ny, nz))

    def _kinematics(self, frames: FramesOfTree, element: PlacedElement) -> SX:
        tree, parts = self._motion().tree, list[SX]()
        for _, at in element.frames:
            frame = tree.attached(at.link, at.pose)
            pose = frames.pose(frame)
            linear, angular = frames.velocity(frame)
            parts.append(SX(vertcat(*pose.x, *pose.y, *pose.z, *pose.p, *linear, *angular)))
        return SX(vertcat(*parts))

    def _frame_accelerations(self, frames: FramesOfTree, element: PlacedElement) -> SX:
        tree = self._motion().tree
        places = [tree.attached(at.link, at.pose) for _, at in element.frames]
        return SX(vertcat(*(vertcat(*part) for frame in places for part in frames.acceleration(frame))))


@lru_cache(maxsize=32)
def drawn_motion(robot: Robot, near: tuple[float, ...], bodies: tuple[Attachment, ...]) -> DrawnMotion:
    """The equations of a robot with bodies, cached for the last 32 robots."""
    return DrawnMotion(robot, np.array(near), bodies)


@lru_cache(maxsize=32)
def _without_masses(robot: Robot) -> Robot:
    """The robot with massless links; the equations add the bodies, whose inertias are values of the run."""
    massless = {"mass": 0.0, "centre_of_mass": (0.0,) * 3, "inertia": ((0.0,) * 3,) * 3}
    return replace(robot, links=tuple(replace(link, **massless) for link in robot.links))


@lru_cache(maxsize=32)
def drawn_drives(motion: DrawnMotion, near: tuple[float, ...], driven: tuple[int, ...]) -> DrawnDrives:
    """The equations of a robot with given speeds; those of the last 32 robots are cached."""
    return DrawnDrives(motion, np.array(near), driven)


def driven_speeds(joint: PlacedJoint) -> list[int]:
    """The indices in qd of the robot of the speeds of a joint whose motion is an input."""
    parts = [list(range(part.start, part.stop)) for part in _slices(joint.part.motions, speeds=True)]
    order = [k for part in (reversed(parts) if joint.reversed else parts) for k in part]
    driven = joint.part.driven_speeds()
    return [joint.speed + place for place, k in enumerate(order) if k in driven]


def _port(path: str, quantity: str, size: int) -> Port:
    return Port(port_of(path, quantity), quantity, shape=() if size == 1 else (size,), internal=True)


# -- coordinates of drawn joints and of the tree: they differ for joints whose link carries the base


def _positions(joint: PlacedJoint) -> list[int]:
    return list(range(joint.position, joint.position + joint.part.nq))


def _speeds(joint: PlacedJoint) -> list[int]:
    return list(range(joint.speed, joint.speed + joint.part.nv))


def _slices(motions: Sequence[Motion], *, speeds: bool) -> list[slice]:
    slices: list[slice] = []
    first = 0
    for motion in motions:
        count = len(motion.speeds if speeds else motion.positions)
        slices.append(slice(first, first + count))
        first += count
    return slices


def _tree_coordinates(joint: PlacedJoint, q: SX) -> SX:
    """The coordinates of the tree: for a reversed joint in reversed order, quaternions conjugate."""
    if not joint.reversed:
        return q
    parts = [
        q[part] if isinstance(motion, AxisMotion) else SX(vertcat(q[part][0], -q[part][1:]))
        for motion, part in zip(joint.part.motions, _slices(joint.part.motions, speeds=False))
    ]
    return SX(vertcat(*reversed(parts)))


def _drawn_coordinates(joint: PlacedJoint, q: SX) -> SX:
    """The coordinates of the drawn joint from the coordinates of the tree; rates in the same way."""
    if not joint.reversed:
        return q
    backwards = list(reversed(joint.part.motions))
    parts = [
        q[part] if isinstance(motion, AxisMotion) else SX(vertcat(q[part][0], -q[part][1:]))
        for motion, part in zip(backwards, _slices(backwards, speeds=False))
    ]
    return SX(vertcat(*reversed(parts)))


def _tree_speeds(joint: PlacedJoint, drawn_q: SX, qd: SX) -> SX:
    """The speeds of the tree from the speeds of the drawn joint.

    A ball joint with the rotation R of the follower in the base has the angular velocity w in follower axes.
    The angular velocity of the base relative to the follower, in base axes, is ``-R w``.
    """
    if not joint.reversed:
        return qd
    return SX(vertcat(*reversed(_turned(joint.part, drawn_q, qd, back=False))))


def _tree_forces(joint: PlacedJoint, tree_q: SX, force: SX) -> SX:
    """The generalised forces of the tree, with the same power as the forces of the drawn joint."""
    if not joint.reversed:
        return force
    drawn_q = _drawn_coordinates(joint, tree_q[_positions(joint)])
    return SX(vertcat(*reversed(_turned(joint.part, drawn_q, force, back=False))))


def _drawn_speeds(joint: PlacedJoint, tree_q: SX, qd: SX) -> SX:
    """The speeds of the drawn joint from the speeds of the tree; accelerations in the same way.

    ``w = -R' w_tree`` has the derivative ``-R' dw_tree/dt``, because ``[w]x R' w_tree`` is zero.
    """
    if not joint.reversed:
        return qd
    drawn_q = _drawn_coordinates(joint, tree_q[_positions(joint)])
    backwards = list(reversed(joint.part.motions))
    parts = [qd[part] for part in _slices(backwards, speeds=True)]
    return SX(vertcat(*_turned(joint.part, drawn_q, SX(vertcat(*reversed(parts))), back=True)))


def _turned(part: JointPart, drawn_q: SX, values: SX, *, back: bool) -> list[SX]:
    """The values of each motion; values of balls are multiplied by ``-R``, or by ``-R'`` (``back``)."""
    parts: list[SX] = []
    speeds, positions = _slices(part.motions, speeds=True), _slices(part.motions, speeds=False)
    for motion, at, where in zip(part.motions, speeds, positions):
        value = values[at]
        if not isinstance(motion, AxisMotion):
            w, x, y, z = (drawn_q[where][k] for k in range(4))
            R = SX(vertcat(*(vertcat(*row).T for row in rotation_of((w, x, y, z)))))
            value = -mtimes(R.T if back else R, value)
        parts.append(value)
    return parts

"""The base class of joint blocks: state targets, spring and damper, limits, actuation, sensing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from armblocks.diagram import Block, FramePort, Parameter, ParameterKind, Port, parameter, shape_of
from armblocks.errors import InputError, counted
from armblocks.multibody.driven_joints import motion_input_port, motion_name
from armblocks.multibody.gathering import gather_mechanisms
from armblocks.multibody.joint_states import common_unit, force_unit, motion_ports
from armblocks.multibody.parts import BASE, FOLLOWER, JointPart, Targets
from armblocks.robot import Closure
from armblocks.robot.joints import AxisMotion, Motion
from armblocks.spatial import Transform

PRIORITIES = ("low", "high", "none")
ACTUATIONS = ("none", "torque", "motion")
NOT_TUNABLE_WITH_BALL = ("spring_stiffness", "equilibrium_position", "position_target")


@dataclass(frozen=True, kw_only=True)
class JointBlock(Block):
    """Base class of joints between the frames B (base) and F (follower).

    A joint is a sequence of elementary motions from B to F: a subclass declares ``motions``, and ``closure``
    if a type of constraint has the same relations. Coordinates describe F relative to B.

    ``q``, ``qd`` and ``qdd`` of a joint with coordinates are recorded in every run as signals of the block;
    the parameters ``sense_position`` … give it output ports for them.
    """

    motions: ClassVar[tuple[Motion, ...]]
    closure: ClassVar[type[Closure] | None] = None
    closure_frames: ClassVar[tuple[Transform, Transform]] = (Transform(), Transform())
    virtual: ClassVar[bool] = True
    gathers: ClassVar[Callable[[Any], Any] | None] = gather_mechanisms
    card_size: ClassVar[tuple[float, float]] = (84.0, 56.0)

    position_target: ArrayLike = parameter(
        0.0,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        doc="coordinates at the start, or 0 for neutral coordinates",
        unit="rad",
    )
    position_priority: str = parameter(
        "low", choices=PRIORITIES, doc="high: exact or an error; low: approximate in loops; none: no target"
    )
    velocity_target: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, dimensions=(0, 1), doc="speeds at the start", unit="rad/s"
    )
    velocity_priority: str = parameter(
        "low", choices=PRIORITIES, doc="high: exact or an error; low: approximate in loops; none: no target"
    )
    equilibrium_position: ArrayLike = parameter(
        0.0,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        doc="coordinates at which the spring exerts no force",
        unit="rad",
    )
    spring_stiffness: ArrayLike = parameter(
        0.0,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        minimum=0.0,
        doc="stiffness of the spring",
        unit="N m/rad",
    )
    damping_coefficient: ArrayLike = parameter(
        0.0,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        minimum=0.0,
        doc="coefficient of viscous damping",
        unit="N m s/rad",
    )
    lower_limit: ArrayLike = parameter(
        -np.inf,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        finite=False,
        tunable=False,
        doc="lower limit of the coordinates",
        unit="rad",
    )
    upper_limit: ArrayLike = parameter(
        np.inf,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        finite=False,
        tunable=False,
        doc="upper limit of the coordinates",
        unit="rad",
    )
    limit_stiffness: ArrayLike = parameter(
        1e4,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        minimum=0.0,
        doc="stiffness of the limits",
        unit="N m/rad",
    )
    limit_damping: ArrayLike = parameter(
        10.0,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        minimum=0.0,
        doc="damping of the limits",
        unit="N m s/rad",
    )
    transition_width: ArrayLike = parameter(
        1e-3,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        above=0.0,
        doc="penetration within which the force of a limit grows smoothly",
        unit="rad",
    )
    actuation: str = parameter(
        "none",
        choices=ACTUATIONS,
        doc="torque: an input for torques or forces; motion: an input for the coordinates",
    )
    moved: str = parameter(
        "",
        doc="coordinates with a motion input, separated by commas; the others are free (actuation motion) "
        "or have torques (actuation torque); empty: the actuation applies to all coordinates",
    )
    sense_position: bool = parameter(False, doc="output q of the coordinates")
    sense_velocity: bool = parameter(False, doc="output qd of the speeds")
    sense_acceleration: bool = parameter(False, doc="output qdd of the accelerations")
    sense_actuator: bool = parameter(False, doc="output of the torque or force of the actuator")

    @classmethod
    def parameters(cls) -> tuple[Parameter, ...]:
        """The parameters, with the units of the coordinates of this type of joint."""
        return _rules_of(cls, super().parameters())

    def check(self) -> None:
        part = self._part_without_targets()
        for rule in self.parameters():
            if rule.kind is not ParameterKind.ARRAY:
                continue
            count = part.nq if rule.name == "position_target" else part.nv
            shape = shape_of(self.parameter_value(rule.name))
            if shape not in ((), (count,)):
                raise InputError(
                    f"{rule.name} has {counted(shape[0], 'number')}",
                    where=f"{self.type_name()}.{rule.name}",
                    allowed=f"one number, or {count}: {', '.join(self._names(rule.name))}",
                    fix="give one number for each coordinate of the joint",
                )
        if np.any(np.asarray(self.lower_limit) > np.asarray(self.upper_limit)):
            raise InputError(
                f"the lower limit {self.lower_limit} is above the upper limit {self.upper_limit}",
                where=f"{self.type_name()}.lower_limit",
                allowed="a lower limit below the upper limit",
                fix="exchange the two limits",
            )
        if part.nq != part.nv:
            self._check_ball_values(part)
        self._check_moved(part)

    def _check_ball_values(self, part: JointPart) -> None:
        target = np.asarray(self.position_target)
        if target.shape == () and target != 0.0:
            raise InputError(
                f"position_target is {float(target):g} for all coordinates, among them a quaternion",
                where=f"{self.type_name()}.position_target",
                allowed=f"0 for the neutral coordinates, or {part.nq} numbers",
                fix="give the quaternion w x y z of the rotation from F to B",
            )
        for k, motion in enumerate(part.motions):
            first = sum(len(before.positions) for before in part.motions[:k])
            if target.shape and not isinstance(motion, AxisMotion) and not np.any(target[first : first + 4]):
                raise InputError(
                    "position_target has a quaternion of zeros, which is not a rotation",
                    where=f"{self.type_name()}.position_target",
                    allowed="a quaternion w x y z other than zero",
                    fix="write 1 0 0 0 for no rotation",
                )
        balls = [not isinstance(motion, AxisMotion) for motion in part.motions for _ in motion.speeds]
        for name in ("lower_limit", "upper_limit"):
            values = np.broadcast_to(np.asarray(getattr(self, name), dtype=float), (part.nv,))
            if np.isfinite(values[balls]).any():
                raise InputError(
                    f"{name} limits a rotation vector",
                    where=f"{self.type_name()}.{name}",
                    allowed="limits of coordinates about or along an axis",
                    fix="give -inf or inf for the rotation, or use a joint with axes, such as a Gimbal Joint",
                )

    def _names(self, parameter_name: str) -> list[str]:
        """The names of the entries of an array parameter."""
        part = self._part_without_targets()
        of_positions = parameter_name == "position_target"
        return [
            entry.name or "the coordinate"
            for motion in part.motions
            for entry in (motion.positions if of_positions else motion.speeds)
        ]

    # -- ports

    def frame_ports(self) -> tuple[FramePort, ...]:
        return (
            FramePort(BASE, "base frame"),
            FramePort(FOLLOWER, "follower frame, which moves relative to the base", "right"),
        )

    def input_ports(self) -> tuple[Port, ...]:
        part = self._part_without_targets()
        ports: list[Port] = []
        if part.has_motion_input:
            ports.append(motion_input_port(part))
        if "torque" in part.actuation:
            driven = [k for k, kind in enumerate(part.actuation) if kind == "torque"]
            ports.append(self._force_port("tau", "torque or force on the follower", driven))
        return tuple(ports)

    def output_ports(self) -> tuple[Port, ...]:
        q, qd, qdd = motion_ports(self._part_without_targets())
        sensed = (
            (self.sense_position, q),
            (self.sense_velocity, qd),
            (self.sense_acceleration, qdd),
            (self.sense_actuator, self._force_port("actuator", "torque or force of the actuator")),
        )
        return tuple(port for chosen, port in sensed if chosen)

    def _force_port(self, name: str, doc: str, driven: Sequence[int] | None = None) -> Port:
        part = self._part_without_targets()
        speeds = [entry for motion in part.motions for entry in motion.speeds]
        chosen = speeds if driven is None else [speeds[k] for k in driven]
        units = {entry.unit for entry in chosen}
        unit = force_unit(units.pop()) if len(units) == 1 else ""
        names = tuple(entry.name for entry in chosen) if part.nv > 1 else ()
        return Port(name, doc, unit, (len(chosen),) if names else (), names)

    def _moved_motions(self, motions: Sequence[Motion]) -> list[bool]:
        """For each elementary motion, whether it is an input."""
        names = [name.strip() for name in self.moved.split(",") if name.strip()]
        if self.actuation == "none" or not names:
            return [self.actuation == "motion"] * len(motions)
        return [motion_name(motion) in names for motion in motions]

    def _check_moved(self, part: JointPart) -> None:
        names = [name.strip() for name in self.moved.split(",") if name.strip()]
        where, allowed = f"{self.type_name()}.moved", [motion_name(motion) for motion in part.motions]
        for name in names:
            if name not in allowed or len(allowed) == 1:
                raise InputError(
                    f"the joint has no coordinate '{name}'",
                    where=where,
                    allowed="an empty text" if len(allowed) == 1 else ", ".join(allowed),
                    fix="correct the name, or leave moved empty to move all coordinates",
                )
        if names and self.actuation == "none":
            raise InputError(
                f"moved names '{names[0]}', but the actuation is {self.actuation}",
                where=where,
                allowed="coordinates of a joint with the actuation motion or torque",
                fix="change the actuation, or leave moved empty",
            )

    # -- the joint of the mechanism

    def elementary_motions(self) -> tuple[Motion, ...]:
        """The motions from B to F; they may depend on parameters that are not tunable."""
        return self.motions

    def part(self) -> JointPart:
        part = self._part_without_targets()
        neutral = np.array([value for motion in part.motions for value in motion.neutral])
        given = np.asarray(self.position_target, dtype=float)
        start = given if given.shape and self.position_priority != "none" else neutral
        if not given.shape and self.position_priority != "none":
            start = neutral + given
        qd = np.zeros(part.nv)
        if self.velocity_priority != "none":
            qd = qd + np.asarray(self.velocity_target, dtype=float)
        q_entries: list[float] = start.tolist()
        qd_entries: list[float] = qd.tolist()
        targets = Targets(
            q=tuple(q_entries),
            qd=tuple(qd_entries),
            position_priority=self.position_priority,
            velocity_priority=self.velocity_priority,
        )
        return JointPart(
            motions=part.motions,
            targets=targets,
            closure=self.closure,
            closure_frames=self.closure_frames,
            needs_coordinate=self._needs_coordinate(),
            actuation=part.actuation,
        )

    def _part_without_targets(self) -> JointPart:
        motions = self.elementary_motions()
        others = "torque" if self.actuation == "torque" else "none"
        actuation = [
            "motion" if moved else others
            for motion, moved in zip(motions, self._moved_motions(motions))
            for _ in motion.speeds
        ]
        return JointPart(motions=motions, targets=Targets(q=(), qd=()), actuation=tuple(actuation))

    def _needs_coordinate(self) -> bool:
        """Whether a value of a parameter has no meaning for a joint without coordinates."""
        defaults = {rule.name: rule.check(rule.default, "") for rule in self.parameters()}
        return any(
            getattr(self, name) != default
            for name, default in defaults.items()
            if name not in ("limit_stiffness", "limit_damping", "transition_width", "equilibrium_position")
        )


@cache
def _rules_of(kind: type[JointBlock], rules: tuple[Parameter, ...]) -> tuple[Parameter, ...]:
    """The parameters with the units of the coordinates: of rad, of m, or none for a joint with both.

    The spring of a ball joint is in the equations only if it is stiff, and its target may be 0 instead of a
    quaternion: these parameters are not tunable.
    """
    unit = common_unit(JointPart(motions=kind.motions, targets=Targets(q=(), qd=())))
    units = {"rad": "m", "rad/s": "m/s", "N m/rad": "N/m", "N m s/rad": "N s/m"} if unit == "m" else {}
    ball = any(not isinstance(motion, AxisMotion) for motion in kind.motions)
    return tuple(
        replace(
            rule,
            unit=rule.unit if unit == "rad" or "rad" not in rule.unit else units.get(rule.unit, ""),
            tunable=rule.tunable and not (ball and rule.name in NOT_TUNABLE_WITH_BALL),
        )
        for rule in rules
    )

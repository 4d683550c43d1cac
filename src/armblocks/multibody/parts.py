"""The contributions of blocks of mechanics to a mechanism, which the pass ``gathering`` reads.

A block of the family ``mechanics`` returns one of these parts. Frame ports are named here once.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from casadi import SX
from numpy.typing import NDArray

from armblocks.diagram import Port, Signals
from armblocks.robot import Closure
from armblocks.robot.joints import Motion
from armblocks.robot.shapes import Shape
from armblocks.spatial import Matrix3, Transform, Vector3
from armblocks.spatial.inertia import RigidInertia
from armblocks.spatial.vectors import Vector

BASE, FOLLOWER = "B", "F"
"""The frame ports of joints, transforms, forces between two frames and sensors."""
REFERENCE = "R"
"""The frame port of bodies, and of reference frames."""
WORLD = "W"
SETTINGS = "C"


@dataclass(frozen=True, kw_only=True)
class WorldPart:
    """The inertial frame, at the frame port ``W``."""


@dataclass(frozen=True, kw_only=True)
class SettingsPart:
    """The settings of the mechanism whose frames are connected with the frame port ``C``.

    ``gravity``: m/s2, in the World Frame. ``animated``: whether a run records the poses of all bodies.
    """

    gravity: Vector3
    animated: bool = True


@dataclass(frozen=True, kw_only=True)
class NodePart:
    """A frame without any property, at the frame port ``R``."""


@dataclass(frozen=True, kw_only=True)
class RigidPart:
    """A rigid connection: the constant ``pose`` of frame ``F`` in frame ``B``."""

    pose: Transform


@dataclass(frozen=True, kw_only=True)
class BodyPart:
    """A rigid body at the frame port ``R``, in its axes.

    ``mass`` kg, ``centre`` of mass m, ``inertia`` about the centre of mass kg m2, ``shapes`` for drawings.
    The numbers are those of the start of a run; the equations read the inertia from the block
    (:class:`InertiaLaw`).
    """

    mass: float
    centre: Vector3 = (0.0, 0.0, 0.0)
    inertia: Matrix3 = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    shapes: tuple[Shape, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Targets:
    """The desired start of a joint: coordinates ``q`` (nq,) and speeds ``qd`` (nv,) with their priorities.

    ``high``: satisfied exactly, or an error. ``low``: the start is searched near the target. ``none``: the
    target is ignored.
    """

    q: tuple[float, ...]
    qd: tuple[float, ...]
    position_priority: str = "low"
    velocity_priority: str = "low"


_AT_THE_JOINT = (Transform(), Transform())


@dataclass(frozen=True, kw_only=True)
class JointPart:
    """A joint from frame ``B`` to frame ``F``: a sequence of elementary motions.

    - ``closure``: the type of the constraint that replaces the joint where it closes a loop. ``None``: the
      joint cannot close a loop.
    - ``closure_frames``: the poses of the frames of this constraint, in ``B`` and in ``F``.
    - ``needs_coordinate``: whether the joint must have coordinates, because a parameter of its block, such
      as a target or a spring, refers to them, or a coupling does.
    - ``actuation``: ``none``, ``torque`` or ``motion`` for each speed; the three of a ball motion are equal.
    """

    motions: tuple[Motion, ...]
    targets: Targets
    closure: type[Closure] | None = None
    closure_frames: tuple[Transform, Transform] = _AT_THE_JOINT
    needs_coordinate: bool = False
    actuation: tuple[str, ...] = ()

    @property
    def nq(self) -> int:
        """Number of coordinates."""
        return sum(len(motion.positions) for motion in self.motions)

    @property
    def nv(self) -> int:
        """Number of speeds."""
        return sum(len(motion.speeds) for motion in self.motions)

    @property
    def has_motion_input(self) -> bool:
        """Whether the motion of some coordinates is an input."""
        return "motion" in self.actuation

    def driven_speeds(self) -> list[int]:
        """The indices of the speeds whose motion is an input."""
        return [k for k, kind in enumerate(self.actuation) if kind == "motion"]

    def driven_positions(self) -> list[int]:
        """The indices of the coordinates whose motion is an input."""
        driven: list[int] = []
        position = speed = 0
        for motion in self.motions:
            count = len(motion.positions)
            if self.actuation and self.actuation[speed] == "motion":
                driven += range(position, position + count)
            position, speed = position + count, speed + len(motion.speeds)
        return driven


@dataclass(frozen=True, kw_only=True)
class CouplingPart:
    """A linear relation between two joints with one axis, at the frame ports ``B`` and ``F``.

    ``joints``: the kinds of the joints to the bodies of B and of F, ``revolute`` or ``prismatic``. The motion
    of F is a factor (:class:`CouplingLaw`) times the motion of B, plus ``offset`` (rad or m). Both are
    relative to the body that carries both joints, about or along the z axes of B and F.
    """

    joints: tuple[str, str]
    offset: float = 0.0


class AxisOfCoupling(NamedTuple):
    """The z axis of a frame of a coupling, in the body that carries both joints.

    ``point`` (3,): the origin of the frame at joint coordinate 0, m; for a revolute joint, the point of the
    joint's axis nearest to it. ``direction`` (3,): a unit vector.
    """

    point: NDArray[np.float64]
    direction: NDArray[np.float64]


class CouplingLaw(Protocol):
    """A block that is a coupling."""

    def follower_per_base(self, base: AxisOfCoupling, follower: AxisOfCoupling) -> float:
        """The motion of F (rad or m) per motion of B, about or along their z axes; 0 is not permitted.

        Raises InputError, with the reason, for axes that the coupling does not permit.
        """
        ...


@dataclass(frozen=True)
class FrameMotion:
    """The motion of a frame in the World Frame: all vectors have world axes.

    ``rotation``: the columns are the axes of the frame. ``position`` m, ``velocity`` m/s and ``acceleration``
    m/s2 of its origin; ``angular_velocity`` rad/s, ``angular_acceleration`` rad/s2.
    """

    rotation: tuple[Vector, Vector, Vector]
    position: Vector
    velocity: Vector
    angular_velocity: Vector
    acceleration: Vector
    angular_acceleration: Vector


class InertiaLaw(Protocol):
    """A block that is a body, whose inertia depends on tunable parameters."""

    def inertia(self, p: Signals) -> RigidInertia:
        """The inertia in the frame R of the block, for the values ``p`` of its tunable parameters."""
        ...


class ForceLaw(Protocol):
    """A block that exerts a force, and possibly a moment, as a function of the motion of its frames."""

    def loads(
        self, frames: Mapping[str, FrameMotion], u: Signals, p: Signals
    ) -> Mapping[str, tuple[Vector, Vector]]:
        """Force (N) and moment (N m) on the body at each frame port, at its origin, in world axes."""
        ...

    def measured(self, frames: Mapping[str, FrameMotion], u: Signals, p: Signals) -> Mapping[str, SX]:
        """The values of the output ports of the block."""
        ...

    def input_ports(self) -> tuple[Port, ...]: ...

    def output_ports(self) -> tuple[Port, ...]: ...


@dataclass(frozen=True, kw_only=True)
class ForcePart:
    """A force element at the frame ports ``frames``, or a sensor, which exerts no force.

    ``accelerations``: whether it reads accelerations; a force element must not, because it would depend on
    itself.
    """

    frames: tuple[str, ...]
    exerts: bool = True
    accelerations: bool = False


Part = WorldPart | SettingsPart | NodePart | RigidPart | BodyPart | JointPart | ForcePart | CouplingPart

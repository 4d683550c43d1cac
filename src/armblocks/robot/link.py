"""A link of an arm with its joint and motor."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import InputError, RobotError, counted
from armblocks.robot.dh_row import DhRow
from armblocks.robot.fields import check_kind, number, numbers, pose
from armblocks.robot.joints import Joint, Revolute
from armblocks.robot.shapes import Shape
from armblocks.spatial import Matrix3, Transform, Vector3, matrix3, vector3

ZERO3: Matrix3 = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


@dataclass(frozen=True, kw_only=True)
class Motor(metaclass=ArgumentErrors):
    """A motor and its gear, all numbers at the motor's side of the gear.

    - ``inertia``: Jm, inertia of the rotor, kg m2.
    - ``gear_ratio``: G, motor turns per joint turn (motor rad per m of a prismatic joint); negative if motor
      and joint turn in opposite directions.
    - ``viscous_friction``: B, N m s/rad.
    - ``coulomb_friction``: (Tc+, Tc-), N m, Tc- negative. A single number t means (t, -t).
    """

    inertia: float = 0.0
    gear_ratio: float = 1.0
    viscous_friction: float = 0.0
    coulomb_friction: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("inertia", "gear_ratio", "viscous_friction"):
            object.__setattr__(self, name, number(getattr(self, name), where=f"{name} of a motor"))
        Tc = np.atleast_1d(numbers(self.coulomb_friction, where="coulomb_friction of a motor")).ravel()
        if Tc.size not in (1, 2):
            raise RobotError(
                f"the Coulomb friction of a motor has {counted(Tc.size, 'number')}",
                allowed="Tc, or the pair Tc+ Tc-",
                where="motor",
                fix="give (Tc+, Tc-), Tc- negative",
            )
        pair = (float(Tc[0]), -float(Tc[0]) if Tc.size == 1 else float(Tc[1]))
        object.__setattr__(self, "coulomb_friction", (pair[0] + 0.0, pair[1] + 0.0))

    @property
    def reflected_inertia(self) -> float:
        """``G^2 Jm``: the rotor inertia at the joint, kg m2 (kg for a prismatic joint)."""
        return self.gear_ratio * self.gear_ratio * self.inertia


@dataclass(frozen=True, kw_only=True)
class Link(metaclass=ArgumentErrors):
    """A rigid body, and the joint that connects it to ``parent``.

    - ``parent``: the name of a link; ``None`` is the robot's base.
    - ``before``, ``joint``, ``after``: the pose in the parent's frame is ``T_parent_link = before
      joint.motion(q) after``.
    - ``dh``: the Denavit-Hartenberg row from which ``before``, ``joint`` and ``after`` were computed, if
      there is one. It must agree with them; :func:`armblocks.robot.dh.standard_dh` builds all four.
    - ``mass``: kg.
    - ``centre_of_mass``: (3,) m, in the link's frame.
    - ``inertia``: kg m2, about the centre of mass in the link's axes: a (3, 3) array, or Ixx Iyy Izz, or Ixx
      Iyy Izz Ixy Iyz Ixz. These are the matrix entries, so Ixy is minus the integral of x y dm.
    - ``motor``: drives the link's joint; a joint with several degrees of freedom has such a motor for each of
      them.
    - ``geometry``: the shapes of the drawing; ``None``: they are derived from the kinematics.

    Raises RobotError for wrong shapes, and InputError for a wrong shape of ``centre_of_mass``.
    :class:`armblocks.robot.Robot` checks the values, because its messages name the robot and the link.
    """

    name: str
    parent: str | None = None
    joint: Joint = field(default_factory=Revolute)
    before: Transform = field(default_factory=Transform)
    after: Transform = field(default_factory=Transform)
    dh: DhRow | None = None
    mass: float = 0.0
    centre_of_mass: Vector3 = (0.0, 0.0, 0.0)
    inertia: Matrix3 = ZERO3
    motor: Motor | None = None
    geometry: tuple[Shape, ...] | None = None

    def __post_init__(self) -> None:
        link = f"link '{self.name}'"
        check_kind(self.joint, Joint, where=f"joint of {link}")
        if self.motor is not None:
            check_kind(self.motor, Motor, where=f"motor of {link}")
        if self.dh is not None:
            check_kind(self.dh, DhRow, where=f"dh of {link}")
        for frame in ("before", "after"):
            object.__setattr__(self, frame, pose(getattr(self, frame), where=f"{frame} of {link}"))
        object.__setattr__(self, "mass", number(self.mass, where=f"mass of {link}"))
        where = f"centre_of_mass of {link}"
        object.__setattr__(self, "centre_of_mass", vector3(self.centre_of_mass, where=where))
        object.__setattr__(self, "inertia", inertia_matrix(self.inertia, link=self.name))
        if self.geometry is not None:
            object.__setattr__(self, "geometry", tuple(self.geometry))

    @property
    def I(self) -> NDArray[np.float64]:  # noqa: E743 - the field's letter
        """The inertia about the centre of mass in link axes, a new (3, 3) array, kg m2."""
        return np.array(self.inertia)

    @property
    def r(self) -> NDArray[np.float64]:
        """The centre of mass in the link's frame, a new (3,) array, m."""
        return np.array(self.centre_of_mass)

    def pose(self, q: ArrayLike | None = None) -> Transform:
        """``T_parent_link`` at the joint coordinates ``q`` (nq,), rad or m; a number for one coordinate.

        Without ``q`` it is the pose at ``joint.neutral``. Raises InputError for a wrong number of values, and
        RobotError for values that are not numbers.
        """
        if q is None:
            return self.before @ self.joint.motion(self.joint.neutral) @ self.after
        values = numbers(q, where=f"q of link '{self.name}'").ravel().tolist()
        if len(values) != self.joint.nq:
            raise InputError(
                f"{counted(len(values), 'coordinate is', 'coordinates are')} given",
                where=f"link '{self.name}'",
                allowed=f"{self.joint.nq} for a {type(self.joint).__name__} joint",
                fix="give one number for each coordinate of the joint",
            )
        return self.before @ self.joint.motion(values) @ self.after


def inertia_matrix(value: ArrayLike, *, link: str = "") -> Matrix3:
    """A (3, 3) array, or Ixx Iyy Izz, or Ixx Iyy Izz Ixy Iyz Ixz, as a symmetric matrix.

    Raises RobotError that names ``link`` for a wrong shape or an asymmetric matrix.
    """
    where = f"inertia of link '{link}'" if link else "inertia"
    entries = numbers(value, where=where)
    if entries.shape == (3, 3):
        if not np.allclose(entries, entries.T, rtol=1e-9, atol=0.0, equal_nan=True):
            raise RobotError(
                "the matrix is not symmetric",
                where=where,
                allowed="Ixy = Iyx, Iyz = Izy, Ixz = Izx",
                fix="make the matrix symmetric",
            )
        return matrix3((entries + entries.T) / 2, where=where)
    flat = [float(entry) + 0.0 for entry in entries.ravel()]
    if len(flat) == 3:
        flat += [0.0, 0.0, 0.0]
    if len(flat) != 6:
        raise RobotError(
            f"the shape is {entries.shape}",
            where=where,
            allowed="(3, 3), or 3 numbers Ixx Iyy Izz, or 6 numbers Ixx Iyy Izz Ixy Iyz Ixz",
            fix="give the inertia in one of these forms",
        )
    xx, yy, zz, xy, yz, xz = flat
    return (xx, xy, xz), (xy, yy, yz), (xz, yz, zz)

"""Palletising arms with four axes. Parallel rods keep their flange level."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from armblocks.argument_errors import ArgumentErrors, with_argument_errors
from armblocks.errors import InputError
from armblocks.robot.constraints import Coupling
from armblocks.robot.fields import number
from armblocks.robot.joints import JointLimits, Revolute
from armblocks.robot.link import Link, Motor
from armblocks.robot.robot import Robot
from armblocks.robot.shapes import Cylinder, Material, Pose
from armblocks.spatial import Transform, rotation_about, transl

LEVER = 0.3
"""Length of the drive lever as a fraction of the upper arm. Manufacturers do not publish it."""
TRIANGLE = 0.15
"""Distance of the level rods from the axes of the arms, as a fraction of the upper arm; not published."""
SLENDERNESS = 0.12
"""Side of the square section of arms and rods as a fraction of their length, for their inertias."""
ROD_RADIUS = 0.02
"""Radius of the drawn rods as a fraction of the upper arm."""


@dataclass(frozen=True, kw_only=True)
class Masses(metaclass=ArgumentErrors):
    """Masses of the moving parts, kg. ``level_rods``: the rods along the lower and the upper arm."""

    turret: float
    lower_arm: float
    upper_arm: float
    drive_lever: float
    drive_rod: float
    level_rods: tuple[float, float]
    triangle: float
    wrist: float
    flange: float

    @classmethod
    def estimated(cls, payload: float, lower_arm: float, upper_arm: float) -> Masses:
        """Estimate the masses from the payload (kg) and the lengths of the arms (m).

        No manufacturer publishes them. The estimate has the masses of the KUKA KR 180 in the paper (150,
        100 and 50 kg for lower arm, upper arm and wrist) and is proportional to payload and length; rods,
        lever and triangle are assumptions. Real masses may differ by a factor of two.
        """
        return cls(
            turret=1.7 * payload,
            lower_arm=0.65 * payload * lower_arm,
            upper_arm=0.4 * payload * upper_arm,
            drive_lever=0.05 * payload,
            drive_rod=0.03 * payload * lower_arm,
            level_rods=(0.02 * payload * lower_arm, 0.02 * payload * upper_arm),
            triangle=0.03 * payload,
            wrist=0.2 * payload,
            flange=0.08 * payload,
        )


@dataclass(frozen=True, kw_only=True)
class AxisConvention(metaclass=ArgumentErrors):
    """The angle φ of an axis from its coordinate: ``φ = sign (q + zero)``, rad; ``sign`` is 1 or -1."""

    zero: float = 0.0
    sign: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "zero", number(self.zero, where="zero of an axis"))
        if self.sign not in (1.0, -1.0):
            raise InputError(
                f"the sign of an axis is {self.sign}", where="axis", allowed="1 or -1", fix="use 1 or -1"
            )


@with_argument_errors
def palletiser(
    name: str,
    *,
    shoulder_height: float,
    shoulder_offset: float,
    lower_arm: float,
    upper_arm: float,
    wrist_offset: float,
    flange_drop: float,
    upper_arm_angle: Literal["absolute", "relative"],
    axes: Sequence[AxisConvention] = (AxisConvention(),) * 4,
    limits: Sequence[JointLimits] = (JointLimits(),) * 4,
    motors: Sequence[Motor | None] = (None,) * 4,
    masses: Masses | None = None,
    manufacturer: str = "",
    comment: str = "",
) -> Robot:
    """Build a palletising arm with four axes from the lengths of its data sheet, m.

    ``shoulder_height``: of axis 2 above the floor. ``shoulder_offset``: of axis 2 from axis 1.
    ``wrist_offset``, ``flange_drop``: of the flange from the wrist, forward and down.

    The angles of the axes are:

    - φ1: turret about the vertical,
    - φ2: lower arm from the vertical, positive forward,
    - φ3: upper arm from the horizontal, positive down,
    - φ4: flange about its axis, which points down.

    ``axes`` has zeros and signs of the published joint angles q. With
    ``upper_arm_angle="absolute"`` q3 gives φ3; the motor of axis 3 is on the drive lever. With ``"relative"``
    q3 gives ``φ3 - φ2``, the angle between the arms, and the motor is on the elbow.

    Turret, arms, drive lever and drive rod, two level rods with their triangle, wrist and flange are bodies.
    The parallelograms are couplings, so q has four entries and all motions are exact. ``masses`` (None: no
    masses): the masses of the parts; arms and rods are beams of square section with uniform mass.
    """
    if upper_arm_angle not in ("absolute", "relative"):
        raise InputError(
            f"upper_arm_angle is {upper_arm_angle!r}",
            where=f"palletiser '{name}'",
            allowed="'absolute' or 'relative'",
            fix="use the convention of the data sheet",
        )
    links = _links(
        shoulder=(shoulder_offset, 0.0, shoulder_height),
        lengths=(lower_arm, upper_arm, wrist_offset, flange_drop),
        relative=upper_arm_angle == "relative",
        joints=tuple(zip(axes, limits, motors)),
        masses=masses,
    )
    couplings = _couplings(tuple(axes), upper_arm_angle == "relative")
    return Robot(name=name, manufacturer=manufacturer, comment=comment, links=links, constraints=couplings)


def _links(
    *,
    shoulder: tuple[float, float, float],
    lengths: tuple[float, float, float, float],
    relative: bool,
    joints: tuple[tuple[AxisConvention, JointLimits, Motor | None], ...],
    masses: Masses | None,
) -> tuple[Link, ...]:
    """The bodies, each with x forward and z up when the arms are at φ2 = φ3 = 0."""
    lower, upper, forward, drop = lengths
    lever, offset = LEVER * upper, TRIANGLE * upper
    x, _, z = shoulder
    vertical, level = (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)
    flange = Transform(rotation=rotation_about((1.0, 0.0, 0.0), math.pi), translation=(forward, 0.0, -drop))
    driven = {
        "turret": (vertical, joints[0]),
        "lower_arm": (level, joints[1]),
        "upper_arm" if relative else "drive_lever": (level, joints[2]),
        "flange": (vertical, joints[3]),
    }

    def link(name: str, parent: str | None, before: Transform, **inertial: object) -> Link:
        axis, (convention, limits, motor) = driven.get(name, (level, (AxisConvention(), JointLimits(), None)))
        joint = Revolute(
            axis=tuple(convention.sign * entry for entry in axis),  # pyright: ignore[reportArgumentType]
            offset=convention.zero,
            limits=limits,
        )
        return Link(name=name, parent=parent, joint=joint, before=before, motor=motor, **inertial)  # pyright: ignore[reportArgumentType]

    m = masses
    rods = m.level_rods if m else (0.0, 0.0)

    def rod(name: str, parent: str, at: tuple[float, float, float], mass: float, axis: int) -> Link:
        length = {"drive_lever": -lever, "triangle": offset}.get(name, lower if axis == 2 else upper)
        shape = _drawn_rod(length, axis, ROD_RADIUS * upper)
        return link(name, parent, transl(*at), geometry=(shape,), **_beam(mass, length, axis=axis))

    return (
        link("turret", None, Transform(), **_beam(m and m.turret, z / 2, axis=2, side=0.5 * z)),
        link("lower_arm", "turret", transl(*shoulder), **_beam(m and m.lower_arm, lower, axis=2)),
        link("upper_arm", "lower_arm", transl(0, 0, lower), **_beam(m and m.upper_arm, upper, axis=0)),
        rod("drive_lever", "turret", shoulder, m.drive_lever if m else 0.0, 0),
        rod("drive_rod", "drive_lever", (-lever, 0.0, 0.0), m.drive_rod if m else 0.0, 2),
        rod("lower_level_rod", "turret", (x - offset, 0.0, z + offset), rods[0], 2),
        rod("triangle", "lower_arm", (0.0, 0.0, lower), m.triangle if m else 0.0, 2),
        rod("upper_level_rod", "triangle", (0.0, 0.0, offset), rods[1], 0),
        link("wrist", "upper_arm", transl(upper, 0, 0), **_beam(m and m.wrist, forward, axis=0)),
        link("flange", "wrist", flange, **_beam(m and m.flange, -drop / 2, axis=2)),
    )


def _beam(mass: float | None, length: float, *, axis: int, side: float | None = None) -> Mapping[str, object]:
    """Mass, centre and inertia of a beam of square section from the origin to ``length`` along an axis."""
    if not mass:
        return {}
    side = SLENDERNESS * abs(length) if side is None else side
    centre = [0.0, 0.0, 0.0]
    centre[axis] = length / 2
    moments = [mass * (length**2 + side**2) / 12] * 3
    moments[axis] = mass * side**2 / 6
    return {"mass": mass, "centre_of_mass": tuple(centre), "inertia": tuple(moments)}


def _drawn_rod(length: float, axis: int, radius: float) -> Cylinder:
    """The drawing of a rod from the origin to ``length`` along the x or the z axis."""
    middle = length / 2
    poses: dict[int, Pose] = {
        0: ((0.0, 0.0, 1.0, middle), (0.0, 1.0, 0.0, 0.0), (-1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)),
        2: ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, middle), (0.0, 0.0, 0.0, 1.0)),
    }
    return Cylinder(radius=radius, length=abs(length), material=Material.FLANGE, pose=poses[axis])


def _couplings(axes: tuple[AxisConvention, ...], relative: bool) -> tuple[Coupling, ...]:
    """The angles of the other joints as combinations of φ2 and φ3, in the coordinates of axes 2 and 3."""
    second, third = axes[1], axes[2]
    names = ("lower_arm", "upper_arm" if relative else "drive_lever")
    # Each angle: factors of q2 and q3, and the constant.
    phi2 = (second.sign, 0.0, second.sign * second.zero)
    own3 = (0.0, third.sign, third.sign * third.zero)
    phi3 = tuple(a + b for a, b in zip(phi2, own3)) if relative else own3
    difference = tuple(b - a for a, b in zip(phi2, phi3))
    angles = {
        **({"drive_lever": phi3} if relative else {"upper_arm": difference}),
        "drive_rod": tuple(-value for value in difference),
        "lower_level_rod": phi2,
        "triangle": tuple(-value for value in phi2),
        "upper_level_rod": phi3,
        "wrist": tuple(-value for value in phi3),
    }
    return tuple(
        Coupling(
            name=f"parallel {joint.replace('_', ' ')}",
            terms=((joint, 1.0), *((name, -factor) for name, factor in zip(names, angle) if factor)),
            constant=angle[2],
        )
        for joint, angle in angles.items()
    )

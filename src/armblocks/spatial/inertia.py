"""The ten inertial parameters of a rigid body, about the origin of its frame; numbers or symbols."""

from __future__ import annotations

from typing import NamedTuple

from armblocks.spatial.rotation import Matrix3, Vector3
from armblocks.spatial.transform import Transform
from armblocks.spatial.vectors import (
    ZERO,
    Scalar,
    Symmetric,
    Vector,
    add,
    add_symmetric,
    dot,
    rotate,
    rotate_symmetric,
    scale,
)

NO_INERTIA = Symmetric(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class RigidInertia(NamedTuple):
    """The inertial parameters of a body in the axes of one frame.

    ``mass``, kg; ``first`` moment m c, kg m; ``second`` moment, the inertia matrix about the frame's origin,
    kg m2. Inertias in the same frame can be added.
    """

    mass: Scalar = 0.0
    first: Vector = ZERO
    second: Symmetric = NO_INERTIA

    @classmethod
    def about_centre(cls, mass: float, centre: Vector3, inertia: Matrix3) -> RigidInertia:
        """The parameters from the inertia matrix about the centre of mass."""
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = inertia
        return cls.at_centre(mass, Symmetric(xx, yy, zz, xy, yz, xz)).shifted(centre)

    @classmethod
    def at_centre(cls, mass: Scalar, inertia: Symmetric) -> RigidInertia:
        """The parameters of a body whose centre of mass is the origin."""
        return cls(mass, ZERO, inertia)

    def plus(self, other: RigidInertia) -> RigidInertia:
        """The parameters of both bodies together."""
        return RigidInertia(
            self.mass + other.mass,
            add(self.first, other.first),
            add_symmetric(self.second, other.second),
        )

    def shifted(self, p: Vector) -> RigidInertia:
        """The same body in a frame with the same axes, in which this frame's origin is at ``p`` m.

        With ``x = y + p``: first ``h + m p``, second ``I + (2 p.h + m p.p) 1 - p h' - h p' - m p p'``
        (parallel-axis theorem; neither origin needs to be the centre of mass).
        """
        mass, h, S = self
        # k = h + m p / 2 combines the first-moment and the mass terms of the correction.
        k = add(h, scale(0.5 * mass, p))
        isotropic = 2.0 * dot(p, k)
        return RigidInertia(
            mass,
            add(h, scale(mass, p)),
            Symmetric(
                xx=S.xx + (isotropic - 2.0 * (p[0] * k[0])),
                yy=S.yy + (isotropic - 2.0 * (p[1] * k[1])),
                zz=S.zz + (isotropic - 2.0 * (p[2] * k[2])),
                xy=S.xy - (p[0] * k[1] + k[0] * p[1]),
                yz=S.yz - (p[1] * k[2] + k[1] * p[2]),
                xz=S.xz - (p[0] * k[2] + k[0] * p[2]),
            ),
        )

    def moved(self, T_ab: Transform) -> RigidInertia:
        """The parameters in frame a of a body given in frame b."""
        R = T_ab.rotation
        rotated = RigidInertia(self.mass, rotate(R, self.first), rotate_symmetric(R, self.second))
        return rotated.shifted(T_ab.translation)

"""Rotations about given axes that satisfy one equation, with symbols: the subproblems of Paden and Kahan.

In the numbering of Elias and Wen, *IK-Geo: Unified robot inverse kinematics using subproblem decomposition*,
Mechanism and Machine Theory 209, 2025. Directions are unit vectors. A solution that does not exist is NaN.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from casadi import SX, atan2, cross, dot, fabs, fmax, if_else, sin, sqrt
from casadi import cos as cosine
from numpy.typing import NDArray

Vector = SX | NDArray[np.float64]

ROUNDING = 1e-12
"""A square root of a number above minus this, relative to its terms, is zero: two solutions coincide."""


class TwoAngles(NamedTuple):
    """Two solutions ``middle ± half``; ``root`` (0 to 1) is zero where they coincide."""

    middle: SX
    half: SX
    root: SX

    def angle(self, sign: float) -> SX:
        """The solution with the sign."""
        return SX(self.middle + sign * self.half)


def rotated(k: Vector, angle: SX, p: Vector) -> SX:
    """The vector ``p`` rotated by ``angle`` rad about ``k``: Rodrigues' formula."""
    c, s = cosine(angle), sin(angle)
    return SX(c * p + s * cross(SX(k), SX(p)) + (1.0 - c) * dot(SX(k), SX(p)) * k)


def angle_between(p: Vector, r: Vector, k: Vector) -> SX:
    """Subproblem 1: the angle of the rotation about ``k`` that takes ``p`` to ``r``."""
    p, r, k = SX(p), SX(r), SX(k)
    return SX(atan2(dot(k, cross(p, r)), dot(p, r) - dot(k, p) * dot(k, r)))


def height(h: Vector, p: Vector, k: Vector, d: SX | float, square: SX | None = None) -> TwoAngles:
    """Subproblem 4: the angles with ``h' Rot(k, angle) p = d``.

    ``square``: ``A² + B² - c²`` below, where it is known with less cancellation.
    """
    h, p, k = SX(h), SX(p), SX(k)
    along = dot(h, k) * dot(k, p)
    A, B = dot(h, p) - along, dot(h, cross(k, p))
    c = SX(d - along)
    size = SX(A * A + B * B)
    rest = SX(size - c * c) if square is None else square
    tolerance = ROUNDING * fmax(size, c * c)
    root = sqrt(if_else(fabs(rest) <= tolerance, 0.0, rest))
    relative = SX(if_else(size > 0.0, root / sqrt(if_else(size > 0.0, size, 1.0)), 0.0))
    return TwoAngles(SX(atan2(B, A)), SX(atan2(root, c)), relative)


def distance(p: Vector, r: Vector, k: Vector, d_squared: SX) -> TwoAngles:
    """Subproblem 3: the angles with ``|p - Rot(k, angle) r|² = d_squared``."""
    p, r = SX(p), SX(r)
    return height(p, r, k, SX(0.5 * (dot(p, p) + dot(r, r) - d_squared)))

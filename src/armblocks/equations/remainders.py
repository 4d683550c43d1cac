"""Remainders u - n v, the integer n in them, and the ends of the interval with this n.

``mod`` has the sign of v, and mod(u, 0) = u; ``rem`` has the sign of u, and rem(u, 0) is NaN. The integer n
is used as a mode, so that the remainder is smooth between two events.

If |n| is greater than 2**44, rounding errors of u are not small compared with v, and events would follow
these errors. There, and for a zero or huge divisor, n counts as 0, no event occurs, and the remainder is
computed directly.
"""

from __future__ import annotations

from casadi import SX, fabs, floor, fmod, if_else, logic_and, sign

OFFSET = 1e-300
"""Offset of a guard that gives zero a definite sign. It is below the resolution of any signal."""
LARGEST_QUOTIENT, LARGEST_DIVISOR = 2.0**44, 2.0**900
"""The quotient u / v and the divisor from which on n is not computed."""


def nearest(u: SX) -> SX:
    """Round to the nearest integer, halves away from zero, exactly for every double."""
    whole = floor(fabs(u))
    return sign(u) * (whole + (fabs(u) - whole >= 0.5))


def remainder(function: str, u: SX, v: SX) -> SX:
    """``mod`` or ``rem`` of u and v, exact up to one rounding."""
    rest = fmod(u, v)
    if function == "rem":
        return rest
    other_sign = logic_and(rest != 0.0, (rest < 0.0) != (v < 0.0))
    return if_else(v == 0.0, u, if_else(other_sign, rest + v, rest))


def quotient_of(function: str, u: SX, v: SX) -> SX:
    """The integer n in u - n v, consistent with :func:`remainder`; 0 if no n is computed."""
    return nearest(if_else(_has_quotient(u, v), (u - remainder(function, u, v)) / v, 0.0))


def remainder_for_quotient(function: str, u: SX, v: SX, quotient: SX) -> SX:
    """The remainder u - n v for a given n, also slightly beyond the ends of its interval, rounded once.

    For a consistent n it equals :func:`remainder`, which jumps, and which is evaluated only if no n is
    computed.
    """
    known = _has_quotient(u, v)
    product = quotient * v
    rest = (u - product) - _rounding_error(quotient, v, product)
    return if_else(known, rest, remainder(function, if_else(known, 0.0, u), if_else(known, 1.0, v)))


def _rounding_error(a: SX, b: SX, product: SX) -> SX:
    """The exact difference between a b and the rounded product (Dekker, Numerische Mathematik 18, 1971,
    224-242)."""
    (a_high, a_low), (b_high, b_low) = _halves(a), _halves(b)
    return ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


def _halves(a: SX) -> tuple[SX, SX]:
    """Two doubles of at most 26 bits with the sum a (Veltkamp)."""
    scaled = (2.0**27 + 1.0) * a
    high = scaled - (scaled - a)
    return high, a - high


def beyond_ends(function: str, u: SX, v: SX, quotient: SX) -> tuple[SX, SX]:
    """The distance of u beyond the upper and above the lower end of the interval with a given n, in the
    direction of v; 0 if no n is computed.

    The signs are exact: u - k v is computed from the remainder.
    """
    if function == "mod":
        upper, lower, upper_offset, lower_offset = quotient + 1.0, quotient, SX(OFFSET), SX(OFFSET)
    else:
        upper, lower = quotient + (quotient >= 0.0), quotient - (quotient <= 0.0)
        upper_offset = if_else(quotient >= 0.0, OFFSET, -OFFSET)
        lower_offset = if_else(quotient <= 0.0, -OFFSET, OFFSET)
    rest, n = remainder(function, u, v), quotient_of(function, u, v)
    up = (rest - (upper - n) * v) * sign(v) + upper_offset
    down = (rest - (lower - n) * v) * sign(v) + lower_offset
    known = _has_quotient(u, v)
    return if_else(known, up, 0.0), if_else(known, down, 0.0)


def _has_quotient(u: SX, v: SX) -> SX:
    return logic_and(fabs(u) < LARGEST_QUOTIENT * fabs(v), fabs(v) < LARGEST_DIVISOR)

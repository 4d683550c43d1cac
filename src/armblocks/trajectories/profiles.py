"""Profiles of motions from rest to rest: trapezoidal speed, limited jerk, and the toolbox's ``lspb``.

Sources: Siciliano et al., Robotics, 2009, 4.2.1 (trapezoidal speed); Biagiotti and Melchiorri, Trajectory
Planning for Automatic Machines and Robots, 2008, 3.2 and 3.4 (trapezoidal speed, double S).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from armblocks.trajectories.piecewise import PiecewisePolynomial, hermite

Array = NDArray[np.float64]


def from_derivatives(durations: Sequence[float], highest: Sequence[float], order: int) -> PiecewisePolynomial:
    """A motion of one joint from rest at 0; its derivative of ``order`` is constant in each piece.

    ``durations`` (s) and the values ``highest`` of the derivative, piece after piece; pieces of length 0 are
    omitted. The end is exactly at rest.
    """
    state = [0.0] * order
    times, rows = [0.0], list[list[float]]()
    for duration, value in zip(durations, highest):
        if duration <= 0.0:
            continue
        derivatives = [*state, value]
        rows.append([entry / math.factorial(power) for power, entry in enumerate(derivatives)])
        for k in range(order):
            state[k] = sum(
                entry * duration**power / math.factorial(power) for power, entry in enumerate(derivatives[k:])
            )
        times.append(times[-1] + duration)
    end = np.array([[state[0]], [0.0], [highest[-1] if order == 2 else 0.0]])
    return PiecewisePolynomial(times=np.array(times), coefficients=np.array(rows)[:, :, None], end=end)


def trapezoid(speed: float, acceleration: float, deceleration: float) -> PiecewisePolynomial:
    """The time-optimal motion over the distance 1 with limits of speed and of acceleration at both ends.

    The limits are per unit of distance: 1/s, 1/s². Where the speed limit is not reached, the profile is a
    triangle.
    """
    a, d = acceleration, deceleration
    triangle = math.sqrt(2.0 * a * d / (a + d)) if math.isfinite(a + d) else math.sqrt(2.0 * min(a, d))
    v = min(speed, triangle)
    cruise = 0.0 if v == triangle else (1.0 - v * v / (2.0 * a) - v * v / (2.0 * d)) / v
    motion = from_derivatives((v / a, max(cruise, 0.0), v / d), (a, 0.0, -d), 2)
    return _to_one(motion)


def double_s(speed: float, acceleration: float, jerk: float) -> PiecewisePolynomial:
    """The time-optimal motion over the distance 1 with limits of speed, acceleration and jerk (1/s, 1/s²,
    1/s³).

    The speed rises in an S, is constant, and falls in the same S. Phases of constant acceleration and speed
    are omitted where the limits are not reached.
    """
    v, a, j = speed, acceleration, jerk
    if v * j < a * a:
        rise = math.sqrt(v / j)
        ramp = 2.0 * rise
    else:
        rise = a / j
        ramp = rise + v / a
    cruise = 1.0 / v - ramp
    if cruise < 0.0:
        cruise, rise = 0.0, a / j
        if j * j >= 2.0 * a**3:
            ramp = rise / 2.0 + math.sqrt(rise * rise / 4.0 + 1.0 / a)
        else:
            rise = (1.0 / (2.0 * j)) ** (1.0 / 3.0)
            ramp = 2.0 * rise
    hold = ramp - 2.0 * rise
    hold = hold if hold > 1e-12 * ramp else 0.0
    cruise = cruise if cruise > 1e-12 * ramp else 0.0
    motion = from_derivatives((rise, hold, rise, cruise, rise, hold, rise), (j, 0.0, -j, 0.0, -j, 0.0, j), 3)
    return _to_one(motion)


def along(start: Array, change: Array, profile: PiecewisePolynomial) -> PiecewisePolynomial:
    """The straight joint motion ``start + change s`` with the profile ``s`` from 0 to 1."""
    coefficients = profile.coefficients * change
    coefficients[:, 0] += start
    end = profile.end
    assert end is not None
    final = end * change
    final[0] = start + change
    return PiecewisePolynomial(times=profile.times, coefficients=coefficients, end=final)


def at_rest(q: Array, duration: float = 0.0) -> PiecewisePolynomial:
    """Joints at rest at ``q`` (n,) for a duration (s)."""
    end = np.array([q, 0.0 * q, 0.0 * q])
    return PiecewisePolynomial(times=np.array([0.0, duration]), coefficients=q[None, None, :] + 0.0, end=end)


def lspb(q0: float, q1: float, duration: float, speed: float) -> PiecewisePolynomial:
    """The toolbox's ``lspb`` of one joint: parabola, line with the given ``speed``, parabola.

    The speed has the sign of ``q1 - q0`` and is between one and two times the mean speed.
    """
    if q0 == q1:
        return at_rest(np.array([q0]), duration)
    blend = (q0 - q1 + speed * duration) / speed
    a = speed / blend
    half = a * blend * blend / 2.0
    blend = min(blend, duration / 2.0)
    times, rows = [0.0, blend], [[q0, 0.0, a / 2.0]]
    if duration - 2.0 * blend > 1e-12 * duration:
        rows.append([q0 + half, speed, 0.0])
        times.append(duration - blend)
    rows.append([q1 - half, speed, -a / 2.0])
    times.append(duration)
    end = np.array([[q1], [0.0], [-a]])
    return PiecewisePolynomial(times=np.array(times), coefficients=np.array(rows)[:, :, None], end=end)


def quintic(q0: Array, q1: Array, duration: float, qd0: Array, qd1: Array) -> PiecewisePolynomial:
    """A quintic from ``q0`` to ``q1`` (n,) with end speeds and without end accelerations, duration in s."""
    rest = np.zeros((1, len(q0)))
    end = np.array([q1, qd1, rest[0]])
    times = np.array([0.0, duration])
    return hermite(times, (q0[None], qd0[None], rest), (q1[None], qd1[None], rest), end=end)


def _to_one(motion: PiecewisePolynomial) -> PiecewisePolynomial:
    """The motion with the rounding error of its distance removed: the last position is exactly 1."""
    assert motion.end is not None
    distance = motion.end[0, 0]
    end = motion.end / distance
    end[0] = 1.0
    return PiecewisePolynomial(times=motion.times, coefficients=motion.coefficients / distance, end=end)

"""The Robotics Toolbox's trajectory ``jtraj``: a quintic with given end speeds and zero end accelerations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from casadi import SX, fmax, fmin, if_else
from numpy.typing import NDArray

Quantity = TypeVar("Quantity", SX, NDArray[np.float64])
"""CasADi symbols or NumPy arrays; the same equations serve both."""


class Motion(NamedTuple, Generic[Quantity]):
    """Positions (rad, m), speeds (rad/s, m/s) and accelerations (rad/s², m/s²) at one or several times."""

    q: Quantity
    qd: Quantity
    qdd: Quantity


@dataclass(frozen=True, eq=False, kw_only=True)
class Quintic(Generic[Quantity]):
    """A motion from ``q0`` at t = 0 to ``qf`` at t = ``tmax`` (s), with the end speeds ``qd0`` and ``qd1``.

    A speed ``None`` is zero. With ``s = t / tmax`` the motion is ``q0 + (qf - q0) h(s) + qd0 tmax f(s) +
    qd1 tmax g(s)``,

    ``h = s^3 (10 - 15 s + 6 s^2)``,  ``f = s (1 - s)^3 (1 + 3 s)``,  ``g = -s^3 (1 - s) (4 - 3 s)``.

    These are the toolbox's coefficients, in a form with exact speeds at both ends. A joint at rest has the
    speed 0 and not 1e-17, which would cause Coulomb friction.

    Before t = 0 the joints are at rest at ``q0``, after ``tmax`` at ``qf``: speeds and accelerations are
    zero. At the times 0 and ``tmax`` the speeds are ``qd0`` and ``qd1``.

    Symbols: ``q0, qf, qd0, qd1`` are columns (n, 1), ``tmax`` is a scalar. Numbers: arrays (n,) and a scalar
    array. ``tmax`` must be above zero; callers check user input.
    """

    q0: Quantity
    qf: Quantity
    tmax: Quantity
    qd0: Quantity | None = None
    qd1: Quantity | None = None

    def at(self, t: Quantity) -> Motion[Quantity]:
        """Return the motion at time ``t`` (s).

        Symbols: ``t`` is a scalar, the results are columns (n, 1). Numbers: ``t`` has shape () or (N,), the
        results have shape (n,) or (N, n).
        """
        T = self.tmax
        fraction = _as_column(t) / T
        s: Quantity = _limited(fraction)
        r = 1.0 - s
        change = self.qf - self.q0
        q = self.q0 + change * (s * s * s * (10.0 - s * (15.0 - 6.0 * s)))
        qd = change * (30.0 * (s * s) * (r * r)) / T
        qdd = change * (60.0 * s * r * (r - s)) / (T * T)
        if self.qd0 is not None:
            q = q + self.qd0 * (T * (s * r * r * r * (1.0 + 3.0 * s)))
            qd = qd + self.qd0 * _while_moving(fraction, r * r * (1.0 - 3.0 * s) * (1.0 + 5.0 * s))
            qdd = qdd - self.qd0 * (12.0 * s * r * (3.0 - 5.0 * s)) / T
        if self.qd1 is not None:
            q = q - self.qd1 * (T * (s * s * s * r * (4.0 - 3.0 * s)))
            qd = qd + self.qd1 * _while_moving(fraction, s * s * (3.0 * s - 2.0) * (6.0 - 5.0 * s))
            qdd = qdd - self.qd1 * (12.0 * s * r * (2.0 - 5.0 * s)) / T
        return Motion(q, qd, qdd)


def _as_column(t: Quantity) -> Quantity:
    return t[..., None] if isinstance(t, np.ndarray) else t


def _limited(s: SX | NDArray[np.float64]) -> Any:
    """Return ``s`` limited to 0 … 1, of the same type."""
    return fmin(fmax(s, 0.0), 1.0) if isinstance(s, SX) else np.clip(s, 0.0, 1.0)


def _while_moving(s: SX | NDArray[np.float64], value: Any) -> Any:
    """Return ``value`` for s in [0, 1] and 0 outside, of the same type."""
    if isinstance(s, SX):
        return if_else(s < 0.0, 0.0, if_else(s > 1.0, 0.0, value))
    return np.where((s < 0.0) | (s > 1.0), 0.0, value)

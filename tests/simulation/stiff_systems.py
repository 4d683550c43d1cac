"""Stiff problems of the literature, written as equations, with NumPy versions for independent solvers."""

from __future__ import annotations

import casadi as ca
import numpy as np
from casadi import SX
from hybrid_systems import column, hybrid
from small_systems import states_of, system

from armblocks.equations import HybridSystem, signature

ROBERTSON_END = np.array([0.2083340149701255e-7, 0.8333360770334713e-13, 0.9999999791665050])
"""Reference solution at 1e11 s from the Bari test set for initial value problems."""
VAN_DER_POL_END = np.array([1.706167732170469, -0.8928097010248125e-3])
"""Reference solution at 2000 s with mu = 1000 from the same test set."""


def robertson() -> HybridSystem:
    """Robertson's problem: three reactions with rates from 0.04 to 3e7 1/s."""

    def rates(t: SX, y: SX, p: SX) -> SX:
        slow, fast, back = 0.04 * y[0], 3e7 * y[1] ** 2, 1e4 * y[1] * y[2]
        return ca.vertcat(back - slow, slow - back - fast, fast)

    return system(
        "robertson",
        states=states_of("a/x", "b/x", "c/x"),
        signals=signature(("y", (3,))),
        derivative=rates,
        outputs=lambda t, y, p: y,
        initial=(1.0, 0.0, 0.0),
    )


def robertson_dae() -> HybridSystem:
    """Robertson's problem with the conservation law ``a + b + w = 1`` as an implicit equation of index 1."""
    return hybrid(
        "robertson_dae",
        states=("a/x", "b/x"),
        algebraic=("balance/c",),
        signals=("a", "b", "c"),
        x0=(1.0, 0.0),
        w0=(0.0,),
        derivative=lambda t, x, z, w, p: column(
            1e4 * x[1] * w - 0.04 * x[0], 0.04 * x[0] - 1e4 * x[1] * w - 3e7 * x[1] ** 2
        ),
        outputs=lambda t, x, z, w, p: column(x[0], x[1], w),
        residual=lambda t, x, z, w, p: x[0] + x[1] + w - 1.0,
    )


def van_der_pol(mu: float) -> HybridSystem:
    """Relaxation oscillations: long stiff phases with fast transitions between them."""
    return system(
        "van_der_pol",
        states=states_of("mass/x", "mass/v"),
        signals=signature(("y", (2,))),
        derivative=lambda t, x, p: ca.vertcat(x[1], mu * (1 - x[0] ** 2) * x[1] - x[0]),
        outputs=lambda t, x, p: x,
        initial=(2.0, 0.0),
    )


def hires_rates(y: np.ndarray | SX) -> list[float | SX]:
    """Photomorphogenesis, 8 substances (Hairer, Wanner II, IV.10, equation (10.4))."""
    reaction = 280.0 * y[5] * y[7]
    return [
        -1.71 * y[0] + 0.43 * y[1] + 8.32 * y[2] + 0.0007,
        1.71 * y[0] - 8.75 * y[1],
        -10.03 * y[2] + 0.43 * y[3] + 0.035 * y[4],
        8.32 * y[1] + 1.71 * y[2] - 1.12 * y[3],
        -1.745 * y[4] + 0.43 * y[5] + 0.43 * y[6],
        -reaction + 0.69 * y[3] + 1.71 * y[4] - 0.43 * y[5] + 0.69 * y[6],
        reaction - 1.81 * y[6],
        -reaction + 1.81 * y[6],
    ]


def oregonator_rates(y: np.ndarray | SX) -> list[float | SX]:
    """A chemical oscillator (Hairer, Wanner II, IV.10, equation (10.5))."""
    return [
        77.27 * (y[1] + y[0] * (1.0 - 8.375e-6 * y[0] - y[1])),
        (y[2] - (1.0 + y[0]) * y[1]) / 77.27,
        0.161 * (y[0] - y[2]),
    ]


KINETICS = {
    "hires": (hires_rates, (1.0, 0, 0, 0, 0, 0, 0, 0.0057), 321.8122),
    "oregonator": (oregonator_rates, (1.0, 2.0, 3.0), 360.0),
}


def kinetics(name: str) -> HybridSystem:
    """Build one of :data:`KINETICS`."""
    rates, start, _ = KINETICS[name]
    return system(
        name,
        states=states_of(*(f"s{k}/x" for k in range(len(start)))),
        signals=signature(("y", (len(start),))),
        derivative=lambda t, x, p: ca.vertcat(*rates(x)),
        outputs=lambda t, x, p: x,
        initial=start,
    )


def heat(n: int) -> tuple[HybridSystem, np.ndarray, float]:
    """Return a rod with cold ends as ``n`` states, its first mode ``(n,)``, and the decay rate of the mode.

    The mode is also an eigenvector of the finite differences, so that the states are known exactly.
    """
    h = 1.0 / (n + 1)
    mode = np.sin(np.pi * h * np.arange(1, n + 1))

    def rates(t: SX, x: SX, p: SX) -> SX:
        left, right = ca.vertcat(0, x[:-1]), ca.vertcat(x[1:], 0)
        return (left - 2 * x + right) / h**2

    rod = system(
        "heat",
        states=signature(("rod/x", (n,))),
        signals=signature(("y", (n,))),
        derivative=rates,
        outputs=lambda t, x, p: x,
        initial=mode,  # pyright: ignore[reportArgumentType]
    )
    return rod, mode, 4.0 / h**2 * np.sin(np.pi * h / 2) ** 2


def pendulum() -> HybridSystem:
    """A unit mass on a unit rod in Cartesian coordinates: an implicit equation of index 1 for the rod force.

    ``x'' = -w x``, ``y'' = -w y - g`` and ``x^2 + y^2 = 1``, differentiated twice. The rod starts horizontal,
    at rest.
    """
    g = 9.81
    return hybrid(
        "pendulum",
        states=("bob/x", "bob/y", "bob/vx", "bob/vy"),
        algebraic=("rod/force",),
        signals=("x", "y", "vx", "vy", "force"),
        x0=(-1.0, 0.0, 0.0, 0.0),
        w0=(0.0,),
        derivative=lambda t, x, z, w, p: column(x[2], x[3], -w * x[0], -w * x[1] - g),
        outputs=lambda t, x, z, w, p: column(x, w),
        residual=lambda t, x, z, w, p: x[2] ** 2 + x[3] ** 2 - w * (x[0] ** 2 + x[1] ** 2) - g * x[1],
    )


def ball_on_fast_plate(rate: float = 1e4) -> HybridSystem:
    """A bouncing ball; its height is measured through a lag of ``rate`` 1/s and a sample-and-hold."""
    return hybrid(
        "fast_plate",
        states=("ball/h", "ball/v", "lag/x"),
        discrete=("hold/y", "ball/last"),
        signals=("h", "v", "lag", "hold", "last"),
        x0=(1.0, 0.0, 1.0),
        z0=(0.0, 0.0),
        clocks=((0.1, 0.0),),
        guards=(("ball", -1),),
        derivative=lambda t, x, z, w, p: column(x[1], -9.81, rate * (x[0] - x[2])),
        outputs=lambda t, x, z, w, p: column(x, z),
        update=lambda t, x, z, w, p, m: column(x[2], z[1]),
        guard=lambda t, x, z, w, p: x[0],
        reset=lambda t, x, z, w, p, e: (column(0.0, -0.7 * x[1], x[2]), column(z[0], t)),
    )

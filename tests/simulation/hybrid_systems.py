"""Small hybrid systems written directly as equations, with solutions in closed form."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import casadi as ca
import numpy as np
from casadi import SX

from armblocks.equations import HybridSystem, SampleClock, Signature, Slot, TracedFunction, signature

Equation = Callable[..., SX]


def column(*parts: SX | float) -> SX:
    return ca.vertcat(*parts) if parts else SX(0, 1)


def scalars(names: Sequence[str]) -> Signature:
    return Signature(tuple(Slot(name) for name in names))


def hybrid(
    name: str,
    *,
    states: Sequence[str] = (),
    discrete: Sequence[str] = (),
    algebraic: Sequence[str] = (),
    signals: Sequence[str],
    parameters: Sequence[str] = (),
    values: Sequence[float] = (),
    x0: Sequence[float] = (),
    z0: Sequence[float] = (),
    w0: Sequence[float] = (),
    clocks: Sequence[tuple[float, float]] = (),
    guards: Sequence[tuple[str, int]] = (),
    breakpoints: Sequence[float] = (),
    derivative: Equation = lambda t, x, z, w, p: column(),
    outputs: Equation,
    residual: Equation = lambda t, x, z, w, p: column(),
    update: Equation = lambda t, x, z, w, p, m: z,
    guard: Equation = lambda t, x, z, w, p: column(),
    reset: Callable[..., tuple[SX, SX]] = lambda t, x, z, w, p, e: (x, z),
) -> HybridSystem:
    """Build a system; inputs and outputs are flat, and ``guards`` are pairs of a block name and a direction.

    ``reset`` is evaluated only if a guard fired: these systems have no modes.
    """
    sizes = {
        "x": len(states),
        "z": len(discrete),
        "w": len(algebraic),
        "p": len(parameters),
        "m": len(clocks),
        "e": len(guards),
    }

    def ends(letters: str) -> Signature:
        return signature(*((letter, () if letter == "t" else (sizes[letter],)) for letter in letters))

    def trace(title: str, letters: str, out: Signature, equations: Callable[..., object]) -> TracedFunction:
        return TracedFunction.trace(title, ends(letters), out, equations)  # pyright: ignore

    def jacobian(t: SX, x: SX, z: SX, w: SX, p: SX) -> SX:
        return ca.densify(ca.jacobian(residual(t, x, z, w, p), w)) if algebraic else SX(0, 0)

    def reset_of_events(t: SX, x: SX, z: SX, w: SX, p: SX, e: SX) -> tuple[SX, SX]:
        """Return the reset, or the unchanged variables if no guard fired, as at the start."""
        fired = ca.sum1(ca.fabs(e)) > 0
        return tuple(ca.if_else(fired, new, old) for new, old in zip(reset(t, x, z, w, p, e), (x, z)))  # pyright: ignore

    flat = {letter: (size,) for letter, size in sizes.items()}
    constant = lambda numbers: lambda p: column(*map(SX, numbers))  # noqa: E731
    return HybridSystem(
        name=name,
        states=scalars(states),
        discrete=scalars(discrete),
        algebraic=scalars(algebraic),
        parameters=scalars(parameters),
        signals_layout=scalars(signals),
        clocks=tuple(SampleClock(*clock) for clock in clocks),
        parameter_values=np.array(values, dtype=float),
        derivative=trace("derivative", "txzwp", signature(("xd", flat["x"])), derivative),
        signals=trace("signals", "txzwp", signature(("y", (len(signals),))), outputs),
        residual=trace("residual", "txzwp", signature(("r", flat["w"])), residual),
        residual_jacobian=trace(
            "residual_jacobian", "txzwp", signature(("J", (sizes["w"], sizes["w"]))), jacobian
        ),
        update=trace("update", "txzwpm", signature(("z", flat["z"])), update),
        guards=trace("guards", "txzwp", signature(("g", flat["e"])), guard),
        guard_directions=tuple(direction for _, direction in guards),
        guard_names=tuple(block for block, _ in guards),
        reset=trace("reset", "txzwpe", signature(("x", flat["x"]), ("z", flat["z"])), reset_of_events),
        initial_states=trace("initial_states", "p", signature(("x0", flat["x"])), constant(x0)),
        initial_discrete=trace("initial_discrete", "p", signature(("z0", flat["z"])), constant(z0)),
        initial_algebraic=trace("initial_algebraic", "p", signature(("w0", flat["w"])), constant(w0)),
        breakpoints=trace(
            "breakpoints", "p", signature(("times", (len(breakpoints),))), constant(breakpoints)
        ),
        aliases={},
    )


def bouncing_ball(restitution: float = 0.7, height: float = 1.0, speed: float = 0.0) -> HybridSystem:
    """A ball that counts its bounces and keeps the time of the last one; the restitution is a parameter."""
    return hybrid(
        "bouncing_ball",
        states=("ball/h", "ball/v"),
        discrete=("ball/bounces", "ball/last"),
        signals=("ball/h", "ball/v", "ball/bounces", "ball/last"),
        x0=(height, speed),
        z0=(0.0, 0.0),
        parameters=("ball.restitution",),
        values=(restitution,),
        guards=(("ball", -1),),
        derivative=lambda t, x, z, w, p: column(x[1], -9.81),
        outputs=lambda t, x, z, w, p: column(x[0], x[1], z[0], z[1]),
        guard=lambda t, x, z, w, p: x[0],
        reset=lambda t, x, z, w, p, e: (column(0.0, -p[0] * x[1]), column(z[0] + 1, t)),
    )


def sampled_loop(period: float = 0.25) -> HybridSystem:
    """``x' = -u``, where ``u`` is ``x`` at the last tick: in one period ``x`` changes to ``x (1 - T)``."""
    return hybrid(
        "sampled_loop",
        states=("plant/x",),
        discrete=("hold/y",),
        signals=("plant/x", "hold/y"),
        x0=(1.0,),
        z0=(0.0,),
        clocks=((period, 0.0),),
        derivative=lambda t, x, z, w, p: -z,
        outputs=lambda t, x, z, w, p: column(x[0], z[0]),
        update=lambda t, x, z, w, p, m: x,
    )


def tick_recorder(clocks: Sequence[tuple[float, float]]) -> HybridSystem:
    """A system without states that records the ticks and last time of each clock, and common ticks."""
    n = len(clocks)
    names = [f"clock{k}/{what}" for k in range(n) for what in ("count", "time")] + ["all/count"]

    def update(t: SX, x: SX, z: SX, w: SX, p: SX, m: SX) -> SX:
        parts = []
        for k in range(n):
            parts += [z[2 * k] + m[k], ca.if_else(m[k] > 0, t, z[2 * k + 1])]
        return column(*parts, z[2 * n] + ca.if_else(ca.sum1(m) > 1, 1, 0))

    return hybrid(
        "tick_recorder",
        discrete=names,
        signals=names,
        z0=[0.0] * len(names),
        clocks=clocks,
        outputs=lambda t, x, z, w, p: z,
        update=update,
    )


def relay_oscillator(width: float = 0.5) -> HybridSystem:
    """``x' = -m`` with a relay ``m = ±1`` of hysteresis ``±width``: a triangle of period ``4 width``."""
    return hybrid(
        "relay",
        states=("plant/x",),
        discrete=("relay/mode",),
        signals=("plant/x", "relay/y"),
        x0=(0.0,),
        z0=(-1.0,),
        guards=(("relay", 1), ("relay", -1)),
        derivative=lambda t, x, z, w, p: -z,
        outputs=lambda t, x, z, w, p: column(x[0], z[0]),
        guard=lambda t, x, z, w, p: column(x[0] - width, x[0] + width),
        reset=lambda t, x, z, w, p, e: (x, ca.if_else(e[0] > 0, 1, ca.if_else(e[1] < 0, -1, z[0]))),
    )


def stick_slip(rate: float = 2.0, static: float = 3.0, sliding: float = 2.0) -> HybridSystem:
    """A unit mass at rest under a force ``rate t`` that breaks away at ``static / rate`` and then slides."""
    return hybrid(
        "stick_slip",
        states=("mass/s", "mass/v"),
        discrete=("mass/mode", "mass/last"),
        signals=("mass/s", "mass/v", "mass/mode", "mass/last"),
        x0=(0.0, 0.0),
        z0=(0.0, 0.0),
        guards=(("mass", 1),),
        derivative=lambda t, x, z, w, p: column(x[1], ca.if_else(z[0] > 0, rate * t - sliding, 0)),
        outputs=lambda t, x, z, w, p: column(x[0], x[1], z[0], z[1]),
        guard=lambda t, x, z, w, p: rate * t - static,
        reset=lambda t, x, z, w, p, e: (x, column(1, t)),
    )


def loop_of_cosine() -> HybridSystem:
    """``w = cos(w) + x`` with ``x' = -w``: every evaluation solves the implicit equation."""
    return hybrid(
        "cosine_loop",
        states=("block/x",),
        algebraic=("loop/u",),
        signals=("block/x", "loop/u"),
        x0=(0.0,),
        w0=(0.0,),
        derivative=lambda t, x, z, w, p: 0 * w,
        outputs=lambda t, x, z, w, p: column(x[0], w[0]),
        residual=lambda t, x, z, w, p: ca.cos(w) + x - w,
    )

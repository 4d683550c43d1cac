"""Small systems written directly as equations, in the form of a traced diagram."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import casadi as ca
import numpy as np
from casadi import SX

from armblocks.equations import HybridSystem, Signature, Slot, TracedFunction, continuous_system, signature

Equation = Callable[[SX, SX, SX], SX]
NOTHING = Signature()


def system(
    name: str,
    *,
    states: Signature = NOTHING,
    signals: Signature,
    derivative: Equation = lambda t, x, p: SX(0, 1),
    outputs: Equation,
    initial: Sequence[float] = (),
    parameters: Signature = NOTHING,
    values: Sequence[float] = (),
    breakpoints: Callable[[SX], Sequence[SX | float]] = lambda p: (),
    aliases: Mapping[str, str] | None = None,
) -> HybridSystem:
    """Build a system from equations in ``t, x, p``; ``initial`` is ``x(0)``."""
    flat = lambda size: (size,)  # noqa: E731
    ends = signature(("t", ()), ("x", flat(states.size)), ("p", flat(parameters.size)))
    p_only = signature(("p", flat(parameters.size)))
    count = len(breakpoints(SX.sym("p", parameters.size)))
    column = lambda parts: ca.vertcat(*parts) if len(parts) else SX(0, 1)  # noqa: E731
    return continuous_system(
        name=name,
        states=states,
        parameters=parameters,
        signals_layout=signals,
        parameter_values=np.array(values, dtype=float),
        derivative=TracedFunction.trace("derivative", ends, signature(("xd", flat(states.size))), derivative),
        signals=TracedFunction.trace("signals", ends, signature(("y", flat(signals.size))), outputs),
        initial_states=TracedFunction.trace(
            "initial_states",
            p_only,
            signature(("x0", flat(states.size))),
            lambda p: column([SX(v) for v in initial]),
        ),
        breakpoints=TracedFunction.trace(
            "breakpoints", p_only, signature(("times", flat(count))), lambda p: column(list(breakpoints(p)))
        ),
        aliases=aliases or {},
    )


def states_of(*names: str, unit: str = "") -> Signature:
    """Scalar states."""
    return Signature(tuple(Slot(name, (), unit) for name in names))


def van_der_pol_pid() -> HybridSystem:
    """Model C: van der Pol under PID control, 3 states."""

    def equations(t: SX, x: SX, p: SX) -> tuple[SX, SX, SX]:
        e = ca.sin(2 * np.pi * 0.1 * t) - x[0]
        u = 2 * e + 0.5 * x[2] - 0.5 * x[1]
        return e, u, (1 - x[0] * x[0]) * x[1] - x[0] + u

    return system(
        "van_der_pol",
        states=states_of("position/x", "speed/x", "pid/integral"),
        signals=signature(("position/y", (), "m"), ("speed/y", (), "m/s"), ("pid/e", ()), ("pid/u", (), "N")),
        derivative=lambda t, x, p: ca.vertcat(x[1], equations(t, x, p)[2], equations(t, x, p)[0]),
        outputs=lambda t, x, p: ca.vertcat(x[0], x[1], equations(t, x, p)[0], equations(t, x, p)[1]),
        initial=(1.0, 0.0, 0.0),
        aliases={"position": "position/y", "scope/u": "position/y"},
    )


def oscillator() -> HybridSystem:
    """``x'' = -omega^2 x`` with ``omega`` a parameter, from 1 at rest: ``x = cos(omega t)``."""
    return system(
        "oscillator",
        states=states_of("mass/x", "mass/v"),
        signals=signature(("mass/x", (), "m"), ("mass/v", (), "m/s")),
        derivative=lambda t, x, p: ca.vertcat(x[1], -p[0] * p[0] * x[0]),
        outputs=lambda t, x, p: x,
        initial=(1.0, 0.0),
        parameters=signature(("mass.omega", (), "rad/s")),
        values=(2.0,),
    )


def scalar(
    name: str,
    derivative: Equation,
    initial: float,
    outputs: Equation = lambda t, x, p: x,
    **more: object,
) -> HybridSystem:
    """Build a system with one state ``block/x`` and one signal ``block/y``."""
    return system(
        name,
        states=states_of("block/x"),
        signals=signature(("block/y", ())),
        derivative=derivative,
        outputs=outputs,
        initial=(initial,),
        **more,  # pyright: ignore
    )

"""Hand-written continuous systems without clocks, events or implicit equations."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from casadi import SX
from numpy.typing import NDArray

from armblocks.equations.hybrid_system import HybridSystem
from armblocks.equations.signatures import Signature, signature
from armblocks.equations.traced_function import TracedFunction


def continuous_system(
    *,
    name: str,
    states: Signature,
    parameters: Signature,
    signals_layout: Signature,
    parameter_values: NDArray[np.float64],
    derivative: TracedFunction,
    signals: TracedFunction,
    initial_states: TracedFunction,
    breakpoints: TracedFunction,
    aliases: Mapping[str, str],
) -> HybridSystem:
    """A continuous system; ``derivative`` and ``signals`` take ``t, x, p``."""
    no_slots = Signature()
    t, x, p = derivative.arguments
    z, w, m, e = (SX.sym(letter, 0) for letter in "zwme")
    flat = {"t": t, "x": x, "z": z, "w": w, "p": p, "m": m, "e": e}

    def function(
        name: str, letters: str, outputs: Signature, results: tuple[SX, ...], traced: TracedFunction | None
    ) -> TracedFunction:
        symbols = flat if traced is None else {**flat, **dict(zip("txp", traced.arguments))}
        inputs = signature(
            *((letter, () if letter == "t" else (flat[letter].numel(),)) for letter in letters)
        )
        return TracedFunction(
            name if traced is None else traced.name,
            inputs,
            outputs,
            tuple(symbols[letter] for letter in letters),
            results,
        )

    def empty(name: str, letters: str, output: str, *axes: int) -> TracedFunction:
        return function(name, letters, signature((output, axes or (0,))), (SX(0, 1),), None)

    return HybridSystem(
        name=name,
        states=states,
        discrete=no_slots,
        algebraic=no_slots,
        parameters=parameters,
        signals_layout=signals_layout,
        clocks=(),
        parameter_values=parameter_values,
        derivative=function("derivative", "txzwp", derivative.outputs, derivative.results, derivative),
        signals=function("signals", "txzwp", signals.outputs, signals.results, signals),
        residual=empty("residual", "txzwp", "r"),
        residual_jacobian=empty("residual_jacobian", "txzwp", "J", 0, 0),
        update=empty("update", "txzwpm", "z"),
        guards=empty("guards", "txzwp", "g"),
        guard_directions=(),
        guard_names=(),
        reset=function("reset", "txzwpe", signature(("x", (x.numel(),)), ("z", (0,))), (x, SX(0, 1)), None),
        initial_states=initial_states,
        initial_discrete=empty("initial_discrete", "p", "z0"),
        initial_algebraic=empty("initial_algebraic", "p", "w0"),
        breakpoints=breakpoints,
        aliases=aliases,
    )

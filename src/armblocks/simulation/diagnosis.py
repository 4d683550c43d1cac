"""What went wrong in a run, in the words of the diagram: which signal, which state, when, and what to do."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from armblocks.compiler.integrator_workspace import Status
from armblocks.compiler.native_integrator import Integration
from armblocks.compiler.system import CompiledSystem
from armblocks.equations import Signature
from armblocks.errors import SimulationError
from armblocks.simulation.result import element_names

Array = NDArray[np.float64]

MANY_STEPS = 20_000
"""Steps below which stiffness is no matter: the run took milliseconds."""


def element_name(layout: Signature, place: int) -> str:
    """The name of scalar ``place`` of a flat vector: ``arm/q[2]``."""
    return [name for slot in layout for name in element_names(slot)][place]


def first_bad_signal(
    system: CompiledSystem, instants: Array, signals: Array
) -> tuple[SimulationError, int] | None:
    """The error for the first signal that is NaN or infinite, and how many instants before it are good.

    ``signals`` ``(ny, N)``. First in time, then in evaluation order. Finite signals cost one pass over
    memory: a sum that is finite proves them so. (Not a dot product: BLAS would start threads for it, which
    wait for each other for milliseconds where the processors are busy.)
    """
    with np.errstate(over="ignore", invalid="ignore"):
        if math.isfinite(np.add.reduce(signals.reshape(-1))):
            return None
    finite = np.isfinite(signals)
    if finite.all():  # only their sum overflows
        return None
    instant = int(np.argmin(finite.all(axis=0)))
    place = int(np.argmin(finite[:, instant]))
    return _signal_error(system, place, float(signals[place, instant]), float(instants[instant])), instant


def _signal_error(system: CompiledSystem, place: int, value: float, time: float) -> SimulationError:
    name = element_name(system.signals_layout, place)
    block = name.split("[")[0].rpartition("/")[0]
    return SimulationError(
        f"signal '{name}' is {value} at {time:.9g} s",
        where=system.name,
        allowed="finite numbers; every signal before it in evaluation order is finite",
        fix=f"look at block '{block}': a division by zero, a root or logarithm of a negative number, or an "
        "overflow",
    )


def integration_failure(system: CompiledSystem, run: Integration, p: Array) -> SimulationError:
    """Why the native loop gave up."""
    if run.status is Status.STEP_TOO_SMALL:
        return _step_too_small(system, run)
    time, state = run.first_non_finite_stage()
    signals = system.evaluate_signals(np.array([time]), state[np.newaxis], p)[:, 0]
    bad = np.flatnonzero(~np.isfinite(signals))
    if bad.size:
        return _signal_error(system, int(bad[0]), float(signals[bad[0]]), time)
    place = int(np.argmin(np.isfinite(system.derivative(time, state, p))))
    name = element_name(system.states, place)
    return SimulationError(
        f"the derivative of state '{name}' is not finite at {time:.9g} s, where it is {state[place]:.6g}",
        where=system.name,
        allowed="finite numbers",
        fix="the solution may blow up there, or the step may be too long: look at what drives the state",
    )


def _step_too_small(system: CompiledSystem, run: Integration) -> SimulationError:
    errors = run.weighted_errors()
    worst = np.argsort(-errors, kind="stable")[:3]
    share = ", ".join(
        f"'{element_name(system.states, int(i))}' ({errors[i]:.3g})" for i in worst if errors[i] > 0
    )
    name = element_name(system.states, int(worst[0]))
    return SimulationError(
        f"the step became as small as the rounding of the time at {run.time:.9g} s, and the error is still "
        f"too large; its largest parts, over what is allowed: {share}; "
        f"state '{name}' is {run.state[worst[0]]:.6g}",
        where=system.name,
        allowed="solutions that stay bounded, and jumps only at known instants",
        fix=f"look at what drives '{name}': it may grow without bound there, or its derivative may jump",
    )


def stiffness_hint(system: CompiledSystem, run: Integration, p: Array) -> str:
    """A sentence for a person where stability held the steps short, not accuracy; else empty.

    The spectral radius of the Jacobian where the run ended, by power iteration on differences of the
    derivative, times the mean step, against the method's stability interval.
    """
    tried = run.accepted + run.rejected
    if tried < MANY_STEPS or run.time <= 0.0:
        return ""
    x, t = run.state.copy(), run.time
    slope = system.derivative(t, x, p)
    size = 1e-7 * max(1.0, float(np.linalg.norm(x)))
    direction = np.ones_like(x) + 0.1 * np.arange(x.size)
    rate = 0.0
    for _ in range(30):
        direction *= size / np.linalg.norm(direction)
        change = system.derivative(t, x + direction, p) - slope
        rate = float(np.linalg.norm(change)) / size
        if not np.isfinite(rate) or rate == 0.0:
            return ""
        direction = change
    mean_step = run.time / run.accepted
    if rate * mean_step < 0.5 * run.integrator.tableau.real_stability:
        return ""
    return (
        f"this system looks stiff: {tried} steps of {mean_step:.2g} s on average were held short by the "
        f"stability of the explicit method, not by accuracy (fastest rate about {rate:.2g} 1/s). Replace the "
        "fastest dynamics by their steady state, or make them slower, to run faster"
    )

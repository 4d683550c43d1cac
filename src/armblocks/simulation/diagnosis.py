"""Error messages of failed runs in terms of the diagram: signal, state, time and possible correction."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from armblocks.equations import Signature
from armblocks.errors import SimulationError
from armblocks.integration.guard_functions import (
    CLOSE_DISTANCE,
    MAX_CLOSE_EVENTS,
    MAX_RAPID_EVENTS,
    RAPID_DISTANCE,
)
from armblocks.integration.native_integrator import Integration
from armblocks.integration.system import CompiledSystem
from armblocks.integration.workspace import Status
from armblocks.simulation.methods.rosenbrock import ROS5
from armblocks.simulation.signal_names import element_names
from armblocks.simulation.tableaux import STIFF

Array = NDArray[np.float64]

MIN_REPORTED_STEPS = 20_000
"""Minimum number of steps for a remark about stiffness; a shorter run takes milliseconds."""


def element_name(layout: Signature, place: int) -> str:
    """The name of the scalar at index ``place`` of a flat vector: ``arm/q[2]``."""
    return [name for slot in layout for name in element_names(slot)][place]


def first_invalid_signal(
    system: CompiledSystem, instants: Array, signals: Array, algebraic: Array
) -> tuple[SimulationError, int] | None:
    """The error for the first signal that is NaN or infinite, and the number of valid samples before it.

    ``signals`` ``(ny, N)``, ``algebraic`` ``(N, nw)``. "First" is the earliest time, then evaluation order.
    If all signals are finite, their sum is finite, and one pass over memory suffices. (A dot product would
    start threads of BLAS, which wait for each other for milliseconds on busy processors.)
    """
    if algebraic.size and not np.isfinite(algebraic).all():
        unsolved = int(np.argmin(np.isfinite(algebraic).all(axis=1)))
        return _unsolved(system, float(instants[unsolved])), unsolved
    with np.errstate(over="ignore", invalid="ignore"):
        if math.isfinite(np.add.reduce(signals.reshape(-1))):
            return None
    finite = np.isfinite(signals)
    if finite.all():  # the signals are finite and only their sum overflows
        return None
    instant = int(np.argmin(finite.all(axis=0)))
    place = int(np.argmin(finite[:, instant]))
    return _signal_error(system, place, float(signals[place, instant]), float(instants[instant])), instant


def _signal_error(system: CompiledSystem, place: int, value: float, time: float) -> SimulationError:
    name = element_name(system.signals_layout, place)
    known = _known_failure(system, name, time)
    if known:
        return known
    block = _block_of(name)
    return SimulationError(
        f"signal '{name}' is {value} at {time:.9g} s",
        where=system.name,
        allowed="finite numbers; every signal before it in evaluation order is finite",
        fix=f"check block '{block}': a division by zero, a root or logarithm of a negative number, an "
        "overflow, or an algebraic loop through it that has become singular",
    )


def _block_of(name: str) -> str:
    """The block of an element of a signal or state: ``arm`` of ``arm/q[2]``."""
    return name.split("[")[0].rpartition("/")[0]


def _known_failure(system: CompiledSystem, name: str, time: float) -> SimulationError | None:
    """The error for a signal or state that can be invalid for a reason that its block states."""
    reason = system.reasons_of_invalid_values().get(_block_of(name))
    if not reason:
        return None
    return SimulationError(
        f"{reason}, at {time:.9g} s",
        where=system.name,
        allowed="finite numbers in all signals",
        fix="change the input, or the part of the diagram that the message names",
    )


def ended_by_block(system: CompiledSystem, run: Integration) -> str | SimulationError:
    """A message with the block that ended a run, or the error of an Assertion whose input has become 0."""
    guard = run.positive_guards(system.sizes.stops)[0]
    block = system.guard_names[guard]
    if system.guard_actions[guard] != "fail":
        return f"stopped by block '{block}' at {run.time:.9g} s"
    return SimulationError(
        f"assertion '{block}' does not hold at {run.time:.9g} s",
        where=system.name,
        allowed="an input that is not 0 at any time",
        fix=f"check the input of '{block}', or set its action to warn",
    )


def warnings_of_blocks(system: CompiledSystem, run: Integration) -> list[str]:
    """The messages of assertions with the action ``warn``."""
    messages: list[str] = []
    for guard, action in enumerate(system.guard_actions):
        fired = run.last_fired(guard)
        if action == "warn" and (fired > -np.inf or run.positive_guards([guard])):
            when = f"last from {fired:.9g} s on" if fired > -np.inf else "from the start on"
            messages.append(f"assertion '{system.guard_names[guard]}' did not hold, {when}")
    return messages


def integration_failure(system: CompiledSystem, run: Integration, p: Array) -> SimulationError:
    """The error for a status of the native loop."""
    if run.status is Status.STEP_TOO_SMALL:
        return _step_too_small(system, run)
    if run.status is Status.ENDLESS_EVENTS:
        return _endless_events(system, run)
    if run.status is Status.INCONSISTENT_MODES:
        return _inconsistent_modes(system, run)
    if run.status is Status.MINIMUM_STEP:
        return _minimum_step(system, run)
    time, state = run.first_non_finite_stage()
    point = run.point
    if not np.isfinite(run.trial_unknowns).all():
        return _unsolved(system, time)
    z, w = point.z[np.newaxis], run.trial_unknowns[np.newaxis].copy()
    signals = system.evaluate_signals(np.array([time]), state[np.newaxis], z, w, p)[:, 0]
    invalid = np.flatnonzero(~np.isfinite(signals))
    if invalid.size:
        return _signal_error(system, int(invalid[0]), float(signals[invalid[0]]), time)
    derivative = system.derivative(time, state, point.z, run.trial_unknowns, p)
    place = int(np.argmin(np.isfinite(derivative)))
    name = element_name(system.states, place)
    known = _known_failure(system, name, time)
    if known:
        return known
    return SimulationError(
        f"the derivative of state '{name}' is not finite at {time:.9g} s, where it is {state[place]:.6g}",
        where=system.name,
        allowed="finite numbers",
        fix="the solution may diverge there, or the step may be too long: check the input of the state",
    )


def _unsolved(system: CompiledSystem, time: float) -> SimulationError:
    blocks = sorted({slot.name.rpartition("/")[0] or slot.name for slot in system.algebraic})
    names = ", ".join(f"'{name}'" for name in blocks)
    return SimulationError(
        f"Newton's method found no solution of the implicit equations of the loop through {names} at "
        f"{time:.9g} s",
        where=system.name,
        allowed="loops with one solution near the previous solution: the Jacobian must not be singular",
        fix="check whether the loop has a unique solution; a delay or an integrator breaks the loop",
    )


def _endless_events(system: CompiledSystem, run: Integration) -> SimulationError:
    blocks = _unique(system.guard_names[guard] for guard in run.repeating_guards)
    blocks = blocks or _inconsistent_blocks(system, run)
    verb = "causes" if len(blocks) == 1 else "cause"
    return SimulationError(
        f"{_listed(blocks)} {verb} events without end at {run.time:.15g} s, after {run.events} events in "
        "all: they occur at decreasing intervals, or at one instant (Zeno behaviour or "
        "chattering)",
        where=system.name,
        allowed=f"{MAX_CLOSE_EVENTS} consecutive events within {CLOSE_DISTANCE:g} t of each other, "
        f"{MAX_RAPID_EVENTS} within {RAPID_DISTANCE:g} t",
        fix=f"give '{blocks[0]}' a hysteresis, zero_crossing=False or a state of rest (ArmPlant, "
        "StickSlipFriction), or stop earlier",
    )


def _inconsistent_modes(system: CompiledSystem, run: Integration) -> SimulationError:
    blocks = _inconsistent_blocks(system, run)
    return SimulationError(
        f"no choice of the modes of {_listed(blocks)} is consistent at {run.time:.15g} s: each choice leads "
        "to signals that require another choice",
        where=system.name,
        allowed="switching blocks in loops that have a solution",
        fix=f"break the loop through '{blocks[0]}' with an integrator, a delay or a hysteresis",
    )


def _inconsistent_blocks(system: CompiledSystem, run: Integration) -> list[str]:
    """The blocks of the inconsistent modes at the present time."""
    names = [name for slot in system.discrete for name in [slot.name] * slot.size]
    return _unique(names[place].rpartition("/")[0] for place in run.inconsistent_modes)


def _listed(blocks: list[str]) -> str:
    """The first three block names as text, with the number of further blocks."""
    block_list = ", ".join(f"'{block}'" for block in blocks[:3])
    more = f" and {len(blocks) - 3} more" if len(blocks) > 3 else ""
    return f"{'block' if len(blocks) == 1 else 'the blocks'} {block_list}{more}"


def _unique(names: Iterable[str]) -> list[str]:
    """Each name once, in the order of first occurrence."""
    return list(dict.fromkeys(names))


def _step_too_small(system: CompiledSystem, run: Integration) -> SimulationError:
    errors = run.weighted_errors()
    worst = np.argsort(-errors, kind="stable")[:3]
    share = ", ".join(
        f"'{element_name(system.states, int(i))}' ({errors[i]:.3g})" for i in worst if errors[i] > 0
    )
    name = element_name(system.states, int(worst[0]))
    known = _known_failure(system, name, run.time)
    if known:
        return known
    return SimulationError(
        f"the step became as small as the rounding of the time at {run.time:.9g} s, and the error is still "
        f"too large; its largest components, relative to the tolerance: {share}; "
        f"state '{name}' is {run.state[worst[0]]:.6g}",
        where=system.name,
        allowed="solutions that stay bounded, and derivatives that jump only at events and breakpoints",
        fix=f"check the input of '{name}': the state may grow without bound, or its derivative may jump",
    )


def _minimum_step(system: CompiledSystem, run: Integration) -> SimulationError:
    name = element_name(system.states, int(np.argmax(run.weighted_changes())))
    left = (run.stop - run.time) / run.last_step
    known = _known_failure(system, name, run.time)
    if known:
        return known
    needs_jacobian = run.integrator.tableau.needs_jacobian
    stiff = "" if needs_jacobian else f"; if it is stiff, solver='{STIFF.name}'"
    return SimulationError(
        f"the run takes extremely short steps at {run.time:.6g} s: {run.last_step:.2g} s. It would need "
        f"{left:.0e} more steps, mainly because of state '{name}'",
        where=system.name,
        allowed="equations that jump at events only",
        fix=f"check the input of '{name}' for a jump that depends on the state, such as Coulomb friction or "
        f"a sign in a formula: use a block with a rest state (ArmPlant, StickSlipFriction){stiff}",
    )


def stiffness_hint(system: CompiledSystem, run: Integration, p: Array) -> str:
    """A hint if stability, not accuracy, limited the steps; else an empty text.

    The mean step times the spectral radius of the Jacobian at the end of the run is compared with the
    stability interval of the method. The spectral radius comes from power iteration on differences of the
    derivative.
    """
    tried, tableau = run.accepted + run.rejected, run.integrator.tableau
    if tried < MIN_REPORTED_STEPS or run.time <= 0.0 or tableau.needs_jacobian:
        return ""
    point = run.point
    x, t, rest = point.x, point.time, (point.z, point.w, p)
    if x.size == 0:
        return ""
    derivative = system.derivative(t, x, *rest)
    with np.errstate(over="ignore"):
        size = 1e-7 * max(1.0, float(np.linalg.norm(x)))
    if not math.isfinite(size):
        return ""
    direction = np.ones_like(x) + 0.1 * np.arange(x.size)
    rate = 0.0
    for _ in range(30):
        direction *= size / np.linalg.norm(direction)
        change = system.derivative(t, x + direction, *rest) - derivative
        rate = float(np.linalg.norm(change)) / size
        if not np.isfinite(rate) or rate == 0.0:
            return ""
        direction = change
    mean_step = run.time / run.accepted
    if rate * mean_step < 0.5 * tableau.real_stability:
        return ""
    return (
        f"this system looks stiff: {tried} steps of {mean_step:.2g} s on average were limited by the "
        f"stability of the explicit method, not by accuracy (fastest rate about {rate:.2g} 1/s). "
        f"solver='{STIFF.name if tableau.adaptive else ROS5.name}' is suitable for such systems"
    )

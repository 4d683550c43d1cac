"""Step, impulse and forced responses by matrix exponentials, which are exact at every sample."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.analysis.reduction import minimal
from armblocks.analysis.shown_values import EPSILON, ROUNDOFFS, is_stable, shown_dcgain, shown_poles
from armblocks.analysis.state_space import StateSpaceModel, SystemT
from armblocks.errors import InputError
from armblocks.extras import from_extra

Array = NDArray[np.float64]

SystemT_co = TypeVar("SystemT_co", bound=StateSpaceModel, covariant=True)

MAX_SAMPLES = 20_000
"""Maximum number of samples of the response of a discrete system."""


@dataclass(frozen=True, kw_only=True)
class StepMeasures:
    """Characteristics of a step response (all times in s; ``nan`` if undefined).

    ``final``: the steady-state value. ``rise_time``: the time from 10 to 90 per cent of ``final``.
    ``settling_time``: the time after which the response stays within 2 per cent of ``final``. ``overshoot``
    and ``undershoot``: per cent of ``final``.
    ``peak``: the largest value in the direction of the final value, at ``peak_time``.
    """

    final: float
    rise_time: float
    settling_time: float
    overshoot: float
    undershoot: float
    peak: float
    peak_time: float


@dataclass(frozen=True, kw_only=True, eq=False)
class TimeResponse(Generic[SystemT_co]):
    """``values`` (N, ny, nu): every output for each single input, at ``time`` (N,) s.

    A forced response has one column for all inputs together. ``states`` (N, nx, nu) has the same columns.
    """

    system: SystemT_co
    kind: str
    time: Array
    values: Array
    states: Array

    def measures(self, output: int = 0, column: int = 0) -> StepMeasures:
        """Rise, settling and overshoot of one step response."""
        final = float(shown_dcgain(self.system)[output, column]) if is_stable(self.system) else math.nan
        return step_measures(self.time, self.values[:, output, column], final)


def natural_times(system: StateSpaceModel) -> tuple[float, float]:
    """Two times (s): the duration of the slowest mode, and the time constant of the fastest mode.

    The duration is the time in which the slowest mode decays or visibly grows.
    """
    reduced = minimal(system)
    roots = shown_poles(reduced)
    if reduced.is_discrete:
        roots = np.log(roots[np.abs(roots) > 1e-6]) / reduced.dt
    magnitudes = np.abs(roots)
    largest = float(magnitudes.max(initial=0.0))
    moving = roots[magnitudes > 0.0]
    if not moving.size:
        return (100.0 * system.dt if system.is_discrete else 1.0), 1.0
    fastest = 1.0 / largest
    spans: list[float] = []
    for pole in moving.tolist():
        decay = abs(pole.real)
        period = 2.0 * math.pi / abs(pole.imag) if pole.imag else math.inf
        if decay < 1e-3 * abs(pole):
            spans.append(10.0 * period)  # lightly damped: show ten periods
        elif pole.real < 0.0:
            spans.append(min(7.0 / decay, 25.0 * period))
        else:
            spans.append(4.0 / decay)
    span = max(spans) if all(pole.real <= 0.0 for pole in moving.tolist()) else min(spans)
    return span, fastest


def _sample_times(system: StateSpaceModel, stop_time: float | None, points: int) -> Array:
    span, fastest = natural_times(system)
    end = span if stop_time is None else float(stop_time)
    if not (math.isfinite(end) and end > 0.0):
        raise InputError(
            f"the stop time is {stop_time}",
            allowed="a finite time > 0 s",
            where="time response",
            fix="omit the stop time, or give it in seconds",
        )
    if system.is_discrete:
        count = max(round(end / system.dt), 1)
        return system.dt * np.arange(min(count, MAX_SAMPLES) + 1, dtype=np.float64)
    if stop_time is None:
        end = _rounded_up(end)
    # Enough points for the fastest motion that is visible in the whole figure.
    count = int(min(max(points, 8.0 * end / fastest), 4000.0))
    return np.linspace(0.0, end, count + 1, dtype=np.float64)


def _rounded_up(span: float) -> float:
    """The next round number, such as 1.5 or 20, for the end of a time axis."""
    power = 10.0 ** math.floor(math.log10(span))
    return next(
        f * power for f in (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0) if f * power >= span * 0.999
    )


def _powers(transition: Array, start: Array, count: int) -> Array:
    """The sequence ``start, transition start, transition^2 start, …`` (count, rows, columns)."""
    states = np.empty((count, *start.shape))
    states[0] = start
    for k in range(1, count):
        states[k] = transition @ states[k - 1]
    return states


def step_response(system: SystemT, stop_time: float | None, points: int) -> TimeResponse[SystemT]:
    """The response of every output to a unit step of every input.

    ``stop_time=None``: until the slowest mode has decayed.
    """
    time = _sample_times(system, stop_time, points)
    n, nu = system.B.shape
    # Constant inputs are states with the derivative 0.
    transition = _step_map(system, float(time[1]))
    start = np.vstack([np.zeros((n, nu)), np.eye(nu)])
    states = _powers(transition, start, time.size)[:, :n]
    return TimeResponse(
        system=system, kind="step", time=time, values=system.C @ states + system.D, states=states
    )


def impulse_response(system: SystemT, stop_time: float | None, points: int) -> TimeResponse[SystemT]:
    """The response of every output to a unit impulse of every input.

    The impulses due to direct feedthrough are omitted for a continuous system.
    """
    time = _sample_times(system, stop_time, points)
    n = system.order
    transition = _step_map(system, float(time[1]))[:n, :n]
    if system.is_discrete:
        later = _powers(transition, system.B, time.size - 1)
        states = np.concatenate([np.zeros((1, *system.B.shape)), later])
        values = system.C @ states
        values[0] += system.D
    else:
        states = _powers(transition, system.B, time.size)
        values = system.C @ states
    return TimeResponse(system=system, kind="impulse", time=time, values=values, states=states)


def _step_map(system: StateSpaceModel, step: float) -> Array:
    """The map of ``[x; u]`` over a step (s) with constant inputs."""
    with from_extra("analysis", "responses of a linear system"):
        from scipy.linalg import expm

    n, nu = system.B.shape
    matrix = np.zeros((n + nu, n + nu))
    matrix[:n] = np.hstack([system.A, system.B])
    if system.is_discrete:
        matrix[n:, n:] = np.eye(nu)
        return matrix
    return expm(matrix * step)


def forced_response(
    system: SystemT, time: ArrayLike, inputs: ArrayLike, start: ArrayLike | None
) -> TimeResponse[SystemT]:
    """See :meth:`LinearSystem.response`. Raises ``InputError`` for shapes and times that do not fit."""
    with from_extra("analysis", "responses of a linear system"):
        from scipy.linalg import expm

    sample_times = np.asarray(time, dtype=np.float64)
    signals = np.asarray(inputs, dtype=np.float64)
    n, nu = system.B.shape
    signals = signals[:, None] if signals.ndim == 1 and nu == 1 else signals
    steps = np.diff(sample_times)
    if sample_times.ndim != 1 or sample_times.size < 2 or not (steps > 0.0).all():
        raise InputError(
            "the times are not ascending",
            allowed="two or more ascending times, s",
            where="time response",
            fix="sort the times and remove duplicates",
        )
    if signals.shape != (sample_times.size, nu):
        raise InputError(
            f"the inputs have shape {signals.shape}",
            allowed=f"shape {(sample_times.size, nu)}: times, inputs",
            where="time response",
            fix="give one row of inputs for each time",
        )
    if system.is_discrete and not np.allclose(steps, system.dt, rtol=1e-9, atol=0.0):
        raise InputError(
            f"the times are not {system.dt:g} s apart",
            allowed="the sample times of the system",
            where="time response",
            fix=f"use {system.dt:g} * numpy.arange(n)",
        )
    x = np.zeros(n) if start is None else np.asarray(start, dtype=np.float64)
    if x.shape != (n,):
        raise InputError(
            f"the start has shape {x.shape}",
            allowed=f"shape {(n,)}, one for each state",
            where="time response",
            fix="omit start for the initial state 0",
        )
    states = np.empty((sample_times.size, n))
    states[0] = x
    maps: dict[float, Array] = {}
    for k, step in enumerate(steps.tolist()):
        if system.is_discrete:
            states[k + 1] = system.A @ states[k] + system.B @ signals[k]
            continue
        key = float(f"{step:.12e}")
        if key not in maps:
            # For inputs that are linear in time, their derivatives are additional states (Van Loan, 1978).
            matrix = np.zeros((n + 2 * nu, n + 2 * nu))
            matrix[:n, : n + nu] = np.hstack([system.A, system.B])
            matrix[n : n + nu, n + nu :] = np.eye(nu)
            maps[key] = expm(matrix * step)[:n]
        input_rate = (signals[k + 1] - signals[k]) / step
        states[k + 1] = maps[key] @ np.concatenate([states[k], signals[k], input_rate])
    values = states @ system.C.T + signals @ system.D.T
    return TimeResponse(
        system=system, kind="forced", time=sample_times, values=values[:, :, None], states=states[:, :, None]
    )


def step_measures(time: Array, values: Array, final: float) -> StepMeasures:
    """Characteristics of one curve that ends at ``final``, interpolated linearly between samples."""
    if not math.isfinite(final) or final == 0.0:
        k = int(np.argmax(np.abs(values)))
        nan = math.nan
        return StepMeasures(
            final=final,
            rise_time=nan,
            settling_time=nan,
            overshoot=nan,
            undershoot=nan,
            peak=float(values[k]),
            peak_time=float(time[k]),
        )
    fractions = values / final
    k = int(np.argmax(fractions))
    begin, end = _first_above(time, fractions, 0.1), _first_above(time, fractions, 0.9)
    return StepMeasures(
        final=final,
        rise_time=end - begin,
        settling_time=_settled_after(time, fractions, 0.02),
        overshoot=max(0.0, 100.0 * (float(fractions[k]) - 1.0)),
        undershoot=max(0.0, -100.0 * float(fractions.min())),
        peak=float(values[k]),
        peak_time=float(time[k]),
    )


def _first_above(time: Array, fractions: Array, level: float) -> float:
    above = fractions >= level
    if not above.any():
        return math.nan
    k = int(np.argmax(above))
    if k == 0:
        return float(time[0])
    fraction = (level - fractions[k - 1]) / (fractions[k] - fractions[k - 1])
    return float(time[k - 1] + fraction * (time[k] - time[k - 1]))


def _settled_after(time: Array, fractions: Array, band: float) -> float:
    outside = np.flatnonzero(np.abs(fractions - 1.0) > band)
    if not outside.size:
        return 0.0
    k = int(outside[-1])
    if k == time.size - 1:
        return math.nan
    off, on = abs(fractions[k] - 1.0), abs(fractions[k + 1] - 1.0)
    return float(time[k] + (off - band) / (off - on) * (time[k + 1] - time[k]))


def shown_measures(response: TimeResponse[StateSpaceModel], output: int = 0, column: int = 0) -> StepMeasures:
    """:meth:`TimeResponse.measures` with overshoot and undershoot 0 if they are only rounding errors."""
    computed = response.measures(output, column)
    system = response.system
    if not computed.final or not math.isfinite(computed.final):
        return computed
    # Every sample is a product with the same matrix, and the output is a sum over the states.
    terms = np.abs(response.states[:, :, column]) @ np.abs(system.C[output]) + abs(system.D[output, column])
    errors = max(system.order, 1) * response.time.size * EPSILON * float(terms.max())
    threshold = 100.0 * ROUNDOFFS * errors / abs(computed.final)
    return dataclasses.replace(
        computed,
        overshoot=computed.overshoot if computed.overshoot > threshold else 0.0,
        undershoot=computed.undershoot if computed.undershoot > threshold else 0.0,
    )

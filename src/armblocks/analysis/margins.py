"""Margins of a loop, and the bandwidth of a system."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks.analysis.connections import feedback
from armblocks.analysis.frequency import (
    as_continuous,
    boundary_points,
    evaluate,
    frequency_grid,
    frequency_response,
)
from armblocks.analysis.reduction import minimal
from armblocks.analysis.shown_values import (
    EPSILON,
    is_stable,
    response_errors,
    shown_dcgain,
    shown_poles,
    shown_zeros,
)
from armblocks.analysis.state_space import StateSpaceModel
from armblocks.errors import InputError, counted

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_BISECTIONS = 90


@dataclass(frozen=True, kw_only=True, eq=False)
class Margins:
    """Stability margins of a loop ``1 + L``.

    A margin is ``inf`` if no such change brings the loop to the stability boundary. Its frequency is then
    ``nan``.

    - ``gain``, also as ``gain_decibels``: the factor nearest to 1 by which L may be multiplied before the
      loop reaches the stability boundary. A factor below 1 is a decrease.
    - ``phase`` (degrees): the phase lag nearest to 0 with which the loop reaches this boundary; negative for
      a lead.
    - ``delay`` (s): the smallest dead time with which the loop reaches this boundary.
    - ``gain_frequency``, ``phase_frequency``, ``delay_frequency`` (rad/s): the frequencies of the margins.
    - ``modulus``: the minimum distance of L from -1, the inverse of the peak of ``1 / (1 + L)``.
    - ``modulus_frequency`` (rad/s): the frequency of this minimum.
    - ``stable``: whether the closed loop is stable.
    - ``gain_crossings`` (frequency, factor), ``phase_crossings`` (frequency, degrees): all crossings.
    """

    gain: float
    gain_frequency: float
    phase: float
    phase_frequency: float
    delay: float
    delay_frequency: float
    modulus: float
    modulus_frequency: float
    stable: bool
    gain_crossings: tuple[tuple[float, float], ...]
    phase_crossings: tuple[tuple[float, float], ...]

    @property
    def gain_decibels(self) -> float:
        """The gain margin in dB."""
        return 20.0 * math.log10(self.gain) if math.isfinite(self.gain) else math.inf


def _bisected(function: Callable[[float], float], low: float, high: float) -> float:
    """The zero between two frequencies with values of opposite sign, by bisection to the last digits."""
    below = function(low)
    for _ in range(_BISECTIONS):
        middle = math.sqrt(low * high)
        if not low < middle < high:
            break
        value = function(middle)
        if (value < 0.0) == (below < 0.0):
            low, below = middle, value
        else:
            high = middle
    return math.sqrt(low * high)


def _response_at(system: StateSpaceModel, frequency: float) -> complex:
    """The response of a system with one input and one output at a frequency (rad/s)."""
    return complex(frequency_response(system, np.array([frequency]))[0, 0, 0])


def margins(system: StateSpaceModel) -> Margins:
    """Margins of the loop with negative feedback around this system; see :class:`Margins`.

    Crossings are searched on a grid that is denser around lightly damped modes, then located by bisection.
    Raises ``InputError`` for more than one input or output.
    """
    if not system.is_siso:
        raise InputError(
            f"margins of {counted(system.D.shape[1], 'input')} and "
            f"{counted(system.D.shape[0], 'output')} are requested",
            where=system.name,
            allowed="one of each",
            fix="choose with system.select(output, input)",
        )
    loop = minimal(system)
    grid = _search_grid(loop, 1.0)
    response = frequency_response(loop, grid)[:, 0, 0]
    phase_crossings: list[tuple[float, float]] = []
    gain_crossings: list[tuple[float, float]] = []

    def gain_excess(frequency: float) -> float:
        return abs(_response_at(loop, frequency)) - 1.0

    def imaginary_part(frequency: float) -> float:
        return _response_at(loop, frequency).imag

    above = np.abs(response) > 1.0
    for k in np.flatnonzero(above[1:] != above[:-1]).tolist():
        frequency = _bisected(gain_excess, float(grid[k]), float(grid[k + 1]))
        value = -_response_at(loop, frequency)
        angle = math.degrees(math.atan2(value.imag, value.real))
        phase_crossings.append((frequency, angle + 0.0))  # 0 instead of -0
    upper = response.imag > 0.0
    for k in np.flatnonzero((upper[1:] != upper[:-1]) & (response.real[1:] < 0.0)).tolist():
        frequency = _bisected(imaginary_part, float(grid[k]), float(grid[k + 1]))
        value = _response_at(loop, frequency)
        if value.real < 0.0 and abs(value.imag) <= 1e-6 * abs(value):
            gain_crossings.append((frequency, -1.0 / value.real))
    for frequency in (0.0, math.pi / loop.dt if loop.is_discrete else math.inf):
        value = complex(loop.D[0, 0]) if math.isinf(frequency) else _response_at(loop, frequency)
        if math.isfinite(value.real) and value.real < 0.0:
            gain_crossings.append((frequency, -1.0 / value.real))
    return _collected_margins(loop, grid, response, gain_crossings, phase_crossings)


def _search_grid(system: StateSpaceModel, level: float) -> Array:
    """Frequencies (rad/s) between which the gain crosses ``level`` and the phase crosses -180 degrees.

    They contain all corner frequencies that are not 0 and the frequencies at which the asymptotes below and
    above the corners have this gain. ``system`` is minimal and has one input and one output.
    """
    poles, zeros = (as_continuous(system, roots(system)) for roots in (shown_poles, shown_zeros))
    corners = np.abs(np.concatenate([poles, zeros]))
    corners = corners[corners > 0.0]
    nyquist = math.pi / system.dt if system.is_discrete else math.inf
    middle = min(1.0, nyquist / 10.0)
    low = 1e-4 * float(corners.min(initial=middle))
    high = 1e4 * float(corners.max(initial=middle))
    slopes = [(low, int((zeros == 0.0).sum()) - int((poles == 0.0).sum()))]
    slopes += [(high, len(zeros) - len(poles))] * (not system.is_discrete)
    for frequency, slope in slopes:
        gain = abs(_response_at(system, min(frequency, nyquist)))
        if slope and gain > 0.0 and math.isfinite(gain):
            decades = math.log10(level / gain) / slope
            crossing = frequency * 10.0 ** min(max(decades, -60.0), 60.0)
            low, high = min(low, crossing / 10.0), max(high, crossing * 10.0)
    high = min(high, nyquist)
    return frequency_grid(system, low, high, max(2000, int(150.0 * math.log10(high / low))))


def _collected_margins(
    loop: StateSpaceModel,
    grid: Array,
    response: Complex,
    gains: list[tuple[float, float]],
    phases: list[tuple[float, float]],
) -> Margins:
    gain = min(gains, key=lambda pair: abs(math.log(pair[1])), default=(math.nan, math.inf))
    phase = min(phases, key=lambda pair: abs(pair[1]), default=(math.nan, math.inf))
    delays = [(frequency, math.radians(angle % 360.0) / frequency) for frequency, angle in phases]
    delay = min(delays, key=lambda pair: pair[1], default=(math.nan, math.inf))
    frequency, modulus = _nearest_to_minus_one(loop, grid, response)
    return Margins(
        gain=gain[1],
        gain_frequency=gain[0],
        phase=phase[1],
        phase_frequency=phase[0],
        delay=delay[1],
        delay_frequency=delay[0],
        modulus=modulus,
        modulus_frequency=frequency,
        stable=is_stable(feedback(loop, 1.0, -1)) if abs(1.0 + loop.D[0, 0]) > 1e-12 else False,
        gain_crossings=tuple(gains),
        phase_crossings=tuple(phases),
    )


def _nearest_to_minus_one(loop: StateSpaceModel, grid: Array, response: Complex) -> tuple[float, float]:
    """The frequency of the minimum of ``|1 + L|``, and the minimum.

    Golden-section search is used between the neighbours of the nearest grid point.
    """
    k = int(np.nanargmin(np.abs(1.0 + response)))
    low, high = float(grid[max(k - 1, 0)]), float(grid[min(k + 1, len(grid) - 1)])
    ratio = (math.sqrt(5.0) - 1.0) / 2.0
    for _ in range(60):
        a, b = high - ratio * (high - low), low + ratio * (high - low)
        if abs(1.0 + _response_at(loop, a)) < abs(1.0 + _response_at(loop, b)):
            high = b
        else:
            low = a
    frequency = (low + high) / 2.0
    return frequency, abs(1.0 + _response_at(loop, frequency))


def bandwidth(system: StateSpaceModel, drop: float) -> float:
    """See :meth:`LinearSystem.bandwidth`; ``inf`` if the gain never decreases by ``drop``."""
    if not system.is_siso:
        raise InputError(
            f"the bandwidth of {counted(system.D.shape[1], 'input')} and "
            f"{counted(system.D.shape[0], 'output')} is requested",
            where=system.name,
            allowed="one of each",
            fix="choose with system.select(output, input)",
        )
    steady_state_gain = abs(float(shown_dcgain(system)[0, 0]))
    if not math.isfinite(steady_state_gain) or steady_state_gain == 0.0:
        raise InputError(
            f"the steady-state gain is {steady_state_gain:g}",
            where=system.name,
            allowed="a finite steady-state gain that is not 0",
            fix="compute the bandwidth of the closed loop",
        )
    level = steady_state_gain * 10.0 ** (-drop / 20.0)
    grid = _search_grid(minimal(system), level)
    below = np.abs(frequency_response(system, grid)[:, 0, 0]) < level
    if not below.any():
        return math.inf
    k = int(np.argmax(below))
    if k == 0:
        return float(grid[0])
    return _bisected(
        lambda frequency: abs(_response_at(system, frequency)) - level, float(grid[k - 1]), float(grid[k])
    )


def shown_margins(system: StateSpaceModel) -> Margins:
    """The displayed margins: :meth:`LinearSystem.margins` without rounding errors.

    They are 0 dB, 0 deg, 0 s and a distance of 0 if the loop passes through -1 within the accuracy of the
    computation.
    """
    computed = margins(system)
    loop = minimal(system)

    def accuracy(frequency: float) -> tuple[float, float]:
        """Relative error of the response at a frequency found by bisection, and the response."""
        if math.isinf(frequency):
            return EPSILON, abs(float(loop.D[0, 0]))
        s = complex(boundary_points(loop, np.array([frequency]))[0])
        value = abs(complex(evaluate(loop, np.array([s]))[0, 0, 0]))
        error, derivative = response_errors(loop, s)
        # The error of the frequency follows from this error of the response and from its own rounding.
        return (2.0 * error + 4.0 * EPSILON * frequency * derivative) / max(value, 1e-300), value

    gains = [(f, 1.0 if abs(k - 1.0) <= accuracy(f)[0] else k) for f, k in computed.gain_crossings]
    phases = [
        (f, 0.0 if abs(angle) <= math.degrees(accuracy(f)[0]) else angle)
        for f, angle in computed.phase_crossings
    ]
    gain = min(gains, key=lambda pair: abs(math.log(pair[1])), default=(math.nan, math.inf))
    phase = min(phases, key=lambda pair: abs(pair[1]), default=(math.nan, math.inf))
    delays = [(f, math.radians(angle % 360.0) / f) for f, angle in phases]
    delay = min(delays, key=lambda pair: pair[1], default=(math.nan, math.inf))
    passes_through = computed.modulus <= math.prod(accuracy(computed.modulus_frequency))
    return dataclasses.replace(
        computed,
        gain=gain[1],
        gain_frequency=gain[0],
        phase=phase[1],
        phase_frequency=phase[0],
        delay=delay[1],
        delay_frequency=delay[0],
        modulus=0.0 if passes_through else computed.modulus,
        gain_crossings=tuple(gains),
        phase_crossings=tuple(phases),
    )

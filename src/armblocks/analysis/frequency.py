"""Frequency response, gain at rest, bandwidth, and the margins of a loop."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from armblocks.analysis.scaling import balanced
from armblocks.errors import InputError

if TYPE_CHECKING:
    from armblocks.analysis.linear_system import LinearSystem

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_CHUNK = 4_000_000
"""Numbers that one batch of linear equations may have."""
_BISECTIONS = 90


@dataclass(frozen=True, kw_only=True, eq=False)
class Margins:
    """How far a loop ``1 + L`` is from the edge of stability.

    ``gain`` the factor (and ``gain_decibels``) by which L may grow, or where below 1 may shrink, nearest to
    1; ``phase`` degrees; ``delay`` s; each ``inf`` where nothing of the kind makes the loop unstable. They
    are found at ``gain_frequency``, ``phase_frequency`` and ``delay_frequency`` rad/s (``nan`` where there
    is none). ``modulus``: the least distance of L from -1, the inverse of the peak of ``1 / (1 + L)``.
    ``stable``: whether the closed loop is. All crossings stand in ``gain_crossings`` (frequency, factor) and
    ``phase_crossings`` (frequency, degrees).
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


def evaluate(system: LinearSystem, places: Complex) -> Complex:
    """``C (s I - A)^-1 B + D`` (N, ny, nu) at complex numbers (N,); infinite at a pole."""
    n = system.order
    result = np.broadcast_to(system.D, (len(places), *system.D.shape)).astype(np.complex128)
    if not n or not system.B.size or not system.C.size:
        return result
    a, b, c = balanced(system.A, system.B, system.C)
    chunk = max(1, _CHUNK // (n * n))
    for start in range(0, len(places), chunk):
        piece = places[start : start + chunk]
        matrices = piece[:, None, None] * np.eye(n) - a
        try:
            states = np.linalg.solve(matrices, np.broadcast_to(b, (len(piece), *b.shape)))
            result[start : start + chunk] += c @ states
        except np.linalg.LinAlgError:
            for k, matrix in enumerate(matrices):
                try:
                    result[start + k] += c @ np.linalg.solve(matrix, b)
                except np.linalg.LinAlgError:
                    result[start + k] = complex(math.inf, 0.0)
    return result


def on_the_edge(system: LinearSystem, frequencies: Array) -> Complex:
    """``j w``, or ``exp(j w dt)``."""
    along = (1j * frequencies).astype(np.complex128)
    return np.exp(along * system.dt) if system.is_discrete else along


def frequency_response(system: LinearSystem, frequencies: Array) -> Complex:
    """See :meth:`LinearSystem.frequency_response`."""
    return evaluate(system, on_the_edge(system, frequencies))


def gain_and_phase(system: LinearSystem, frequencies: Array) -> tuple[Array, Array]:
    """Magnitude and continuous phase in degrees, (N, ny, nu) each, at rising frequencies (rad/s).

    The phase starts at the multiple of 360 degrees that puts it next to -90 degrees for every integrator.
    An undamped pole turns it by -180 degrees, an undamped zero by +180, as if they were hardly damped.
    """
    response = frequency_response(system, frequencies)
    phase = np.degrees(np.unwrap(np.angle(response), axis=0))
    for row in range(phase.shape[1]):
        for column in range(phase.shape[2]):
            part = system.select([system.outputs[row]], [system.inputs[column]]).minimal()
            _mend_phase(part, frequencies, phase[:, row, column])
    return np.abs(response), phase


def _mend_phase(part: LinearSystem, frequencies: Array, phase: Array) -> None:
    """Put right, in place, what unwrapping alone cannot know."""
    integrators = 0
    for roots, way in ((part.poles(), -1.0), (part.zeros(), 1.0)):
        s = as_continuous(part, roots)
        size = max(float(np.abs(s).max(initial=0.0)), 1e-300)
        integrators -= int(way) * sum(abs(root) <= 1e-7 * size for root in s.tolist())
        undamped = (np.abs(s.real) <= 1e-9 * np.abs(s)) & (s.imag > 1e-7 * size)
        for frequency in s.imag[undamped].tolist():
            k = int(np.searchsorted(frequencies, float(frequency)))
            if 0 < k < len(phase) and way * (phase[k] - phase[k - 1]) < -90.0:
                phase[k:] += way * 360.0
    expected = -90.0 * integrators - 1e-6  # of +180 and -180 degrees the lower one
    phase += 360.0 * round((expected - float(phase[0])) / 360.0)


def as_continuous(system: LinearSystem, roots: Complex) -> Complex:
    """The roots in rad/s: of a sampled system ``log(z) / dt``, without those at ``z = 0``."""
    if not system.is_discrete:
        return roots
    return np.asarray(np.log(roots[roots != 0.0]) / system.dt, dtype=np.complex128)


def dcgain(system: LinearSystem) -> Array:
    """The response at rest of what lies between each input and each output."""
    place = np.array([1.0 if system.is_discrete else 0.0], dtype=np.complex128)
    result = np.empty(system.D.shape)
    for row in range(system.D.shape[0]):
        for column in range(system.D.shape[1]):
            # An integrator on another path must not spoil this one.
            part = system.select([system.outputs[row]], [system.inputs[column]]).minimal()
            value = float(evaluate(part, place)[0, 0, 0].real)
            if part.order and np.linalg.cond(place[0].real * np.eye(part.order) - part.A) > 1e14:
                value = math.inf
            result[row, column] = value
    return result


def frequency_range(system: LinearSystem) -> tuple[float, float]:
    """A decade below the slowest and above the fastest corner, rad/s; to the Nyquist frequency if sampled."""
    roots = np.concatenate([system.poles(), system.zeros()])
    if system.is_discrete:
        roots = roots[np.abs(roots) > 1e-8]
        roots = np.log(roots) / system.dt
    corners = np.abs(roots)
    corners = corners[corners > 1e-6 * max(1e-6, float(corners.max(initial=0.0)))]
    nyquist = math.pi / system.dt if system.is_discrete else math.inf
    low = float(corners.min()) / 10.0 if corners.size else min(0.1, nyquist / 100.0)
    high = min(float(corners.max()) * 10.0 if corners.size else 10.0, nyquist)
    low, high = 10.0 ** math.floor(math.log10(low) + 1e-9), 10.0 ** math.ceil(math.log10(high) - 1e-9)
    high = min(high, nyquist)
    return min(low, high / 100.0), high


def frequency_grid(system: LinearSystem, low: float, high: float, points: int = 500) -> Array:
    """Angular frequencies (rad/s), even on a logarithmic axis and closer about lightly damped modes."""
    grid = np.geomspace(low, high, points)
    roots = np.concatenate([system.poles(), system.zeros()])
    if system.is_discrete:
        roots = np.log(roots[np.abs(roots) > 1e-8]) / system.dt
    extra: list[Array] = []
    for root in roots[roots.imag > 0.0]:
        width = max(abs(root.real), 1e-6 * abs(root))
        if width < 0.3 * abs(root):
            spread = width * np.sinh(np.linspace(-8.0, 8.0, 81)) / 10.0
            extra.append(root.imag + spread)
    whole = np.unique(np.concatenate([grid, *extra]))
    return whole[(whole >= low) & (whole <= high)]


def _located(function: Callable[[float], float], low: float, high: float) -> float:
    """The zero between two frequencies with values of opposite sign, to the last digits (bisection)."""
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


def _response_at(system: LinearSystem, frequency: float) -> complex:
    return complex(frequency_response(system, np.array([frequency]))[0, 0, 0])


def margins(system: LinearSystem) -> Margins:
    """Margins of the loop with negative feedback around this system; see :class:`Margins`.

    Crossings are sought on a grid that is closer about lightly damped modes, then located by bisection.
    Raises ``InputError`` for more than one input or output.
    """
    if not system.is_siso:
        raise InputError(
            f"margins of {system.D.shape[1]} inputs and {system.D.shape[0]} outputs are asked for",
            where=system.name,
            allowed="one of each",
            fix="choose with system.select(output, input)",
        )
    loop = system.minimal()
    low, high = frequency_range(loop)
    top = high if loop.is_discrete else 1e3 * high
    grid = frequency_grid(loop, 1e-3 * low, top, 2000)
    response = frequency_response(loop, grid)[:, 0, 0]
    phase_crossings: list[tuple[float, float]] = []
    gain_crossings: list[tuple[float, float]] = []

    def size(frequency: float) -> float:
        return abs(_response_at(loop, frequency)) - 1.0

    def side(frequency: float) -> float:
        return _response_at(loop, frequency).imag

    above = np.abs(response) > 1.0
    for k in np.flatnonzero(above[1:] != above[:-1]).tolist():
        frequency = _located(size, float(grid[k]), float(grid[k + 1]))
        angle = math.degrees(math.atan2(*(lambda v: (v.imag, v.real))(-_response_at(loop, frequency))))
        phase_crossings.append((frequency, angle))
    upper = response.imag > 0.0
    for k in np.flatnonzero((upper[1:] != upper[:-1]) & (response.real[1:] < 0.0)).tolist():
        frequency = _located(side, float(grid[k]), float(grid[k + 1]))
        value = _response_at(loop, frequency)
        if value.real < 0.0 and abs(value.imag) <= 1e-6 * abs(value):
            gain_crossings.append((frequency, -1.0 / value.real))
    for frequency in (0.0, math.pi / loop.dt if loop.is_discrete else math.inf):
        value = complex(loop.D[0, 0]) if math.isinf(frequency) else _response_at(loop, frequency)
        if math.isfinite(value.real) and value.real < 0.0:
            gain_crossings.append((frequency, -1.0 / value.real))
    return _gathered(loop, grid, response, gain_crossings, phase_crossings)


def _gathered(
    loop: LinearSystem,
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
        stable=loop.feedback().is_stable if abs(1.0 + loop.D[0, 0]) > 1e-12 else False,
        gain_crossings=tuple(gains),
        phase_crossings=tuple(phases),
    )


def _nearest_to_minus_one(loop: LinearSystem, grid: Array, response: Complex) -> tuple[float, float]:
    """The least ``|1 + L|`` by golden sections between the neighbours of the nearest point of the grid."""
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


def bandwidth(system: LinearSystem, drop: float) -> float:
    """See :meth:`LinearSystem.bandwidth`; ``inf`` where the gain never falls so far."""
    if not system.is_siso:
        raise InputError(
            f"the bandwidth of {system.D.shape[1]} inputs and {system.D.shape[0]} outputs is asked for",
            where=system.name,
            allowed="one of each",
            fix="choose with system.select(output, input)",
        )
    from armblocks.analysis.shown_values import shown_dcgain

    rest = abs(float(shown_dcgain(system)[0, 0]))
    if not math.isfinite(rest) or rest == 0.0:
        raise InputError(
            f"the gain at rest is {rest:g}",
            where=system.name,
            allowed="a finite gain at rest that is not 0",
            fix="ask for the bandwidth of the closed loop",
        )
    level = rest * 10.0 ** (-drop / 20.0)
    low, high = frequency_range(system)
    grid = frequency_grid(system, 1e-3 * low, high if system.is_discrete else 1e3 * high, 2000)
    below = np.abs(frequency_response(system, grid)[:, 0, 0]) < level
    if not below.any():
        return math.inf
    k = int(np.argmax(below))
    if k == 0:
        return float(grid[0])
    return _located(
        lambda frequency: abs(_response_at(system, frequency)) - level, float(grid[k - 1]), float(grid[k])
    )

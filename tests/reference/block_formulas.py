"""Formulas of blocks in NumPy: the required outputs as functions of the recorded inputs.

The formulas share no code with the blocks. They cover sources and switching blocks without memory, and hold
at every recorded time of every run.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from armblocks.diagram import Block, Diagram, flat_diagram

Inputs = Mapping[str, np.ndarray]
Formula = Callable[[Any, Inputs, np.ndarray], np.ndarray]
"""Function of a block, its inputs (N, *shape) by port, and the time (N, 1, …); it returns the output y."""

SWITCHING_TOLERANCE = 1e-8
"""Tolerance of switching times, as a difference of inputs relative to 1 + |u|."""

_RELATIONS: Mapping[str, Callable[[Any, Any], Any]] = {
    "==": np.equal,
    "~=": np.not_equal,
    "<": np.less,
    "<=": np.less_equal,
    ">": np.greater,
    ">=": np.greater_equal,
}


def _array(value: Any) -> np.ndarray:
    return np.asarray(value, dtype=np.float64)


def _within(block: Any, u: Any, lower: Any, upper: Any) -> np.ndarray:
    above = u >= lower if block.lower_closed else u > lower
    below = u <= upper if block.upper_closed else u < upper
    return np.logical_and(above, below)


def _half_up(u: np.ndarray) -> np.ndarray:
    return np.floor(u + 0.5)


def _away(u: np.ndarray) -> np.ndarray:
    return np.sign(u) * np.floor(np.abs(u) + 0.5)


_ROUNDINGS = {"floor": np.floor, "ceil": np.ceil, "round": _away, "fix": np.trunc}


def _minmax(block: Any, u: Inputs, t: np.ndarray) -> np.ndarray:
    values = np.broadcast_arrays(*u.values())
    return (np.min if block.function == "min" else np.max)(np.stack(values), axis=0)


def _modulo(block: Any, u: Inputs, t: np.ndarray) -> np.ndarray:
    a, v = np.broadcast_arrays(u["u"], u["v"])
    if block.function == "rem":
        return np.fmod(a, v)
    return np.where(v == 0.0, a, np.mod(a, np.where(v == 0.0, 1.0, v)))


def _switch(block: Any, u: Inputs, t: np.ndarray) -> np.ndarray:
    is_first = u["u2"] >= block.threshold if block.criterion == ">=" else u["u2"] > block.threshold
    return np.where(is_first, u["u1"], u["u3"])


def _multiport(block: Any, u: Inputs, t: np.ndarray) -> np.ndarray:
    index, *candidates = u.values()
    element = np.trunc(index) - (0.0 if block.counting == "zero-based" else 1.0)
    element = np.clip(element, 0, len(candidates) - 1)
    return np.choose(element.astype(int), np.broadcast_arrays(index, *candidates)[1:])


def _table(block: Any, u: Inputs, t: np.ndarray) -> np.ndarray:
    x, y, v = _array(block.positions), _array(block.table), u["u"]
    if block.method == "cubic":
        return np.full(v.shape, np.nan)  # no formula: a spline does not switch
    if block.method == "flat":
        return y[np.clip(np.searchsorted(x, v, side="right") - 1, 0, len(x) - 1)]
    if block.method == "nearest":
        return y[np.searchsorted((x[1:] + x[:-1]) / 2, v, side="right")]
    k = np.clip(np.searchsorted(x, v, side="right") - 1, 0, len(x) - 2)
    v = np.clip(v, x[0], x[-1]) if block.extrapolation == "clip" else v
    return y[k] + (y[k + 1] - y[k]) * (v - x[k]) / (x[k + 1] - x[k])


def _phase(t: np.ndarray, period: float) -> np.ndarray:
    """Return the time since the start of the period; rounding errors just before the start are ignored."""
    count = np.floor(t / period * (1.0 + 2e-14))
    return np.maximum(t - count * period, 0.0)


def _pulses(block: Any, u: Inputs, t: np.ndarray) -> np.ndarray:
    since = _phase(t - block.delay, block.period)
    high = (t >= block.delay * (1 - 1e-14)) & (since < block.period * block.width / 100 * (1 - 1e-12))
    return np.where(high, _array(block.amplitude), 0.0)


def _wave(block: Any, u: Inputs, t: np.ndarray) -> np.ndarray:
    period = (1.0 if block.units == "Hz" else 2 * math.pi) / block.frequency
    amplitude = _array(block.amplitude)
    if block.waveform == "sine":
        return amplitude * np.sin(2 * math.pi * t / period)
    since = _phase(t, period) / period
    if block.waveform == "square":
        return np.where(since < 0.5 * (1 - 1e-12), -amplitude, amplitude)
    return amplitude * (1.0 - 2.0 * since)


def _sequence(block: Any, u: Inputs, t: np.ndarray) -> np.ndarray:
    times = _array(block.times)
    return np.interp(_phase(t, float(times[-1])), times, _array(block.values))


def _gate(block: Any, u: Inputs, t: np.ndarray) -> np.ndarray:
    values = [value != 0.0 for value in u.values()]
    if block.operator == "NOT":
        return ~values[0]
    names = {"AND": np.all, "NAND": np.all, "OR": np.any, "NOR": np.any}
    stacked = np.stack(np.broadcast_arrays(*values))
    if block.operator in names:
        result = names[block.operator](stacked, axis=0)
    else:
        result = stacked.sum(axis=0) % 2 == 1
    return ~result if block.operator in ("NAND", "NOR", "NXOR") else result


FORMULAS: Mapping[str, Formula] = {
    "Abs": lambda b, u, t: np.abs(u["u"]),
    "AngleDifference": lambda b, u, t: np.mod(u["a"] - u["b"] + np.pi, 2 * np.pi) - np.pi,
    "CompareToConstant": lambda b, u, t: _RELATIONS[b.relation](u["u"], _array(b.constant)),
    "CompareToZero": lambda b, u, t: _RELATIONS[b.relation](u["u"], 0.0),
    "CoulombFriction": lambda b, u, t: np.sign(u["u"]) * (_array(b.offset) + _array(b.gain) * np.abs(u["u"])),
    "DeadZone": lambda b, u, t: u["u"] - np.clip(u["u"], _array(b.start), _array(b.end)),
    "DeadZoneDynamic": lambda b, u, t: np.where(
        u["u"] > u["upper"], u["u"] - u["upper"], np.where(u["u"] < u["lower"], u["u"] - u["lower"], 0.0)
    ),
    "IntervalTest": lambda b, u, t: _within(b, u["u"], _array(b.lower), _array(b.upper)),
    "IntervalTestDynamic": lambda b, u, t: _within(b, u["u"], u["lower"], u["upper"]),
    "LogicalOperator": _gate,
    "LookupTable1D": _table,
    "MinMax": _minmax,
    "Modulo": _modulo,
    "MultiportSwitch": _multiport,
    "PulseGenerator": _pulses,
    "Quantizer": lambda b, u, t: b.interval * _half_up(u["u"] / b.interval),
    "RelationalOperator": lambda b, u, t: _RELATIONS[b.relation](u["u1"], u["u2"]),
    "RepeatingSequence": _sequence,
    "Rounding": lambda b, u, t: _ROUNDINGS[b.function](u["u"]),
    "Saturation": lambda b, u, t: np.minimum(np.maximum(u["u"], _array(b.lower)), _array(b.upper)),
    "SaturationDynamic": lambda b, u, t: np.where(
        u["u"] > u["upper"], u["upper"], np.where(u["u"] < u["lower"], u["lower"], u["u"])
    ),
    "Sign": lambda b, u, t: np.sign(u["u"]),
    "SignalGenerator": _wave,
    "Step": lambda b, u, t: np.where(t < b.time, _array(b.initial), _array(b.final)),
    "Switch": _switch,
    "WrapToZero": lambda b, u, t: np.where(u["u"] > _array(b.threshold), 0.0, u["u"]),
}


def broken_formulas(diagram: Diagram, actual: Any, t: np.ndarray) -> dict[str, tuple[int, float, float]]:
    """Return by block the first row that contradicts its formula, the output, and the required output.

    ``actual`` gives signals (N, *shape) by path, at the times ``t`` (N,). Blocks inside conditional
    subsystems are skipped: their outputs are undefined while the subsystem is off."""
    flat = flat_diagram(diagram)
    broken: dict[str, tuple[int, float, float]] = {}
    for name, block in flat.blocks.items():
        kind = type(block).__name__
        sampled = block.sampled or name in flat.gates
        if kind not in FORMULAS or sampled or getattr(block, "zero_crossing", True) is False:
            continue
        inputs = {port.name: _array(actual[f"{name}/{port.name}"]) for port in block.input_ports()}
        y = _array(actual[f"{name}/y"])
        contradiction = contradictions(FORMULAS[kind], block, inputs, _array(t), y)
        if contradiction is not None:
            broken[name] = contradiction
    return broken


def contradictions(
    formula: Formula, block: Block, inputs: Inputs, t: np.ndarray, y: np.ndarray
) -> tuple[int, float, float] | None:
    """Return the first row whose output contradicts the formula for all inputs near the recorded ones.

    Inputs are near if they differ by at most ``SWITCHING_TOLERANCE``.
    """
    rank = y.ndim
    wide = {name: _broadcastable(value, rank) for name, value in inputs.items()}
    t = t.reshape((-1,) + (1,) * (rank - 1))
    size = 1.0 + np.abs(y) + sum(np.abs(v).max(initial=0.0) for v in wide.values())

    def fits(moves: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
        moved = {k: v + move * (1.0 + np.abs(v)) for (k, v), move in zip(wide.items(), moves)}
        with np.errstate(all="ignore"):
            expected = np.broadcast_to(_array(formula(block, moved, t)), y.shape)
        return (np.abs(y - expected) <= 4 * SWITCHING_TOLERANCE * size) | ~np.isfinite(expected), expected

    exact, expected = fits((0.0,) * len(wide))
    near = exact.copy()
    for moves in itertools.product((0.0, SWITCHING_TOLERANCE, -SWITCHING_TOLERANCE), repeat=len(wide)):
        near |= fits(moves)[0]
    # A switching time may be located slightly late, which affects one row; longer deviations are errors.
    deviating = np.pad(~exact, [(2, 2)] + [(0, 0)] * (rank - 1))
    n = len(y)
    stays = np.any(
        [
            deviating[k : k + n] & deviating[k + 1 : k + n + 1] & deviating[k + 2 : k + n + 2]
            for k in range(3)
        ],
        axis=0,
    )
    # Rounding may also leave an input next to a switching value, such as -0.15000000000000002 next to -0.15.
    rounded = np.zeros(y.shape, dtype=bool)
    for value in wide.values():
        rounded = rounded | _has_rounding_error(value)
    is_consistent = exact | (near & (~stays | rounded))
    if is_consistent.all():
        return None
    entry = tuple(np.argwhere(~is_consistent)[0])
    return int(entry[0]), float(y[entry]), float(expected[entry])


def _has_rounding_error(value: np.ndarray) -> np.ndarray:
    """Return where a value differs from a decimal with nine places by rounding only."""
    error = np.abs(value - np.round(value, 9))
    return (error > 0.0) & (error < 1e-12)


def _broadcastable(value: np.ndarray, rank: int) -> np.ndarray:
    """Reshape (N,) to (N, 1, …), so that a scalar is broadcast to every element."""
    return value.reshape(value.shape + (1,) * (rank - value.ndim)) if value.ndim < rank else value

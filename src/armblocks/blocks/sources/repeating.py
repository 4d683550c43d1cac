"""Periodic sources: waves and sequences with exact edge times.

Edges of a wave in continuous time are events at multiples of the period, which are computed by a product and
not accumulated. Sampled sequences count ticks.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, ClassVar, cast

import numpy as np
from casadi import SX, dot, floor, fmax, if_else, sin, vertcat
from numpy.typing import ArrayLike

from armblocks.blocks.interpolation import cells, weights
from armblocks.blocks.switching import edge_count, since
from armblocks.blocks.table_axes import ascending_positions
from armblocks.diagram import (
    Block,
    Guard,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    parameter,
    sample_time_parameter,
    shape_of,
)
from armblocks.diagram.signs import FaceSign, graph, pulses, sine_curve, stairs
from armblocks.errors import InputError

_ROUNDING_MARGIN = 1.0 + 1e-14
"""A factor that compensates rounding: k * period / period may be slightly less than k."""


_WAVES = {
    "sine": sine_curve(2.0),
    "square": pulses((0.5, 0.5)),
    "sawtooth": graph((0, 0.5), (0.25, 0), (0.25, 1), (0.75, 0), (0.75, 1), (1, 0.5)),
}


@dataclass(frozen=True, kw_only=True)
class SignalGenerator(Block):
    """A periodic wave of amplitude A and frequency f: a sine, a square wave or a sawtooth.

    s = f t - floor(f t) is the elapsed fraction of the period, with f in Hz:

    - ``sine``: y = A sin(2 pi s).
    - ``square``: y = -A in the first half of each period, A in the second half.
    - ``sawtooth``: y = A (1 - 2 s), which falls from A to -A in each period.

    The signs of the waves are those of Simulink's block. For the random waveform of Simulink's block use the
    block Uniform Random Number.
    """

    following_modes: ClassVar[bool] = True
    title: ClassVar[str] = "Signal Generator"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A square wave of 0.5 Hz: -1 in the first half of every period, 1 in the second.",
        parameters={"waveform": "square", "frequency": 0.5},
    )

    waveform: str = parameter("sine", choices=("sine", "square", "sawtooth"), doc="the form of the wave")
    amplitude: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="A, half the peak-to-peak value")
    frequency: float = parameter(1.0, above=0.0, doc="frequency f, in the unit of units")
    units: str = parameter("Hz", choices=("Hz", "rad/s"), doc="unit of the frequency")

    def face_sign(self) -> FaceSign:
        return _WAVES[self.waveform]

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the wave"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": shape_of(self.amplitude)}

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return () if self.waveform == "sine" else (State("edges", (), "number of past edges"),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return () if self.waveform == "sine" else (Guard("edge", (), "t - the next edge", 1),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        if self.waveform == "sine":
            to_angle = 2.0 * math.pi if self.units == "Hz" else 1.0
            return {"y": p["amplitude"] * sin(to_angle * p["frequency"] * t)}
        if self.waveform == "square":
            return {"y": p["amplitude"] * (2.0 * (x["edges"] - 2.0 * floor(x["edges"] / 2.0)) - 1.0)}
        return {"y": p["amplitude"] * (1.0 - 2.0 * (t - x["edges"] * self._spacing(p)) / self._spacing(p))}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {} if self.waveform == "sine" else {"edge": since(t, (x["edges"] + 1.0) * self._spacing(p))}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        if self.waveform == "sine":
            return {}
        passed = floor(t / self._spacing(p) * _ROUNDING_MARGIN)
        return {"edges": edge_count(passed, x["edges"], self.contradictions(t, x, u, p)["edges"])}

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        if self.waveform == "sine":
            return {}
        return {"edges": self.guard_values(t, x, u, p)["edge"] > 0.0}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return {} if self.waveform == "sine" else {"edges": x["edges"] + (e["edge"] > 0.0)}

    def _spacing(self, p: Signals) -> SX:
        """Time from one edge to the next."""
        period = (1.0 if self.units == "Hz" else 2.0 * math.pi) / p["frequency"]
        return period / 2.0 if self.waveform == "square" else period


@dataclass(frozen=True, kw_only=True)
class RepeatingSequence(Block):
    """A periodic signal of straight lines: y = values(k) at times(k), with the period times(n).

    If the last value differs from the first value, the signal jumps at the end of each period.
    """

    following_modes: ClassVar[bool] = True
    title: ClassVar[str] = "Repeating Sequence"
    sign: ClassVar[FaceSign] = graph((0, 0), (0.5, 1), (0.5, 0), (1, 1), (1, 0))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Four points with a period of three seconds.",
        parameters={"times": (0.0, 1.0, 2.0, 3.0), "values": (0.0, 2.0, 1.5, 0.0)},
    )

    times: ArrayLike = parameter(
        (0.0, 2.0), dimensions=(1,), tunable=False, doc="times (n,), starting at 0", unit="s"
    )
    values: ArrayLike = parameter((0.0, 2.0), dimensions=(1,), doc="values at the times (n,)")

    def check(self) -> None:
        _check_times(self, self.times, shape_of(self.values)[0])

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the sequence", shape=()),)

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("pieces", (), "number of past segments"),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return (Guard("corner", (), "t - the next corner", 1),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        times = _numbers(self.times)
        periods, segment = self._segment(x["pieces"])
        segment_durations = SX([right - left for left, right in pairwise(times)])
        elapsed = t - (periods * times[-1] + dot(segment, SX(times[:-1])))
        left, right = dot(segment, p["values"][:-1]), dot(segment, p["values"][1:])
        return {"y": left + (right - left) * (elapsed / dot(segment, segment_durations))}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        times = _numbers(self.times)
        periods, segment = self._segment(x["pieces"])
        return {"corner": since(t, periods * times[-1] + dot(segment, SX(times[1:])))}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        times = _numbers(self.times)
        periods = floor(t / times[-1] * _ROUNDING_MARGIN)
        time_in_period = (t - periods * times[-1]) + 1e-14 * t
        passed = sum((time_in_period >= corner for corner in times[1:-1]), SX(0.0))
        passed = periods * (len(times) - 1) + passed
        return {"pieces": edge_count(passed, x["pieces"], self.contradictions(t, x, u, p)["pieces"])}

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"pieces": self.guard_values(t, x, u, p)["corner"] > 0.0}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return {"pieces": x["pieces"] + (e["corner"] > 0.0)}

    def _segment(self, pieces: SX) -> tuple[SX, SX]:
        """The number of past periods, and a vector that is 1 for the present segment and 0 for all other
        segments."""
        count = shape_of(self.times)[0] - 1
        periods = floor(pieces / count)
        return periods, vertcat(*cells(pieces - count * periods, [k - 0.5 for k in range(1, count)]))


@dataclass(frozen=True, kw_only=True)
class RepeatingSequenceInterpolated(Block):
    """A periodic signal at ticks: y = values(k) at times(k), interpolated, with the period times(n).

    The value at a tick is interpolated at the time of the tick modulo times(n). ``linear`` interpolates
    linearly, ``nearest`` takes the nearest value, ``flat`` the previous value.
    """

    title: ClassVar[str] = "Repeating Sequence Interpolated"
    sign: ClassVar[FaceSign] = graph((0, 0), (0.2, 1), (0.5, 0.3), (0.5, 0), (0.7, 1), (1, 0.3))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Four points, interpolated every 0.1 s and held in between.",
        parameters={"times": (0.0, 1.0, 2.0, 3.0), "values": (0.0, 2.0, 1.5, 0.0), "sample_time": 0.1},
    )
    sampled: ClassVar[bool] = True

    times: ArrayLike = parameter(
        (0.0, 0.1, 0.5, 0.6, 1.0), dimensions=(1,), tunable=False, doc="times (n,), starting at 0", unit="s"
    )
    values: ArrayLike = parameter((3.0, 1.0, 4.0, 2.0, 1.0), dimensions=(1,), doc="values at the times (n,)")
    method: str = parameter("linear", choices=("linear", "nearest", "flat"), doc="interpolation method")
    sample_time: ArrayLike = sample_time_parameter(0.01)

    def check(self) -> None:
        _check_times(self, self.times, shape_of(self.values)[0])

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the interpolated sequence", shape=()),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        times = _numbers(self.times)
        periods = floor(t / times[-1] * _ROUNDING_MARGIN)
        time_in_period = fmax(t - periods * times[-1], 0.0)
        if self.method == "flat":
            time_in_period = time_in_period + 1e-14 * t
        return {"y": dot(vertcat(*weights(time_in_period, times, self.method)), p["values"])}


@dataclass(frozen=True, kw_only=True)
class RepeatingSequenceStair(Block):
    """A periodic sequence of values, one at each tick: y(k) = values[k mod n]."""

    title: ClassVar[str] = "Repeating Sequence Stair"
    sign: ClassVar[FaceSign] = stairs((0.2, 1.0, 0.6, 0.2, 1.0, 0.6))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Five values, one per second, repeated.",
    )
    sampled: ClassVar[bool] = True

    values: ArrayLike = parameter((3.0, 1.0, 4.0, 2.0, 1.0), dimensions=(1,), doc="the values (n,)")
    sample_time: ArrayLike = sample_time_parameter(1.0)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the stair", shape=()),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("k", (), "index of the next value, from 0"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        cell = cells(x["k"], [k - 0.5 for k in range(1, p["values"].numel())])
        return {"y": dot(vertcat(*cell), p["values"])}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"k": if_else(x["k"] >= p["values"].numel() - 1.0, 0.0, x["k"] + 1.0)}

    def initial_states(self, p: Signals) -> Signals:
        return {"k": SX(0.0)}


def _check_times(block: Block, times: ArrayLike, count: int) -> None:
    """Raise ``InputError`` unless ``count`` times ascend from 0."""
    first = ascending_positions(block.type_name(), "times", times, count)[0]
    if first != 0.0:
        raise InputError(
            f"the first of the times is {first}",
            where=f"{block.type_name()}.times",
            allowed="times that start at 0",
            fix="subtract the first time; the last time is the period",
        )


def _numbers(values: ArrayLike) -> list[float]:
    """The values as a flat list of numbers."""
    return [float(value) for value in np.ravel(cast("Any", values))]

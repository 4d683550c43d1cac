"""Sources with a given waveform: ground, a pulse, a chirp, a table of times and values."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar, cast

import numpy as np
from casadi import SX, fmax, fmin, if_else, logic_and, logic_not, mtimes, sin, vertcat
from numpy.typing import ArrayLike, NDArray

from armblocks.blocks.elementwise import parameters_shape
from armblocks.blocks.interpolation import weights
from armblocks.blocks.long_tables import inputs_with, interpolated, interval_of, is_long, is_spline
from armblocks.blocks.splines import spline_corners, with_derivatives
from armblocks.blocks.table_axes import ascending_positions
from armblocks.diagram import (
    Block,
    Parameter,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    WorkedExample,
    parameter,
    shape_of,
)
from armblocks.diagram.signs import FaceSign, Words, graph, sine_curve
from armblocks.equations import last_at_or_below, read_entry
from armblocks.errors import InputError

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Ground(Block):
    """Ground: y = 0, for unused inputs; a scalar, or a vector or matrix of zeros."""

    title: ClassVar[str] = "Ground"
    sign: ClassVar[FaceSign] = Words("0")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Zero at all times.",
    )

    dimensions: ArrayLike = parameter(
        1.0,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        minimum=1.0,
        maximum=1e4,
        tunable=False,
        doc="shape of the output: 1 a scalar, n a vector, (m, n) a matrix",
    )

    def check(self) -> None:
        dimensions = np.atleast_1d(np.asarray(self.dimensions, dtype=np.float64))
        if dimensions.size > 2 or bool(np.any(dimensions != np.floor(dimensions))):
            raise InputError(
                f"the dimensions are {dimensions.tolist()}",
                where="Ground.dimensions",
                allowed="1 (a scalar), n (a vector), or (m, n) (a matrix)",
                fix="give one or two integers",
            )

    def _shape(self) -> tuple[int, ...]:
        dimensions = np.atleast_1d(np.asarray(self.dimensions, dtype=np.float64)).tolist()
        return () if dimensions == [1.0] else tuple(int(size) for size in dimensions)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "zero", shape=self._shape()),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": SX.zeros(*(self._shape() or (1,)))}


@dataclass(frozen=True, kw_only=True)
class Pulse(Block):
    """One pulse: y = amplitude for start <= t < start + width, else 0. Steps end at both edges."""

    title: ClassVar[str] = "Pulse"
    sign: ClassVar[FaceSign] = graph((0, 0), (0.3, 0), (0.3, 1), (0.7, 1), (0.7, 0), (1, 0))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="One pulse from 2 s to 5 s.",
        parameters={"start": 2.0, "width": 3.0},
    )

    amplitude: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="the value during the pulse")
    start: float = parameter(1.0, doc="start time of the pulse", unit="s")
    width: float = parameter(1.0, above=0.0, doc="duration of the pulse", unit="s")

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the pulse"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": shape_of(self.amplitude)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        during = logic_and(logic_not(t < p["start"]), t < p["start"] + p["width"])
        return {"y": if_else(during, p["amplitude"], 0.0)}

    def breakpoints(self, p: Signals) -> tuple[SX, ...]:
        return p["start"], p["start"] + p["width"]


@dataclass(frozen=True, kw_only=True)
class Chirp(Block):
    """A chirp, a sine whose frequency rises linearly: y = sin(2 pi (f1 t + (f2 - f1) t^2 / (2 T))).

    The frequency is ``initial_frequency`` f1 at t = 0 and ``final_frequency`` f2 at ``target_time`` T; it
    continues to rise after T.
    """

    title: ClassVar[str] = "Chirp Signal"
    sign: ClassVar[FaceSign] = sine_curve(1.2, 1.6)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The frequency rises from 0.1 Hz to 1 Hz within ten seconds.",
        parameters={"target_time": 10.0},
    )

    initial_frequency: ArrayLike = parameter(
        0.1, kind=ParameterKind.ARRAY, doc="frequency f1 at t = 0", unit="Hz"
    )
    final_frequency: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="frequency f2 at T", unit="Hz")
    target_time: float = parameter(100.0, above=0.0, doc="time T at which the frequency is f2", unit="s")

    def check(self) -> None:
        parameters_shape(self, "initial_frequency", "final_frequency")

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the chirp"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": parameters_shape(self, "initial_frequency", "final_frequency")}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        first, last = p["initial_frequency"], p["final_frequency"]
        return {"y": sin(2.0 * math.pi * (first * t + (last - first) * (t * t / (2.0 * p["target_time"]))))}


@dataclass(frozen=True, kw_only=True)
class FromTable(Block):
    """A signal through given points: y = values(k) at t = times(k), interpolated in between.

    - ``method``: ``linear`` interpolates linearly, ``flat`` holds the previous value, ``cubic`` is the
      not-a-knot spline.
    - ``outside`` applies before the first and after the last time: ``hold`` keeps the first or last value,
      ``zero`` gives 0, ``linear`` extrapolates linearly.

    Solver steps end at the given times.
    """

    title: ClassVar[str] = "From Workspace"
    sign: ClassVar[FaceSign] = graph((0, 0.2), (0.3, 0.9), (0.6, 0.4), (1, 0.7))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A cubic spline through four points; after the last point its value is held.",
        parameters={"times": (0.0, 2.0, 5.0, 8.0), "values": (0.0, 1.0, -1.0, 0.5), "method": "cubic"},
    )

    times: ArrayLike = parameter(
        (0.0, 1.0), dimensions=(1,), tunable=False, doc="sample times (n,)", unit="s"
    )
    values: ArrayLike = parameter((0.0, 1.0), dimensions=(1, 2), doc="values at the times, (n,) or (n, m)")
    method: str = parameter("linear", choices=("linear", "flat", "cubic"), doc="interpolation method")
    outside: str = parameter("hold", choices=("hold", "linear", "zero"), doc="extrapolation method")

    def check(self) -> None:
        ascending_positions("FromTable", "times", self.times, shape_of(self.values)[0])

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the signal: a scalar, or a vector (m,)"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": shape_of(self.values)[1:]}

    def inputs_of_the_run(self) -> tuple[Parameter, ...]:
        return inputs_with(self, self._is_long(), "values", "times")

    def parameters_behind_inputs(self) -> tuple[str, ...]:
        return ("times", "values") if is_spline(self, self._is_long()) else ()

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        if self._is_long():
            return {"y": self._read(t, p)}
        times = self._times()
        by_time = vertcat(*weights(t, times, self.method, "linear" if self.outside == "linear" else "clip"))
        signal = mtimes(p["values"].T, by_time)
        if self.outside == "zero":
            signal = if_else(logic_and(t >= times[0], t <= times[-1]), signal, 0.0)
        return {"y": signal}

    def breakpoints(self, p: Signals) -> tuple[SX, ...]:
        if self._is_long():
            return (p["knots" if self.method == "cubic" else "times"],)
        return tuple(SX(time) for time in self._times())

    def _is_long(self) -> bool:
        return is_long(shape_of(self.times), self.method)

    def _read(self, t: SX, p: Signals) -> SX:
        """The signal, from the two rows around t."""
        is_cubic = self.method == "cubic"
        values = p["spline" if is_cubic else "values"].T  # row-major, as in the parameter vector
        times = p["knots" if is_cubic else "times"]
        first, last = times[0], times[times.numel() - 1]
        width = values.shape[0] if len(shape_of(self.values)) == 2 else 1

        def row(k: SX) -> SX:
            return vertcat(*(read_entry(values, width * k + float(column)) for column in range(width)))

        if self.method == "flat":
            signal = row(fmax(last_at_or_below(times, t), 0.0))
        elif is_cubic:
            corners = spline_corners(t, times, None, straight=self.outside == "linear")
            signal = sum((weight * row(k) for k, weight in corners), SX(0.0))
        else:
            clipped = t if self.outside == "linear" else fmin(fmax(t, first), last)
            signal = interpolated(clipped, times, interval_of(t, times), row)
        return if_else(logic_and(t >= first, t <= last), signal, 0.0) if self.outside == "zero" else signal

    @property
    def knots(self) -> Array:
        """The times of a long cubic table, s."""
        return np.asarray(self._times())

    @property
    def spline(self) -> Array:
        """The values and derivatives of a long cubic table, row by row."""
        return with_derivatives((tuple(self._times()),), self.values)

    def _times(self) -> list[float]:
        return [float(time) for time in np.ravel(cast("Any", self.times))]

"""The quantities and measures of a sweep: signals, expressions over signals, and functions of them."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from armblocks.compiler.batch import BatchLayout, Layout, emit_batch
from armblocks.compiler.cached_tapes import tape_of
from armblocks.compiler.ir_text import Module
from armblocks.compiler.native import NativeCode, load_code
from armblocks.compiler.target import host_target
from armblocks.equations import TracedFunction
from armblocks.simulation.jumps import JumpTable, Side, merged
from armblocks.simulation.run_data import RunData
from armblocks.sweeps.batch_routine import batch_code
from armblocks.sweeps.measure_routines import OPTIONS

Array = NDArray[np.float64]

EVENTS = "events"
"""The kind of the measure that counts events."""
_LAYOUT = BatchLayout(inputs=(Layout.COLUMNS, Layout.COLUMNS), outputs=(Layout.COLUMNS,))
_MEASURE = ctypes.CFUNCTYPE(
    ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64, ctypes.c_void_p
)


@dataclass(frozen=True, kw_only=True)
class RunQuantity:
    """A scalar over time: row ``row`` of the signals, or expression ``-1 - row``.

    ``used``: the rows of the signals on which the quantity depends. The quantity can jump only where one of
    these signals jumps.
    """

    row: int
    used: tuple[int, ...]


@dataclass(frozen=True, kw_only=True)
class RunMeasure:
    """A number for each run: a ``kind`` of :data:`~armblocks.sweeps.measure_routines.ROUTINES` of a quantity,
    with its options; or the number of events."""

    kind: str
    quantity: int = 0
    options: tuple[float, ...] = ()

    @property
    def address(self) -> int:
        """The address of the native function; 0 for the number of events."""
        return 0 if self.kind == EVENTS else batch_code().address(f"measure.{self.kind}")

    @cached_property
    def all_options(self) -> Array:
        """The options as the native function reads them."""
        values = np.zeros(OPTIONS)
        values[: len(self.options)] = self.options
        return values

    def of(self, times: Array, values: Array) -> float:
        """The measure of the rows ``times (n,)`` s and ``values (n,)``."""
        t, y = np.ascontiguousarray(times), np.ascontiguousarray(values)
        options = self.all_options
        return float(_MEASURE(self.address)(t.ctypes.data, y.ctypes.data, t.size, options.ctypes.data))


class Expressions:
    """Expressions over signals in native code: a function of the time and all signals."""

    def __init__(self, traced: TracedFunction) -> None:
        """``traced``: inputs ``t`` and ``y (ny,)``, one output with a number for each expression."""
        self.traced = traced
        self._tape = tape_of(traced)
        self.count = traced.outputs.size

    @cached_property
    def _code(self) -> NativeCode:
        def write() -> str:
            module = Module()
            emit_batch(module, self._tape, _LAYOUT, host_target().lanes, "expressions")
            return module.text

        return load_code(("sweep expressions", self._tape.digest), write)

    @cached_property
    def address(self) -> int:
        """The address of ``expressions(start, stop, columns, t, y, values)``."""
        return self._code.address("expressions")

    def of(self, times: Array, signals: Array) -> Array:
        """The expressions ``(ne, N)`` at times ``(N,)`` s with signals ``(ny, N)``."""
        call = ctypes.CFUNCTYPE(None, *[ctypes.c_int64] * 3, *[ctypes.c_void_p] * 3)(self.address)
        t, y = np.ascontiguousarray(times), np.ascontiguousarray(signals)
        values = np.empty((self.count, t.size))
        call(0, t.size, t.size, t.ctypes.data, y.ctypes.data, values.ctypes.data)
        return values


@dataclass(frozen=True, kw_only=True, eq=False)
class Observation:
    """The results for each run of a sweep: measures, and samples of the ``kept`` quantities."""

    quantities: tuple[RunQuantity, ...] = ()
    measures: tuple[RunMeasure, ...] = ()
    kept: tuple[int, ...] = ()
    expressions: Expressions | None = field(default=None)

    @cached_property
    def used(self) -> tuple[int, ...]:
        """The rows of the signals that the quantities depend on, ascending."""
        return tuple(sorted({row for quantity in self.quantities for row in quantity.used}))

    def measured(self, result: RunData) -> list[float]:
        """The measures of one result, bit-identical to the measures in a sweep."""
        rows = self._values(result.time, result.signals)
        table = result.jumps.table
        sides = [self._values(table.time, side.signals) for side in (table.before, table.after)]
        series: list[tuple[Array, Array]] = []
        for k, quantity in enumerate(self.quantities):
            jumping = table.jumping[list(quantity.used)].any(axis=0) & (table.time > result.time[0])
            jumping &= table.time <= result.time[-1]
            time = table.time[jumping]
            both = [side[k : k + 1, jumping] for side in sides]
            series.append(_merged(result.time, rows[k : k + 1], time, both[0], both[1]))
        return [
            float(result.run.events) if measure.kind == EVENTS else measure.of(*series[measure.quantity])
            for measure in self.measures
        ]

    def samples(self, result: RunData) -> Array:
        """The samples of the kept quantities, ``(kept, N)``."""
        return self._values(result.time, result.signals)[list(self.kept)]

    def _values(self, times: Array, signals: Array) -> Array:
        """All quantities ``(nq, N)``."""
        expressions = None if self.expressions is None else self.expressions.of(times, signals)
        values = np.empty((len(self.quantities), times.size))
        for k, quantity in enumerate(self.quantities):
            if quantity.row >= 0:
                values[k] = signals[quantity.row]
            else:
                assert expressions is not None
                values[k] = expressions[-1 - quantity.row]
        return values


def _merged(time: Array, values: Array, jumps: Array, before: Array, after: Array) -> tuple[Array, Array]:
    """The rows of one quantity ``(1, N)``, including its jumps."""
    states = np.empty((jumps.size, 0))
    left, right = (Side(states=states, signals=side) for side in (before, after))
    table = JumpTable(time=jumps, before=left, after=right, jumping=np.ones((1, jumps.size), dtype=np.bool_))
    times, rows = merged(time, values, table)
    return times, rows[0]

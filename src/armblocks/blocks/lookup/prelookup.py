"""Table lookup in two steps, with one search for several tables, and direct access by index."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, floor, fmax, fmin, if_else
from numpy.typing import ArrayLike

from armblocks.blocks.integer_steps import BlockWithSteps, IntegerSteps
from armblocks.blocks.interpolation import EXTRAPOLATIONS, cells, contract
from armblocks.blocks.long_tables import is_long
from armblocks.blocks.switching import zero_crossing_parameter
from armblocks.blocks.table_axes import (
    BlockWithAxes,
    ascending_positions,
    axis_ports,
    elementwise,
    numbers_of,
    read,
)
from armblocks.diagram import (
    Block,
    Port,
    Shapes,
    Signals,
    WorkedExample,
    driver,
    parameter,
    shape_of,
)
from armblocks.equations import flatten, read_entry
from armblocks.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Prelookup(BlockWithAxes):
    """The interval k of a table axis that contains u, and the fraction f of this interval at u.

    u = b(k) + f (b(k+1) - b(k)), where b are the positions and k counts from 0. At the last position the
    index of the last interval is returned, with f = 1. Beyond the ends ``clip`` limits f to 0 or 1, and
    ``linear`` extrapolates. Several Interpolation Using Prelookup blocks can use the result of one Prelookup.
    """

    title: ClassVar[str] = "Prelookup"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The index of the interval that contains the input, and the fraction of the interval.",
        parameters={"positions": (0.0, 2.0, 5.0, 10.0)},
        inputs={"u": driver("Ramp")},
        shown=("k", "f"),
    )

    positions: ArrayLike = parameter((0.0, 1.0), dimensions=(1,), tunable=False, doc="positions (n,)")
    extrapolation: str = parameter("clip", choices=EXTRAPOLATIONS, doc="extrapolation beyond the ends")
    zero_crossing: bool = zero_crossing_parameter()

    def check(self) -> None:
        ascending_positions("Prelookup", "positions", self.positions, *shape_of(self.positions))

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the position"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (
            Port("k", "index of the interval, from 0"),
            Port("f", "fraction of the interval; 0 to 1 with clip"),
        )

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"k": inputs["u"], "f": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        points = p["positions"] if self._is_long() else SX(numbers_of(self, "positions"))
        cell = self._axes(p).cell("u", x, u)
        n = points.numel()

        def interval(cell: SX) -> SX:
            return fmin(fmax(cell - 1.0, 0.0), n - 2.0) if self.extrapolation == "clip" else cell

        def fraction(u: SX, cell: SX) -> SX:
            k = interval(cell)
            begin, end = (self._at(points, index) for index in (k, k + 1.0))
            unlimited = (u - begin) / (end - begin)
            if self.extrapolation == "linear":
                return unlimited
            return if_else(cell == 0.0, 0.0, if_else(cell == float(n), 1.0, unlimited))

        return {"k": elementwise([cell], interval), "f": elementwise([u["u"], cell], fraction)}

    def _is_long(self) -> bool:
        return is_long(shape_of(self.positions), "linear")

    def _at(self, points: SX, index: SX) -> SX:
        if self._is_long():
            return read_entry(points, index)
        return sum((if_else(index == float(k), points[k], 0.0) for k in range(points.numel())), SX(0.0))

    def _positions_by_input(self) -> Mapping[str, list[float]]:
        return {"u": numbers_of(self, "positions")}

    def _run_positions(self, p: Signals) -> Mapping[str, SX]:
        return {"u": p["positions"]}

    @property
    def _method(self) -> str:
        return "linear"


@dataclass(frozen=True, kw_only=True)
class InterpolationUsingPrelookup(Block):
    """Linear interpolation in a table at index k and fraction f: y = (1 - f) table[k] + f table[k + 1].

    A table of several axes is interpolated along each axis. Indices and fractions come from Prelookup blocks,
    one pair for each axis. An index is rounded down to an integer and limited to the table.
    """

    title: ClassVar[str] = "Interpolation Using Prelookup"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A curve; the index of the interval and the fraction come from a Prelookup block.",
        parameters={"table": (0.0, 3.0, 1.0, 2.0)},
        inputs={
            "k1": driver("Prelookup", positions=(0.0, 2.0, 5.0, 10.0))
            .named("prelookup")
            .by(u=driver("Ramp"))
            .at("k"),
            "f1": driver("Prelookup", positions=(0.0, 2.0, 5.0, 10.0)).named("prelookup").at("f"),
        },
    )

    table: ArrayLike = parameter(
        (0.0, 1.0), dimensions=(1, 2, 3, 4), doc="values, at least two along each axis"
    )

    def check(self) -> None:
        if min(shape_of(self.table)) < 2:
            raise InputError(
                f"the table has shape {shape_of(self.table)}",
                where="InterpolationUsingPrelookup",
                allowed="two or more entries along each axis",
                fix="omit the axis with one entry",
            )

    def input_ports(self) -> tuple[Port, ...]:
        axes = range(1, len(shape_of(self.table)) + 1)
        return tuple(
            port
            for k in axes
            for port in (Port(f"k{k}", f"index along axis {k}"), Port(f"f{k}", f"fraction along axis {k}"))
        )

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the value"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        shape = shape_of(self.table)
        entries = flatten(p["table"], shape)

        def value(*pairs: SX) -> SX:
            positions = list(zip(pairs[::2], pairs[1::2], shape))
            if is_long(shape):
                return read(entries, shape, [_corners(*position) for position in positions])
            return contract(p["table"], shape, [_weights(*position) for position in positions])

        return {"y": elementwise([*u.values()], value)}


def _corners(k: SX, f: SX, n: int) -> list[tuple[SX, SX]]:
    """Index and weight of the two entries for an index and a fraction."""
    index = fmin(fmax(floor(k), 0.0), float(n - 2))
    return [(index, 1.0 - f), (index + 1.0, f)]


def _weights(k: SX, f: SX, n: int) -> list[SX]:
    """Weights of all n entries."""
    (index, left), (_, right) = _corners(k, f, n)
    return [
        if_else(index == float(i), left, 0.0) + if_else(index == float(i - 1), right, 0.0) for i in range(n)
    ]


@dataclass(frozen=True, kw_only=True)
class DirectLookup(BlockWithSteps):
    """The entry of a table at given indices, which count from 0: y = table[u1, u2, …].

    An index is rounded down to an integer and limited to the table.
    """

    title: ClassVar[str] = "Direct Lookup Table"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A counter reads the table entry by entry.",
        parameters={"table": (0.5, 2.0, 1.0, -1.0)},
        inputs={"u": driver("CounterLimited", upper=3)},
    )

    table: ArrayLike = parameter((0.0, 1.0), dimensions=(1, 2, 3, 4), doc="the entries")
    zero_crossing: bool = zero_crossing_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return axis_ports("index", self.table)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the entry"),)

    def _steps(self) -> tuple[IntegerSteps, ...]:
        ports, counts = self.input_ports(), shape_of(self.table)
        return tuple(
            IntegerSteps(port.name, mode=f"index {port.name}", count=count, prefix=f"{port.name} ")
            for port, count in zip(ports, counts)
            if self.zero_crossing
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        shape = shape_of(self.table)
        entries = flatten(p["table"], shape)

        def entry(*indices: SX) -> SX:
            if is_long(shape):
                limited = (fmin(fmax(floor(u), 0.0), n - 1.0) for u, n in zip(indices, shape))
                return read(entries, shape, [[(index, SX(1.0))] for index in limited])
            axes = [cells(u, [float(k) for k in range(1, n)]) for u, n in zip(indices, shape)]
            return contract(p["table"], shape, axes)

        return {
            "y": elementwise([x[f"index {name}"] if self.zero_crossing else u[name] for name in u], entry)
        }

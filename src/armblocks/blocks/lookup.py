"""Lookup tables. Break points are fixed, entries are tunable; signals are looked up element by element."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, ClassVar, cast

import numpy as np
from casadi import SX, floor, fmax, fmin, if_else, reshape, vertcat
from numpy.typing import ArrayLike

from armblocks.blocks.elementwise import numbered_ports
from armblocks.blocks.interpolation import (
    EXTRAPOLATIONS,
    METHODS,
    borders,
    cells,
    contract,
    linear_weights,
    weights,
)
from armblocks.blocks.long_tables import Borders, is_long, line, with_positions
from armblocks.blocks.switching import JUST, zero_crossing_parameter
from armblocks.diagram import (
    Block,
    Guard,
    Parameter,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    broadcast,
    made,
    parameter,
    shape_of,
)
from armblocks.equations import Shape, read_entry
from armblocks.errors import InputError


def rising(where: str, name: str, points: ArrayLike, count: int) -> list[float]:
    """Break points as floats; raises ``InputError`` unless they rise and are as many as the table is long."""
    values = [float(value) for value in np.ravel(cast("Any", points))]
    if len(values) < 2 or any(right <= left for left, right in pairwise(values)):
        raise InputError(
            f"{name} is {values}"[:90],
            where=where,
            allowed="at least two numbers, each greater than the one before",
            fix="sort them and drop repeated ones",
        )
    if len(values) != count:
        raise InputError(
            f"{name} has {len(values)} break points for {count} entries of the table",
            where=where,
            allowed="as many as the table has entries along that axis",
            fix="correct the table or the break points",
        )
    return values


def by_element(inputs: Sequence[SX], function: Callable[..., SX]) -> SX:
    """A function of scalars applied to all elements; scalars spread."""
    largest = max(inputs, key=lambda value: value.numel())
    size = largest.numel()
    columns = [[value[k if value.numel() > 1 else 0] for k in range(size)] for value in inputs]
    return reshape(vertcat(*[function(*elements) for elements in zip(*columns)]), *largest.shape)


@dataclass(frozen=True, kw_only=True)
class LookupTable1D(Block):
    """A curve through given points: y = table(u), between them by the method chosen.

    ``cubic`` is the spline with not-a-knot ends (MATLAB's ``spline``); ``flat`` takes the entry at or below
    u, ``nearest`` the nearest. Beyond the ends ``clip`` holds the last value, ``linear`` goes straight on.
    """

    family: ClassVar[str] = "lookup"
    title: ClassVar[str] = "1-D Lookup Table"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A curve through five points: straight between them, held beyond the ends.",
        parameters={"positions": (1.0, 3.0, 5.0, 6.0, 8.0), "table": (0.0, 2.0, 1.0, 1.5, 0.0)},
        inputs={"u": made("Ramp")},
    )

    positions: ArrayLike = parameter((0.0, 1.0), dimensions=(1,), tunable=False, doc="positions (n,)")
    table: ArrayLike = parameter((0.0, 1.0), dimensions=(1,), doc="values there (n,)")
    method: str = parameter("linear", choices=METHODS, doc="what to do between the points")
    extrapolation: str = parameter("clip", choices=EXTRAPOLATIONS, doc="what to do beyond the ends")
    zero_crossing: bool = zero_crossing_parameter()

    def check(self) -> None:
        rising("LookupTable1D", "positions", self.positions, *shape_of(self.table))

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the position"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the value"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": inputs["u"]}

    def inputs_of_the_run(self) -> tuple[Parameter, ...]:
        return with_positions(self, self._is_long(), "positions")

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        located = bool(self._borders())
        return (State("cell", inputs["u"], "how many borders are at or below u"),) if located else ()

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        if not self._borders():
            return ()
        up = Guard("up", inputs["u"], "u reaches the next border", 1)
        return (up, Guard("down", inputs["u"], "u falls below the border", -1))

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        points, located = self._points(), bool(self._borders())
        if self._is_long():
            cell = x["cell"] if located else self._cell(u["u"], p)
            return {"y": by_element([u["u"], cell], self._reader(p))}

        def value(position: SX, *cell: SX) -> SX:
            found = weights(position, points, self.method, self.extrapolation, *cell)
            return contract(p["table"], (len(points),), [found])

        return {"y": by_element([u["u"], x["cell"]] if located else [u["u"]], value)}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        borders = self._borders()
        if not borders:
            return {}
        if self._is_long():
            long = Borders(p["positions"], self.method, self.extrapolation)
            ends = [u["u"], x["cell"]]
            up, down = by_element(ends, long.to_next), by_element(ends, long.to_last)
            return {"up": up + JUST, "down": down + JUST}

        def distance(ends: list[float]) -> Callable[..., SX]:
            def beyond(cell: SX, position: SX) -> SX:
                parts = (if_else(cell == float(k), position - end + JUST, 0.0) for k, end in enumerate(ends))
                return sum(parts, SX(0.0))

            return beyond

        # No border beyond the last: nothing is as far away as can be.
        up, down = distance([*borders, math.inf]), distance([-math.inf, *borders])
        place = [x["cell"], u["u"]]
        return {"up": by_element(place, up), "down": by_element(place, down)}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"cell": self._cell(u["u"], p)} if self._borders() else {}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        if not self._borders():
            return {}
        cell = self._cell(u["u"], p)
        down = if_else(e["down"] < 0.0, fmin(cell, x["cell"] - 1.0), x["cell"])
        return {"cell": if_else(e["up"] > 0.0, fmax(cell, x["cell"] + 1.0), down)}

    def _points(self) -> list[float]:
        return [float(value) for value in np.ravel(cast("Any", self.positions))]

    def _borders(self) -> list[float]:
        """Where an event happens."""
        return borders(self._points(), self.method, self.extrapolation) if self.zero_crossing else []

    def _is_long(self) -> bool:
        return is_long(shape_of(self.table)[0], self.method)

    def _reader(self, p: Signals) -> Callable[[SX, SX], SX]:
        """The value at a position in a cell of a long table."""
        positions, table = p["positions"], p["table"]
        n = positions.numel()

        def value(u: SX, cell: SX) -> SX:
            if self.method == "flat":
                return read_entry(table, cell)
            if self.extrapolation == "linear":
                return line(u, positions, cell, lambda k: read_entry(table, k))
            inside = if_else(cell == 0.0, positions[0], if_else(cell == float(n), positions[n - 1], u))
            interval = fmin(fmax(cell, 1.0), n - 1.0) - 1.0
            return line(inside, positions, interval, lambda k: read_entry(table, k))

        return value

    def _cell(self, u: SX, p: Signals) -> SX:
        if self._is_long():
            long = Borders(p["positions"], self.method, self.extrapolation)
            return by_element([u], long.at_or_below)
        return sum((u >= border for border in self._borders()), SX.zeros(*u.shape))


@dataclass(frozen=True, kw_only=True)
class LookupTable2D(Block):
    """A surface over given points: y = table(u1, u2), rows along u1 and columns along u2."""

    family: ClassVar[str] = "lookup"
    title: ClassVar[str] = "2-D Lookup Table"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The table is crossed along its first axis while the second swings.",
        parameters={
            "positions1": (0.0, 5.0, 10.0),
            "positions2": (-1.0, 1.0),
            "table": ((0.0, 1.0), (2.0, 4.0), (1.0, 3.0)),
        },
        inputs={"u1": made("Ramp"), "u2": made("SineWave", frequency=2.0)},
    )

    positions1: ArrayLike = parameter((0.0, 1.0), dimensions=(1,), tunable=False, doc="positions of rows")
    positions2: ArrayLike = parameter((0.0, 1.0), dimensions=(1,), tunable=False, doc="and of columns")
    table: ArrayLike = parameter(((0.0, 1.0), (1.0, 2.0)), dimensions=(2,), doc="values (rows, columns)")
    method: str = parameter("linear", choices=METHODS, doc="what to do between the points")
    extrapolation: str = parameter("clip", choices=EXTRAPOLATIONS, doc="what to do beyond the ends")

    def check(self) -> None:
        rows, columns = shape_of(self.table)
        rising("LookupTable2D", "positions1", self.positions1, rows)
        rising("LookupTable2D", "positions2", self.positions2, columns)

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u1", "the position along the rows"), Port("u2", "the position along the columns"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the value"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast(inputs)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        points = (self.positions1, self.positions2)
        axes = [[float(value) for value in np.ravel(cast("Any", axis))] for axis in points]
        return {"y": _look_up([*u.values()], axes, p["table"], self.method, self.extrapolation)}


@dataclass(frozen=True, kw_only=True)
class LookupTableND(Block):
    """A table of one to four axes: y = table(u1, u2, …), one input for each axis.

    ``positions`` holds the positions of the first axis, then those of the second, and so on: as many
    numbers as the table has entries along each.
    """

    family: ClassVar[str] = "lookup"
    title: ClassVar[str] = "n-D Lookup Table"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A table of two axes, smooth by cubic splines, crossed along the first.",
        parameters={
            "positions": (0.0, 3.0, 6.0, 10.0, 0.0, 1.0, 2.0, 3.0),
            "table": ((0.0, 1.0, 1.0, 0.0), (2.0, 3.0, 3.0, 2.0), (1.0, 2.0, 2.0, 1.0), (0.0, 1.0, 1.0, 0.0)),
            "method": "cubic",
        },
        inputs={"u1": made("Ramp"), "u2": made("Constant", value=1.5)},
    )

    positions: ArrayLike = parameter(
        (0.0, 1.0, 0.0, 1.0), dimensions=(1,), tunable=False, doc="positions, axis after axis, rising in each"
    )
    table: ArrayLike = parameter(((0.0, 1.0), (1.0, 2.0)), dimensions=(1, 2, 3, 4), doc="values")
    method: str = parameter("linear", choices=METHODS, doc="what to do between the points")
    extrapolation: str = parameter("clip", choices=EXTRAPOLATIONS, doc="what to do beyond the ends")

    def check(self) -> None:
        shape, count = shape_of(self.table), shape_of(self.positions)[0]
        if count != sum(shape):
            raise InputError(
                f"there are {count} break points for a table of shape {shape}",
                where="LookupTableND",
                allowed=f"{sum(shape)}: {' + '.join(map(str, shape))}",
                fix="give the positions of every axis, one axis after the other",
            )
        for k, axis in enumerate(self._axes(), 1):
            rising("LookupTableND", f"axis {k} of positions", axis, shape[k - 1])

    def input_ports(self) -> tuple[Port, ...]:
        return numbered_ports("u", len(shape_of(self.table)), "position along axis")

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the value"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast(inputs)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": _look_up([*u.values()], self._axes(), p["table"], self.method, self.extrapolation)}

    def _axes(self) -> list[list[float]]:
        points = [float(value) for value in np.ravel(cast("Any", self.positions))]
        ends = np.cumsum(shape_of(self.table)).tolist()
        return [points[start:end] for start, end in zip([0, *ends], ends)]


@dataclass(frozen=True, kw_only=True)
class DirectLookup(Block):
    """The entry of a table at given indices, which count from 0: y = table[u1, u2, …].

    An index is cut down to an integer and held inside the table.
    """

    family: ClassVar[str] = "lookup"
    title: ClassVar[str] = "Direct Lookup Table"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A counter reads the table entry by entry.",
        parameters={"table": (0.5, 2.0, 1.0, -1.0)},
        inputs={"u": made("CounterLimited", upper=3)},
    )

    table: ArrayLike = parameter((0.0, 1.0), dimensions=(1, 2, 3, 4), doc="the entries")

    def input_ports(self) -> tuple[Port, ...]:
        return numbered_ports("u", len(shape_of(self.table)), "index along axis")

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the entry"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast(inputs)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        shape = shape_of(self.table)

        def entry(*indices: SX) -> SX:
            axes = [cells(u, [float(k) for k in range(1, n)]) for u, n in zip(indices, shape)]
            return contract(p["table"], shape, axes)

        return {"y": by_element([*u.values()], entry)}


@dataclass(frozen=True, kw_only=True)
class Prelookup(Block):
    """Where a position lies between break points: u = b(k) + f (b(k+1) - b(k)), index k from 0, fraction f.

    Several Interpolation Using Prelookup blocks can share it. The index never passes the last interval, so
    that f is 1 at the last break point; beyond the ends ``clip`` holds f at 0 or 1, ``linear`` lets it go on.
    """

    family: ClassVar[str] = "lookup"
    title: ClassVar[str] = "Prelookup"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="In which interval of the positions the input lies, and which part of it has been passed.",
        parameters={"positions": (0.0, 2.0, 5.0, 10.0)},
        inputs={"u": made("Ramp")},
        shown=("k", "f"),
    )

    positions: ArrayLike = parameter((0.0, 1.0), dimensions=(1,), tunable=False, doc="positions (n,)")
    extrapolation: str = parameter("clip", choices=EXTRAPOLATIONS, doc="what to do beyond the ends")

    def check(self) -> None:
        rising("Prelookup", "positions", self.positions, *shape_of(self.positions))

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the position"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("k", "index of the interval, from 0"), Port("f", "fraction of the interval, 0 to 1"))

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"k": inputs["u"], "f": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        points = [float(value) for value in np.ravel(cast("Any", self.positions))]

        def index(u: SX) -> SX:
            return sum((u >= point for point in points[1:-1]), SX(0.0))

        def fraction(u: SX) -> SX:
            inside = fmin(fmax(u, points[0]), points[-1]) if self.extrapolation == "clip" else u
            found = SX(0.0)
            for k, here in enumerate(cells(u, points[1:-1])):
                part = (inside - points[k]) / (points[k + 1] - points[k])
                found = found + if_else(here, part, 0.0)
            return found

        return {"k": by_element([u["u"]], index), "f": by_element([u["u"]], fraction)}


@dataclass(frozen=True, kw_only=True)
class InterpolationUsingPrelookup(Block):
    """Linear interpolation at known intervals: y = (1 - f) table[k] + f table[k + 1], and so along each axis.

    Indices and fractions come from Prelookup blocks, one pair for each axis of the table. An index is cut
    down to an integer and held inside the table.
    """

    family: ClassVar[str] = "lookup"
    title: ClassVar[str] = "Interpolation Using Prelookup"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The curve whose interval and fraction a Prelookup has found.",
        parameters={"table": (0.0, 3.0, 1.0, 2.0)},
        inputs={
            "k1": made("Prelookup", positions=(0.0, 2.0, 5.0, 10.0))
            .named("prelookup")
            .by(u=made("Ramp"))
            .at("k"),
            "f1": made("Prelookup", positions=(0.0, 2.0, 5.0, 10.0)).named("prelookup").at("f"),
        },
    )

    table: ArrayLike = parameter((0.0, 1.0), dimensions=(1, 2, 3, 4), doc="values, two or more an axis")

    def check(self) -> None:
        if min(shape_of(self.table)) < 2:
            raise InputError(
                f"the table has shape {shape_of(self.table)}",
                where="InterpolationUsingPrelookup",
                allowed="two or more entries along each axis",
                fix="leave out the axis of one entry",
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

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast(inputs)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        shape = shape_of(self.table)

        def value(*pairs: SX) -> SX:
            axes = [_at(k, f, n) for k, f, n in zip(pairs[::2], pairs[1::2], shape)]
            return contract(p["table"], shape, axes)

        return {"y": by_element([*u.values()], value)}


@dataclass(frozen=True, kw_only=True)
class LookupTableDynamic(Block):
    """A curve whose points are signals: y = table(u), straight between them, held beyond the ends.

    The positions must rise at every instant; where two of them are equal the value is not finite.
    """

    family: ClassVar[str] = "lookup"
    title: ClassVar[str] = "Lookup Table Dynamic"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A curve whose values grow while it is read.",
        inputs={
            "u": made("SineWave", bias=1.0),
            "positions": made("Constant", value=(0.0, 1.0, 2.0)),
            "values": made("Ramp", slope=(0.0, 0.2, 0.1)),
        },
        shown=("u", "y"),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (
            Port("u", "where to look"),
            Port("positions", "positions (n,), rising"),
            Port("values", "values there (n,)"),
        )

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the value"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        positions, values = inputs["positions"], inputs["values"]
        if positions != values or len(positions) != 1 or math.prod(positions) < 2:
            raise InputError(
                f"the positions have shape {positions} and the values {values}",
                allowed="two vectors of one length, of at least 2",
                fix="change the width of one of the signals",
            )
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        n = u["positions"].numel()
        points = [u["positions"][k] for k in range(n)]

        def value(position: SX) -> SX:
            inside = fmin(fmax(position, points[0]), points[-1])
            return contract(u["values"], (n,), [linear_weights(inside, points)])

        return {"y": by_element([u["u"]], value)}


def _look_up(inputs: list[SX], axes: list[list[float]], table: SX, method: str, extrapolation: str) -> SX:
    shape: Shape = tuple(len(axis) for axis in axes)

    def value(*positions: SX) -> SX:
        found = [weights(u, axis, method, extrapolation) for u, axis in zip(positions, axes)]
        return contract(table, shape, found)

    return by_element(inputs, value)


def _at(k: SX, f: SX, n: int) -> list[SX]:
    """Weights of n entries for an index and a fraction."""
    place = fmin(fmax(floor(k), 0.0), float(n - 2))
    return [
        if_else(place == float(i), 1.0 - f, 0.0) + if_else(place == float(i - 1), f, 0.0) for i in range(n)
    ]

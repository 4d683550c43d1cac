"""Lookup tables: constant positions with tunable entries, and positions that are signals.

The blocks look up each element of their inputs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from casadi import SX
from numpy.typing import ArrayLike

from armblocks.blocks.interpolation import EXTRAPOLATIONS, METHODS
from armblocks.blocks.long_tables import is_long
from armblocks.blocks.switching import zero_crossing_parameter
from armblocks.blocks.table_axes import Axes, BlockWithAxes, ascending_positions, axis, axis_ports, numbers_of
from armblocks.diagram import (
    Block,
    Guard,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    driver,
    parameter,
    shape_of,
)
from armblocks.diagram.signs import TABLE, FaceSign, Words
from armblocks.errors import InputError, counted


@dataclass(frozen=True, kw_only=True)
class LookupTable1D(BlockWithAxes):
    """A curve through given points: y = table(u), interpolated by the chosen method.

    Methods between the points:

    - ``linear``: a straight line.
    - ``cubic``: the spline with not-a-knot ends (MATLAB's ``spline``).
    - ``flat``: the entry at the largest position below or equal to u.
    - ``nearest``: the entry at the nearest position.

    Beyond the ends, ``clip`` gives the value at the end and ``linear`` extrapolates along the tangent.
    """

    title: ClassVar[str] = "1-D Lookup Table"
    sign: ClassVar[FaceSign] = TABLE
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A curve through five points: linear interpolation, constant beyond the ends.",
        parameters={"positions": (1.0, 3.0, 5.0, 6.0, 8.0), "table": (0.0, 2.0, 1.0, 1.5, 0.0)},
        inputs={"u": driver("Ramp")},
    )

    positions: ArrayLike = parameter((0.0, 1.0), dimensions=(1,), tunable=False, doc="positions (n,)")
    table: ArrayLike = parameter((0.0, 1.0), dimensions=(1,), doc="values at the positions (n,)")
    method: str = parameter("linear", choices=METHODS, doc="interpolation method")
    extrapolation: str = parameter("clip", choices=EXTRAPOLATIONS, doc="extrapolation method")
    zero_crossing: bool = zero_crossing_parameter()

    def check(self) -> None:
        ascending_positions("LookupTable1D", "positions", self.positions, *shape_of(self.table))

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the position"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the value"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": self._value(x, u, p)}

    def _is_long(self) -> bool:
        return is_long(shape_of(self.table), self.method)

    def _positions_by_input(self) -> Mapping[str, list[float]]:
        return {"u": numbers_of(self, "positions")}

    def _run_positions(self, p: Signals) -> Mapping[str, SX]:
        return {"u": p["positions"]}


@dataclass(frozen=True, kw_only=True)
class LookupTable2D(BlockWithAxes):
    """A surface through given points: y = table(u1, u2), rows along u1 and columns along u2.

    Interpolation and extrapolation methods are the same as in the 1-D Lookup Table.
    """

    title: ClassVar[str] = "2-D Lookup Table"
    sign: ClassVar[FaceSign] = Words("T(u₁, u₂)")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The first input crosses the table while the second input oscillates.",
        parameters={
            "positions1": (0.0, 5.0, 10.0),
            "positions2": (-1.0, 1.0),
            "table": ((0.0, 1.0), (2.0, 4.0), (1.0, 3.0)),
        },
        inputs={"u1": driver("Ramp"), "u2": driver("SineWave", frequency=2.0)},
    )

    positions1: ArrayLike = parameter(
        (0.0, 1.0), dimensions=(1,), tunable=False, doc="positions of the rows (m,)"
    )
    positions2: ArrayLike = parameter(
        (0.0, 1.0), dimensions=(1,), tunable=False, doc="positions of the columns (n,)"
    )
    table: ArrayLike = parameter(((0.0, 1.0), (1.0, 2.0)), dimensions=(2,), doc="values (m, n)")
    method: str = parameter("linear", choices=METHODS, doc="interpolation method")
    extrapolation: str = parameter("clip", choices=EXTRAPOLATIONS, doc="extrapolation method")
    zero_crossing: bool = zero_crossing_parameter()

    def check(self) -> None:
        rows, columns = shape_of(self.table)
        ascending_positions("LookupTable2D", "positions1", self.positions1, rows)
        ascending_positions("LookupTable2D", "positions2", self.positions2, columns)

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u1", "position along axis 1, rows"), Port("u2", "position along axis 2, columns"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the value"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": self._value(x, u, p)}

    def _is_long(self) -> bool:
        return is_long(shape_of(self.table), self.method)

    def _positions_by_input(self) -> Mapping[str, list[float]]:
        return {"u1": numbers_of(self, "positions1"), "u2": numbers_of(self, "positions2")}

    def _run_positions(self, p: Signals) -> Mapping[str, SX]:
        return {"u1": p["positions1"], "u2": p["positions2"]}


@dataclass(frozen=True, kw_only=True)
class LookupTableND(BlockWithAxes):
    """A table of one to four axes: y = table(u1, u2, …), one input for each axis.

    ``positions`` lists the positions of the first axis, then of the second axis, and so on. Each axis has as
    many positions as the table has entries along it. Interpolation and extrapolation methods are the same as
    in the 1-D Lookup Table.
    """

    title: ClassVar[str] = "n-D Lookup Table"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A table with two axes and cubic splines; the position moves along the first axis.",
        parameters={
            "positions": (0.0, 3.0, 6.0, 10.0, 0.0, 1.0, 2.0, 3.0),
            "table": ((0.0, 1.0, 1.0, 0.0), (2.0, 3.0, 3.0, 2.0), (1.0, 2.0, 2.0, 1.0), (0.0, 1.0, 1.0, 0.0)),
            "method": "cubic",
        },
        inputs={"u1": driver("Ramp"), "u2": driver("Constant", value=1.5)},
    )

    positions: ArrayLike = parameter(
        (0.0, 1.0, 0.0, 1.0),
        dimensions=(1,),
        tunable=False,
        doc="positions, axis after axis, ascending in each",
    )
    table: ArrayLike = parameter(((0.0, 1.0), (1.0, 2.0)), dimensions=(1, 2, 3, 4), doc="values")
    method: str = parameter("linear", choices=METHODS, doc="interpolation method")
    extrapolation: str = parameter("clip", choices=EXTRAPOLATIONS, doc="extrapolation method")
    zero_crossing: bool = zero_crossing_parameter()

    def check(self) -> None:
        shape, count = shape_of(self.table), shape_of(self.positions)[0]
        if count != sum(shape):
            raise InputError(
                f"{counted(count, 'position is', 'positions are')} given for a table of shape {shape}",
                where="LookupTableND",
                allowed=f"{sum(shape)}: {' + '.join(map(str, shape))}",
                fix="list the positions of all axes, axis after axis",
            )
        for k, axis_positions in enumerate(self._positions_by_input().values(), 1):
            ascending_positions("LookupTableND", f"axis {k} of positions", axis_positions, shape[k - 1])

    def input_ports(self) -> tuple[Port, ...]:
        return axis_ports("position", self.table)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the value"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": self._value(x, u, p)}

    def _is_long(self) -> bool:
        return is_long(shape_of(self.table), self.method)

    def _positions_by_input(self) -> Mapping[str, list[float]]:
        points = numbers_of(self, "positions")
        return {port: points[part] for port, part in self._slices().items()}

    def _run_positions(self, p: Signals) -> Mapping[str, SX]:
        return {port: p["positions"][part] for port, part in self._slices().items()}

    def _slices(self) -> dict[str, slice]:
        """The slice of the positions for each input."""
        ends = np.cumsum(shape_of(self.table)).tolist()
        ports = (port.name for port in self.input_ports())
        return {port: slice(start, end) for port, start, end in zip(ports, [0, *ends], ends)}


@dataclass(frozen=True, kw_only=True)
class LookupTableDynamic(Block):
    """A curve whose points are signals: y = table(u), linear between the points, constant beyond the ends.

    The positions must be strictly ascending at all times. The block does not check this; equal positions may
    give NaN.
    """

    following_modes: ClassVar[bool] = True
    title: ClassVar[str] = "Lookup Table Dynamic"
    sign: ClassVar[FaceSign] = TABLE
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A curve whose values grow during the run.",
        inputs={
            "u": driver("SineWave", bias=1.0),
            "positions": driver("Constant", value=(0.0, 1.0, 2.0)),
            "values": driver("Ramp", slope=(0.0, 0.2, 0.1)),
        },
        shown=("u", "y"),
    )

    zero_crossing: bool = zero_crossing_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (
            Port("u", "position"),
            Port("positions", "positions (n,), ascending"),
            Port("values", "values at the positions (n,)"),
        )

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the value"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        positions, values = inputs["positions"], inputs["values"]
        if positions != values or len(positions) != 1 or math.prod(positions) < 2:
            raise InputError(
                f"the positions have shape {positions} and the values {values}",
                allowed="two vectors of the same length, at least 2",
                fix="change the width of one of the signals",
            )
        return {"y": inputs["u"]}

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return self._axes(math.prod(inputs["positions"])).modes(inputs)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return self._axes(math.prod(inputs["positions"])).guards(inputs)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": self._axes(u["positions"]).value(u["values"], u["values"].shape[:1], x, u)}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return self._axes(u["positions"]).guard_values(x, u)

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return self._axes(u["positions"]).mode_values(x, u)

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return self._axes(u["positions"]).contradictions(x, u)

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return self._axes(u["positions"]).resets(x, u, e)

    def _axes(self, positions: SX | int) -> Axes:
        """The axis with these positions. An integer gives an axis with as many placeholder positions."""
        is_count = isinstance(positions, int)
        points = range(positions) if is_count else (positions[k] for k in range(positions.numel()))
        return Axes({"u": axis([*points], "linear", "clip")}, self.zero_crossing)

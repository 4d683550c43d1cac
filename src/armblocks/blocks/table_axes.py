"""The axes of a lookup table: cells, and events at which a position enters another cell.

Along each axis the *boundaries* are the positions at which the value or its derivative jumps. *Cell* k is
above k boundaries. With event location, the cell is a mode, so that the table is smooth within a solver step.
The points of short tables are part of the equations; long tables are read by index (see :mod:`.long_tables`).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, ClassVar, Protocol, cast

import numpy as np
from casadi import SX, fmax, fmin, if_else, reshape, vertcat
from numpy.typing import ArrayLike, NDArray

from armblocks.blocks.elementwise import numbered_ports
from armblocks.blocks.interpolation import boundaries, contract, weights
from armblocks.blocks.long_tables import inputs_with, is_spline
from armblocks.blocks.splines import spline_corners, with_derivatives
from armblocks.blocks.switching import THRESHOLD_OFFSET, beyond, cell_of
from armblocks.diagram import Block, Guard, Parameter, Port, Shapes, Signals, State, shape_of
from armblocks.equations import Shape, flatten, last_at_or_below, read_entry
from armblocks.errors import InputError, counted

Array = NDArray[np.float64]


def ascending_positions(where: str, name: str, points: ArrayLike, count: int) -> list[float]:
    """Positions as floats; raises ``InputError`` unless they are ascending and fit the table."""
    values = [float(value) for value in np.ravel(cast("Any", points))]
    if len(values) < 2 or any(right <= left for left, right in pairwise(values)):
        raise InputError(
            f"{name} is {values}"[:90],
            where=where,
            allowed="at least two numbers in strictly ascending order",
            fix="sort the numbers and remove duplicates",
        )
    if len(values) != count:
        raise InputError(
            f"{name} has {counted(len(values), 'position')} for {counted(count, 'entry', 'entries')} of the "
            "table",
            where=where,
            allowed="one for each entry along that axis",
            fix="correct the table or the positions",
        )
    return values


def axis_ports(quantity: str, table: ArrayLike) -> tuple[Port, ...]:
    """The ports ``u`` or ``u1, u2, …`` for a quantity along each axis of a table."""
    count = len(shape_of(table))
    return numbered_ports("u", count, f"{quantity} along {'axis' if count > 1 else 'the axis'}")


def numbers_of(block: Block, name: str) -> list[float]:
    """The entries of an array parameter as a flat list of numbers."""
    return [float(value) for value in np.ravel(cast("Any", block.parameter_value(name)))]


def elementwise(inputs: Sequence[SX], function: Callable[..., SX]) -> SX:
    """A function of scalars applied to all elements; scalars are broadcast."""
    largest = max(inputs, key=lambda value: value.numel())
    size = largest.numel()
    columns = [[value[k if value.numel() > 1 else 0] for k in range(size)] for value in inputs]
    return reshape(vertcat(*[function(*elements) for elements in zip(*columns)]), *largest.shape)


class Axis(Protocol):
    """One axis, for scalar positions u and cells."""

    @property
    def has_boundaries(self) -> bool:
        """Whether entering another cell of the axis is an event."""
        ...

    def cell(self, u: SX) -> SX:
        """The number of boundaries at or below u."""
        ...

    def above_upper_boundary(self, u: SX, cell: SX) -> SX:
        """u minus the upper boundary of its cell; -inf without an upper boundary."""
        ...

    def above_lower_boundary(self, u: SX, cell: SX) -> SX:
        """u minus the lower boundary of its cell; inf without a lower boundary."""
        ...


@dataclass(frozen=True, eq=False)
class ShortAxis:
    """An axis whose points are part of the equations, as numbers or as signals."""

    points: Sequence[float | SX]
    method: str
    extrapolation: str

    @property
    def boundaries(self) -> list[float | SX]:
        """The boundaries, ascending."""
        return list(boundaries(self.points, self.method, self.extrapolation))

    @property
    def has_boundaries(self) -> bool:
        return bool(self.boundaries)

    def cell(self, u: SX) -> SX:
        return sum((u >= boundary for boundary in self.boundaries), SX(0.0))

    def weights(self, u: SX, cell: SX | None = None) -> list[SX]:
        """The weight of every point."""
        return weights(u, self.points, self.method, self.extrapolation, cell)

    def above_upper_boundary(self, u: SX, cell: SX) -> SX:
        return _beyond([*self.boundaries, math.inf], u, cell)

    def above_lower_boundary(self, u: SX, cell: SX) -> SX:
        return _beyond([-math.inf, *self.boundaries], u, cell)


@dataclass(frozen=True, eq=False)
class LongAxis:
    """An axis whose points are searched and read by index, as inputs of the run."""

    points: SX
    method: str
    extrapolation: str

    @property
    def has_boundaries(self) -> bool:
        return True

    @property
    def _constant_outside(self) -> bool:
        return self.method == "linear" and self.extrapolation == "clip"

    @property
    def _count(self) -> int:
        """The number of boundaries."""
        n = self.points.numel()
        return n if self._constant_outside else n - 2 if self.method == "linear" else n - 1

    def cell(self, u: SX) -> SX:
        last = last_at_or_below(self.points, u)
        if self.method == "nearest":
            boundary = fmin(fmax(last, 0.0), self._count - 1.0)
            return if_else(
                last >= self._count, float(self._count), boundary + (u >= self._boundary(boundary))
            )
        return fmin(fmax(last + (1.0 if self._constant_outside else 0.0), 0.0), float(self._count))

    def above_upper_boundary(self, u: SX, cell: SX) -> SX:
        return if_else(cell < float(self._count), u - self._boundary(cell), -math.inf)

    def above_lower_boundary(self, u: SX, cell: SX) -> SX:
        return if_else(cell > 0.0, u - self._boundary(cell - 1.0), math.inf)

    def corners(self, u: SX, cell: SX) -> list[tuple[SX, SX]]:
        """Indices and weights of the points of a cell."""
        if self.method != "linear":
            return [(cell, SX(1.0))]
        n = self.points.numel()
        interval = fmin(fmax(cell, 1.0), n - 1.0) - 1.0 if self._constant_outside else cell
        begin, end = read_entry(self.points, interval), read_entry(self.points, interval + 1.0)
        if self._constant_outside:
            u = if_else(cell == 0.0, self.points[0], if_else(cell == float(n), self.points[n - 1], u))
        fraction = (u - begin) / (end - begin)
        return [(interval, 1.0 - fraction), (interval + 1.0, fraction)]

    def _boundary(self, number: SX) -> SX:
        """The position of a boundary; its index starts at 0 and is limited to valid values."""
        k = fmin(fmax(number, 0.0), self._count - 1.0)
        if self.method == "nearest":
            return (read_entry(self.points, k) + read_entry(self.points, k + 1.0)) / 2.0
        return read_entry(self.points, k if self._constant_outside else k + 1.0)


@dataclass(frozen=True, eq=False)
class SplineAxis:
    """An axis of a long cubic spline, whose table has alternating values and derivatives."""

    points: SX
    extrapolation: str

    @property
    def has_boundaries(self) -> bool:
        return self.extrapolation == "clip"

    def cell(self, u: SX) -> SX:
        return (u >= self._ends[0]) + (u >= self._ends[1])

    def above_upper_boundary(self, u: SX, cell: SX) -> SX:
        return _beyond([*self._ends, math.inf], u, cell)

    def above_lower_boundary(self, u: SX, cell: SX) -> SX:
        return _beyond([-math.inf, *self._ends], u, cell)

    def corners(self, u: SX, cell: SX) -> list[tuple[SX, SX]]:
        """Indices and weights of the values and derivatives of a cell."""
        return spline_corners(u, self.points, cell, straight=not self.has_boundaries)

    @property
    def _ends(self) -> list[SX]:
        return [self.points[0], self.points[self.points.numel() - 1]]


def _beyond(ends: Sequence[float | SX], u: SX, cell: SX) -> SX:
    """``u - ends[cell]``."""
    return sum((if_else(cell == float(k), u - end, 0.0) for k, end in enumerate(ends)), SX(0.0))


@dataclass(frozen=True, eq=False)
class Axes:
    """The axes of a table, by the names of the input ports for the positions along them.

    ``located``: whether the cells are modes. The block then has the modes ``cell`` or ``cell1``, ….
    """

    axes: Mapping[str, Axis]
    located: bool

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        """The cells."""
        doc = "number of boundaries at or below"
        return tuple(
            State(f"cell{k}", inputs[port], f"{doc} {port}") for port, k, _ in self._axes_with_modes()
        )

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        """The guards at both ends of each cell."""
        return tuple(
            guard
            for port, k, _ in self._axes_with_modes()
            for guard in (
                Guard(f"up{k}", inputs[port], f"{port} reaches the next boundary", 1),
                Guard(f"down{k}", inputs[port], f"{port} falls below the lower boundary", -1),
            )
        )

    def guard_values(self, x: Signals, u: Signals) -> Signals:
        """The distances of the inputs beyond both ends of their cells."""
        values = dict[str, SX]()
        for port, k, axis in self._axes_with_modes():
            position = [u[port], x[f"cell{k}"]]
            values[f"up{k}"] = elementwise(position, axis.above_upper_boundary) + THRESHOLD_OFFSET
            values[f"down{k}"] = elementwise(position, axis.above_lower_boundary) + THRESHOLD_OFFSET
        return values

    def mode_values(self, x: Signals, u: Signals) -> Signals:
        """The consistent cells for the present inputs."""
        guards = self.guard_values(x, u)
        return {
            f"cell{k}": cell_of(
                elementwise([u[port]], axis.cell), x[f"cell{k}"], guards, f"up{k}", f"down{k}"
            )
            for port, k, axis in self._axes_with_modes()
        }

    def contradictions(self, x: Signals, u: Signals) -> Signals:
        """Whether a position is outside its cell."""
        guards = self.guard_values(x, u)
        return {f"cell{k}": beyond(guards, f"up{k}", f"down{k}") for _, k, _ in self._axes_with_modes()}

    def cell(self, port: str, x: Signals, u: Signals) -> SX:
        """The cell along one axis: the mode, or computed from the present values."""
        modes = {mode_port: x[f"cell{k}"] for mode_port, k, _ in self._axes_with_modes()}
        return modes[port] if port in modes else elementwise([u[port]], self.axes[port].cell)

    def resets(self, x: Signals, u: Signals, e: Signals) -> Signals:
        """The cells after events: the next cell, or the cell to which u has jumped."""
        cells = dict[str, SX]()
        for port, k, axis in self._axes_with_modes():
            target, cell = elementwise([u[port]], axis.cell), x[f"cell{k}"]
            down = if_else(e[f"down{k}"] < 0.0, fmin(target, cell - 1.0), cell)
            cells[f"cell{k}"] = if_else(e[f"up{k}"] > 0.0, fmax(target, cell + 1.0), down)
        return cells

    def value(self, table: SX, shape: Shape, x: Signals, u: Signals) -> SX:
        """The output of a table of this shape, element by element."""
        cells = {port: x[f"cell{k}"] for port, k, _ in self._axes_with_modes()}
        for port, axis in self.axes.items():
            if not isinstance(axis, ShortAxis) and port not in cells:
                cells[port] = elementwise([u[port]], axis.cell)
        entries = flatten(table, shape)

        def at(*point: SX) -> SX:
            positions, cell_by_port = dict(zip(self.axes, point)), dict(zip(cells, point[len(self.axes) :]))
            corners = list[list[tuple[SX, SX]]]()
            weights_by_axis = list[list[SX]]()
            for port, axis in self.axes.items():
                if isinstance(axis, LongAxis | SplineAxis):
                    corners.append(axis.corners(positions[port], cell_by_port[port]))
                elif isinstance(axis, ShortAxis):
                    weights_by_axis.append(axis.weights(positions[port], cell_by_port.get(port)))
            return read(entries, shape, corners) if corners else contract(table, shape, weights_by_axis)

        return elementwise([*(u[port] for port in self.axes), *cells.values()], at)

    def _axes_with_modes(self) -> list[tuple[str, str, Axis]]:
        """Port, name suffix and axis, for axes whose cells are modes."""
        many = len(self.axes) > 1
        numbered = (
            (port, str(k) if many else "", axis) for k, (port, axis) in enumerate(self.axes.items(), 1)
        )
        return [entry for entry in numbered if self.located and entry[2].has_boundaries]


def axis(points: SX | Sequence[float | SX], method: str, extrapolation: str) -> Axis:
    """An axis. It is long if its points are a column of symbols (a run input)."""
    if isinstance(points, SX):
        return LongAxis(points, method, extrapolation)
    return ShortAxis(points, method, extrapolation)


def read(entries: SX, shape: Shape, corners: Sequence[Sequence[tuple[SX, SX]]]) -> SX:
    """The weighted sum of the entries of a flat table at the corners of a cell, read by index."""
    strides = [math.prod(shape[k + 1 :]) for k in range(len(shape))]
    total = SX(0.0)
    for corner in itertools.product(*corners):
        index = sum((float(stride) * entry for stride, (entry, _) in zip(strides, corner)), SX(0.0))
        weight = math.prod((weight for _, weight in corner), start=SX(1.0))
        total = total + weight * read_entry(entries, index)
    return total


@dataclass(frozen=True, kw_only=True)
class BlockWithAxes(Block):
    """A block with a lookup table. The cells are its modes, and a change of the cell is an event."""

    following_modes: ClassVar[bool] = True

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return self._axes().modes(inputs)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return self._axes().guards(inputs)

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return self._axes(p).guard_values(x, u)

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return self._axes(p).mode_values(x, u)

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return self._axes(p).contradictions(x, u)

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return self._axes(p).resets(x, u, e)

    def inputs_of_the_run(self) -> tuple[Parameter, ...]:
        return inputs_with(self, self._is_long(), "table", *self._positions())

    def parameters_behind_inputs(self) -> tuple[str, ...]:
        return ("table", *self._positions()) if is_spline(self, self._is_long()) else ()

    @property
    def knots(self) -> Array:
        """The positions of a long cubic spline, axis after axis."""
        return np.concatenate([np.asarray(points) for points in self._positions_by_input().values()])

    @property
    def spline(self) -> Array:
        """The values and derivatives of a long cubic spline, see :func:`.splines.with_derivatives`."""
        axes = tuple(tuple(points) for points in self._positions_by_input().values())
        return with_derivatives(axes, self.parameter_value("table"))

    @classmethod
    def _positions(cls) -> tuple[str, ...]:
        """The parameters that contain positions."""
        return tuple(rule.name for rule in cls.parameters() if rule.name.startswith("positions"))

    def _positions_by_input(self) -> Mapping[str, list[float]]:
        """The positions along the axis of each input."""
        raise NotImplementedError

    def _run_positions(self, p: Signals) -> Mapping[str, SX]:
        """The positions as run inputs."""
        raise NotImplementedError

    def _is_long(self) -> bool:
        """Whether the table is read by index."""
        raise NotImplementedError

    @property
    def _method(self) -> str:
        return str(self.parameter_value("method"))

    def _axes(self, p: Signals | None = None) -> Axes:
        """The axis of each input; the positions of a long table are run inputs."""
        extrapolation = str(self.parameter_value("extrapolation"))
        axes = dict[str, Axis]()
        if p and is_spline(self, self._is_long()):
            first = 0
            for port, points in self._positions_by_input().items():
                axes[port] = SplineAxis(p["knots"][first : first + len(points)], extrapolation)
                first += len(points)
        else:
            positions = self._run_positions(p) if p and self._is_long() else self._positions_by_input()
            axes = {port: axis(points, self._method, extrapolation) for port, points in positions.items()}
        return Axes(axes, bool(self.parameter_value("zero_crossing")))

    def _value(self, x: Signals, u: Signals, p: Signals) -> SX:
        """The output of the table, element by element."""
        table = "spline" if is_spline(self, self._is_long()) else "table"
        return self._axes(p).value(p[table], shape_of(self.parameter_value(table)), x, u)

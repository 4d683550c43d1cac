"""Playback of measurements from tables of any length. Only the rows around the present time are read."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from casadi import SX, if_else, vertcat

from armblocks.blocks.table_rows import BlockWithRows
from armblocks.diagram import (
    ParameterKind,
    Port,
    Signals,
    TimeTable,
    WorkedExample,
    parameter,
)
from armblocks.diagram.signs import FaceSign, graph


@dataclass(frozen=True, kw_only=True)
class FromFile(BlockWithRows):
    """A signal from the rows (time, values) of a file: y = the values at time t, interpolated or held.

    ``data`` is the table:

    - In the file of a diagram it names a CSV, NPZ, MAT or Parquet file, relative to the diagram's file, and
      the columns of the times and of the values.
    - In the studio the file is chosen in the block's dialog, with a preview, or dropped on the sheet.
    - In Python it is the result of ``load_table``, or rows (time, value, …).

    Each row is an event, so that no step passes over a row. The cost of a row does not depend on the length
    of the table.

    Before the first row and after the last row, the values of that row are held; or, with ``zero``, the
    signal is 0 before the first row and from the time of the last row on. Values are not converted: the
    signal has the unit in its header, such as ``q1 [deg]``.
    """

    title: ClassVar[str] = "From File"
    sign: ClassVar[FaceSign] = graph((0, 0.2), (0.3, 0.9), (0.6, 0.4), (1, 0.7))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Five rows with linear interpolation.",
        parameters={"data": ((0.0, 0.0), (1.0, 2.0), (2.5, -1.0), (4.0, 1.0), (5.0, 1.0))},
    )

    data: Any = parameter(
        ((0.0, 0.0), (1.0, 1.0)),
        kind=ParameterKind.TABLE,
        of_type=TimeTable,
        tunable=True,
        doc="rows of a time (s) and m values",
    )
    method: str = parameter("linear", choices=("linear", "flat"), doc="interpolation method")
    outside: str = parameter("hold", choices=("hold", "zero"), doc="extrapolation method")

    def output_ports(self) -> tuple[Port, ...]:
        _, width = self._size
        table: TimeTable = self.data
        units = set(table.units)
        return (
            Port(
                "y",
                "the values",
                unit=units.pop() if len(units) == 1 else "",
                shape=(width - 1,) if width > 2 else (),
                names=table.names if width > 2 else (),
            ),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        table, width = self._rows(p), self._size[1]
        row, between = table.present(x["row"]), table.is_between(x["row"])
        values = vertcat(*(table.entry(row, k) for k in range(1, width)))
        if self.method == "linear":
            next_row = table.present(row + 1.0)
            begin, end = table.entry(row, 0), table.entry(next_row, 0)
            fraction = if_else(between, (t - begin) / if_else(between, end - begin, 1.0), 0.0)
            next_values = vertcat(*(table.entry(next_row, k) for k in range(1, width)))
            values = (1.0 - fraction) * values + fraction * next_values
        if self.outside == "zero":
            values = if_else(between, values, 0.0)
        return {"y": values}

"""Measurements played back: tables of any length, of which only the row of the moment is read."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from casadi import SX, fmax, fmin, if_else, logic_and, logic_or, vertcat

from armblocks.blocks.switching import counted, since
from armblocks.diagram import (
    Block,
    Guard,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    State,
    TimeTable,
    WorkedExample,
    parameter,
)
from armblocks.diagram.signs import FaceSign, graph
from armblocks.equations import last_at_or_below, read_entry


@dataclass(frozen=True, kw_only=True)
class FromFile(Block):
    """What a table holds: y = the values of the rows around t, between them straight lines or the last row.

    In a diagram's file ``data`` is the path of a CSV, NPZ, MAT or Parquet file beside it; in Python what
    ``load_table`` gives, or rows (time, value, …). Each row is an event, so that no step passes over one,
    and costs no more in a long table than in a short one. Before and after the table the first and the last
    row are held, or the signal is ``zero`` (from the last instant on).
    """

    memoryless: ClassVar[bool] = True
    title: ClassVar[str] = "From File"
    sign: ClassVar[FaceSign] = graph((0, 0.2), (0.3, 0.9), (0.6, 0.4), (1, 0.7))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Five rows, with straight lines between them.",
        parameters={"data": ((0.0, 0.0), (1.0, 2.0), (2.5, -1.0), (4.0, 1.0), (5.0, 1.0))},
    )

    data: Any = parameter(
        ((0.0, 0.0), (1.0, 1.0)),
        kind=ParameterKind.TABLE,
        of_type=TimeTable,
        tunable=True,
        doc="rows of an instant (s) and m values",
    )
    method: str = parameter("linear", choices=("linear", "flat"), doc="what to do between two rows")
    outside: str = parameter("hold", choices=("hold", "zero"), doc="what to do before and after")

    def output_ports(self) -> tuple[Port, ...]:
        _, width = self._size
        return (Port("y", "the values", shape=(width - 1,) if width > 2 else ()),)

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("row", (), "the last row that has passed, from 0; -1 before the first"),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return (Guard("next", (), "t - the instant of the next row", 1),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        count, width = self._size
        here = fmin(fmax(x["row"], 0.0), count - 1.0)
        between = logic_and(x["row"] >= 0.0, x["row"] < count - 1.0)
        now = vertcat(*(self._entry(p, here, k) for k in range(1, width)))
        if self.method == "linear":
            there = fmin(here + 1.0, count - 1.0)
            begin, end = self._entry(p, here, 0), self._entry(p, there, 0)
            share = if_else(between, (t - begin) / if_else(between, end - begin, 1.0), 0.0)
            then = vertcat(*(self._entry(p, there, k) for k in range(1, width)))
            now = (1.0 - share) * now + share * then
        if self.outside == "zero":
            now = if_else(between, now, 0.0)
        return {"y": now}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        last = self._size[0] - 1.0
        coming = since(t, self._entry(p, fmin(x["row"] + 1.0, last), 0))
        return {"next": if_else(x["row"] < last, coming, -1.0)}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        count, width = self._size
        now = last_at_or_below(p["data"].T, t, count=count, stride=width)
        due = self.guard_values(t, x, u, p)["next"] > 0.0
        return {"row": counted(now, if_else(self._early(t, x, p), -1.0, x["row"]), due)}

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        due = self.guard_values(t, x, u, p)["next"] > 0.0
        return {"row": logic_or(due, self._early(t, x, p))}

    def _early(self, t: SX, x: Signals, p: Signals) -> SX:
        """Whether row 0 is still to come: at the start, where it is the first to hold."""
        return logic_and(x["row"] == 0.0, since(t, self._entry(p, SX(0.0), 0)) < 0.0)

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return {"row": x["row"] + (e["next"] > 0.0)}

    @property
    def _size(self) -> tuple[int, int]:
        rows, width = np.shape(self.data)
        return rows, width

    def _entry(self, p: Signals, row: SX, column: int) -> SX:
        # row by row in the vector of parameters, which is column by column in the transpose
        return read_entry(p["data"].T, self._size[1] * row + float(column))

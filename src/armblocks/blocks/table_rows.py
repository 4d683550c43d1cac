"""The row of a table of times at the present time, for blocks that play back tables of any length.

The row is a mode, which an event at the time of each row increases: no step passes over a row, and the cost
does not depend on the length of the table.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from casadi import SX, fmax, fmin, if_else, logic_and, logic_or

from armblocks.blocks.switching import edge_count, since
from armblocks.diagram import Block, Guard, Shapes, Signals, State
from armblocks.equations import last_at_or_below, read_entry

ROW_MODES = (State("row", (), "index of the last row at or before t, from 0; -1 before the first row"),)
ROW_GUARDS = (Guard("next", (), "t - the time of the next row", 1),)


@dataclass(frozen=True)
class TableRows:
    """A table with ``count`` rows of ``width`` entries; the first entry is the time (s)."""

    count: int
    width: int
    table: SX

    def entry(self, row: SX, column: int) -> SX:
        """An entry of the table; the row is limited to the table."""
        # The parameter vector is row-major, which is the column-major order of the transpose.
        return read_entry(self.table.T, self.width * row + float(column))

    def present(self, row: SX) -> SX:
        """The mode ``row`` limited to the table."""
        return fmin(fmax(row, 0.0), self.count - 1.0)

    def is_between(self, row: SX) -> SX:
        """Whether the present time is between two rows."""
        return logic_and(row >= 0.0, row < self.count - 1.0)

    def guard(self, t: SX, row: SX) -> SX:
        """The value that becomes positive at the time of the next row."""
        last = self.count - 1.0
        next_row = since(t, self.entry(fmin(row + 1.0, last), 0))
        return if_else(row < last, next_row, -1.0)

    def consistent(self, t: SX, row: SX) -> SX:
        """The row at ``t``, found by a binary search if the mode contradicts the time."""
        found = last_at_or_below(self.table.T, t, count=self.count, stride=self.width)
        passed = self.guard(t, row) > 0.0
        return edge_count(found, if_else(self._is_before(t, row), -1.0, row), passed)

    def contradicts(self, t: SX, row: SX) -> SX:
        """Whether the mode contradicts the time."""
        return logic_or(self.guard(t, row) > 0.0, self._is_before(t, row))

    def _is_before(self, t: SX, row: SX) -> SX:
        """Whether t is before row 0, while the first row is held."""
        return logic_and(row == 0.0, since(t, self.entry(SX(0.0), 0)) < 0.0)


@dataclass(frozen=True, kw_only=True)
class BlockWithRows(Block):
    """A block that plays back the table of its parameter ``data``: rows of a time (s) and values."""

    following_modes: ClassVar[bool] = True

    if TYPE_CHECKING:
        data: Any  # a parameter of the subclass

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return ROW_MODES

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return ROW_GUARDS

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"next": self._rows(p).guard(t, x["row"])}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"row": self._rows(p).consistent(t, x["row"])}

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"row": self._rows(p).contradicts(t, x["row"])}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return {"row": x["row"] + (e["next"] > 0.0)}

    @property
    def _size(self) -> tuple[int, int]:
        rows, width = np.shape(self.data)
        return rows, width

    def _rows(self, p: Signals) -> TableRows:
        return TableRows(*self._size, p["data"])

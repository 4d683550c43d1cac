"""Values at instants, as a file of measurements holds them: what some blocks play back."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from armblocks.errors import InputError


@dataclass(frozen=True, eq=False)
class TimeTable:
    """``rows (n, 1 + m)``: an instant (s) and the values there, at least two rows, instants rising.

    Compared and hashed by content; ``source`` (the file that it comes from) and ``names`` (of the m columns)
    are not compared. Raises ``InputError`` for rows that are no such table.
    """

    rows: ArrayLike
    names: tuple[str, ...] = ()
    source: str = ""
    _bytes: bytes = field(init=False, repr=False, default=b"")

    def __post_init__(self) -> None:
        rows = np.array(self.rows, dtype=np.float64, order="C")
        if rows.ndim != 2 or rows.shape[0] < 2 or rows.shape[1] < 2:
            raise InputError(
                f"the table has shape {rows.shape}",
                where=self.source,
                allowed="(n, 1 + m): n >= 2 rows of an instant and m >= 1 values",
                fix="put the instants (s) into the first column",
            )
        wrong = np.flatnonzero(~(np.diff(rows[:, 0]) > 0.0) | ~np.isfinite(rows[1:]).all(axis=1))
        if wrong.size or not np.isfinite(rows[0]).all():
            row = int(wrong[0]) + 1 if np.isfinite(rows[0]).all() else 0
            raise InputError(
                f"row {row + 1} of the table is {rows[row].tolist()}",
                where=self.source,
                allowed="finite numbers, each instant later than the one before",
                fix="sort the rows by their instants and drop repeated ones",
            )
        rows.setflags(write=False)
        object.__setattr__(self, "rows", rows)
        object.__setattr__(self, "_bytes", rows.tobytes())

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        return np.array(self.rows, dtype=dtype)

    def __reduce__(self) -> tuple[object, ...]:
        return TimeTable, (np.asarray(self.rows), self.names, self.source)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, TimeTable):
            return NotImplemented
        return np.shape(self.rows) == np.shape(other.rows) and self._bytes == other._bytes

    def __hash__(self) -> int:
        return hash(self._bytes)

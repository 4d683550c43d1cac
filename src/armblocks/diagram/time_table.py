"""Tables of sampled values, such as measurements, that source blocks play back."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from armblocks.errors import InputError


@dataclass(frozen=True, eq=False)
class TimeTable:
    """``rows (n, 1 + m)``: a time (s) and the values at that time; at least two rows, times ascending.

    Two rows with the same time are a jump: the left limits, then the values. The time of the first one is
    stored as the double before it.

    Compared and hashed by content; ``source`` (the file that it comes from) and ``names`` (of the m columns)
    are not compared. Raises ``InputError`` for invalid rows.
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
                allowed="(n, 1 + m): n >= 2 rows of a time and m >= 1 values",
                fix="put the times (s) into the first column",
            )
        times = rows[:, 0]
        left = np.append(times[:-1] == times[1:], False)
        times[left] = np.nextafter(times[left], -np.inf)
        wrong = np.flatnonzero(~(np.diff(rows[:, 0]) > 0.0) | ~np.isfinite(rows[1:]).all(axis=1))
        if wrong.size or not np.isfinite(rows[0]).all():
            row = int(wrong[0]) + 1 if np.isfinite(rows[0]).all() else 0
            raise InputError(
                f"row {row + 1} of the table is {np.array(self.rows, dtype=np.float64)[row].tolist()}",
                where=self.source,
                allowed="finite numbers, ascending times; a time twice for a jump",
                fix="sort the rows by time and drop repeated times",
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

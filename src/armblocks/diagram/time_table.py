"""Tables of sampled values, such as measurements, that source blocks play back."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from armblocks.errors import ArmblocksError, InputError


@dataclass(frozen=True, eq=False)
class TimeTable:
    """``rows (n, 1 + m)``: a time (s) and the values at that time; at least two rows, times ascending.

    Two rows with the same time are a jump: the left limits, then the values. The time of the first of
    these rows is stored as the next smaller double.

    Tables are compared and hashed by ``rows`` only. ``names`` and ``units`` describe the m columns.
    ``source`` is the file of the table, and ``shown`` its path in user interfaces. ``time`` is the column of
    times in the file and ``columns`` are the columns of values; they are empty where the file determines
    them.

    A table that could not be read has a ``fault`` and zeros as rows. Its shape is usable; reading its values
    raises the fault. Raises ``InputError`` for invalid rows.
    """

    rows: ArrayLike
    names: tuple[str, ...] = ()
    source: str = ""
    units: tuple[str, ...] = ()
    time: str = ""
    columns: tuple[str, ...] = ()
    shown: str = ""
    fault: ArmblocksError | None = None
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
        invalid = np.flatnonzero(~(np.diff(rows[:, 0]) > 0.0) | ~np.isfinite(rows[1:]).all(axis=1))
        if invalid.size or not np.isfinite(rows[0]).all():
            row = int(invalid[0]) + 1 if np.isfinite(rows[0]).all() else 0
            raise InputError(
                f"row {row + 1} of the table is {np.array(self.rows, dtype=np.float64)[row].tolist()}",
                where=self.source,
                allowed="finite numbers, ascending times; a time twice for a jump",
                fix="sort the rows by time and drop repeated times",
            )
        rows.setflags(write=False)
        object.__setattr__(self, "rows", rows)
        object.__setattr__(self, "_bytes", rows.tobytes())

    @classmethod
    def unread(cls, fault: ArmblocksError, source: str, *, time: str, columns: tuple[str, ...]) -> TimeTable:
        """The table of a file that could not be read."""
        rows = np.zeros((2, 1 + max(len(columns), 1)))
        rows[1, 0] = 1.0
        return cls(rows, columns, source, time=time, columns=columns, fault=fault)

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows, and number of columns including the column of times."""
        count, width = np.shape(self.rows)
        return count, width

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        if self.fault is not None:
            raise self.fault
        return np.array(self.rows, dtype=dtype)

    def __reduce__(self) -> tuple[object, ...]:
        properties = (self.units, self.time, self.columns, self.shown, self.fault)
        return TimeTable, (np.asarray(self.rows), self.names, self.source, *properties)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, TimeTable):
            return NotImplemented
        if self.fault is not None or other.fault is not None:
            return self is other
        return self.shape == other.shape and self._bytes == other._bytes

    def __hash__(self) -> int:
        return hash(self._bytes)

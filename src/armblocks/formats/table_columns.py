"""The columns of a file of measurements, and the table of the chosen columns."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armblocks.diagram import TimeTable
from armblocks.errors import FormatError, InputError, UnknownNameError, counted

MAX_NUMBERS = 1 << 26
"""Maximum number of entries of a file."""
MAX_EXACT_INTEGER = 2.0**53
"""Integers up to this absolute value are exact as floating-point numbers."""

_SECONDS = {
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), (1.0, 1.0)),
    **dict.fromkeys(("ms", "msec", "millisecond", "milliseconds"), (1.0, 1e3)),
    **dict.fromkeys(("us", "µs", "μs", "usec", "microsecond", "microseconds"), (1.0, 1e6)),
    **dict.fromkeys(("ns", "nsec", "nanosecond", "nanoseconds"), (1.0, 1e9)),
    **dict.fromkeys(("min", "mins", "minute", "minutes"), (60.0, 1.0)),
    **dict.fromkeys(("h", "hr", "hour", "hours"), (3600.0, 1.0)),
}
"""Factor and divisor from a unit of time to seconds. No double equals 0.001, so ms are divided by 1000."""
_UNITS = frozenset(
    (
        *(
            "s",
            "sec",
            "ms",
            "us",
            "µs",
            "μs",
            "ns",
            "min",
            "h",
            "Hz",
            "kHz",
            "MHz",
            "GHz",
            "rpm",
            "rev",
            "turns",
        ),
        *("m", "km", "cm", "mm", "µm", "μm", "um", "nm", "l", "rad", "mrad", "radian", "radians", "t"),
        *("deg", "mdeg", "degree", "degrees", "°", "grad", "mrev", "inc", "counts"),
        *(
            "N",
            "kN",
            "MN",
            "Nm",
            "N·m",
            "N*m",
            "mNm",
            "kNm",
            "Nms",
            "kg",
            "g",
            "Pa",
            "kPa",
            "MPa",
            "bar",
            "mbar",
        ),
        *("V", "mV", "kV", "A", "mA", "W", "kW", "mW", "J", "kJ", "C", "Ω", "ohm", "K", "°C", "degC"),
        *("%", "1", "-", "n/a", "pu"),
    )
)
_DEGREES = ("deg", "degree", "degrees", "°")
_BRACKETS = re.compile(r"^(?P<name>.*?)\s*(\[(?P<square>[^\[\]]*)\]|\((?P<round>[^()]*)\))\s*$")
_TIME = re.compile(r"^(?P<name>time|t)(\s*/\s*|_)(?P<unit>[a-zµμ]+)$", re.IGNORECASE)
_TIME_NAMES = ("time", "t")


@dataclass(frozen=True, kw_only=True)
class Column:
    """One column of a file.

    ``values`` are its numbers, with NaN for missing ones. For a column without numbers they are ``None``, and
    ``fault`` is the reason. ``kind`` is the type of the values in the file.
    """

    name: str
    kind: str = "number"
    """``number``, ``boolean``, ``date`` or ``text``."""
    values: NDArray[np.float64] | None = None
    fault: str = ""
    unit: str = ""
    is_default: bool = True
    """Whether the column belongs to the table where no columns are chosen."""

    @property
    def rows(self) -> int:
        """Number of rows, 0 for a column without numbers."""
        return 0 if self.values is None else len(self.values)


@dataclass(frozen=True, kw_only=True)
class ColumnFile:
    """The columns of a file in order, and notes about how the file was interpreted."""

    columns: tuple[Column, ...]
    notes: tuple[str, ...] = ()

    def column(self, name: str, where: str) -> Column:
        """The column of this name; raises ``UnknownNameError``."""
        for column in self.columns:
            if column.name == name:
                return column
        raise UnknownNameError("column", name, [column.name for column in self.columns], where=where)


def unique_names(names: Sequence[str]) -> list[str]:
    """The names, with ``(2)``, ``(3)``, … after repeated ones; an empty name becomes ``c0``, ``c1``, …"""
    given = {name for name in names if name}
    taken: set[str] = set()
    next_numbers: dict[str, int] = {}
    unique: list[str] = []
    for k, name in enumerate(names):
        stem = candidate = name or f"c{k}"
        number = next_numbers.get(stem, 2)
        while candidate in taken or (candidate != name and candidate in given):
            candidate, number = f"{stem} ({number})", number + 1
        next_numbers[stem] = number
        taken.add(candidate)
        unique.append(candidate)
    return unique


def repeated_notes(names: Sequence[str]) -> Iterator[str]:
    """A note where several columns have the same name."""
    repeated = sorted(name for name, count in Counter(names).items() if name and count > 1)
    if repeated:
        yield f"Several columns have the same name; a number is appended: {', '.join(repeated[:8])}."


def header_unit(name: str) -> str:
    """The unit in a header such as ``q1 [rad]``, ``time (ms)``, ``t/ms`` or ``time_ms``; ``""`` for none."""
    if match := _BRACKETS.match(name):
        unit = (match["square"] if match["square"] is not None else match["round"]).strip()
        return unit if _is_unit(unit) and not unit.isdigit() else ""
    if (match := _TIME.match(name.strip())) and match["unit"].lower() in _SECONDS:
        return match["unit"]
    return ""


def _is_unit(text: str) -> bool:
    if text in _UNITS:
        return True
    parts = [part for part in re.split(r"[/*·^ \d²³-]+", text) if part]
    return bool(parts) and len(text) <= 16 and all(part in _UNITS for part in parts)


def time_column(file: ColumnFile) -> str:
    """The name of the column of times where none is chosen.

    It is ``time``, else ``t``, else one of these names in any case or with a unit, else the only name that
    ends in ``/time``, else the first column of numbers. A column of dates counts as numbers.
    """
    names = [column.name for column in file.columns]
    for time_name in _TIME_NAMES:
        if time_name in names:
            return time_name
    for time_name in _TIME_NAMES:
        for name in names:
            if _name_without_unit(name).casefold() == time_name:
                return name
    inside = [name for name in names if name.casefold().endswith("/time")]
    if len(inside) == 1:
        return inside[0]
    usable = (column.name for column in file.columns if column.values is not None and column.is_default)
    return next(usable, "")


def _name_without_unit(name: str) -> str:
    """A name without its unit."""
    if not header_unit(name):
        return name.strip()
    match = _BRACKETS.match(name) or _TIME.match(name.strip())
    return match["name"].strip() if match else name


def table_of(
    file: ColumnFile,
    source: str = "",
    time: str = "",
    columns: Sequence[str] = (),
    *,
    strict: bool = False,
) -> TimeTable:
    """The table of the chosen columns; ``time`` and ``columns`` as in :func:`load_table`.

    ``strict``: text in any column is an error where no columns are chosen. Raises ``FormatError`` for a file
    without numbers, ``UnknownNameError`` for an unknown column, and ``InputError`` for columns that are not
    numbers, have gaps or different lengths, and for times that are not ascending.
    """
    key = time or time_column(file)
    if not key:
        raise FormatError(
            "the file has no columns of numbers",
            where=source,
            fix="give the file one column of times and one or more of values",
        )
    times = seconds_of(file.column(key, source), source)
    if columns:
        selected = [_numbers(file.column(name, source), source) for name in columns]
        _check_lengths(key, times, selected, source)
    else:
        candidates = [column for column in file.columns if column.name != key and column.kind != "date"]
        if strict:
            candidates = [_numbers(column, source) for column in candidates if column.is_default]
        selected = [column for column in candidates if column.is_default and column.rows == len(times)]
    if not selected:
        raise InputError(
            f"the file has only the times '{key}': no other column has {counted(len(times), 'number')}",
            where=source,
            allowed="one column of times, and one or more columns of values of the same length",
            fix="choose columns of numbers, with as many rows as the times",
        )
    for column in selected:
        _check_gaps(column, source)
    rows = np.column_stack([times, *(column.values for column in selected if column.values is not None)])
    return TimeTable(
        rows,
        tuple(column.name for column in selected),
        source,
        units=tuple(column.unit for column in selected),
        time=time,
        columns=tuple(columns),
    )


def seconds_of(column: Column, source: str) -> NDArray[np.float64]:
    """The times of a column in s, checked: finite and ascending; a time may occur twice, for a jump."""
    values = _numbers(column, source, use="times").values
    assert values is not None
    factor, divisor = _SECONDS.get(column.unit.lower(), (1.0, 1.0))
    times = np.asarray(values * factor / divisor)
    _check_gaps(column, source)
    steps = np.diff(times)
    is_third_occurrence = np.append(False, (steps[1:] == 0.0) & (steps[:-1] == 0.0))
    invalid = np.flatnonzero((steps < 0.0) | is_third_occurrence)
    if invalid.size:
        row = int(invalid[0]) + 1
        time, before = float(values[row]), float(values[row - 1])
        repeated = time == before
        raise InputError(
            f"the times '{column.name}' are not ascending: row {row + 1} of the table is {time:.12g}, "
            f"{'as in the two rows before' if repeated else f'after {before:.12g}'}",
            where=source,
            allowed="ascending times; a time twice for a jump",
            fix="sort the rows by time and drop repeated times, or choose another column",
        )
    return times


def time_notes(file: ColumnFile, name: str) -> Iterator[str]:
    """Notes on times that are not plain seconds."""
    for column in file.columns:
        if column.name != name:
            continue
        if column.kind == "date":
            yield f"The dates of '{name}' are converted to seconds since the first row."
        elif column.unit.lower() in _SECONDS and _SECONDS[column.unit.lower()] != (1.0, 1.0):
            yield f"The times '{name}' are converted from {column.unit} to s."
        jumps = 0 if column.values is None else int(np.sum(np.diff(column.values) == 0.0))
        if jumps:
            count = counted(jumps, "time occurs", "times occur")
            yield f"{count} twice: the values jump there, from the first to the second row."
        if column.unit and column.kind != "date" and column.unit.lower() not in _SECONDS:
            yield f"The unit '{column.unit}' is not one of time: the numbers of '{name}' are taken as s."


def unit_notes(columns: Iterable[Column]) -> Iterator[str]:
    """A note on columns whose values are in degrees."""
    names = [column.name for column in columns if column.unit in _DEGREES]
    if names:
        yield f"In degrees: {', '.join(names[:8])}. Robot blocks take rad; values are not converted."


def _numbers(column: Column, source: str, use: str = "values") -> Column:
    if column.values is None or (column.kind == "date" and use != "times"):
        dates = "it contains dates, which can only be times"
        raise FormatError(
            f"the column '{column.name}' has no numbers: {column.fault or dates}",
            where=source,
            allowed=f"a column of numbers as {use}",
            fix="choose other columns, or correct the file",
        )
    return column


def _check_gaps(column: Column, source: str) -> None:
    assert column.values is not None
    gaps = np.flatnonzero(~np.isfinite(column.values))
    if gaps.size:
        row = int(gaps[0])
        raise InputError(
            f"row {row + 1} of the column '{column.name}' is "
            f"{'empty or NaN' if np.isnan(column.values[row]) else 'infinite'}"
            f"{f', as are {gaps.size - 1} others' if gaps.size > 1 else ''}",
            where=source,
            allowed="finite numbers in every row",
            fix="complete or drop these rows, or choose other columns",
        )


def _check_lengths(key: str, times: NDArray[Any], selected: Iterable[Column], source: str) -> None:
    for column in selected:
        if column.rows != len(times):
            raise InputError(
                f"the column '{column.name}' has {counted(column.rows, 'row')}, and the times '{key}' have "
                f"{len(times)}",
                where=source,
                allowed="columns of one length",
                fix="choose columns of the same length",
            )


def with_units(columns: Iterable[Column]) -> tuple[Column, ...]:
    """The columns with the units in their names, where the file gives no other units."""
    return tuple(
        column if column.unit else replace(column, unit=header_unit(column.name)) for column in columns
    )

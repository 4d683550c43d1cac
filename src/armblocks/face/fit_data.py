"""Measured signals to which a diagram is fitted: experiments, their times and columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike, fspath
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.equations import HybridSystem
from armblocks.errors import InputError, UnknownNameError, counted, shortened_list
from armblocks.formats.table_columns import ColumnFile, header_unit, seconds_of, time_column
from armblocks.formats.table_files import load_columns

Array = NDArray[np.float64]

_BEFORE = 1.0 - 2.0**-48
"""Factor to a time before a jump. A run treats times that differ by less than 2^-50 as one instant."""


@dataclass(frozen=True, kw_only=True)
class Experiment(metaclass=ArgumentErrors):
    """Measured signals of one run, and the parameters that differ in this run.

    - ``data``: a dictionary, data frame or file with the times ``t`` (or ``time``, s) and a column for each
      measured signal, by the name of the signal in the diagram. A run starts at 0. NaN are missing values;
      two rows with one time are both sides of a jump.
    - ``parameters``: values of this experiment, such as its input ``{"source.data": table}`` and its initial
      values.
    """

    data: Any = field(repr=False)
    parameters: Mapping[str, Any] = field(default_factory=dict[str, Any])


@dataclass(frozen=True, eq=False, kw_only=True)
class Measurement:
    """``time`` (N,) s, ascending; ``signals``: values (N, m) of each measured signal by its path, with NaN.

    ``ignored``: the columns of a file that are not signals of the diagram.
    """

    time: Array
    signals: Mapping[str, Array]
    ignored: tuple[str, ...] = ()


def read_experiments(data: object, where: str) -> list[Experiment]:
    """The experiments of an argument ``data``: one or several, with or without parameters."""
    several = isinstance(data, Sequence) and not isinstance(data, str | bytes)
    sources: list[Any] = list(cast("Sequence[Any]", data)) if several else [data]
    if not sources:
        raise InputError(
            "there is no experiment",
            where=where,
            allowed="one or more measurements",
            fix="give a dictionary with t and the measured signals",
        )
    return [entry if isinstance(entry, Experiment) else Experiment(data=entry) for entry in sources]


def read_measurement(data: object, system: HybridSystem, where: str) -> Measurement:
    """The measured signals of a diagram. Raises InputError and UnknownNameError for unsuitable data."""
    is_file = isinstance(data, str | PathLike)
    if is_file:
        where = fspath(cast("str | PathLike[str]", data))
        time, columns = _columns_of_file(load_columns(Path(where)), where)
    else:
        time, columns = _columns_of_object(data, where)
    known = {**{name: name for name in system.signals_layout.names}, **system.aliases}
    signals: dict[str, Array] = {}
    ignored: list[str] = []
    parts: dict[str, dict[str, Array]] = {}
    sources: dict[str, str] = {}
    for name, values in columns.items():
        plain = name[: name.rfind(header_unit(name)) - 1].strip() if header_unit(name) else name
        head = plain.rpartition("[")[0] if plain not in known else ""
        path = known.get(plain) or (f"{known[head]}{plain[len(head) :]}" if head in known else "")
        if path in sources and not np.array_equal(columns[sources[path]], values, equal_nan=True):
            raise InputError(
                f"the columns '{sources[path]}' and '{name}' are the same signal '{path}'",
                where=where,
                allowed="one column for each signal",
                fix="remove one of them",
            )
        if path:
            sources[path] = name
        if plain in known:
            slot = system.signals_layout[path]
            if values.size != len(time) * slot.size or len(values) != len(time):
                raise InputError(
                    f"the signal '{plain}' has values of the shape {values.shape}",
                    where=where,
                    allowed=f"{len(time)} rows of {counted(slot.size, 'number')}",
                    fix="give one row for each time",
                )
            signals[path] = values.reshape(len(time), -1)
        elif head in known:
            parts.setdefault(known[head], {})[path] = values
        elif is_file:
            ignored.append(name)
        else:
            raise UnknownNameError("signal", name, known, where=where)
    for path, entries in parts.items():
        signals[path] = _assembled(path, entries, system, len(time), where)
    _check(time, signals, known, where)
    return Measurement(time=_both_sides(time, where), signals=signals, ignored=tuple(ignored))


def _assembled(
    path: str, entries: Mapping[str, Array], system: HybridSystem, count: int, where: str
) -> Array:
    """The entries of a signal with separate columns; all other entries are NaN."""
    elements = list(system.signals_layout[path].elements)
    values = np.full((count, len(elements)), np.nan)
    for name, column in entries.items():
        if name not in elements:
            raise UnknownNameError("entry", name, elements, where=where)
        values[:, elements.index(name)] = column
    return values


def _check(time: Array, signals: Mapping[str, Array], known: Mapping[str, str], where: str) -> None:
    if not signals or not any(np.isfinite(values).any() for values in signals.values()):
        raise InputError(
            "no column is a measured signal of the diagram" if not signals else "every measured value is NaN",
            where=where,
            allowed=shortened_list(list(known)),
            fix="name the columns as the signals of the diagram",
        )
    for path, values in signals.items():
        if np.isinf(values).any():
            raise InputError(
                f"the signal '{path}' has infinite values",
                where=where,
                allowed="finite numbers, and NaN where a value is missing",
                fix="replace them by NaN",
            )
    if not np.isfinite(time).all() or time[0] < 0.0 or (np.diff(time) < 0.0).any():
        raise InputError(
            "the times of the measurement are not finite, negative or not ascending",
            where=where,
            allowed="ascending times from 0, the start of the run, in s",
            fix="sort the rows, and subtract the time at which the run starts",
        )


def _both_sides(time: Array, where: str) -> Array:
    """Times in which the first row of a jump is just before it."""
    sides = time.copy()
    repeated = np.append(time[:-1] == time[1:], False)
    sides[repeated] *= _BEFORE
    if (np.diff(sides) <= 0.0).any() or sides[0] < 0.0:
        raise InputError(
            "a time occurs more than twice, or twice at 0",
            where=where,
            allowed="a time twice for both sides of a jump",
            fix="remove the other rows",
        )
    return sides


def _columns_of_file(file: ColumnFile, where: str) -> tuple[Array, dict[str, Array]]:
    key = time_column(file)
    columns = {c.name: c.values for c in file.columns if c.values is not None and c.name != key}
    return seconds_of(file.column(key, where), where), columns


def _columns_of_object(data: object, where: str) -> tuple[Array, dict[str, Array]]:
    items = cast("Any", data).items if callable(getattr(data, "items", None)) else None
    members = {} if items is None else {str(name): value for name, value in items()}
    key = next((name for name in ("t", "time") if name in members), "")
    if not key:
        raise InputError(
            f"the data are a {type(data).__name__}"
            + (f" with {shortened_list(list(members))}" if members else ""),
            where=where,
            allowed="a dictionary, a data frame or a file with the times 't' and the measured signals",
            fix="give for example {'t': times, 'plant/y': values}",
        )
    try:
        arrays = {name: np.asarray(value, dtype=np.float64) for name, value in members.items()}
    except (TypeError, ValueError):
        arrays = {key: np.empty(0)}
    time = arrays.pop(key).ravel()
    if len(time) < 2 or any(value.ndim == 0 for value in arrays.values()):
        raise InputError(
            f"the measurement has {counted(len(time), 'time')} or a column that is not an array of numbers",
            where=where,
            allowed="two or more times, and an array of numbers for each signal",
            fix="give one value for each time",
        )
    return time, arrays

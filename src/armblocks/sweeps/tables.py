"""The table of a sweep: a row for each run, with columns for its number, parameters, status and measures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armblocks.equations import Slot
from armblocks.errors import InputError
from armblocks.sweeps.batch import STATUSES, RunRows
from armblocks.sweeps.designs import Column, Design

Array = NDArray[Any]

RUN, STATUS, MESSAGE, STEPS, EVENTS, END_TIME = "run", "status", "message", "steps", "events", "end_time"
FIXED = (RUN, STATUS, MESSAGE, STEPS, EVENTS, END_TIME)
"""The columns of every table."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Layout:
    """The columns of a table: number of the run, parameters, status, measures, statistics, kept samples."""

    design: Design
    measures: tuple[str, ...]
    kept: tuple[str, ...] = ()
    samples: int = 0
    """Number of samples of each kept signal."""

    text_file: bool = False
    """Whether the table is written as CSV."""

    def __post_init__(self) -> None:
        if self.kept and self.text_file:
            raise InputError(
                "a CSV file has no columns for kept samples",
                allowed="keep= with a .parquet file, or in memory",
                where="sweep",
                fix="omit keep, or write out='results.parquet'",
            )
        repeated = [name for name, count in Counter(self.parameter_names).items() if count > 1]
        if repeated:
            raise InputError(
                f"'{repeated[0]}' varies twice: as an entry, and with its whole array",
                allowed="values of the entry, or of the array",
                where="sweep",
                fix="remove one of them",
            )
        used = [*FIXED, *self.parameter_names]
        for name in (*self.measures, *self.kept):
            if name in used or not name:
                raise InputError(
                    f"the name '{name}' of a measure is used by another column",
                    allowed=f"other names than {', '.join(used)}",
                    where="sweep",
                    fix="give the measure another name",
                )
            used.append(name)
        for name in self.design.columns:
            if name in FIXED:
                raise InputError(
                    f"'{name}' is not a parameter",
                    allowed="block.parameter, or a parameter of the diagram's mask",
                    where="sweep",
                    fix="write the path of a parameter",
                )

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all columns, except columns of kept samples."""
        return (RUN, *self.parameter_names, STATUS, MESSAGE, *self.measures, STEPS, EVENTS, END_TIME)

    @property
    def texts(self) -> tuple[str, ...]:
        """The names of the columns with texts."""
        objects = (path for path, column in self.design.columns.items() if column.dtype == object)
        return (STATUS, MESSAGE, *objects)

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """The names of the columns of the parameters; a column for each entry of an array."""
        return tuple(name for path, column in self.design.columns.items() for name in _names(path, column))

    def columns(self, begin: int, rows: RunRows) -> dict[str, Array]:
        """The columns of the runs from ``begin`` on."""
        end = begin + rows.status.size
        columns: dict[str, Array] = {RUN: np.arange(begin, end)}
        for path, column in self.design.columns.items():
            part = column[begin:end]
            if column.dtype == object:
                columns[path] = np.array([_text(value) for value in part], dtype=object)
            else:
                flat = part.reshape(len(part), -1).astype(np.float64)
                columns |= {name: flat[:, k] for k, name in enumerate(_names(path, column))}
        columns[STATUS] = np.array(STATUSES, dtype=object)[rows.status]
        columns[MESSAGE] = np.array(rows.messages, dtype=object)
        columns |= {name: rows.measures[:, k] for k, name in enumerate(self.measures)}
        columns |= {STEPS: rows.steps, EVENTS: rows.events, END_TIME: rows.end_time}
        return columns | {name: rows.kept[:, k] for k, name in enumerate(self.kept)}


def concatenated(parts: Sequence[Mapping[str, Array]], layout: Layout) -> dict[str, Array]:
    """The columns of several parts of a table, one after the other."""
    names = (*layout.names, *layout.kept)
    if not parts:
        return {name: np.empty((0, layout.samples) if name in layout.kept else 0) for name in names}
    return {name: np.concatenate([part[name] for part in parts]) for name in names}


def _names(path: str, column: Column) -> tuple[str, ...]:
    return Slot(path, column.shape[1:]).elements


def _text(value: Any) -> str:
    """The text of a value that is not a number: a robot's name, a choice."""
    robot = getattr(value, "robot", value)
    name = getattr(robot, "name", None)
    return name if isinstance(name, str) else str(value)

"""The preview of a table file, which a client shows before a block uses the file."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from armblocks.diagram import TimeTable
from armblocks.errors import ArmblocksError
from armblocks.formats.table_columns import Column, ColumnFile, table_of, time_column, time_notes, unit_notes
from armblocks.studio.protocol.message import Fault
from armblocks.studio.protocol.messages.data_files import TableColumn, TablePreview

MAX_ROWS = 6
MAX_COLUMNS = 500
MAX_SHOWN_COLUMNS = 12
"""Number of columns whose rows and curves are shown."""
MAX_POINTS = 600


def table_preview(file: ColumnFile, shown: str, time: str, columns: Sequence[str]) -> TablePreview:
    """Return the preview of the chosen columns."""
    table, fault = None, None
    try:
        table = table_of(file, shown, time, columns)
    except ArmblocksError as error:
        fault = Fault(what=error.what, where=error.where, allowed=error.allowed, fix=error.fix)
    key = time or time_column(file)
    chosen_names = list(table.names) if table is not None else list(columns)
    columns_by_name = {column.name: column for column in file.columns}
    times, curves, spacing = _curves(table)
    return TablePreview(
        columns=[
            TableColumn(name=c.name, unit=c.unit, kind=c.kind, rows=c.rows, fault=c.fault)
            for c in file.columns[:MAX_COLUMNS]
        ],
        time=key,
        chosen=chosen_names,
        rows=_rows(
            [
                columns_by_name[name]
                for name in [key, *chosen_names[:MAX_SHOWN_COLUMNS]]
                if name in columns_by_name
            ]
        ),
        count=0 if table is None else table.shape[0],
        spacing=spacing,
        times=times,
        curves=curves,
        notes=[
            *file.notes,
            *time_notes(file, key),
            *unit_notes(columns_by_name[c] for c in chosen_names if c in columns_by_name),
        ],
        fault=fault,
    )


def _rows(columns: Sequence[Column]) -> list[list[str]]:
    values = [column.values for column in columns]
    count = min(MAX_ROWS, max((len(column) for column in values if column is not None), default=0))
    return [[_cell(column, row) for column in values] for row in range(count)]


def _cell(values: NDArray[np.float64] | None, row: int) -> str:
    if values is None or row >= len(values):
        return ""
    return "" if np.isnan(values[row]) else f"{values[row]:.7g}"


def _curves(table: TimeTable | None) -> tuple[list[float], list[list[float]], tuple[float, float]]:
    """Times and values for a plot, with all extremes, and the minimum and maximum difference of successive
    times."""
    if table is None:
        return [], [], (0.0, 0.0)
    rows = np.asarray(table)
    steps = np.diff(rows[:, 0])
    group = max(1, -(-2 * len(rows) // MAX_POINTS))
    shown_rows = rows[:, 1 : 1 + MAX_SHOWN_COLUMNS]
    times: list[float] = []
    curves: list[list[float]] = [[] for _ in range(shown_rows.shape[1])]
    for start in range(0, len(rows), group):
        part = shown_rows[start : start + group]
        times += (
            [float(rows[start, 0])] if len(part) == 1 else rows[[start, start + len(part) - 1], 0].tolist()
        )
        for k, curve in enumerate(curves):
            low, high = int(part[:, k].argmin()), int(part[:, k].argmax())
            curve += part[[low], k].tolist() if len(part) == 1 else part[sorted((low, high)), k].tolist()
    return times, curves, (float(steps.min()), float(steps.max()))

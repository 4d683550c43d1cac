"""Columns from files of arrays: NPZ, MAT and Parquet. No code in files is executed."""

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Mapping
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import FormatError, InputError, counted
from armblocks.extras import from_extra
from armblocks.formats.table_columns import (
    MAX_EXACT_INTEGER,
    MAX_NUMBERS,
    Column,
    ColumnFile,
    repeated_notes,
    time_column,
    unique_names,
    with_units,
)

Array = NDArray[Any]


def read_npz(data: bytes) -> ColumnFile:
    """The columns of the arrays of an NPZ file; the first axis is time."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        _check_size(sum(entry.file_size for entry in archive.infolist()) // 8)
    with np.load(io.BytesIO(data), allow_pickle=False) as archive:
        return _columns({name: archive[name] for name in archive.files})


def read_mat(data: bytes) -> ColumnFile:
    """The columns of the variables and structures of a MAT file; the first axis is time.

    Raises ``FormatError`` for version 7.3 and for too many numbers.
    """
    with from_extra("data", "MAT files"):
        import scipy.io
    if data[:128].lstrip().startswith(b"MATLAB 7.3") or data[:8] == b"\x89HDF\r\n\x1a\n":
        raise FormatError(
            "this is a MAT file of version 7.3",
            allowed="MAT files of version 4 to 7",
            where="a MAT file",
            fix="save it in MATLAB with the option -v7, or as CSV",
        )
    mat = cast("Any", scipy.io)
    shapes: list[tuple[str, tuple[int, ...], str]] = mat.whosmat(io.BytesIO(data))
    _check_size(sum(math.prod(shape) for _, shape, _ in shapes))
    contents: dict[str, Any] = mat.loadmat(io.BytesIO(data))
    return _columns(_members({name: value for name, value in contents.items() if not name.startswith("__")}))


def _members(contents: Mapping[str, Any]) -> dict[str, Any]:
    """The variables, and variables in structures of one element as ``structure/member``."""
    members: dict[str, Any] = {}
    for name, value in contents.items():
        array = np.asarray(value)
        if array.dtype.names and array.size == 1:
            nested = _members({field: array[field].item() for field in array.dtype.names})
            members |= {f"{name}/{field}": member for field, member in nested.items()}
        else:
            members[name] = value
    return members


def read_parquet(data: bytes) -> ColumnFile:
    """The columns of a Parquet file."""
    with from_extra("data", "Parquet files"):
        import pyarrow.parquet as pq
    stored = cast("Any", pq).ParquetFile(io.BytesIO(data))
    _check_size(stored.metadata.num_rows * max(stored.metadata.num_columns, 1))
    table = stored.read()
    columns = [_parquet_column(str(name), table.column(k)) for k, name in enumerate(table.column_names)]
    names = unique_names(["index" if c.name.startswith(_INDEX) else c.name for c in columns])
    named = [
        Column(
            name=name, kind=c.kind, values=c.values, fault=c.fault, is_default=not c.name.startswith(_INDEX)
        )
        for name, c in zip(names, columns)
    ]
    return ColumnFile(columns=with_units(named), notes=tuple(repeated_notes([c.name for c in columns])))


_INDEX = "__index_level_"
"""Names that pandas gives to an index without a name."""


def _parquet_column(name: str, values: Any) -> Column:
    import pyarrow as pa

    arrow = cast("Any", pa)
    kinds = arrow.types
    if kinds.is_dictionary(values.type):
        values = values.cast(values.type.value_type)
    if kinds.is_decimal(values.type):
        values = values.cast(arrow.float64())
    if kinds.is_date(values.type) or kinds.is_timestamp(values.type) or kinds.is_duration(values.type):
        return _column(name, values.to_numpy())
    if kinds.is_boolean(values.type) and values.null_count:
        values = values.cast(arrow.int8())
    if kinds.is_integer(values.type) and values.null_count:
        values = values.cast(arrow.float64(), safe=True)
    if not (kinds.is_integer(values.type) or kinds.is_floating(values.type) or kinds.is_boolean(values.type)):
        return Column(name=name, kind="text", fault=f"its values are of type {str(values.type)[:40]}")
    return _column(name, values.to_numpy())


def _check_size(numbers: int) -> None:
    if numbers > MAX_NUMBERS:
        raise FormatError(
            f"the file has {counted(numbers, 'number')}",
            allowed=f"at most {MAX_NUMBERS}",
            where="a file of arrays",
            fix="split or shorten it",
        )


def _columns(arrays: Mapping[str, Any]) -> ColumnFile:
    """The columns of several arrays.

    The first axis is time. If only the last axis of an array has the length of the times, the array is read
    along that axis: Simulink stores signals in this form if the times are a row.
    """
    arrays_by_name = {name: np.asarray(values) for name, values in arrays.items()}
    flat = {
        name: array.ravel() if array.ndim >= 2 and max(array.shape) == array.size else array
        for name, array in arrays_by_name.items()
    }
    vectors = [_column(name, array) for name, array in flat.items() if array.ndim == 1]
    notes: list[str] = []
    key = time_column(ColumnFile(columns=with_units(vectors)))
    count = next((column.rows for column in vectors if column.name == key), 0)
    selected: list[Column] = []
    for name, array in flat.items():
        if array.ndim < 2:
            selected.append(_column(name, np.atleast_1d(array)))
            continue
        if array.dtype.kind not in "biuf" or not array.size:
            selected.append(Column(name=name, kind="text", fault=_fault(array)))
            continue
        if not count:
            array = _times_by_rows(name, array, notes)
        elif array.shape[0] != count == array.shape[-1]:
            array = np.moveaxis(array, -1, 0)
            notes.append(f"The rows of '{name}' are its signals.")
        columns = array.reshape(array.shape[0], -1)
        selected += [_column(f"{name}[{k}]", columns[:, k]) for k in range(columns.shape[1])]
    return ColumnFile(columns=with_units(selected), notes=tuple(notes))


def _times_by_rows(name: str, array: Array, notes: list[str]) -> Array:
    """A matrix that contains the times: by columns, or by rows where only the first row can be times."""
    if array.ndim != 2 or array.shape[0] >= array.shape[1]:
        return array
    is_time_column, is_time_row = (
        bool(np.all(np.diff(line.astype(np.float64)) > 0.0)) for line in (array[:, 0], array[0])
    )
    if is_time_column and is_time_row:
        raise InputError(
            f"the matrix '{name}' has {counted(array.shape[0], 'row')} and "
            f"{counted(array.shape[1], 'column')}, and both its first "
            "row and its first column can be times",
            allowed="a time in each row, or a separate variable 'time'",
            where="a file of arrays",
            fix="transpose the matrix, or store the times as a vector 'time'",
        )
    if is_time_row:
        notes.append(f"The rows of '{name}' are its signals, the first row the times.")
        return array.T
    return array


def _fault(array: Array) -> str:
    if not array.size:
        return "it is empty"
    words = {"c": "its values are complex", "U": "it contains text", "S": "it contains text"}
    return words.get(array.dtype.kind, "it contains objects")


def _column(name: str, array: Array) -> Column:
    """A vector as a column."""
    kind = array.dtype.kind
    if not array.size or kind not in "biufmM":
        return Column(name=name, kind="text", fault=_fault(array))
    if kind == "M":
        if bool(np.isnat(array).any()):
            return Column(name=name, kind="date", fault="a row has no date")
        return Column(name=name, kind="date", values=_seconds(array - array[0]))
    if kind == "m":
        return Column(name=name, values=_seconds(array))
    if kind in "iu" and max(abs(int(array.max())), abs(int(array.min()))) > MAX_EXACT_INTEGER:
        fault = "its integers exceed 2^53, so they are not exact as numbers; subtract an offset"
        return Column(name=name, fault=fault)
    values = np.ascontiguousarray(array, dtype=np.float64)
    return Column(name=name, kind="boolean" if kind == "b" else "number", values=values)


def _seconds(durations: Array) -> NDArray[np.float64]:
    """Durations as numbers of seconds; ``NaT`` is NaN."""
    absent = np.isnat(durations)
    ticks = durations.astype("timedelta64[ns]").astype(np.int64)
    return np.where(absent, np.nan, ticks / 1e9)

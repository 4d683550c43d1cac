"""Export of results to tables and files; the only module that uses pandas, pyarrow and SciPy's MAT files.

======== ================================================================ =========================
suffix   content                                                          description of the run
======== ================================================================ =========================
.csv     a line for each row: ``time``, then a column for each scalar     none
.parquet the same columns, as doubles                                     key ``armblocks`` (JSON)
.npz     ``time`` and an ``(N, *shape)`` array for each signal path       array ``run`` (JSON)
.mat     ``time`` and a structure for each block, a field for each port   structure ``run``
======== ================================================================ =========================

A row is a sample, or one side of a jump: at the time of a jump there are two rows with the same time, first
the left limits, then the values. A file without these rows has the samples alone.

Parquet needs pyarrow, MAT needs SciPy: the extra ``data``. CSV files have the same bytes with and without
pyarrow, which is only faster. Files are written atomically
(:func:`armblocks.files.write_atomically`).
"""

from __future__ import annotations

import csv
import io
import json
import re
import zipfile
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import MissingLibraryError, UnknownNameError
from armblocks.extras import from_extra, installed
from armblocks.files import GrowingFile, write_atomically
from armblocks.simulation.csv_rows import csv_rows

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

    from armblocks.simulation.run_data import RunData


Array = NDArray[np.float64]


def to_dataframe(result: RunData, *, jumps: bool) -> pd.DataFrame:
    """A data frame with the index ``time`` in s and a column for each scalar.

    ``attrs`` has the description of the run.
    """
    with from_extra("data", "data frames"):
        import pandas as pd

    result = result.with_jumps() if jumps else result
    index = pd.Index(result.time, name="time")
    frame = pd.DataFrame(result.signals.T, index=index, columns=list(result.columns()))
    frame.attrs.update(description_of(result))
    return frame


def save(result: RunData, path: str | PathLike[str], *, jumps: bool) -> None:
    """Write ``path`` in the format of its suffix, atomically. The module's docstring lists the formats."""
    place = Path(path)
    write = _WRITERS.get(place.suffix.lower())
    if write is None:
        raise UnknownNameError("file type", place.suffix or place.name, list(_WRITERS), where=str(place))
    check_format(place)
    write_atomically(place, write(result.with_jumps() if jumps else result))


def check_format(path: Path) -> None:
    """Raise ``MissingLibraryError`` if the format of this suffix needs a library that is not installed."""
    library, use = _LIBRARIES.get(path.suffix.lower(), ("", ""))
    if library and not installed(library):
        raise MissingLibraryError(library, "data", use, where=str(path))


def description_of(result: RunData) -> dict[str, Any]:
    """The description of the run (solver, steps, times, messages) as plain values."""
    parameters = {name: value.tolist() for name, value in result.parameters.items()}
    return {
        "name": result.name,
        "run": asdict(result.run),
        "units": dict(result.units),
        "parameters": parameters,
    }


def _csv(result: RunData) -> bytes:
    body = io.BytesIO()
    _write_csv_rows(body, [result.time, *result.signals])
    return _csv_head(["time", *result.columns()]) + body.getvalue()


def _csv_head(names: Sequence[str]) -> bytes:
    head = io.StringIO()
    csv.writer(head, lineterminator="\n").writerow(names)
    return head.getvalue().encode()


def _write_csv_rows(stream: BinaryIO, columns: Sequence[Array]) -> None:
    """Write rows with pyarrow if it is installed, which is five times as fast and gives the same bytes."""
    if not installed("pyarrow"):
        stream.write(csv_rows(columns).encode())
        return
    import pyarrow as pa
    from pyarrow import csv as arrow_csv

    names = [str(number) for number in range(len(columns))]
    table = pa.table([_column(values) for values in columns], names=names)
    arrow_csv.write_csv(table, stream, arrow_csv.WriteOptions(include_header=False))


def _parquet(result: RunData) -> bytes:
    import pyarrow.parquet as pq

    buffer = io.BytesIO()
    pq.write_table(_table(result), buffer)
    return buffer.getvalue()


def _table(result: RunData) -> pa.Table:
    """A column ``time`` and a column for each scalar; the metadata contain the description of the run."""
    import pyarrow as pa

    names = ["time", *result.columns()]
    metadata = {"armblocks": json.dumps(description_of(result))}
    arrays = [_column(values) for values in (result.time, *result.signals)]
    return pa.table(arrays, names=names, metadata=metadata)


def _column(values: Array) -> pa.Array:
    """A column that shares the memory of the numbers.

    ``pyarrow.array`` would import pandas in order to check for its types.
    """
    import pyarrow as pa

    buffer = pa.py_buffer(np.ascontiguousarray(values))
    return pa.Array.from_buffers(pa.float64(), len(values), [None, buffer])


def _npz(result: RunData) -> bytes:
    """The bytes of an NPZ file.

    ``numpy.savez_compressed`` cannot write them: it rejects arrays with the names of its own parameters.
    """
    arrays = {slot.title or slot.name: result[slot.name] for slot in result.signals_layout}
    arrays |= {"time": result.time, "run": np.array(json.dumps(description_of(result)))}
    buffer = io.BytesIO()
    _write_arrays(buffer, arrays)
    return buffer.getvalue()


def _write_arrays(stream: BinaryIO, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write named arrays as an NPZ file."""
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, values in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as entry:
                np.lib.format.write_array(entry, values, allow_pickle=False)


def _mat(result: RunData) -> bytes:
    with from_extra("data", "MAT files"):
        from scipy.io import savemat

    contents: dict[str, Any] = {"time": result.time}
    blocks: dict[str, str] = {}
    paths: list[list[str]] = []
    for slot in result.signals_layout:
        name = slot.title or slot.name
        block, _, port = name.rpartition("/")
        if not block:
            variable = _identifier(name, {*contents, "run", "paths"})
            contents[variable] = result[slot.name]
            paths.append([name, variable, slot.unit])
            continue
        if block not in blocks:
            blocks[block] = _identifier(block, {*contents, "run", "paths"})
            contents[blocks[block]] = {}
        fields: dict[str, Any] = contents[blocks[block]]
        field = _identifier(port, set(fields))
        fields[field] = result[slot.name]
        paths.append([name, f"{blocks[block]}.{field}", slot.unit])
    contents["run"] = {"name": result.name, **asdict(result.run)}
    contents["paths"] = np.array(paths, dtype=object).reshape(len(paths), 3)
    buffer = io.BytesIO()
    savemat(buffer, contents, long_field_names=True, oned_as="column")
    return buffer.getvalue()


def _identifier(name: str, used: set[str]) -> str:
    """An unused MATLAB name (letters, digits, underscores, at most 63) similar to ``name``."""
    plain = re.sub(r"[^A-Za-z0-9_]", "_", name)[:56]
    if not plain or not plain[0].isalpha():
        plain = f"x{plain}"
    candidate, number = plain, 2
    while candidate in used:
        candidate, number = f"{plain}_{number}", number + 1
    return candidate


TABLE_SUFFIXES = (".csv", ".parquet", ".npz")
"""Suffixes of the formats of :func:`save_table`."""


def save_table(path: Path, columns: Mapping[str, Array]) -> None:
    """Write columns (N,) of doubles in the format of the suffix, which is in ``TABLE_SUFFIXES``.

    Raises ``MissingLibraryError`` for Parquet files without pyarrow.
    """
    check_format(path)
    buffer = io.BytesIO()
    match path.suffix.lower():
        case ".csv":
            buffer.write(_csv_head(list(columns)))
            _write_csv_rows(buffer, list(columns.values()))
        case ".parquet":
            import pyarrow as pa
            import pyarrow.parquet as pq

            arrays = [_column(values) for values in columns.values()]
            pq.write_table(pa.table(arrays, names=list(columns)), buffer)
        case _:
            _write_arrays(buffer, {name: np.ascontiguousarray(values) for name, values in columns.items()})
    write_atomically(path, buffer.getvalue())


_WRITERS: dict[str, Callable[[RunData], bytes]] = {
    ".csv": _csv,
    ".parquet": _parquet,
    ".npz": _npz,
    ".mat": _mat,
}
_LIBRARIES = {".parquet": ("pyarrow", "Parquet files"), ".mat": ("scipy", "MAT files")}
"""The library that each format requires, and the name of the format in messages."""

# Files that are written during a run.


class LogFile(ABC):
    """A table that is written in several parts. The file gets its name when it is complete."""

    def __init__(self, path: Path, columns: Sequence[str]) -> None:
        self.columns = ("time", *columns)
        self._file = GrowingFile(path)

    def append(self, time: Array, signals: Array) -> None:
        """Add samples: times ``(N,)`` s and values ``(number of columns, N)``."""
        self._append([time, *signals])

    def finish(self, description: Mapping[str, Any]) -> None:
        """Complete the file, with the ``description`` of the run if the format can store it."""
        self._close(description)
        self._file.finish()

    def abandon(self) -> None:
        """Delete the incomplete file."""
        self._file.abandon()

    @abstractmethod
    def _append(self, columns: Sequence[Array]) -> None: ...

    @abstractmethod
    def _close(self, description: Mapping[str, Any]) -> None: ...


class _CsvLog(LogFile):
    """A CSV file that grows during a run."""

    def __init__(self, path: Path, columns: Sequence[str]) -> None:
        super().__init__(path, columns)
        self._file.stream.write(_csv_head(self.columns))

    def _append(self, columns: Sequence[Array]) -> None:
        _write_csv_rows(self._file.stream, columns)

    def _close(self, description: Mapping[str, Any]) -> None:
        pass


class _ParquetLog(LogFile):
    """A Parquet file with a row group for each part."""

    def __init__(self, path: Path, columns: Sequence[str]) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        super().__init__(path, columns)
        schema = pa.schema([(name, pa.float64()) for name in self.columns])
        self._writer = pq.ParquetWriter(self._file.stream, schema)

    def _append(self, columns: Sequence[Array]) -> None:
        import pyarrow as pa

        arrays = [_column(values) for values in columns]
        self._writer.write_table(pa.table(arrays, names=self.columns))

    def _close(self, description: Mapping[str, Any]) -> None:
        self._writer.add_key_value_metadata({"armblocks": json.dumps(description)})
        self._writer.close()


_LOGS: dict[str, type[LogFile]] = {".csv": _CsvLog, ".parquet": _ParquetLog}


def open_log(path: Path, columns: Sequence[str]) -> LogFile:
    """A new log in the format of its suffix.

    Raises ``UnknownNameError``, ``FormatError``, ``MissingLibraryError``.
    """
    kind = _LOGS.get(path.suffix.lower())
    if kind is None:
        raise UnknownNameError("log file type", path.suffix or path.name, list(_LOGS), where=str(path))
    check_format(path)
    return kind(path, columns)

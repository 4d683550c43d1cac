"""Results as tables and files: the only place that knows pandas, pyarrow and SciPy's MAT files.

======== ================================================================ =========================
suffix   holds                                                            how the run went
======== ================================================================ =========================
.csv     one line an instant, ``time`` then one column a scalar           cannot be said
.parquet the same columns, doubles                                        key ``armblocks`` (JSON)
.npz     ``time`` and one ``(N, *shape)`` array a signal, by its path     array ``run`` (JSON)
.mat     ``time`` and a structure a block with a field a port             structure ``run``
======== ================================================================ =========================

A file is there completely or not at all (:func:`armblocks.files.write_atomically`).
"""

from __future__ import annotations

import csv
import io
import json
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import UnknownNameError
from armblocks.files import GrowingFile, write_atomically

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

    from armblocks.simulation.run_data import RunData


Array = NDArray[np.float64]


def to_dataframe(result: RunData) -> pd.DataFrame:
    """Index ``time`` in s, one column for each scalar; ``attrs`` holds how the run went."""
    import pandas as pd

    index = pd.Index(result.time, name="time")
    frame = pd.DataFrame(result.signals.T, index=index, columns=list(result.columns()))
    frame.attrs.update(description_of(result))
    return frame


def save(result: RunData, path: str | PathLike[str]) -> None:
    """Write ``path`` in the format of its suffix, all or nothing. See the module for the formats."""
    place = Path(path)
    write = _WRITERS.get(place.suffix.lower())
    if write is None:
        raise UnknownNameError("file type", place.suffix or place.name, list(_WRITERS), where=str(place))
    write_atomically(place, write(result))


def description_of(result: RunData) -> dict[str, Any]:
    """How the run went, in plain values."""
    parameters = {name: value.tolist() for name, value in result.parameters.items()}
    return {
        "name": result.name,
        "run": asdict(result.run),
        "units": dict(result.units),
        "parameters": parameters,
    }


def _csv(result: RunData) -> bytes:
    from pyarrow import csv as arrow_csv

    head = io.StringIO()
    csv.writer(head, lineterminator="\n").writerow(["time", *result.columns()])
    body = io.BytesIO()
    arrow_csv.write_csv(_table(result), body, arrow_csv.WriteOptions(include_header=False))
    return head.getvalue().encode() + body.getvalue()


def _parquet(result: RunData) -> bytes:
    import pyarrow.parquet as pq

    buffer = io.BytesIO()
    pq.write_table(_table(result), buffer)
    return buffer.getvalue()


def _table(result: RunData) -> pa.Table:
    """Column ``time`` and one column a scalar; how the run went is in the metadata."""
    import pyarrow as pa

    names = ["time", *result.columns()]
    metadata = {"armblocks": json.dumps(description_of(result))}
    arrays = [_column(values) for values in (result.time, *result.signals)]
    return pa.table(arrays, names=names, metadata=metadata)


def _column(values: Array) -> pa.Array:
    """A column that reads the numbers in place. (``pyarrow.array`` imports pandas to look for its types.)"""
    import pyarrow as pa

    buffer = pa.py_buffer(np.ascontiguousarray(values))
    return pa.Array.from_buffers(pa.float64(), len(values), [None, buffer])


def _npz(result: RunData) -> bytes:
    buffer = io.BytesIO()
    arrays = {name: result[name] for name in result.names}
    description = np.array(json.dumps(description_of(result)))
    np.savez_compressed(buffer, allow_pickle=False, time=result.time, run=description, **arrays)
    return buffer.getvalue()


def _mat(result: RunData) -> bytes:
    from scipy.io import savemat

    contents: dict[str, Any] = {"time": result.time}
    blocks: dict[str, str] = {}
    paths: list[list[str]] = []
    for name in result.names:
        block, _, port = name.rpartition("/")
        if not block:
            variable = _identifier(name, {*contents, "run", "paths"})
            contents[variable] = result[name]
            paths.append([name, variable, result.units[name]])
            continue
        if block not in blocks:
            blocks[block] = _identifier(block, {*contents, "run", "paths"})
            contents[blocks[block]] = {}
        fields: dict[str, Any] = contents[blocks[block]]
        field = _identifier(port, set(fields))
        fields[field] = result[name]
        paths.append([name, f"{blocks[block]}.{field}", result.units[name]])
    contents["run"] = {"name": result.name, **asdict(result.run)}
    contents["paths"] = np.array(paths, dtype=object).reshape(len(paths), 3)
    buffer = io.BytesIO()
    savemat(buffer, contents, long_field_names=True, oned_as="column")
    return buffer.getvalue()


def _identifier(name: str, taken: set[str]) -> str:
    """A MATLAB name (letters, digits, underscores, at most 63) near ``name`` that is not taken."""
    plain = re.sub(r"[^A-Za-z0-9_]", "_", name)[:56]
    if not plain or not plain[0].isalpha():
        plain = f"x{plain}"
    candidate, number = plain, 2
    while candidate in taken:
        candidate, number = f"{plain}_{number}", number + 1
    return candidate


_WRITERS: dict[str, Callable[[RunData], bytes]] = {
    ".csv": _csv,
    ".parquet": _parquet,
    ".npz": _npz,
    ".mat": _mat,
}

# Files that grow while a run goes on.


class LogFile(ABC):
    """A table that is written piece by piece; it is there under its name when it is complete."""

    def __init__(self, path: Path, columns: Sequence[str]) -> None:
        self.columns = ("time", *columns)
        self._file = GrowingFile(path)

    def append(self, time: Array, signals: Array) -> None:
        """Add instants, ``(N,)`` s, with their values ``(count of columns, N)``."""
        import pyarrow as pa

        arrays = [_column(values) for values in (time, *signals)]
        self._append(pa.table(arrays, names=self.columns))

    def finish(self, description: Mapping[str, Any]) -> None:
        """Complete the file; ``description`` says how the run went, where the format has a place for it."""
        self._close(description)
        self._file.finish()

    def abandon(self) -> None:
        """Leave nothing behind."""
        self._file.abandon()

    @abstractmethod
    def _append(self, table: pa.Table) -> None: ...

    @abstractmethod
    def _close(self, description: Mapping[str, Any]) -> None: ...


class _CsvLog(LogFile):
    def __init__(self, path: Path, columns: Sequence[str]) -> None:
        super().__init__(path, columns)
        head = io.StringIO()
        csv.writer(head, lineterminator="\n").writerow(self.columns)
        self._file.stream.write(head.getvalue().encode())

    def _append(self, table: pa.Table) -> None:
        from pyarrow import csv as arrow_csv

        arrow_csv.write_csv(table, self._file.stream, arrow_csv.WriteOptions(include_header=False))

    def _close(self, description: Mapping[str, Any]) -> None:
        pass


class _ParquetLog(LogFile):
    def __init__(self, path: Path, columns: Sequence[str]) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        super().__init__(path, columns)
        schema = pa.schema([(name, pa.float64()) for name in self.columns])
        self._writer = pq.ParquetWriter(self._file.stream, schema)

    def _append(self, table: pa.Table) -> None:
        self._writer.write_table(table)

    def _close(self, description: Mapping[str, Any]) -> None:
        self._writer.add_key_value_metadata({"armblocks": json.dumps(description)})
        self._writer.close()


_LOGS: dict[str, type[LogFile]] = {".csv": _CsvLog, ".parquet": _ParquetLog}


def open_log(path: Path, columns: Sequence[str]) -> LogFile:
    """A new log in the format of its suffix. Raises ``UnknownNameError`` and ``FormatError``."""
    kind = _LOGS.get(path.suffix.lower())
    if kind is None:
        raise UnknownNameError("log file type", path.suffix or path.name, list(_LOGS), where=str(path))
    return kind(path, columns)

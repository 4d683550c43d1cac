"""Files of sweeps: parts written during the sweep, and the complete table as Parquet or CSV.

During a sweep ``results.parquet.parts`` is a folder with a description and one Parquet file for each part of
the table. Each file is written atomically. At the end the parts are joined into ``results.parquet``, and the
folder is deleted. A sweep that was interrupted continues with the missing runs.
"""

from __future__ import annotations

import io
import json
import re
import shutil
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import FormatError, InputError, MissingLibraryError, UnknownNameError
from armblocks.extras import from_extra, installed
from armblocks.files import GrowingFile, read_bounded, write_atomically

Array = NDArray[Any]

SUFFIXES = (".parquet", ".csv")
DESCRIPTION = "sweep.json"
KEY = b"armblocks sweep"
MAX_DESCRIPTION = 1 << 20
_INTEGERS = ("run", "steps", "events")
_PART = re.compile(r"runs-(\d{12})-(\d{12})\.parquet")


def _arrow() -> tuple[Any, Any, Any]:
    """The modules ``pyarrow``, ``pyarrow.parquet`` and ``pyarrow.csv``."""
    import pyarrow as pa
    import pyarrow.csv as csv
    import pyarrow.parquet as pq

    return cast("Any", pa), cast("Any", pq), cast("Any", csv)


def check_suffix(path: Path) -> None:
    """Raise ``UnknownNameError`` for an unsupported suffix, ``MissingLibraryError`` without pyarrow."""
    if path.suffix.lower() not in SUFFIXES:
        raise UnknownNameError("file type", path.suffix or path.name, SUFFIXES, where=str(path))
    if not installed("pyarrow"):
        raise MissingLibraryError("pyarrow", "data", "files with the rows of a sweep", where=str(path))


class SweepFile:
    """The files of one sweep at ``path``, with its ``identity``: digests of model, design, measures …"""

    def __init__(self, path: Path, identity: Mapping[str, str], texts: Collection[str] = ()) -> None:
        """``texts``: the names of the columns with strings.

        Raises ``InputError`` if the path contains the results of another sweep, and the errors of
        :func:`check_suffix`.
        """
        check_suffix(path)
        self.path = path
        self.folder = path.with_name(path.name + ".parts")
        self._identity = dict(identity)
        self._texts = texts
        self.complete = False
        """Whether the file has all runs."""
        if path.exists():
            self._check(_stored_identity(path), path)
            self.complete = True
            return
        description = self.folder / DESCRIPTION
        if description.exists():
            self._check(_parsed(read_bounded(description, MAX_DESCRIPTION), str(description)), self.folder)
            return
        try:
            self.folder.mkdir(parents=False, exist_ok=True)
        except OSError as error:
            raise FormatError(
                f"the folder cannot be created ({error.strerror or error})",
                where=str(self.folder),
                fix="give another path, in an existing folder with write permission",
            ) from error
        write_atomically(description, json.dumps(self._identity).encode())

    def _check(self, stored: Mapping[str, str], where: Path) -> None:
        different = [name for name, digest in self._identity.items() if stored.get(name) != digest]
        if different:
            raise InputError(
                f"the file contains the results of another sweep: {', '.join(different)} "
                f"{'differs' if len(different) == 1 else 'differ'}",
                where=str(where),
                allowed="the results of the same model, settings, design and measures",
                fix="give another path, or delete the file and its folder of parts",
            )

    @property
    def done(self) -> list[tuple[int, int]]:
        """The ranges of runs in the parts, ascending."""
        matches = (_PART.fullmatch(entry.name) for entry in self.folder.iterdir())
        return sorted((int(match[1]), int(match[2])) for match in matches if match)

    @property
    def started(self) -> bool:
        """Whether there are results of runs."""
        return self.complete or bool(self.done)

    def missing(self, count: int) -> Iterator[tuple[int, int]]:
        """The ranges of runs that are in no part."""
        position = 0
        for begin, end in self.done:
            if position < begin:
                yield position, begin
            position = max(position, end)
        if position < count:
            yield position, count

    def append(self, begin: int, columns: Mapping[str, Array]) -> None:
        """Write the part with the runs from ``begin`` on."""
        end = begin + len(next(iter(columns.values())))
        write_atomically(self._part(begin, end), _parquet(columns))

    def finish(self) -> None:
        """Join all parts into the complete file, and delete them."""
        _, pq, csv = _arrow()

        file = GrowingFile(self.path)
        try:
            if self.path.suffix.lower() == ".csv":
                # A table without its identity could not be read again, so that the identity is first.
                identity = self.path.with_name(self.path.name + ".json")
                write_atomically(identity, json.dumps(self._identity).encode())
                for number, table in enumerate(self._tables()):
                    csv.write_csv(table, file.stream, csv.WriteOptions(include_header=number == 0))
            else:
                schema = pq.read_schema(self._part(*self.done[0]))
                writer = pq.ParquetWriter(file.stream, schema)
                for table in self._tables():
                    writer.write_table(table)
                writer.add_key_value_metadata({KEY.decode(): json.dumps(self._identity)})
                writer.close()
        except BaseException:
            file.abandon()
            raise
        file.finish()
        shutil.rmtree(self.folder, ignore_errors=True)
        self.complete = True

    def read(self, names: Sequence[str]) -> dict[str, Array]:
        """Columns of all completed runs."""
        self.complete = self.complete or not self.folder.exists()  # another call has completed the sweep
        pa, pq, csv = _arrow()
        if not self.complete:
            tables: list[Any] = list(self._tables(names))
        elif self.path.suffix.lower() == ".csv":
            kinds = {name: pa.int64() if name in _INTEGERS else pa.float64() for name in names}
            kinds |= {name: pa.string() for name in names if name in self._texts}
            options = csv.ConvertOptions(include_columns=list(names), column_types=kinds)
            tables = [csv.read_csv(self.path, convert_options=options)]
        else:
            tables = [pq.read_table(self.path, columns=list(names))]
        return {name: np.concatenate([_values(table[name]) for table in tables]) for name in names}

    def _tables(self, names: Sequence[str] | None = None) -> Iterator[Any]:
        """The tables of all parts. Runs that two processes have computed at the same time occur once."""
        _, pq, _ = _arrow()
        position = 0
        for begin, end in self.done:
            table = pq.read_table(self._part(begin, end), columns=names and list(names))
            yield table.slice(max(0, position - begin))
            position = max(position, end)

    def _part(self, begin: int, end: int) -> Path:
        return self.folder / f"runs-{begin:012d}-{end:012d}.parquet"


def _stored_identity(path: Path) -> Mapping[str, str]:
    """The identity in a complete file. Raises ``FormatError`` for another file."""
    identity = b""
    if path.suffix.lower() == ".csv":
        beside = path.with_name(path.name + ".json")
        identity = read_bounded(beside, MAX_DESCRIPTION) if beside.exists() else b""
    else:
        pa, pq, _ = _arrow()
        try:
            metadata: Mapping[bytes, bytes] = pq.read_schema(path).metadata or {}
        except (pa.ArrowInvalid, OSError):
            metadata = {}
        if KEY not in metadata:
            metadata = _footer(path)
        identity = metadata.get(KEY, b"")
    try:
        return _parsed(identity, str(path))
    except FormatError:
        raise FormatError(
            "this file contains no results of a sweep",
            where=str(path),
            allowed="a file that a sweep has written, or a new file",
            fix="give another path",
        ) from None


def _footer(path: Path) -> Mapping[bytes, bytes]:
    """The metadata at the end of a Parquet file."""
    pa, pq, _ = _arrow()
    try:
        return pq.read_metadata(path).metadata or {}
    except (pa.ArrowInvalid, OSError):
        return {}


def _parsed(data: bytes, where: str) -> Mapping[str, str]:
    try:
        content = json.loads(data)
        return {str(name): str(digest) for name, digest in content.items()}
    except (ValueError, AttributeError) as error:
        raise FormatError(
            "the description of the sweep is damaged",
            where=where,
            fix="delete the folder of parts, and run it again",
        ) from error


def _parquet(columns: Mapping[str, Array]) -> bytes:
    _, pq, _ = _arrow()
    buffer = io.BytesIO()
    pq.write_table(_table(columns), buffer)
    return buffer.getvalue()


def _table(columns: Mapping[str, Array]) -> Any:
    pa, _, _ = _arrow()
    arrays: list[Any] = []
    for values in columns.values():
        if values.ndim == 2:
            flat = pa.array(np.ascontiguousarray(values).reshape(-1), from_pandas=False)
            arrays.append(pa.FixedSizeListArray.from_arrays(flat, values.shape[1]))
        elif values.dtype == object:
            arrays.append(pa.array(values.tolist(), pa.string()))
        else:
            arrays.append(pa.array(np.ascontiguousarray(values), from_pandas=False))
    return pa.table(arrays, names=list(columns))


def _values(column: Any) -> Array:
    """A column of a table as an array, ``(n,)`` or ``(n, samples)``."""
    pa, _, _ = _arrow()
    if pa.types.is_fixed_size_list(column.type):
        flat = np.asarray(column.combine_chunks().flatten())
        return flat.reshape(len(column), -1)
    values = column.to_numpy()
    return values.astype(object) if values.dtype.kind in "OUS" else np.asarray(values)


def write_table(path: Path, columns: Mapping[str, Array]) -> None:
    """Write a whole table atomically, as Parquet or (without pyarrow) as CSV.

    Raises the errors of :func:`check_suffix`.
    """
    if path.suffix.lower() == ".csv":
        import csv

        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(zip(*(values.tolist() for values in columns.values())))
        write_atomically(path, text.getvalue().encode())
        return
    check_suffix(path)
    write_atomically(path, _parquet(columns))


def to_dataframe(columns: Mapping[str, Array]) -> Any:
    """A pandas table with the index ``run``."""
    with from_extra("data", "data frames"):
        import pandas as pd

    return cast("Any", pd).DataFrame(dict(columns)).set_index("run")

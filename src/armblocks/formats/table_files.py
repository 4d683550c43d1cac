"""Tables of values over time, read from files: CSV, NPZ, MAT, Parquet. No code in files is executed."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Mapping
from os import PathLike, fspath
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armblocks.diagram import TimeTable
from armblocks.errors import FormatError, MissingLibraryError, UnknownNameError, check_type
from armblocks.extras import from_extra, installed
from armblocks.files import read_bounded

MOST_BYTES = 1 << 28
"""Maximum size of a file, 256 MiB: a million rows of thirty columns."""

Columns = Mapping[str, NDArray[np.float64]]


def load_table(path: str | PathLike[str]) -> TimeTable:
    """The table of a file, by its suffix: ``.csv``, ``.npz``, ``.mat``, ``.parquet``.

    The column or variable ``time`` (else ``t``, else the first one) contains the times in s. All others of
    the same length are values; matrices are read by columns. Files of ``result.save`` have this form. Raises
    ``FormatError`` for a file that cannot be read, and ``InputError`` if it contains no table.
    """
    check_type(path, (str, PathLike), "the path of a file", where="load_table")
    place = Path(fspath(path))
    read = _READERS.get(place.suffix.lower())
    if read is None:
        raise UnknownNameError("file type", place.suffix or place.name, list(_READERS), where=str(place))
    data = read_bounded(place, MOST_BYTES)
    try:
        columns = read(data)
    except MissingLibraryError:
        raise
    except Exception as error:
        raise FormatError(
            f"the file cannot be read: {error}"[:300],
            where=str(place),
            allowed=f"a {place.suffix} file",
            fix="write the file again with the program that created it",
        ) from None
    if not columns:
        raise FormatError(
            "the file has no columns of numbers",
            where=str(place),
            fix="one column of times, one or more of values",
        )
    key = next((name for name in ("time", "t") if name in columns), next(iter(columns)))
    count = len(columns[key])
    values = {name: column for name, column in columns.items() if name != key and len(column) == count}
    rows = np.column_stack([columns[key], *values.values()])
    return TimeTable(rows, tuple(values), fspath(place))


def _read_csv(data: bytes) -> Columns:
    text = data.decode("utf-8-sig")
    head = next(csv.reader([text.partition("\n")[0].strip()], skipinitialspace=True), [""])
    named = any(not _is_number(entry) for entry in head)
    numbers = np.loadtxt(io.StringIO(text), delimiter=",", skiprows=1 if named else 0, ndmin=2)
    names = [entry.strip() for entry in head] if named else [f"c{k}" for k in range(len(head))]
    return dict(zip(names, numbers.T, strict=True))


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _read_npz(data: bytes) -> Columns:
    with np.load(io.BytesIO(data), allow_pickle=False) as archive:
        return _columns({name: archive[name] for name in archive.files})


def _read_mat(data: bytes) -> Columns:
    with from_extra("data", "MAT files"):
        from scipy.io import loadmat

    contents: dict[str, Any] = loadmat(io.BytesIO(data))
    return _columns(_members({name: value for name, value in contents.items() if not name.startswith("__")}))


def _members(contents: Mapping[str, Any]) -> dict[str, Any]:
    """The variables, and those in structures of one element, as ``structure/member``."""
    found: dict[str, Any] = {}
    for name, value in contents.items():
        array = np.asarray(value)
        if array.dtype.names and array.size == 1:
            inside = _members({field: array[field].item() for field in array.dtype.names})
            found |= {f"{name}/{field}": member for field, member in inside.items()}
        else:
            found[name] = value
    return found


def _read_parquet(data: bytes) -> Columns:
    with from_extra("data", "Parquet files"):
        import pandas as pd

    if not installed("pyarrow"):  # pandas needs it to read Parquet
        raise MissingLibraryError("pyarrow", "data", "Parquet files")
    pandas: Any = pd
    frame = pandas.read_parquet(io.BytesIO(data)).reset_index()
    return _columns({str(name): frame[name].to_numpy() for name in frame.columns if name != "index"})


def _columns(arrays: Mapping[str, Any]) -> Columns:
    """Numeric arrays as columns; the first axis is time."""
    found: dict[str, NDArray[np.float64]] = {}
    for name, given in arrays.items():
        array = np.asarray(given)
        if array.dtype.kind not in "iuf" or array.ndim == 0:
            continue
        if array.ndim == 2 and 1 in array.shape:
            array = array.ravel()
        flat = array.reshape(array.shape[0], -1).astype(np.float64)
        for k in range(flat.shape[1]):
            found[name if flat.shape[1] == 1 else f"{name}[{k}]"] = flat[:, k]
    return found


_READERS: Mapping[str, Callable[[bytes], Columns]] = {
    ".csv": _read_csv,
    ".npz": _read_npz,
    ".mat": _read_mat,
    ".parquet": _read_parquet,
}

"""Tables of values over time, read from files: CSV, NPZ, MAT, Parquet. No code in files is executed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from os import PathLike, fspath
from pathlib import Path

from armblocks.diagram import TimeTable
from armblocks.errors import ArmblocksError, FormatError, MissingLibraryError, UnknownNameError, check_type
from armblocks.files import read_bounded
from armblocks.formats.table_arrays import read_mat, read_npz, read_parquet
from armblocks.formats.table_columns import ColumnFile, table_of
from armblocks.formats.table_csv import read_csv

MAX_BYTES = 1 << 28
"""Maximum size of a file, 256 MiB: a million rows of thirty columns."""


def load_table(path: str | PathLike[str], *, time: str = "", columns: Sequence[str] = ()) -> TimeTable:
    """The table of a file, by its suffix: ``.csv``, ``.npz``, ``.mat``, ``.parquet``.

    ``time`` is the name of the column or variable with the times. Without it, the times are in ``time``, else
    ``t``, else one of these names in any case or with a unit (``Time [ms]``), else the first column. Times
    are in s, unless the header has another unit of time. Dates are converted to seconds since the first row.

    ``columns`` are the names of the values. Without it, these are all other columns of the same length;
    matrices are read by columns. Files of ``result.save`` have this form.

    Raises ``FormatError`` for a file that cannot be read, ``InputError`` if it contains no table, and
    ``UnknownNameError`` for a column that it does not have.
    """
    check_type(path, (str, PathLike), "the path of a file", where="load_table")
    file = Path(fspath(path))
    return table_of(load_columns(file), fspath(file), time, columns, strict=is_strict(file))


def is_strict(file: Path) -> bool:
    """Whether text in a column is an error if no columns are chosen: a typing error must drop no column."""
    return file.suffix.lower() == ".csv"


def load_columns(file: Path) -> ColumnFile:
    """All columns of a file, with the reasons why some have no numbers. Raises ``FormatError``."""
    check_suffix(file)
    return columns_of(read_bounded(file, MAX_BYTES), file)


def check_suffix(file: Path) -> None:
    """Raise ``UnknownNameError`` for a file of another kind."""
    if file.suffix.lower() not in _READERS:
        raise UnknownNameError("file type", file.suffix or file.name, list(_READERS), where=str(file))


def columns_of(data: bytes, file: Path) -> ColumnFile:
    """All columns of a file with this content. Raises ``FormatError``."""
    check_suffix(file)
    try:
        return _READERS[file.suffix.lower()](data)
    except MissingLibraryError:
        raise
    except ArmblocksError as error:
        raise type(error)(error.what, where=str(file), allowed=error.allowed, fix=error.fix) from None
    except Exception as error:
        raise FormatError(
            f"the file cannot be read: {error}"[:300],
            where=str(file),
            allowed=f"a {file.suffix} file",
            fix="write the file again with the program that created it",
        ) from None


_READERS: Mapping[str, Callable[[bytes], ColumnFile]] = {
    ".csv": read_csv,
    ".npz": read_npz,
    ".mat": read_mat,
    ".parquet": read_parquet,
}
TABLE_SUFFIXES = tuple(_READERS)
"""Suffixes of files with tables."""

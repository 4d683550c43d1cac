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

MOST_BYTES = 1 << 28
"""Maximum size of a file, 256 MiB: a million rows of thirty columns."""


def load_table(path: str | PathLike[str], *, time: str = "", columns: Sequence[str] = ()) -> TimeTable:
    """The table of a file, by its suffix: ``.csv``, ``.npz``, ``.mat``, ``.parquet``.

    ``time`` is the name of the column or variable with the times. Without it, the times are in ``time``, else
    ``t``, else such a name in any case or with a unit (``Time [ms]``), else the first column. They are in s,
    unless the header states another unit of time; dates are converted to seconds since the first row.

    ``columns`` are the names of the values. Without it, these are all other columns of the same length;
    matrices are read by columns. Files of ``result.save`` have this form.

    Raises ``FormatError`` for a file that cannot be read, ``InputError`` if it contains no table, and
    ``UnknownNameError`` for a column that it does not have.
    """
    check_type(path, (str, PathLike), "the path of a file", where="load_table")
    place = Path(fspath(path))
    return table_of(load_columns(place), fspath(place), time, columns, strict=is_strict(place))


def is_strict(place: Path) -> bool:
    """Whether text in a column is an error where no columns are chosen: a typing error loses no column."""
    return place.suffix.lower() == ".csv"


def load_columns(place: Path) -> ColumnFile:
    """All columns of a file, with the reasons why some have no numbers. Raises ``FormatError``."""
    check_suffix(place)
    return columns_of(read_bounded(place, MOST_BYTES), place)


def check_suffix(place: Path) -> None:
    """Raise ``UnknownNameError`` for a file of another kind."""
    if place.suffix.lower() not in _READERS:
        raise UnknownNameError("file type", place.suffix or place.name, list(_READERS), where=str(place))


def columns_of(data: bytes, place: Path) -> ColumnFile:
    """All columns of a file with this content. Raises ``FormatError``."""
    check_suffix(place)
    try:
        return _READERS[place.suffix.lower()](data)
    except MissingLibraryError:
        raise
    except ArmblocksError as error:
        raise type(error)(error.what, where=str(place), allowed=error.allowed, fix=error.fix) from None
    except Exception as error:
        raise FormatError(
            f"the file cannot be read: {error}"[:300],
            where=str(place),
            allowed=f"a {place.suffix} file",
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

"""CSV files of measurements: delimiters, decimal commas, headers, units, gaps and dates.

A file of numbers only is read by NumPy. Any other file is read field by field, and each column gets a reason
why it has no numbers.
"""

from __future__ import annotations

import csv
import io
import itertools
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import date

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import FormatError, counted
from armblocks.formats.table_columns import (
    MAX_NUMBERS,
    Column,
    ColumnFile,
    repeated_notes,
    unique_names,
    with_units,
)

MAX_MIXED_BYTES = 64 * 2**20
"""Maximum size of a file that does not consist of numbers only."""
_SAMPLE_ROWS = 40
"""Number of rows from which the delimiter is found."""
_POINT_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?inf(inity)?", re.IGNORECASE)
_COMMA_NUMBER = re.compile(r"[+-]?(\d+,\d*|,\d+)([eE][+-]?\d+)?")
_GAPS = frozenset(("", "nan", "na", "n/a", "null", "none", "-"))
_BOOLEANS = {"true": 1.0, "false": 0.0}
_DATE = re.compile(
    r"(\d{4})-(\d\d)-(\d\d)(?:[T ](\d\d):(\d\d)(?::(\d\d)(?:[.,](\d{1,9}))?)?\s*(Z|[+-]\d\d:?\d\d)?)?"
)


@dataclass
class _Row:
    line: int
    fields: list[str]


def read_csv(data: bytes) -> ColumnFile:
    """The columns of a CSV file. Raises ``FormatError`` for a file that is not a table of text."""
    text, notes = _decoded(data)
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    head = _head(text)
    if not head:
        raise FormatError("the file is empty", where="a CSV file", fix="choose a file with rows")
    delimiter = _delimiter(head)
    rows = list(itertools.islice(_rows(text, delimiter), _SAMPLE_ROWS))
    names, units, first = _header(rows, text, delimiter)
    if delimiter != ",":
        notes.append(f"Columns are separated by {_SEPARATORS[delimiter]}.")
    columns = _numeric_columns(text, delimiter, first, names, notes)
    if columns is None:
        if len(data) > MAX_MIXED_BYTES:
            raise FormatError(
                f"the file has {len(data)} bytes and contains text or gaps",
                allowed=f"at most {MAX_MIXED_BYTES} bytes, or numbers only",
                where="a CSV file",
                fix="remove columns and rows that are not numbers",
            )
        columns = _text_columns(text, delimiter, first, names, notes)
    if names is None:
        notes.append("The file has no header: columns are named c0, c1, …")
    if units:
        columns = [replace(column, unit=unit.strip("[]() ")) for column, unit in zip(columns, units)]
    return ColumnFile(columns=with_units(columns), notes=(*notes, *repeated_notes(names or ())))


_SEPARATORS = {";": "semicolons", "\t": "tabs", " ": "spaces", ",": "commas"}


def _decoded(data: bytes) -> tuple[str, list[str]]:
    """The text of a file: UTF-8, UTF-16 with a byte order mark, else Windows-1252."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        try:
            return data.decode("utf-16"), []
        except UnicodeDecodeError:
            raise _not_text_error() from None
    if b"\0" in data[: 1 << 20]:
        raise _not_text_error()
    try:
        return data.decode("utf-8-sig"), []
    except UnicodeDecodeError:
        return data.decode("cp1252", "replace"), ["The file is not UTF-8: it is read as Windows-1252."]


def _not_text_error() -> FormatError:
    return FormatError("this is not a text file", where="a CSV file", fix="export the table as CSV")


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith("#")


def _head(text: str) -> list[str]:
    """The first lines that are neither empty nor comments."""
    lines = (line for line in _lines(text) if line.strip() and not _is_comment(line))
    return list(itertools.islice(lines, _SAMPLE_ROWS))


def _lines(text: str) -> Iterator[str]:
    start = 0
    while start < len(text):
        end = text.find("\n", start)
        end = len(text) if end < 0 else end
        yield text[start:end]
        start = end + 1


def _delimiter(head: Sequence[str]) -> str:
    """A semicolon or a tab where one is in the first line outside quotes, else a comma, else spaces."""
    unquoted = [re.sub(r'"[^"]*"', "", line) for line in head]
    for candidate in (";", "\t"):
        if candidate in unquoted[0]:
            return candidate
    spaced = [len(line.split()) > 1 and all(map(_is_plain, line.split())) for line in unquoted]
    if any(spaced) and all(spaced[min(spaced.index(True), 2) :]):  # after names and units
        return " "
    if any("," in line for line in unquoted):
        return ","
    fields = [len(line.split()) for line in unquoted]
    return " " if fields[0] > 1 and len(set(fields)) == 1 and not any('"' in line for line in head) else ","


def _is_plain(field: str) -> bool:
    """Whether a field is a number, with digits on both sides of a decimal comma."""
    return bool(
        _POINT_NUMBER.fullmatch(field) or (_COMMA_NUMBER.fullmatch(field) and re.search(r"\d,\d", field))
    )


def _rows(text: str, delimiter: str) -> Iterator[_Row]:
    """The rows of fields with their lines, without empty lines and comments."""
    if delimiter == " ":
        for number, line in enumerate(_lines(text), 1):
            if line.strip() and not _is_comment(line):
                yield _Row(number, line.partition("#")[0].split())
        return
    lines = ("" if _is_comment(line) else f"{line}\n" for line in _lines(text))
    reader = csv.reader(lines, delimiter=delimiter, skipinitialspace=True)
    try:
        for fields in reader:
            if any(field.strip() for field in fields):
                yield _Row(reader.line_num, [field.strip() for field in fields])
    except csv.Error as error:
        raise FormatError(
            f"line {reader.line_num} is not CSV: {error}",
            where="a CSV file",
            fix="export the table as CSV again",
        ) from None


def _header(
    rows: Sequence[_Row], text: str, delimiter: str
) -> tuple[list[str] | None, list[str] | None, int]:
    """The names, the units below them, and the number of the first row of values.

    The first row is a header if its fields are names. A row with numbers and text is a row of values, unless
    its first field is a name: otherwise a row of values would be omitted without a message.
    """
    first = rows[0].fields
    has_other_values = any(_is_value(field) for field in first[1:])
    is_header = not has_other_values if not first[0] else not _is_value(first[0])
    if is_header and has_other_values and len(rows) > 1:
        is_header = _is_value(rows[1].fields[0])  # otherwise the first column contains text
    if not is_header:
        return _commented_names(text, delimiter, len(first)), None, 0
    if len(rows) > 2:
        second, third = rows[1].fields, rows[2].fields
        if len(second) == len(first) and _is_value(third[0]) and not any(map(_is_value, second)):
            return first, second, 2
    return first, None, 1


def _commented_names(text: str, delimiter: str, count: int) -> list[str] | None:
    """The names in the last comment before the first row, as ``numpy.savetxt`` writes them."""
    last = ""
    for line in _lines(text):
        if line.strip() and not _is_comment(line):
            break
        last = line.lstrip().lstrip("#").strip() or last
    if not last:
        return None
    fields = last.split() if delimiter == " " else next(csv.reader([last], delimiter=delimiter))
    fields = [field.strip() for field in fields]
    return fields if len(fields) == count and not any(map(_is_value, fields)) else None


def _is_value(field: str) -> bool:
    """Whether a field is a number, a word for a missing value, a boolean or a date."""
    text = field.strip()
    is_word = text.casefold() in _GAPS | _BOOLEANS.keys() and bool(text)
    return is_word or any(pattern.fullmatch(text) for pattern in (_POINT_NUMBER, _COMMA_NUMBER, _DATE))


def _numeric_columns(
    text: str, delimiter: str, first: int, names: list[str] | None, notes: list[str]
) -> list[Column] | None:
    """The columns of a file of numbers, or ``None``."""
    body = text
    if first:
        start = 0
        for row, line in enumerate(_body_lines(text)):
            if row == first:
                break
            start = line[1]
        body = text[start:]
    if '"' in body or not body.strip():
        return None
    if delimiter != "," and "," in body:
        if "." in body:
            return None
        body = body.replace(",", ".")
        decimal = "The numbers have decimal commas."
    else:
        decimal = ""
    try:
        numbers = np.loadtxt(io.StringIO(body), delimiter=None if delimiter == " " else delimiter, ndmin=2)
    except ValueError:
        return None
    if not numbers.size or (names is not None and numbers.shape[1] != len(names)):
        return None
    if numbers.size > MAX_NUMBERS:
        raise _size_error(numbers.size)
    if decimal:
        notes.append(decimal)
    column_names = unique_names(names if names is not None else [""] * numbers.shape[1])
    return [
        Column(name=name, values=np.ascontiguousarray(values))
        for name, values in zip(column_names, numbers.T)
    ]


def _body_lines(text: str) -> Iterator[tuple[int, int]]:
    """Start and end of the lines that are neither empty nor comments."""
    start = 0
    while start < len(text):
        end = text.find("\n", start)
        end = len(text) if end < 0 else end
        line = text[start:end]
        if line.strip() and not _is_comment(line):
            yield start, end + 1
        start = end + 1


def _size_error(count: int) -> FormatError:
    return FormatError(
        f"the file has {counted(count, 'number')}",
        allowed=f"at most {MAX_NUMBERS}",
        where="a CSV file",
        fix="split or shorten it",
    )


def _text_columns(
    text: str, delimiter: str, first: int, names: list[str] | None, notes: list[str]
) -> list[Column]:
    """The columns of any table of text."""
    rows = list(_rows(text, delimiter))[first:]
    width = len(names) if names is not None else (len(rows[0].fields) if rows else 0)
    for row in rows:
        if (len(row.fields) != width and any(row.fields[width:])) or len(row.fields) < width:
            raise FormatError(
                f"line {row.line} has {counted(len(row.fields), 'field')}, and the first line has {width}",
                allowed="the same number of fields in every line",
                where="a CSV file",
                fix="correct this line; a decimal comma needs semicolons between the fields",
            )
    lines = [row.line for row in rows]
    texts = [[row.fields[k] for row in rows] for k in range(width)]
    if names is None or not names[-1]:
        while texts and not any(texts[-1]):  # a delimiter at the end of every line
            texts.pop()
    points = any(_has_point(field) for fields in texts for field in fields)
    columns: list[Column] = []
    for name, fields in zip(unique_names(list(names or [""] * len(texts))[: len(texts)]), texts):
        columns.append(_column(name, fields, lines, points=points))
    if not points and any(_COMMA_NUMBER.fullmatch(field) for fields in texts for field in fields):
        notes.append("The numbers have decimal commas.")
    return columns


def _has_point(field: str) -> bool:
    return "." in field and _POINT_NUMBER.fullmatch(field) is not None


def _column(name: str, fields: list[str], lines: list[int], *, points: bool) -> Column:
    """One column; ``points``: the file has numbers with decimal points, so a comma could mean thousands."""
    filled = [(field, line) for field, line in zip(fields, lines) if field.casefold() not in _GAPS]
    if not filled:
        return Column(name=name, kind="text", fault="all rows are empty")
    if all(field.casefold() in _BOOLEANS for field, _ in filled):
        return Column(name=name, kind="boolean", values=_numbers(fields, _BOOLEANS))
    if all(_DATE.fullmatch(field) for field, _ in filled):
        return _dates(name, fields)
    for field, line in filled:
        if _POINT_NUMBER.fullmatch(field):
            continue
        if not _COMMA_NUMBER.fullmatch(field):
            return Column(name=name, kind="text", fault=f"line {line} contains '{field[:40]}'")
        if points:
            fault = f"line {line} contains '{field[:40]}', and other numbers have decimal points"
            return Column(name=name, kind="text", fault=fault)
    values = [np.nan if field.casefold() in _GAPS else float(field.replace(",", ".")) for field in fields]
    return Column(name=name, values=np.array(values))


def _numbers(fields: Sequence[str], table: dict[str, float]) -> NDArray[np.float64]:
    return np.array([table.get(field.casefold(), np.nan) for field in fields])


def _dates(name: str, fields: Sequence[str]) -> Column:
    """Dates as seconds since the first row."""
    nanoseconds: list[int] = []
    has_time_zone: set[bool] = set()
    for field in fields:
        match = _DATE.fullmatch(field)
        if match is None:
            return Column(name=name, kind="date", fault="a row has no date")
        try:
            nanoseconds.append(_nanoseconds(match))
        except ValueError:
            return Column(name=name, kind="date", fault=f"'{field[:40]}' is not a date")
        has_time_zone.add(match[8] is not None)
    if len(has_time_zone) > 1:
        return Column(name=name, kind="date", fault="some dates have a time zone and others have none")
    return Column(name=name, kind="date", values=np.array([(m - nanoseconds[0]) / 1e9 for m in nanoseconds]))


def _nanoseconds(match: re.Match[str]) -> int:
    """The time of a date since 0001-01-01, ns. Raises ``ValueError``."""
    year, month, day = (int(match[k]) for k in (1, 2, 3))
    hours, minutes, seconds = (int(match[k] or 0) for k in (4, 5, 6))
    if hours > 23 or minutes > 59 or seconds > 60:
        raise ValueError
    whole = ((date(year, month, day).toordinal() * 24 + hours) * 60 + minutes) * 60 + seconds
    zone = match[8]
    if zone and zone != "Z":
        offset = int(zone[1:3]) * 60 + int(zone[-2:])
        whole -= 60 * (offset if zone[0] == "+" else -offset)
    return whole * 10**9 + int((match[7] or "").ljust(9, "0"))

"""Tables from files: a file is read with exactly its numbers and their meaning, or it is refused."""

from __future__ import annotations

import io
from collections.abc import Sequence
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.io import savemat

import armblocks as ab
from armblocks.errors import ArmblocksError, FormatError, InputError, UnknownNameError
from armblocks.formats.table_columns import ColumnFile, header_unit, table_of, unique_names
from armblocks.formats.table_files import columns_of

NUMBERS = st.floats(-1e9, 1e9).map(lambda value: round(value, 6))
ROWS = st.lists(st.tuples(st.floats(1e-3, 1e3), NUMBERS, NUMBERS), min_size=2, max_size=12)
TABLES = ROWS.map(lambda rows: [(t, *rest) for t, rest in zip(np.cumsum([row[0] for row in rows]), rows)])


def columns(text: str | bytes, suffix: str = ".csv") -> ColumnFile:
    return columns_of(text if isinstance(text, bytes) else text.encode(), Path(f"a{suffix}"))


def numbers(text: str | bytes, suffix: str = ".csv", **chosen: str | Sequence[str]) -> list[list[float]]:
    return np.asarray(table_of(columns(text, suffix), "a", **chosen)).tolist()  # type: ignore[arg-type]


@given(
    rows=ROWS,
    delimiter=st.sampled_from([",", ";", "\t", " "]),
    comma=st.booleans(),
    header=st.sampled_from(["none", "plain", "quoted", "comment", "units"]),
    line_end=st.sampled_from(["\n", "\r\n", "\r"]),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "cp1252"]),
    trailing=st.booleans(),
)
def test_a_csv_file_gives_its_numbers_in_every_dialect(
    rows: list[tuple[float, float, float]],
    delimiter: str,
    comma: bool,
    header: str,
    line_end: str,
    encoding: str,
    trailing: bool,
) -> None:
    times = np.cumsum([row[0] for row in rows])
    expected = [[float(time), row[1], row[2]] for time, row in zip(times, rows)]
    decimal_comma = comma and delimiter != ","
    texts = [[repr(value) for value in row] for row in expected]
    if decimal_comma:
        texts = [[text.replace(".", ",") for text in row] for row in texts]
    lines = [delimiter.join(row) for row in texts]
    names = ["t", "Größe", "y"]
    match header:
        case "plain":
            lines.insert(0, delimiter.join(names))
        case "quoted" if delimiter != " ":
            lines.insert(0, delimiter.join(f'"{name}"' for name in names))
        case "comment":
            lines.insert(0, "# " + delimiter.join(names))
        case "units" if len(rows) > 1:
            lines[:0] = [delimiter.join(names), delimiter.join(["s", "deg", "Nm"])]
        case _:
            names = ["c0", "c1", "c2"]
    if trailing and delimiter in ",;" and names[0] == "c0":
        lines = [line + delimiter for line in lines]
    text = line_end.join(["", *lines, ""])
    file = columns(text.encode(encoding))
    table = table_of(file, "a")
    assert np.asarray(table).tolist() == expected
    assert list(table.names) == names[1:]
    if header == "units":
        assert table.units == ("deg", "Nm")
    assert any("decimal commas" in note for note in file.notes) == decimal_comma


@given(ROWS, st.data())
def test_a_field_that_is_not_a_number_is_never_read_as_one(
    rows: list[tuple[float, float, float]], data: st.DataObject
) -> None:
    times = np.cumsum([row[0] for row in rows])
    texts = [[repr(float(time)), repr(row[1]), repr(row[2])] for time, row in zip(times, rows)]
    row = data.draw(st.integers(0, len(rows) - 1))
    column = data.draw(st.integers(0, 2))
    invalid = data.draw(
        st.sampled_from(["", "nan", "x", "1_000", "12:30", "0x1F", "--", "1,5", "1.234,5", "1e"])
    )
    texts[row][column] = invalid
    text = "\n".join(["time;a;b", *(";".join(fields) for fields in texts)])
    with pytest.raises(ArmblocksError) as caught:
        np.asarray(table_of(columns(text), "a", "time", ("a", "b")))
    assert ("time", "a", "b")[column] in caught.value.what
    others = [name for name in ("a", "b") if name != ("time", "a", "b")[column]]
    if column:
        assert numbers(text, columns=others)[row][1] == rows[row][3 - column]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "time,x\n0,1\n0,2\n0,3\n",
            r"the times 'time' are not ascending: row 3 of the table is 0, as in the two rows before",
        ),
        ("time,x\n0,1\n2,2\n1,3\n", "row 3 of the table is 1, after 2"),
        ("time;x\n0;1,5\n1;1.5\n", "line 2 contains '1,5', and other numbers have decimal points"),
        ("time,x\n0,1\n1,2,3\n", "line 3 has 3 fields, and the first line has 2"),
        ("0,ok,1\n1,ok,2\n", "the column 'c1' has no numbers: line 1 contains 'ok'"),
        ("time\n0\n1\n", "the file has only the times 'time'"),
        ("time,x\n0,\n1,2\n", "row 1 of the column 'x' is empty or NaN"),
        ("", "the file is empty"),
        (f"time,x\n0,{'1' * 140_000}x\n", "line 2 is not CSV: field larger than field limit"),
        ("\x00\x01\x02", "this is not a text file"),
        (
            "time,x\n01.02.2024,1\n02.02.2024,2\n",
            "the column 'time' has no numbers: line 2 contains '01.02.2024'",
        ),
    ],
)
def test_errors_of_csv_files_name_the_line_or_the_row(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(text)
    with pytest.raises(ArmblocksError, match=message):
        ab.load_table(path)


def test_columns_with_repeated_names_are_kept() -> None:
    file = columns("time,x,x,x (2)\n0,1,2,3\n1,4,5,6\n")
    assert table_of(file, "a").names == ("x", "x (3)", "x (2)")
    assert any("same name" in note for note in file.notes)


def test_tens_of_thousands_of_equal_names_are_numbered() -> None:
    names = unique_names(["x"] * 30_000)
    assert names[:3] == ["x", "x (2)", "x (3)"]
    assert len(set(names)) == len(names)


@given(st.lists(st.sampled_from(["", "a", "a (2)", "a (3)", "c0", "c1", "c1 (2)"]), max_size=9))
def test_names_are_unique_and_given_names_are_kept(names: list[str]) -> None:
    unique = unique_names(names)
    assert len(set(unique)) == len(names)
    firsts = {name: names.index(name) for name in names if name}
    assert all(unique[k] == name for name, k in firsts.items())


def test_the_column_of_times_is_found_by_name_and_unit() -> None:
    for header, factor in {
        "n,Time": 1.0,
        "n,t [s]": 1.0,
        "n,time (ms)": 1e-3,
        "n,T/us": 1e-6,
        "n,time_min": 60.0,
        "n,t[h]": 3600.0,
    }.items():
        rows = numbers(f"{header}\n7,0\n6,3\n")
        assert rows == [[0.0, 7.0], [3.0 / (1 / factor) if factor < 1 else 3.0 * factor, 6.0]], header
    assert numbers("a,b\n0,5\n1,4\n") == [[0.0, 5.0], [1.0, 4.0]]


@pytest.mark.parametrize(
    ("header", "unit"),
    [
        ("q1 [deg]", "deg"),
        ("speed (rad/s)", "rad/s"),
        ("F[N]", "N"),
        ("M[0,0]", ""),
        ("q[1]", ""),
        ("x (measured)", ""),
        ("time_ms", "ms"),
        ("block/port", ""),
    ],
)
def test_units_are_read_from_headers(header: str, unit: str) -> None:
    assert header_unit(header) == unit


@given(
    st.lists(st.integers(1, 10**12), min_size=1, max_size=6), st.sampled_from(["", "Z", "+02:00", "-0530"])
)
def test_dates_are_seconds_since_the_first_row(steps: list[int], zone: str) -> None:
    moments = [datetime(2024, 2, 28, 23, 59, 59)]
    for step in steps:
        moments.append(moments[-1] + timedelta(microseconds=step))
    lines = [f"{moment.isoformat()}{zone},{k}" for k, moment in enumerate(moments)]
    actual = numbers("\n".join(["time,k", *lines]))
    expected = [(moment - moments[0]) / timedelta(seconds=1) for moment in moments]
    assert [row[0] for row in actual] == pytest.approx(expected, rel=1e-15)


def parquet(**columns: object) -> bytes:
    buffer = io.BytesIO()
    pq.write_table(pa.table(columns), buffer)
    return buffer.getvalue()


def mat(**variables: object) -> bytes:
    buffer = io.BytesIO()
    savemat(buffer, variables)
    return buffer.getvalue()


def test_parquet_columns_of_each_type_are_converted_or_refused() -> None:
    moments = np.array(["2024-01-01T00:00:00.000000001", "2024-01-01T00:00:02"], dtype="datetime64[ns]")
    file = columns(
        parquet(
            x=[1, 2],
            time=moments,
            flag=[True, False],
            gap=[1, None],
            huge=[2**60, 2**60 + 1],
            word=["a", "b"],
        ),
        ".parquet",
    )
    table = table_of(file, "a", columns=("x", "flag"))
    assert np.asarray(table).tolist() == [[0.0, 1.0, 1.0], [1.999999999, 2.0, 0.0]]
    for name, message in {
        "gap": "row 2 of the column 'gap' is empty",
        "huge": r"exceed 2\^53",
        "word": "type string",
    }.items():
        with pytest.raises(ArmblocksError, match=message):
            table_of(file, "a", columns=(name,))
    with pytest.raises(UnknownNameError, match="no column named 'flags'"):
        table_of(file, "a", columns=("flags",))


def test_an_index_of_pandas_is_not_read_as_a_time() -> None:
    data = parquet(index=[5.0, 6.0], t=[0.0, 1.0], __index_level_0__=[3, 9])
    file = columns(data, ".parquet")
    assert [column.name for column in file.columns] == ["index", "t", "index (2)"]
    assert table_of(file, "a").names == ("index",)


@pytest.mark.parametrize("row", [False, True])
@pytest.mark.parametrize("across", [False, True])
def test_vectors_and_matrices_of_mat_files_are_read_in_both_orientations(row: bool, across: bool) -> None:
    t = np.array([0.0, 0.5, 2.0, 2.5])
    y = np.arange(8.0).reshape(4, 2)
    data = mat(t=t[None, :] if row else t[:, None], y=y.T if across else y, other=np.arange(3.0))
    assert numbers(data, ".mat") == np.column_stack([t, y]).tolist()


def test_a_matrix_with_times_in_its_first_row_or_column_is_read() -> None:
    t, y = np.array([0.0, 0.5, 2.0, 2.5]), np.array([-3.0, 1.0, 2.0, 0.0])
    expected = np.column_stack([t, y]).tolist()
    assert numbers(mat(ans=np.array([t, y])), ".mat") == expected
    assert numbers(mat(ans=np.column_stack([t, y])), ".mat") == expected
    with pytest.raises(InputError, match="both its first row and its first column can be times"):
        numbers(mat(ans=np.array([t, y + 4.0])), ".mat")


def test_mat_files_of_version_7_3_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    path.write_bytes(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512, b"\0"))
    with pytest.raises(FormatError, match=r"a MAT file of version 7\.3.*with the option -v7"):
        ab.load_table(path)


def test_the_choice_of_columns_is_stored_in_diagram_files(tmp_path: Path) -> None:
    from armblocks.blocks import FromFile, Scope

    path = tmp_path / "a.csv"
    path.write_text("n,time [ms],x,y\n9,0,1,2\n8,10,3,4\n")
    table = ab.load_table(path, time="time [ms]", columns=["y", "x"])
    assert np.asarray(table).tolist() == [[0.0, 2.0, 1.0], [0.01, 4.0, 3.0]]
    builder = ab.DiagramBuilder("d")
    builder.add("scope", Scope(), builder.add("played", FromFile(data=table)))
    diagram = builder.build()
    saved = ab.save_diagram(diagram, tmp_path / "d.json")
    assert ab.load_diagram(saved) == diagram
    assert ab.save_diagram(ab.load_diagram(saved), tmp_path / "e.json").read_text() == saved.read_text()
    assert 'time="time [ms]", columns=["y", "x"]' in ab.to_python(diagram)
    result = ab.simulate(diagram, stop_time=0.01)
    assert result.to_dataframe().columns.tolist() == ["played/y[y]", "played/y[x]"]

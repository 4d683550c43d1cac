"""Playback of short and long tables: values and integrals compared with NumPy, fixed and adaptive steps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import FromFile, Integrator, Ramp
from armblocks.diagram import Diagram, DiagramBuilder, TimeTable, trace_diagram
from armblocks.equations import SimulationOptions
from armblocks.errors import FormatError, InputError, UnknownNameError
from armblocks.simulation import SimulationResult, simulate
from compiled_diagrams import compiled

SOLVERS = pytest.mark.parametrize(("solver", "step"), [("rk45", None), ("rk4", 0.01)])
TIMES = np.array([0.5, 0.7, 1.5, 1.501, 3.0])
VALUES = np.array([[1.0, 0.0], [3.0, -1.0], [-2.0, 5.0], [4.0, 5.0], [1.0, 2.0]])


def diagram_of(**parameters: object) -> Diagram:
    builder = DiagramBuilder("d")
    block = FromFile(**parameters)  # type: ignore[arg-type]
    builder.add("integral", Integrator(), builder.add("table", block))
    return builder.build()


def run(
    diagram: Diagram, solver: str = "auto", step: float | None = None, stop: float = 4.0, count: int = 160
) -> SimulationResult:
    options = SimulationOptions(
        stop_time=stop, sample_time=stop / count, solver=solver, step=step, rtol=1e-10, atol=1e-12
    )
    return simulate(compiled(diagram), options)


@SOLVERS
@pytest.mark.parametrize("outside", ["hold", "zero"])
@pytest.mark.parametrize("method", ["linear", "flat"])
def test_values_and_integrals_agree_with_numpy(
    method: str, outside: str, solver: str, step: float | None
) -> None:
    rows = np.column_stack([TIMES, VALUES])
    result = run(diagram_of(data=rows, method=method, outside=outside), solver, step)
    t = result.time
    fine = np.unique(np.concatenate([t, TIMES]))
    for k in range(2):

        def value(at: np.ndarray, column: np.ndarray = VALUES[:, k]) -> np.ndarray:
            row = np.clip(np.searchsorted(TIMES, at, side="right") - 1, 0, 4)
            values = np.interp(at, TIMES, column) if method == "linear" else column[row]
            inside = (at >= TIMES[0]) & (at < TIMES[-1])
            return np.where(inside | (outside == "hold"), values, 0.0)

        np.testing.assert_allclose(result["table/y"][:, k], value(t), atol=1e-12)
        # between adjacent values of `fine` the signal is linear in time
        middle = (fine[1:] + fine[:-1]) / 2
        area = np.interp(t, fine, np.concatenate([[0.0], np.cumsum(np.diff(fine) * value(middle))]))
        np.testing.assert_allclose(result["integral/y"][:, k], area, atol=1e-11)


@pytest.mark.parametrize("method", ["linear", "flat"])
def test_a_table_of_20_000_rows_gives_the_same_values_as_numpy(method: str) -> None:
    random = np.random.default_rng(3)
    times = np.cumsum(random.uniform(0.5e-4, 1.5e-4, 20_000))
    values = random.normal(size=20_000)
    result = run(diagram_of(data=np.column_stack([times, values]), method=method), stop=1.8)
    t = result.time
    rows = np.clip(np.searchsorted(times, t, side="right") - 1, 0, None)
    expected = np.interp(t, times, values) if method == "linear" else values[rows]
    np.testing.assert_allclose(result["table/y"], expected, rtol=1e-9)
    middle = (values[1:] + values[:-1]) / 2 if method == "linear" else values[:-1]
    area = np.concatenate([[0.0], np.cumsum(np.diff(times) * middle)]) + times[0] * values[0]
    whole = (rows > 0) & (rows < len(times) - 1)
    rest = (t - times[rows]) * ((values[rows] + expected) / 2)
    np.testing.assert_allclose(result["integral/y"][whole], (area[rows] + rest)[whole], atol=1e-9)
    assert result.run.events >= 17_000


def test_the_equations_agree_with_numpy_in_casadi() -> None:
    system = trace_diagram(diagram_of(data=np.column_stack([TIMES, VALUES])))
    p = system.parameter_values
    for t in (0.0, 0.6, 1.5005, 2.0, 5.0):
        _, z = system.reset(t, np.zeros(2), system.initial_discrete(p)[0], (), p, [0.0])
        (y,) = system.signals(t, np.zeros(2), z, (), p)
        expected = [np.interp(t, TIMES, VALUES[:, k]) for k in range(2)]
        assert system.signals_layout.unpack(y)["table/y"] == pytest.approx(expected, abs=1e-13)


@pytest.mark.parametrize("suffix", ["csv", "npz", "mat", "parquet"])
def test_the_saved_results_of_a_run_can_be_played_back(suffix: str, tmp_path: Path) -> None:
    builder = DiagramBuilder("source")
    builder.add("r", Ramp(slope=[2.0, -1.0]))
    result = run(builder.build(), stop=1.0, count=10)
    result.save(tmp_path / f"kept.{suffix}")
    table = ab.load_table(tmp_path / f"kept.{suffix}")
    np.testing.assert_array_equal(np.asarray(table), np.column_stack([result.time, result["r/y"]]))
    assert len(table.names) == 2


def test_a_diagram_file_refers_to_the_file_of_the_table(tmp_path: Path) -> None:
    path = tmp_path / "wind.csv"
    path.write_text("time,x\n0,1\n1,3\n2.5,-2\n")
    diagram = diagram_of(data=ab.load_table(path))
    assert '"data": "wind.csv"' in ab.save_diagram(diagram, tmp_path / "d.json").read_text()
    assert ab.load_diagram(tmp_path / "d.json") == diagram
    path.write_text("time,x\n0,1\n1,4\n")
    assert ab.load_diagram(tmp_path / "d.json") != diagram
    # the table file has changed, so the rows are written into the diagram file
    assert '"data": [' in ab.save_diagram(diagram, tmp_path / "e.json").read_text()
    assert ab.load_diagram(tmp_path / "e.json") == diagram


def test_a_file_without_a_header_is_read(tmp_path: Path) -> None:
    path = tmp_path / "plain.csv"
    path.write_text("0,1,2\n1,3,4\n")
    assert np.asarray(ab.load_table(path)).tolist() == [[0.0, 1.0, 2.0], [1.0, 3.0, 4.0]]


def test_column_names_may_contain_commas(tmp_path: Path) -> None:
    path = tmp_path / "matrix.csv"
    path.write_text('time, "M[0,0]", "M[0,1]"\n0,1,2\n1,3,4\n')
    assert ab.load_table(path).names == ("M[0,0]", "M[0,1]")


def test_invalid_tables_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"the table has shape \(2,\).*times \(s\) into the first column"):
        FromFile(data=(0.0, 1.0))
    with pytest.raises(InputError, match=r"row 3 of the table is \[1\.0, 5\.0\].*drop repeated times"):
        TimeTable([[0.0, 1.0], [1.0, 2.0], [1.0, 5.0], [1.0, 6.0]])
    with pytest.raises(InputError, match="the value is 'x'"):
        FromFile(data="x")
    with pytest.raises(UnknownNameError, match=r"no file type named '\.txt'"):
        ab.load_table(tmp_path / "a.txt")
    bad = tmp_path / "bad.csv"
    bad.write_text("time,x\n0,1\n1,what\n")
    with pytest.raises(FormatError, match=r"bad\.csv: the column 'x' has no numbers: line 3 contains 'what'"):
        ab.load_table(bad)
    np.savez(tmp_path / "words.npz", a=np.array(["x"]))
    with pytest.raises(FormatError, match="the file has no columns of numbers"):
        ab.load_table(tmp_path / "words.npz")
    np.savez(tmp_path / "code.npz", a=np.array([print], dtype=object))
    with pytest.raises(FormatError, match="the file cannot be read: Object arrays cannot be loaded"):
        ab.load_table(tmp_path / "code.npz")
    rows = np.column_stack([np.arange(6000.0), np.zeros(6000)])
    with pytest.raises(
        FormatError, match=r"a table of 6000 rows is not from a file.*use the result of load_table"
    ):
        ab.save_diagram(diagram_of(data=rows), tmp_path / "big.json")

"""Sweeps: designs, tables, continued files, and bit-identical repetitions of runs."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import armblocks as ab
from armblocks import blocks
from armblocks.errors import DiagramError, FormatError, InputError, UnknownNameError
from armblocks.face import sweep as sweep_module
from armblocks.sweeps import files, scheduling
from armblocks.sweeps.files import SweepFile

VDP = "van_der_pol_pid"
SHORT: dict[str, Any] = {"stop_time": 2.0, "sample_time": 0.1}
MEASURES = {"peak": "peak(x1/y)", "iae": "iae({reference/y} - {x1/y})", "last": ab.Measure("final", "u/y")}


def decay() -> ab.Diagram:
    """``x' = -rate x`` from x0, with a stop at a level, noise, and a mask parameter."""
    builder = ab.DiagramBuilder("decay")
    builder.parameter("rate", 1.0)
    builder.parameter("size", 2)
    state = builder.add("state", blocks.Integrator(initial=1.0))
    gain = builder.add("gain", blocks.Gain(gain=ab.formula("-rate")), state)
    builder.connect(gain["y"], state["u"])
    level = builder.add("level", blocks.Constant(value=0.0))
    below = builder.add("below", blocks.RelationalOperator(relation="<"), state, level)
    builder.add("stop", blocks.StopSimulation(), below)
    noise = builder.add("noise", blocks.RandomNumber(sample_time=0.5))
    builder.add("scope", blocks.Scope(), noise)
    return builder.build()


def test_numbers_of_runs_and_values_are_integers() -> None:
    result = ab.sweep(decay(), {"rate": [1.0, 2.0, 3.0]}, measures={"end": "final(state/y)"}, **SHORT)
    assert result.largest("end", 2).tolist() == [0, 1] and result.smallest("end", np.int64(1)).tolist() == [2]
    for count in (-1, 1.5, True):
        with pytest.raises(InputError, match="an integer number of runs, 0 or more"):
            result.largest("end", count)  # pyright: ignore[reportArgumentType]
    for run in (0.5, 3, -1, True):
        with pytest.raises(InputError, match=f"run {run!r} does not exist. Allowed: 0 to 2"):
            result.run(run)  # pyright: ignore[reportArgumentType]
    for count in (-1, 0, 2.5, True):
        for spaced in (ab.linspace, ab.geomspace):
            with pytest.raises(InputError, match=f"the number of values is {count}. Allowed: an integer, 1"):
                spaced(1, 2, count)  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError, match="'a' is not a finite number"):
        ab.linspace("a", 1, 3)  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError, match="nan is not a finite number"):
        ab.geomspace(1, np.nan, 3)
    with pytest.raises(InputError, match="two numbers of the same sign, other than 0"):
        ab.geomspace(-1, 1, 3)


def assert_same_table(first: ab.SweepResult, second: ab.SweepResult) -> None:
    assert first.names == second.names
    for name in (*first.names, *first.kept):
        one, other = first[name], second[name]
        assert np.array_equal(one, other, equal_nan=one.dtype.kind == "f"), name


def test_a_grid_has_all_combinations_in_order() -> None:
    result = ab.sweep(VDP, {"PID.P": [1, 2], "x1.initial": ab.linspace(0, 1, 3)}, **SHORT)
    assert len(result) == 6
    assert result["PID.P"].tolist() == [1, 1, 1, 2, 2, 2]
    assert result["x1.initial"].tolist() == [0.0, 0.5, 1.0] * 2
    assert set(result["status"]) == {"completed"}
    assert result.complete


def test_a_run_opens_again_with_the_same_bits() -> None:
    vary = {"PID.P": ab.loguniform(1, 100), "damping.gain": ab.normal(0.5, 0.1), "x1.initial": [0.0, 1.0]}
    result = ab.sweep(VDP, vary, runs=8, seed=3, design="latin", measures=MEASURES, keep="u/y", **SHORT)
    for run in (0, 5):
        again = result.run(run)
        assert np.abs(again["x1/y"]).max() == result["peak"][run]
        assert np.array_equal(again["u/y"], result["u/y"][run])
        assert np.array_equal(again.time, result.time)
        assert again.run.steps == result["steps"][run]
        same = ab.simulate(VDP, parameters=result.parameters(run), **SHORT)
        assert np.array_equal(same.signals, again.signals)
    worst = result.largest("peak", 3)
    assert np.array_equal(worst, np.argsort(-result["peak"])[:3])
    assert result.smallest("peak")[0] == np.argmin(result["peak"])


def test_tables_do_not_depend_on_threads_and_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    vary = {"PID.P": ab.uniform(1, 5)}
    whole = ab.sweep(VDP, vary, runs=40, measures=MEASURES, threads=1, **SHORT)
    monkeypatch.setattr(scheduling, "FIRST_RUNS", 1)
    monkeypatch.setattr(scheduling, "MAX_RUNS", 3)
    assert_same_table(whole, ab.sweep(VDP, vary, runs=40, measures=MEASURES, threads=3, **SHORT))
    rows = [{"PID.P": value} for value in whole["PID.P"][::-1].tolist()]
    reversed_order = ab.sweep(VDP, rows, measures=MEASURES, **SHORT)
    assert np.array_equal(reversed_order["iae"][::-1], whole["iae"])


@pytest.mark.parametrize("design", ["random", "sobol", "halton", "latin"])
def test_designs_follow_their_distributions(design: str) -> None:
    vary = {"gain.gain": ab.uniform(2, 3), "state.initial": ab.loguniform(1, 100)}
    builder = ab.DiagramBuilder("two")
    state = builder.add("state", blocks.Integrator())
    builder.connect(builder.add("gain", blocks.Gain(), state)["y"], state["u"])
    diagram = builder.build()
    first, second = (
        ab.sweep(diagram, vary, runs=256, design=design, seed=4, stop_time=0.01, sample_time=0.01)
        for _ in range(2)
    )
    assert_same_table(first, second)
    values = first["gain.gain"]
    assert values.min() >= 2.0 and values.max() <= 3.0
    assert abs(values.mean() - 2.5) < 0.1
    assert abs(np.log10(first["state.initial"]).mean() - 1.0) < 0.1


def test_seeds_give_each_run_its_noise() -> None:
    diagram = decay()
    same = ab.sweep(diagram, {"state.initial": [1, 2]}, keep="noise/y", **SHORT)
    assert np.array_equal(same["noise/y"][0], same["noise/y"][1])
    other = ab.sweep(diagram, {"noise.seed": ab.seeds()}, runs=2, keep="noise/y", **SHORT)
    assert other["noise.seed"].tolist() == [1.0, 2.0]
    assert not np.array_equal(other["noise/y"][0], other["noise/y"][1])


def test_stopped_failed_and_long_runs_are_rows() -> None:
    diagram = decay()
    vary = {"rate": [1.0, -1e3], "level.value": [0.0, 0.5]}
    result = ab.sweep(diagram, vary, measures={"end": "final(state/y)"}, keep="state/y", **SHORT)
    assert result["status"].tolist() == ["completed", "stopped", "failed", "failed"]
    assert "stopped by block 'stop' at 0.693147" in result["message"][1]
    assert result["end"][1] == pytest.approx(0.5)
    assert np.isnan(result["state/y"][1][10:]).all()
    assert np.isnan(result["end"][2:]).all() and result["message"][2]
    assert result.failed.tolist() == [2, 3]
    for run in (0, 1):
        again = result.run(run)
        assert again["state/y"][-1] == result["end"][run]
    limited = ab.sweep(VDP, {"PID.P": [1.0]}, max_steps=3, **SHORT)
    assert limited["status"].tolist() == ["step limit"]
    assert "not finished after 3 steps" in limited["message"][0]


def test_masks_entries_and_constants_of_the_equations_vary() -> None:
    diagram = decay()
    result = ab.sweep(diagram, {"rate": [0.5, 2.0]}, measures={"end": "final(state/y)"}, **SHORT)
    assert result["end"] == pytest.approx(np.exp([-1.0, -4.0]), rel=1e-5)
    builder = ab.DiagramBuilder("vector")
    source = builder.add("source", blocks.Constant(value=[1.0, 2.0]))
    builder.add("scope", blocks.Scope(), builder.add("integrator", blocks.Integrator(initial=[0, 0]), source))
    vector = builder.build()
    entries = ab.sweep(
        vector, {"source.value[1]": [3.0, 4.0]}, measures={"end": "final(source/y[1])"}, **SHORT
    )
    assert entries["end"].tolist() == [3.0, 4.0]
    whole = ab.sweep(vector, {"source.value": [[1.0, 2.0], [5.0, 6.0]]}, keep=("source/y",), **SHORT)
    assert whole.kept == ("source/y[0]", "source/y[1]")
    assert whole["source.value[1]"].tolist() == whole["source/y[1]"][:, 0].tolist() == [2.0, 6.0]
    periods = ab.sweep(decay(), {"noise.sample_time": [0.5, 0.25]}, measures={"end": "rms(noise/y)"}, **SHORT)
    assert "1 model compiled" in periods.remark or "2 models compiled" in periods.remark
    for run in (0, 1):
        assert periods.run(run).run.ticks == (5, 9)[run]


def test_every_column_has_a_name_of_its_own() -> None:
    builder = ab.DiagramBuilder("vector")
    source = builder.add("source", blocks.Constant(value=[1.0, 2.0]))
    builder.add("scope", blocks.Scope(), builder.add("integrator", blocks.Integrator(initial=[0, 0]), source))
    diagram = builder.build()
    with pytest.raises(InputError, match=r"'source.value\[0\]' varies twice: as an entry"):
        ab.sweep(diagram, {"source.value[0]": [7.0], "source.value": [[5.0, 6.0]]}, **SHORT)
    measures = {"source.value[0]": "final(source/y[0])"}
    with pytest.raises(InputError, match=r"'source.value\[0\]' of a measure is used by another column"):
        ab.sweep(diagram, {"source.value": [[5.0, 6.0]]}, measures=measures, **SHORT)
    rows = [{"source.value": [0.0] * n, "integrator.initial": [0.0] * n} for n in (2, 3)]
    with pytest.raises(InputError, match=r"the kept signal 'source/y\[2\]' does not exist in all runs"):
        ab.sweep(diagram, rows, keep="source/y", **SHORT)
    assert len(ab.sweep(diagram, rows, keep="source/y[1]", **SHORT)) == 2


def test_equal_texts_are_compiled_once() -> None:
    texts = np.array(["<", ">"] * 3)
    result = ab.sweep(decay(), {"below.relation": texts}, design="paired", **SHORT)
    assert "2 models" in result.remark or "1 model " in result.remark


def test_python_functions_measure_results() -> None:
    def half_peak(result: ab.SimulationResult) -> float:
        return 0.5 * float(np.abs(result["x1/y"]).max())

    measures = {"peak": "peak(x1/y)", "half": half_peak}
    result = ab.sweep(VDP, {"PID.P": [1.0, 2.0]}, measures=measures, **SHORT)
    assert np.array_equal(result["half"], 0.5 * result["peak"])
    assert "'half' is a Python function" in result.remark


def test_files_need_models_and_measures_of_known_content(tmp_path: Path) -> None:
    unknown = object()
    measures = {"a": lambda _: hash(unknown)}
    with pytest.raises(InputError, match="a measure uses Python code of unknown content"):
        ab.sweep(VDP, {"PID.P": [1.0]}, measures=measures, out=tmp_path / "t.csv", **SHORT)


@pytest.mark.parametrize("name", ["table.parquet", "table.csv"])
def test_an_interrupted_sweep_continues(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / name
    monkeypatch.setattr(scheduling, "MAX_RUNS", 10)
    monkeypatch.setattr(sweep_module, "PART_RUNS", 10)
    monkeypatch.setattr(sweep_module, "PROGRESS_SECONDS", 0.0)
    vary = {"PID.P": ab.linspace(1, 5, 60)}

    def interrupt(done: int, runs: int, rate: float, remaining: float) -> None:
        if done >= 30:
            raise KeyboardInterrupt

    part = ab.sweep(VDP, vary, measures=MEASURES, out=path, progress=interrupt, threads=1, **SHORT)
    assert not part.complete and 0 < len(part) < 60 and not path.exists()
    assert "INCOMPLETE" in repr(part)
    done = len(part)
    computed: list[int] = []
    groups = scheduling.Worker.compute

    def counted(worker: Any, parameters: Any) -> Any:
        computed.append(len(parameters))
        return groups(worker, parameters)

    monkeypatch.setattr(scheduling.Worker, "compute", counted)
    whole = ab.sweep(VDP, vary, measures=MEASURES, out=path, **SHORT)
    assert sum(computed) == 60 - done
    assert_same_table(whole, ab.sweep(VDP, vary, measures=MEASURES, **SHORT))
    assert not (tmp_path / f"{name}.parts").exists()
    computed.clear()
    assert_same_table(whole, ab.sweep(VDP, vary, measures=MEASURES, out=path, **SHORT))
    assert not computed
    for changed, what in (
        ({"vary": {"PID.P": ab.linspace(1, 6, 60)}}, "design differs"),
        ({"measures": {"peak": "rms(x1/y)"}}, "measures differs"),
        ({"stop_time": 3.0}, "settings differs"),
        ({"parameters": {"damping.gain": 2.0}}, "model differs"),
    ):
        arguments: dict[str, Any] = {"vary": vary, "measures": MEASURES, **SHORT, **changed}
        with pytest.raises(InputError, match=f"results of another sweep: {what}"):
            ab.sweep(VDP, arguments.pop("vary"), out=path, **arguments)


def test_a_file_belongs_to_the_exact_options_of_its_measures(tmp_path: Path) -> None:
    for reference in (1.0, 1.0 + 1e-9):
        measures = {"a": ab.Measure("iae", "x1/y", {"reference": reference})}
        arguments: Any = {"measures": measures, "out": tmp_path / "table.parquet", **SHORT}
        if reference == 1.0:
            ab.sweep(VDP, {"PID.P": [1.0]}, **arguments)
            continue
        with pytest.raises(InputError, match="measures differs"):
            ab.sweep(VDP, {"PID.P": [1.0]}, **arguments)


@pytest.mark.parametrize("name", ["", "table.parquet", "table.csv"])
def test_a_sweep_that_is_interrupted_at_once_has_no_rows(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(worker: Any, parameters: Any) -> Any:
        raise KeyboardInterrupt

    monkeypatch.setattr(scheduling.Worker, "compute", interrupted)
    arguments: Any = {"measures": MEASURES, "out": tmp_path / name if name else None, **SHORT}
    empty = ab.sweep(VDP, {"PID.P": [1.0, 2.0]}, **arguments)
    assert "0 runs of 2, INCOMPLETE" in repr(empty) and not empty.complete
    assert len(empty) == 0 and not empty.failed.size
    empty.save(tmp_path / "empty.csv")
    assert len((tmp_path / "empty.csv").read_text().splitlines()) == 1


@pytest.mark.parametrize("name", ["table.parquet", "table.csv"])
def test_runs_that_two_processes_have_computed_occur_once(name: str, tmp_path: Path) -> None:
    file = SweepFile(tmp_path / name, {"model": "a"})
    for begin, end in ((0, 4), (2, 3), (2, 6), (6, 7)):
        file.append(begin, {"run": np.arange(begin, end), "y": np.arange(begin, end) * 0.5})
    for complete in (False, True):
        assert file.complete == complete
        assert file.read(["run"])["run"].tolist() == list(range(7))
        assert file.read(["y"])["y"].tolist() == [0.5 * run for run in range(7)]
        if not complete:
            file.finish()


def test_a_csv_file_is_complete_only_with_its_identity(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = SweepFile(tmp_path / "table.csv", {"model": "a"})
    file.append(0, {"run": np.arange(3)})

    def fail(path: Path, data: bytes) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(files, "write_atomically", fail)
    with pytest.raises(KeyboardInterrupt):
        file.finish()
    monkeypatch.undo()
    again = SweepFile(tmp_path / "table.csv", {"model": "a"})
    assert not again.complete and again.done == [(0, 3)]
    again.finish()
    assert SweepFile(tmp_path / "table.csv", {"model": "a"}).complete


def test_files_of_others_are_not_replaced(tmp_path: Path) -> None:
    for name in ("table.csv", "table.parquet"):
        (tmp_path / name).write_text("time,x\n")
        with pytest.raises(FormatError, match="no results of a sweep"):
            ab.sweep(VDP, {"PID.P": [1.0]}, out=tmp_path / name, **SHORT)
    with pytest.raises(UnknownNameError, match="xlsx"):
        ab.sweep(VDP, {"PID.P": [1.0]}, out=tmp_path / "table.xlsx", **SHORT)
    with pytest.raises(FormatError, match="the folder cannot be created"):
        ab.sweep(VDP, {"PID.P": [1.0]}, out=tmp_path / "none" / "table.csv", **SHORT)
    (tmp_path / "new.csv.parts").mkdir()
    (tmp_path / "new.csv.parts" / "sweep.json").write_text("{")
    with pytest.raises(FormatError, match="description of the sweep is damaged"):
        ab.sweep(VDP, {"PID.P": [1.0]}, out=tmp_path / "new.csv", **SHORT)


def test_tables_are_saved_shown_and_copied(tmp_path: Path) -> None:
    result = ab.sweep(VDP, {"PID.P": [1.0, 2.0]}, measures=MEASURES, **SHORT)
    frame = result.to_dataframe()
    assert frame.index.name == "run"
    assert frame["peak"].tolist() == result["peak"].tolist()
    for name in ("t.csv", "t.parquet"):
        result.save(tmp_path / name)
    assert (tmp_path / "t.csv").read_text().startswith("run,PID.P,status,message,peak,iae,last,steps")
    assert "2 runs" in repr(result) and "median" in repr(result)
    copy = pickle.loads(pickle.dumps(result))
    assert_same_table(copy, result)
    assert np.array_equal(copy.run(1).signals, result.run(1).signals)
    with pytest.raises(InputError, match="run 2 does not exist"):
        result.run(2)
    with pytest.raises(UnknownNameError, match="peek"):
        result["peek"]
    with pytest.raises(InputError, match="the column 'status' has no numbers"):
        result.largest("status")


def test_probabilities_and_correlations_of_a_table() -> None:
    builder = ab.DiagramBuilder("product")
    one, two = (builder.add(name, blocks.Constant(value=1.0)) for name in ("one", "two"))
    builder.add("scope", blocks.Scope(), builder.add("product", blocks.Product(operators="**"), one, two))
    vary = {"one.value": ab.linspace(1, 10, 10), "two.value": [-1.0, -2.0]}
    result = ab.sweep(builder.build(), vary, measures={"y": "final(product/y)"}, **SHORT)
    share, low, high = result.probability("one.value", high=8.0)
    assert share == 0.8
    assert (low, high) == pytest.approx((0.5840, 0.9193), abs=1e-4)  # 16 of 20, E. B. Wilson
    assert result.probability("y", high=0.0)[::2] == (1.0, 1.0)
    assert result.probability("y", low=0.0)[:2] == (0.0, 0.0)
    correlations = result.correlations("y")
    assert list(correlations) == ["one.value", "two.value"]
    stats = pytest.importorskip("scipy.stats")
    for name, value in correlations.items():
        assert value == pytest.approx(stats.spearmanr(result[name], result["y"]).statistic, abs=1e-12)
    with pytest.raises(InputError, match="the confidence is 2"):
        result.probability("y", confidence=2.0)


def test_a_table_of_pandas_is_a_paired_design() -> None:
    pandas = pytest.importorskip("pandas")
    table = pandas.DataFrame({"PID.P": [1.0, 2.0], "x1.initial": [0.5, 0.25]})
    result = ab.sweep(VDP, table, **SHORT)
    assert result["x1.initial"].tolist() == [0.5, 0.25]
    paired = ab.sweep(VDP, table.to_dict("list"), design="paired", **SHORT)
    assert_same_table(result, paired)
    column = ab.sweep(VDP, {"PID.P": table["PID.P"]}, **SHORT)
    assert column["PID.P"].tolist() == [1.0, 2.0]
    twice = pandas.DataFrame([[1.0, 2.0]], columns=["PID.P", "PID.P"])
    with pytest.raises(InputError, match=r"the table has several columns 'PID\.P'"):
        ab.sweep(VDP, twice, **SHORT)


@pytest.mark.parametrize(
    ("vary", "more", "message"),
    [
        ({"PID.Q": [1]}, {}, "Q"),
        ({"PID.P": [1.0, np.nan]}, {}, "'PID.P' has a value that is not finite"),
        ({"PID.P": []}, {}, "'PID.P' has no values"),
        ({}, {}, "vary is {}"),
        ({"PID.N": [1.0, -1.0]}, {}, "run 1"),
        ({"PID.P": ab.uniform(1, 2)}, {}, "the number of runs is missing"),
        ({"PID.P": ab.uniform(1, 2)}, {"design": "grid"}, "the design is a grid"),
        ({"PID.P": ab.uniform(1, 2)}, {"design": "gird", "runs": 2}, "gird"),
        ({"PID.P": [1, 2]}, {"runs": 3}, "runs is 3"),
        ({"PID.P": ab.uniform(1, 2)}, {"runs": 2.0}, r"runs is 2\.0.*an integer from 0 on"),
        ({"PID.P": ab.uniform(1, 2)}, {"runs": 2, "seed": -1}, "seed is -1.*an integer from 0 on"),
        ({"PID.P": range(10**5), "PID.D": range(10**5)}, {}, "has 10000000000 runs.*at most 1000000000"),
        ({"PID.P": [1]}, {"threads": 1.5}, "threads is 1.5, not an integer above 0"),
        ({"PID.P": [1, 2], "PID.D": [1]}, {"design": "paired"}, "different lengths"),
        ({"PID.P": [1]}, {"keep": "x1/y", "out": "a.csv"}, "a CSV file has no columns"),
        ({"PID.P": [1]}, {"max_steps": 0}, "max_steps is 0, not an integer above 0"),
        ({"PID.P": [1]}, {"measures": {"status": "peak(x1/y)"}}, "'status' of a measure is used"),
        ({"PID.P": [1]}, {"measures": {"a": 3}}, "the measure 'a' is a int"),
        ({"PID.P": [1]}, {"measures": {"a": "peak(x9/y)"}}, "x9/y"),
        ({"PID.P": [1]}, {"measures": {"a": "peak([{x1/y}, {x2/y}])"}}, "has 2 entries"),
    ],
)
def test_messages_of_invalid_sweeps(vary: Any, more: dict[str, Any], message: str) -> None:
    with pytest.raises((InputError, DiagramError, UnknownNameError), match=message):
        ab.sweep(VDP, vary, **more, **SHORT)


def test_values_of_a_block_are_checked_together() -> None:
    builder = ab.DiagramBuilder("limits")
    sine = builder.add("sine", blocks.SineWave())
    builder.add("scope", blocks.Scope(), builder.add("limit", blocks.Saturation(lower=-1.0, upper=1.0), sine))
    diagram = builder.build()
    with pytest.raises(DiagramError, match=r"block 'limit'.*run 2"):
        ab.sweep(diagram, {"limit.lower": [-2.0, 0.0, 2.0]}, **SHORT)
    both = [{"limit.lower": 2.0, "limit.upper": 3.0}, {"limit.lower": 2.0, "limit.upper": 1.0}]
    with pytest.raises(DiagramError, match=r"block 'limit'.*run 1"):
        ab.sweep(diagram, both, **SHORT)
    result = ab.sweep(diagram, both[:1], measures={"least": "minimum(limit/y)"}, **SHORT)
    assert result["least"].tolist() == [2.0]


def test_messages_of_invalid_distributions_and_entries() -> None:
    with pytest.raises(InputError, match="uniform has the bounds 2 and 1"):
        ab.uniform(2, 1)
    with pytest.raises(InputError, match="loguniform has the bound 0"):
        ab.loguniform(0, 1)
    with pytest.raises(InputError, match="normal has the mean 0 and the standard deviation 0"):
        ab.normal(0, 0)
    with pytest.raises(InputError, match=r"the first seed is 1\.5"):
        ab.seeds(1.5)  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError, match="the first seed is -1"):
        ab.seeds(-1)
    builder = ab.DiagramBuilder("vector")
    builder.add("scope", blocks.Scope(), builder.add("source", blocks.Constant(value=[1.0, 2.0])))
    with pytest.raises(UnknownNameError, match=r"source.value\[2\]"):
        ab.sweep(builder.build(), {"source.value[2]": [3.0]}, **SHORT)
    with pytest.raises(InputError, match="the signal 'source/y' has 2 entries"):
        ab.sweep(builder.build(), {"source.value[1]": [3.0]}, measures={"a": "peak(source/y)"}, **SHORT)
    with pytest.raises(UnknownNameError, match=r"source/y\[5\]"):
        ab.sweep(builder.build(), {"source.value[1]": [3.0]}, measures={"a": "peak(source/y[5])"}, **SHORT)

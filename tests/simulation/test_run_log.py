"""Runs with a log file: equal values, bounded memory, no lost samples."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from hybrid_systems import bouncing_ball, relay_oscillator, sampled_loop
from small_systems import oscillator, scalar, van_der_pol_pid
from small_systems import system as small_system

from armblocks.equations import SimulationOptions, signature
from armblocks.errors import FormatError, InputError, SimulationError, UnknownNameError
from armblocks.integration.native_integrator import Integration
from armblocks.integration.system import CompiledSystem, compile_system
from armblocks.simulation import LogRequest, Simulation, SimulationResult, run_log, simulate
from armblocks.simulation.run_log import View

SYSTEMS = {
    "van_der_pol": compile_system(van_der_pol_pid()),
    "ball": compile_system(bouncing_ball(0.9)),
    "sampled": compile_system(sampled_loop(0.3)),
    "relay": compile_system(relay_oscillator()),
    "source": compile_system(
        small_system("source", signals=signature(("ramp/y", ())), outputs=lambda t, x, p: 2.0 * t)
    ),
}


def read(path: Path) -> tuple[list[str], np.ndarray]:
    """Return names and columns of a log."""
    if path.suffix == ".parquet":
        table = pq.read_table(str(path))
        columns = [table.column(name).to_numpy() for name in table.column_names]  # pyright: ignore
        return table.column_names, np.array(columns)
    with path.open(newline="") as stream:
        rows = list(csv.reader(stream))
    return rows[0], np.array([[float(value) for value in row] for row in rows[1:]]).T


def run_with_log(
    system: CompiledSystem, path: Path, options: SimulationOptions, signals: tuple[str, ...] = ()
) -> SimulationResult:
    return simulate(system, options, log=LogRequest(path=path, signals=signals))


@pytest.fixture
def small_windows(monkeypatch: pytest.MonkeyPatch) -> None:
    """Set windows of a few samples, so that short runs have many windows and a step may span several."""
    monkeypatch.setattr("armblocks.simulation.run_log.window_rows", lambda width: 7)


@pytest.mark.parametrize("suffix", [".parquet", ".csv"])
@pytest.mark.parametrize(("solver", "step"), [("rk45", None), ("rk4", 0.013), ("rodas5p", None)])
@pytest.mark.parametrize("name", list(SYSTEMS))
@pytest.mark.usefixtures("small_windows")
def test_a_log_equals_the_run_in_memory_bit_for_bit(
    name: str, solver: str, step: float | None, suffix: str, tmp_path: Path
) -> None:
    options = SimulationOptions(stop_time=4.0, sample_time=0.01, solver=solver, step=step)
    whole = simulate(SYSTEMS[name], options).with_jumps()
    result = run_with_log(SYSTEMS[name], tmp_path / f"log{suffix}", options)
    names, columns = read(tmp_path / f"log{suffix}")
    assert tuple(names) == ("time", *whole.columns())
    assert columns[0].tobytes() == whole.time.tobytes()
    assert columns[1:].tobytes() == whole.signals.tobytes()
    assert result.log is not None and result.log.rows == whole.time.size
    assert result.run.steps == whole.run.steps and result.run.complete
    assert result.final_state is not None and whole.final_state is not None
    assert result.final_state.states.tobytes() == whole.final_state.states.tobytes()
    # All rows of a short run are also kept in memory.
    assert result.signals.tobytes() == whole.signals.tobytes()
    assert result.states.tobytes() == whole.states.tobytes()


def test_a_view_keeps_the_extremes_and_is_limited_in_size() -> None:
    rng = np.random.default_rng(3)
    table = rng.normal(size=(5, 300_000))
    view = View(table.shape[1], watched=[1, 2, 4])
    for start in range(0, 300_000, 1777):
        view.append(table[:, start : start + 1777])
    view_rows = view.rows()
    assert view_rows.shape[1] < 1.1 * run_log.VIEW_ROWS
    assert np.isin(view_rows[0], table[0]).all()
    for row in (1, 2, 4):
        assert view_rows[row].min() == table[row].min() and view_rows[row].max() == table[row].max()
    # The view has the extremes of every interval of the table.
    length = 300_000 * 7 // run_log.VIEW_ROWS
    intervals = table[2, : 300_000 // length * length].reshape(-1, length)
    assert np.isin(intervals.max(axis=1), view_rows[2]).all()


def test_a_log_has_the_chosen_signals_and_the_run_report(tmp_path: Path) -> None:
    path = tmp_path / "log.parquet"
    result = run_with_log(
        SYSTEMS["van_der_pol"], path, SimulationOptions(stop_time=2.0), ("pid/u", "position")
    )
    names, _ = read(path)
    assert names == ["time", "pid/u", "position/y"]
    message = json.loads(pq.read_metadata(str(path)).metadata[b"armblocks"])  # pyright: ignore
    assert message["run"]["steps"] == result.run.steps and message["run"]["complete"]
    assert "all 1001 rows in" in repr(result)


@pytest.mark.usefixtures("small_windows")
def test_a_log_reflects_a_parameter_change_during_the_run(tmp_path: Path) -> None:
    system = compile_system(oscillator())
    options = SimulationOptions(stop_time=3.0, sample_time=0.01)

    def run(log: LogRequest | None) -> Simulation:
        simulation = Simulation(system, options, log=log)
        simulation.advance(1.234)
        simulation.set({"mass.omega": 3.0})
        simulation.advance()
        return simulation

    whole = run(None).result()
    run(LogRequest(path=tmp_path / "log.parquet")).result()
    _, columns = read(tmp_path / "log.parquet")
    assert columns[1:].tobytes() == whole.signals.tobytes()


@pytest.mark.usefixtures("small_windows")
@pytest.mark.parametrize("moment", ["before", "after"])
def test_an_interrupted_logged_run_can_continue_without_lost_samples(
    moment: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C during an integration call, before or after the call transferred its window."""
    options = SimulationOptions(stop_time=4.0, sample_time=0.01)
    whole = simulate(SYSTEMS["relay"], options).with_jumps()
    calls = [0]

    def interrupting(method: Callable[..., None]) -> Callable[..., None]:
        def call(self: Integration, *arguments: object) -> None:
            calls[0] += 1
            if calls[0] % 17 == 16 and moment == "before":
                raise KeyboardInterrupt
            method(self, *arguments)
            if calls[0] % 17 == 16 and moment == "after":
                raise KeyboardInterrupt

        return call

    run = Simulation(SYSTEMS["relay"], options, log=LogRequest(path=tmp_path / "log.parquet"))
    monkeypatch.setattr(Integration, "restore", interrupting(Integration.restore))
    interruptions = 0
    while not run.finished:
        try:
            run.advance()
        except KeyboardInterrupt:
            interruptions += 1
    run.result()
    assert interruptions > 0
    _, columns = read(tmp_path / "log.parquet")
    assert columns[0].tobytes() == whole.time.tobytes()
    assert columns[1:].tobytes() == whole.signals.tobytes()


@pytest.mark.usefixtures("small_windows")
def test_the_log_of_a_failed_run_has_all_samples_before_the_failure(tmp_path: Path) -> None:
    options = SimulationOptions(stop_time=4.0, sample_time=0.01)
    system = compile_system(scalar("blow_up", lambda t, x, p: x * x, 1.0))
    with pytest.raises(SimulationError) as caught:
        run_with_log(system, tmp_path / "log.parquet", options)
    _, columns = read(tmp_path / "log.parquet")
    assert 0.95 < columns[0][-1] <= 1.0
    partial = caught.value.partial
    assert isinstance(partial, SimulationResult) and partial.log is not None
    assert partial.log.rows == columns.shape[1]


@pytest.mark.usefixtures("small_windows")
def test_the_log_ends_before_a_signal_that_is_not_finite(tmp_path: Path) -> None:
    system = compile_system(
        small_system("pole", signals=signature(("pole/y", ())), outputs=lambda t, x, p: 1 / (t - 2.0))
    )
    with pytest.raises(SimulationError, match="signal 'pole/y' is inf at 2 s"):
        run_with_log(system, tmp_path / "log.csv", SimulationOptions(stop_time=4.0, sample_time=0.125))
    _, columns = read(tmp_path / "log.csv")
    assert columns[0][-1] == 1.875


def test_invalid_log_requests_are_refused_before_the_run(tmp_path: Path) -> None:
    options = SimulationOptions()
    with pytest.raises(UnknownNameError, match=r"no log file type named '.npz'"):
        run_with_log(SYSTEMS["relay"], tmp_path / "log.npz", options)
    with pytest.raises(UnknownNameError, match="no signal named 'relai"):
        run_with_log(SYSTEMS["relay"], tmp_path / "log.csv", options, ("relai/y",))
    with pytest.raises(FormatError, match="does not exist"):
        run_with_log(SYSTEMS["relay"], tmp_path / "nowhere" / "log.csv", options)
    assert list(tmp_path.iterdir()) == []


def test_a_logged_run_may_have_more_samples_than_fit_in_memory(tmp_path: Path) -> None:
    options = SimulationOptions(stop_time=1e6, sample_time=1e-4)
    with pytest.raises(InputError, match="or log the run to a file"):
        Simulation(SYSTEMS["source"], options)
    run = Simulation(SYSTEMS["source"], options, log=LogRequest(path=tmp_path / "log.parquet"))
    run.advance(10.0)
    run.stop("enough")
    result = run.result()
    assert result.log is not None and 100_001 <= result.log.rows < 200_000


def test_a_full_disk_ends_the_logged_run_with_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(self: object, table: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("armblocks.simulation.export._CsvLog._append", full)
    with pytest.raises(FormatError, match=r"writing to the log failed \(No space left"):
        run_with_log(SYSTEMS["relay"], tmp_path / "log.csv", SimulationOptions(stop_time=4.0))
    assert list(tmp_path.iterdir()) == []

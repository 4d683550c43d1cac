"""Both sides of the jumps of signals, compared with closed forms."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import armblocks as ab
from armblocks import Diagram, DiagramBuilder, SimulationResult
from armblocks.blocks import (
    CalledPythonFunction,
    Constant,
    FromFile,
    Gain,
    Integrator,
    Product,
    ResettableIntegrator,
    Sign,
    SineWave,
    Step,
    Sum,
    TransportDelay,
    ZeroOrderHold,
)
from armblocks.errors import ArmblocksError
from armblocks.simulation import jumps as jumps_module

Array = NDArray[np.float64]
SEEDS = range(10)


@dataclass(frozen=True)
class Case:
    """A diagram with jumps of every kind at random times, and the closed forms of its signals."""

    seed: int

    def __post_init__(self) -> None:
        random = np.random.default_rng(self.seed)
        set_field = object.__setattr__
        set_field(self, "sample_time", float(random.choice([0.05, 0.1, 0.13])))
        set_field(self, "period", float(random.choice([0.1, 0.3, 0.17])))
        # Some steps coincide with samples and ticks.
        set_field(self, "step", float(random.choice([0.3, 0.6, random.uniform(0.1, 2.0)])))
        set_field(self, "delay", float(random.choice([0.3, random.uniform(0.1, 0.8)])))
        set_field(self, "frequency", float(random.uniform(2.0, 9.0)))
        set_field(self, "phase", float(random.uniform(0.1, 3.0)))

    sample_time: float = 0.0
    period: float = 0.0
    step: float = 0.0
    delay: float = 0.0
    frequency: float = 0.0
    phase: float = 0.0
    stop_time = 3.0

    def diagram(self, *, states: bool = True) -> Diagram:
        b = DiagramBuilder(f"jumps {self.seed}")
        step = b.add("step", Step(time=self.step))
        sine = b.add("sine", SineWave(frequency=self.frequency, phase=self.phase))
        hold = b.add("hold", ZeroOrderHold(sample_time=self.period), sine)
        sign = b.add("sign", Sign(), sine)
        b.add("product", Product(), hold, sign)
        b.add("delayed", TransportDelay(delay=self.delay), step)
        # y = step - y / 2
        loop = b.add("loop", Sum(signs="+-"), step)
        half = b.add("half", Gain(gain=0.5), loop)
        b.connect(half, loop["u2"])
        if states:
            b.add("integral", Integrator(), hold)
        return b.build()

    def value(self, name: str, t: Array, side: str) -> Array:
        """The left limits or the values of a signal."""
        eps = -1e-9 if side == "before" else 1e-9
        match name:
            case "step":
                return (t + eps >= self.step) * 1.0
            case "loop":
                return self.value("step", t, side) / 1.5
            case "delayed":
                return (t + eps >= self.step + self.delay) * 1.0
            case "sine":
                return np.sin(self.frequency * t + self.phase)
            case "hold":
                return self.value("sine", np.floor((t + eps) / self.period) * self.period, side)
            case "sign":
                return np.sign(np.sin(self.frequency * (t + eps) + self.phase))
            case _:
                return self.value("hold", t, side) * self.value("sign", t, side)

    def times(self, name: str) -> Array:
        """The times at which a signal jumps, s."""
        stop = self.stop_time
        match name:
            case "step" | "loop":
                jump_times = np.array([self.step])
            case "delayed":
                jump_times = np.array([self.step + self.delay])
            case "hold":
                jump_times = np.arange(1, 100) * self.period
            case "sign":
                jump_times = (np.arange(1, 100) * np.pi - self.phase) / self.frequency
            case "product":
                jump_times = np.sort(np.concatenate([self.times("hold"), self.times("sign")]))
            case _:
                jump_times = np.empty(0)
        return jump_times[(jump_times > 0.0) & (jump_times <= stop * (1.0 + 1e-12))]


NAMES = ("step", "loop", "delayed", "hold", "sign", "product", "sine")


def run(case: Case, **settings: object) -> SimulationResult:
    options = {"stop_time": case.stop_time, "sample_time": case.sample_time, **settings}
    return ab.simulate(case.diagram(), **options)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("solver", [{}, {"solver": "rk4", "step": 0.013}, {"solver": "rodas5p"}])
@pytest.mark.parametrize("seed", SEEDS)
def test_jumps_have_the_times_and_both_values_of_the_closed_forms(
    seed: int, solver: dict[str, object]
) -> None:
    case = Case(seed)
    result = run(case, **solver)
    for name in NAMES:
        times, before, after = result.jumps[name]
        assert times == pytest.approx(case.times(name), abs=1e-7), name
        assert before == pytest.approx(case.value(name, times, "before"), abs=1e-6), name
        assert after == pytest.approx(case.value(name, times, "after"), abs=1e-6), name
    assert result.jumps["integral"][0].size == 0
    assert np.all(np.diff(result.jumps.time) > 0.0)


@pytest.mark.parametrize("seed", SEEDS)
def test_held_signals_are_stairs_between_samples(seed: int) -> None:
    case = Case(seed)
    rows = run(case).with_jumps()
    assert np.all(np.diff(rows.time) >= 0.0)
    t = np.random.default_rng(seed).uniform(0.0, case.stop_time, 2000)
    for name in ("step", "loop", "delayed", "hold", "sign", "product"):
        jumps = case.times(name)
        away_from_jumps = t[np.abs(t[:, np.newaxis] - jumps).min(axis=1, initial=1.0) > 1e-6]
        drawn = np.interp(away_from_jumps, rows.time, rows[name])
        assert drawn == pytest.approx(case.value(name, away_from_jumps, "after"), abs=1e-6), name


@pytest.mark.parametrize("seed", SEEDS)
def test_samples_are_the_same_with_and_without_jumps_and_in_pieces(seed: int) -> None:
    case = Case(seed)
    whole, samples = run(case), run(case, record_jumps=False)
    assert len(samples.jumps) == 0
    assert whole.time.tobytes() == samples.time.tobytes()
    assert whole.signals.tobytes() == samples.signals.tobytes()
    pieces = ab.begin(case.diagram(), stop_time=case.stop_time, sample_time=case.sample_time)
    live: list[float] = []
    while not pieces.finished:
        before = pieces.recorded
        pieces.advance(steps=7)
        live += pieces.samples(before).jumps.time.tolist()
    assert pieces.result().signals.tobytes() == whole.signals.tobytes()
    assert same(pieces.result(), whole)
    assert live == whole.jumps.time.tolist()


def same(one: SimulationResult, other: SimulationResult) -> bool:
    """Whether two results have the same rows, bit for bit."""
    one, other = one.with_jumps(), other.with_jumps()
    return one.time.tobytes() == other.time.tobytes() and one.signals.tobytes() == other.signals.tobytes()


@pytest.mark.parametrize("seed", SEEDS)
def test_a_continued_run_has_the_jumps_of_one_run(seed: int) -> None:
    case = Case(seed)
    whole = run(case)
    middle = case.stop_time * (0.31 + 0.04 * seed)
    first = run(case, stop_time=middle)
    second = run(case, initial_state=first.final_state)
    times = np.concatenate([first.jumps.time, second.jumps.time])
    assert times.tobytes() == whole.jumps.time.tobytes()


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
@pytest.mark.parametrize("seed", SEEDS[:4])
def test_a_log_file_has_the_rows_of_the_saved_result(
    seed: int, suffix: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = Case(seed)
    whole = run(case)
    whole.save(tmp_path / f"saved.{suffix}")
    monkeypatch.setattr("armblocks.simulation.run_log.window_rows", lambda width: 7)
    logged = run(case, log=tmp_path / f"log.{suffix}")
    assert logged.log is not None
    assert logged.log.rows == whole.with_jumps().time.size
    if suffix == "csv":
        assert (tmp_path / "log.csv").read_bytes() == (tmp_path / "saved.csv").read_bytes()
    assert same(logged, whole)


def test_files_mark_a_jump_by_two_rows_with_the_same_time(tmp_path: Path) -> None:
    b = DiagramBuilder("step")
    b.add("step", Step(time=2.003))
    result = ab.simulate(b.build(), stop_time=4.0, sample_time=1.0)
    assert result.time.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    result.save(tmp_path / "rows.csv")
    assert (tmp_path / "rows.csv").read_text() == ("time,step/y\n0,0\n1,0\n2,0\n2.003,0\n2.003,1\n3,1\n4,1\n")
    result.save(tmp_path / "samples.csv", jumps=False)
    assert (tmp_path / "samples.csv").read_text() == "time,step/y\n0,0\n1,0\n2,0\n3,1\n4,1\n"
    assert result.to_dataframe().index.tolist() == result.time.tolist()
    assert result.to_dataframe(jumps=True).index.tolist() == [0.0, 1.0, 2.0, 2.003, 2.003, 3.0, 4.0]
    part = result.select({"y": "step/y"}, slice(2, 4)).with_jumps()
    assert part.time.tolist() == [2.0, 2.003, 2.003, 3.0]


@pytest.mark.parametrize("change", [1.0, 1.0375])
@pytest.mark.parametrize("states", [False, True])
def test_a_change_of_parameters_is_a_jump(change: float, states: bool) -> None:
    b = DiagramBuilder("tuned")
    source = b.add("source", Constant(value=2.0))
    gain = b.add("gain", Gain(gain=3.0), source)
    if states:
        b.add("integral", Integrator(), gain)
    live = ab.begin(b.build(), stop_time=2.0, sample_time=0.25)
    live.advance(change, exactly=True)
    changed = live.time
    live.set("gain.gain", 5.0)
    live.advance()
    result = live.result()
    times, before, after = result.jumps["gain"]
    assert times == pytest.approx([changed], abs=1e-12)
    assert (before.tolist(), after.tolist()) == ([6.0], [10.0])
    rows = result.with_jumps()
    t = np.array([0.99, 1.01, 1.05, 1.3]) + changed - 1.0
    assert np.interp(t, rows.time, rows["gain"]).tolist() == [6.0, 10.0, 10.0, 10.0]


def tuned_run(
    seed: int, *, states: bool, hybrid: bool, log: Path | None = None
) -> tuple[ab.Simulation, LiveJumps]:
    """A run whose gain is tuned three times, and the times of the jumps in its live samples."""
    random = np.random.default_rng(seed)
    b = DiagramBuilder("tuned")
    source = b.add("source", Step(time=float(random.uniform(0.2, 2.5)), initial=1.0, final=2.0))
    if hybrid:
        clock = b.add("clock", SineWave(frequency=3.0))
        b.add("hold", ZeroOrderHold(sample_time=0.11), clock)
    gain = b.add("gain", Gain(gain=1.0), source)
    if states:
        b.add("integral", Integrator(), gain)
    live = ab.begin(b.build(), stop_time=3.0, sample_time=0.07, max_step=0.03, log=log)
    live_jumps = LiveJumps()
    for k, time in enumerate(np.sort(random.uniform(0.1, 2.9, 3)).tolist()):
        live_jumps.advance(live, time, exactly=bool(random.integers(2)))
        live.set("gain.gain", float(k + 2))
    live_jumps.advance(live, np.inf)
    return live, live_jumps


class LiveJumps:
    """The times of the jumps in live samples, s."""

    def __init__(self) -> None:
        self.times: list[float] = []

    def advance(self, live: ab.Simulation, time: float, *, exactly: bool = False) -> None:
        """Advance in two pieces, and read the samples after each."""
        for until in (0.5 * (live.time + min(time, 3.0)), min(time, 3.0)):
            before = live.recorded
            live.advance(until, exactly=exactly)
            self.times += live.samples(before).jumps.time.tolist()


@pytest.mark.parametrize("hybrid", [False, True])
@pytest.mark.parametrize("states", [False, True])
@pytest.mark.parametrize("seed", SEEDS[:5])
def test_a_tuned_run_has_the_same_jumps_live_and_in_its_log(
    seed: int, states: bool, hybrid: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    live, live_jumps = tuned_run(seed, states=states, hybrid=hybrid)
    whole = live.result()
    assert live_jumps.times == whole.jumps.time.tolist()
    assert whole.jumps["gain"][0].size == 4
    assert np.all(np.diff(whole.with_jumps().time) >= 0.0)
    monkeypatch.setattr("armblocks.simulation.run_log.window_rows", lambda width: 7)
    logged, _ = tuned_run(seed, states=states, hybrid=hybrid, log=tmp_path / "log.csv")
    whole.save(tmp_path / "saved.csv")
    logged.result()
    assert (tmp_path / "log.csv").read_bytes() == (tmp_path / "saved.csv").read_bytes()


@pytest.mark.parametrize("windows", [False, True])
@pytest.mark.parametrize("sample_time", [0.07, 0.3])
def test_results_of_python_functions_jump_at_their_ticks(
    windows: bool, sample_time: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The function doubles the sine at its ticks."""
    monkeypatch.setattr("armblocks.simulation.run_log.window_rows", lambda width: 7)
    b = DiagramBuilder("called")
    sine = b.add("sine", SineWave(frequency=2.0))
    called = b.add("called", CalledPythonFunction(function=lambda u: 2.0 * u, sample_time=0.1), sine)
    b.add("integral", Integrator(), called)
    log = tmp_path / "log.csv" if windows else None
    result = ab.simulate(b.build(), stop_time=2.0, sample_time=sample_time, log=log)
    if log is None:
        assert result.jumps["called"][0] == pytest.approx(np.arange(1, 21) * 0.1)
        rows = result.with_jumps()
        time, values = rows.time, rows["called"]
    else:
        time, *columns = np.loadtxt(log, delimiter=",", skiprows=1).T
        values = columns[log.read_text().splitlines()[0].split(",").index("called/y") - 1]
    t = np.arange(0.0, 1.99, 0.013) + 0.0004
    held = 2.0 * np.sin(2.0 * np.floor(t / 0.1) * 0.1)
    assert np.interp(t, time, values) == pytest.approx(held, abs=1e-9)


def test_states_that_are_reset_have_both_sides() -> None:
    b = DiagramBuilder("reset")
    rate = b.add("rate", Constant(value=2.0))
    level = b.add("level", Step(time=0.7))
    b.add("integral", ResettableIntegrator(external_reset="rising"), rate, level)
    result = ab.simulate(b.build(), stop_time=1.0, sample_time=0.3)
    times, before, after = result.jumps["integral"]
    assert times == pytest.approx([0.7], abs=1e-9)
    assert before == pytest.approx([1.4], abs=1e-6)
    assert after.tolist() == [0.0]
    rows = result.with_jumps()
    assert rows.states[:, 0] == pytest.approx(rows["integral"])


def test_a_pickled_result_keeps_its_jumps() -> None:
    result = run(Case(1))
    copied = pickle.loads(pickle.dumps(result))
    assert same(copied, result)
    assert copied.jumps["hold"][0].tobytes() == result.jumps["hold"][0].tobytes()


def test_a_run_with_too_many_jumps_reports_when_their_recording_ends(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(jumps_module, "MAX_NUMBERS", 6000)
    b = DiagramBuilder("many")
    sine = b.add("sine", SineWave(frequency=1.0))
    b.add("hold", ZeroOrderHold(sample_time=1e-3), sine)
    result = ab.simulate(b.build(), stop_time=2.0)
    assert 0.1 < result.jumps.time[-1] < 1.5
    assert "jumps after 0." in result.run.message
    monkeypatch.setattr("armblocks.simulation.run_log.window_rows", lambda width: 64)
    logged = ab.simulate(b.build(), stop_time=2.0, log=tmp_path / "all.csv")
    assert logged.run.message == ""
    assert logged.log is not None
    assert logged.log.rows > 2000


@pytest.mark.parametrize("wrong", [1, None, "yes"])
def test_other_values_than_true_and_false_are_refused(wrong: object) -> None:
    refuse: Callable[..., object] = ab.simulate
    with pytest.raises(ArmblocksError, match="record_jumps is"):
        refuse("van_der_pol_pid", record_jumps=wrong)


@pytest.mark.parametrize("seed", SEEDS[:4])
def test_a_saved_result_with_jumps_can_be_played_back(seed: int, tmp_path: Path) -> None:
    case = Case(seed)
    result = run(case)
    names = ("step", "hold", "product")
    result.select({name: f"{name}/y" for name in names}).save(tmp_path / "rows.csv")
    b = DiagramBuilder("playback")
    b.add("file", FromFile(data=ab.load_table(tmp_path / "rows.csv")))
    again = ab.simulate(b.build(), stop_time=case.stop_time, sample_time=0.0123)
    rows = again.with_jumps()
    t = np.random.default_rng(seed).uniform(0.0, case.stop_time, 500)
    for column, name in enumerate(names):
        jumps = case.times(name)
        away_from_jumps = t[np.abs(t[:, np.newaxis] - jumps).min(axis=1, initial=1.0) > 1e-6]
        drawn = np.interp(away_from_jumps, rows.time, rows["file"][:, column])
        assert drawn == pytest.approx(case.value(name, away_from_jumps, "after"), abs=1e-6), name

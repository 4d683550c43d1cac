"""Progress output of a long run."""

import io

import pytest
from rich.console import Console

from armblocks.cli import progress as module
from armblocks.cli.progress import FrameProgress, RunProgress


@pytest.mark.parametrize(
    ("elapsed", "fraction", "message"),
    [(10.0, 0.5, "about 10 s left"), (60.0, 0.1, "about 9 min left"), (3600.0, 0.25, "about 3.0 h left")],
)
def test_a_long_run_shows_the_remaining_time(
    elapsed: float, fraction: float, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock_time = [100.0]
    monkeypatch.setattr(module.time, "perf_counter", lambda: clock_time[0])
    text = io.StringIO()
    with RunProgress("model", Console(file=text, width=200)) as progress:
        clock_time[0] += elapsed
        progress(1.0, fraction, 3.0)
    assert f"t = 1 s, 3 x real time, {message}" in text.getvalue()


@pytest.mark.parametrize(("factor", "message"), [(0.00612, "0.00612"), (3.0, "3"), (123456.0, "123,456")])
def test_the_speed_relative_to_real_time_is_shown(
    factor: float, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock_time = [100.0]
    monkeypatch.setattr(module.time, "perf_counter", lambda: clock_time[0])
    text = io.StringIO()
    with RunProgress("model", Console(file=text, width=200)) as progress:
        clock_time[0] += 60.0
        progress(1.0, 0.5, factor)
    assert f"t = 1 s, {message} x real time" in text.getvalue()


def test_a_run_that_is_nearly_finished_shows_no_remaining_time(monkeypatch: pytest.MonkeyPatch) -> None:
    clock_time = [100.0]
    monkeypatch.setattr(module.time, "perf_counter", lambda: clock_time[0])
    text = io.StringIO()
    with RunProgress("model", Console(file=text, width=200)) as progress:
        clock_time[0] += 5.0
        progress(1.0, 0.9, 3.0)
    assert "left" not in text.getvalue()


def test_the_progress_of_a_film_counts_frames(monkeypatch: pytest.MonkeyPatch) -> None:
    text = io.StringIO()
    now = [0.0]
    monkeypatch.setattr(module.time, "perf_counter", lambda: now[0])
    with FrameProgress("a.mp4", Console(file=text, width=200)) as progress:
        for frame in (1, 30, 60):
            now[0] += 6.0
            progress(frame, 60)
    assert "a.mp4: frame 1 of 60" in text.getvalue() and "frame 30 of 60" in text.getvalue()

"""Progress of a run: a progress bar in a terminal, plain lines in a file or pipe."""

from __future__ import annotations

import time
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn

from armblocks.cli.terminal import ACCENT

_FIRST_LINE_DELAY, _LINE_INTERVAL = 0.5, 5.0
"""Seconds before the first plain line, and between lines; short runs print none."""
_MIN_REMAINING_TIME = 2.0
"""Minimum remaining time that is shown, s."""


class RunProgress:
    """Displays the progress of a run.

    It is called during the run with the simulated time (s), the fraction done and the real-time factor.
    """

    def __init__(self, name: str, console: Console) -> None:
        self._name = name
        self._console = console
        self._start_time = time.perf_counter()
        self._next_line = time.perf_counter() + _FIRST_LINE_DELAY
        self._bar: Progress | None = None
        self._task: TaskID | None = None

    def __enter__(self) -> Self:
        if self._console.is_terminal:
            self._bar = Progress(
                TextColumn("{task.description}"),
                BarColumn(complete_style=ACCENT, finished_style=ACCENT),
                TextColumn("{task.fields[where]}"),
                console=self._console,
                transient=True,
            )
            self._bar.start()
            self._task = self._bar.add_task(self._name, total=None, where="preparing")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.stop()

    def __call__(self, simulated: float, fraction: float, real_time_factor: float) -> None:
        time_text = f"{simulated:,.0f}" if simulated >= 1000 else f"{simulated:.4g}"
        where = f"t = {time_text} s, {factor_text(real_time_factor)} x real time"
        self._show(where, fraction)

    def _show(self, where: str, fraction: float) -> None:
        now = time.perf_counter()
        remaining = (now - self._start_time) * (1.0 / fraction - 1.0) if fraction > 0.0 else 0.0
        if remaining >= _MIN_REMAINING_TIME:
            where += f", {_duration(remaining)} left"
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, total=1.0, completed=fraction, where=where)
        elif now >= self._next_line and fraction < 1.0:
            self._next_line = now + _LINE_INTERVAL
            self._console.print(f"{self._name}: {where} ({fraction:.0%})")


class FrameProgress(RunProgress):
    """Displays the progress of a video: called with the number of written frames, and of all frames."""

    def __call__(self, frame: float, count: float, _: float = 0.0) -> None:
        self._show(f"frame {frame:.0f} of {count:.0f}", frame / count)


class SweepProgress(RunProgress):
    """Displays the progress of a sweep.

    The arguments of a call are the number of computed runs, the number of all runs, the runs per second and
    the remaining time, s.
    """

    def __call__(self, done: float, runs: float, rate: float, remaining: float = 0.0) -> None:
        self._show(f"run {done:,.0f} of {runs:,.0f}, {factor_text(rate)} runs/s", done / runs)


class FitProgress(RunProgress):
    """Displays the progress of a fit: called with the number of evaluations and the sum of squares.

    ``most``: the maximum number of evaluations.
    """

    def __init__(self, name: str, console: Console, most: int) -> None:
        super().__init__(name, console)
        self._most = most

    def __call__(self, evaluations: float, squares: float, _: float = 0.0) -> None:
        where = f"evaluation {evaluations:.0f} of at most {self._most}, sum of squares {squares:.6g}"
        self._show(where, min(evaluations / max(self._most, 1), 1.0))


class SearchProgress(RunProgress):
    """Displays the progress of an optimisation: called with the number of evaluated points and the smallest
    objective so far, NaN before a point satisfies the constraints."""

    def __call__(self, evaluations: float, objective: float, _: float = 0.0) -> None:
        value = f"smallest objective {objective:.6g}" if objective == objective else "no valid point"
        self._show(f"evaluation {evaluations:.0f}, {value}", 0.0)


def _duration(seconds: float) -> str:
    """A rounded duration: ``40 s``, ``3 min``, ``1.5 h``."""
    if seconds < 100.0:
        return f"about {seconds:.0f} s"
    return f"about {seconds / 60.0:.0f} min" if seconds < 6000.0 else f"about {seconds / 3600.0:.1f} h"


def factor_text(factor: float) -> str:
    """A real-time factor with three digits and no exponent."""
    return f"{factor:,.0f}" if factor >= 100 else f"{factor:.3g}"

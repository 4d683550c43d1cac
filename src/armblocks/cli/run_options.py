"""Options that several commands have: settings of runs, and files of results."""

from __future__ import annotations

from typing import Annotated, Any

import typer

Solver = Annotated[str | None, typer.Option(help="auto, or a solver of 'armblocks list solvers'.")]
Step = Annotated[float | None, typer.Option(help="Step of a fixed-step solver, s.")]
RelativeTolerance = Annotated[float | None, typer.Option(help="Relative tolerance of an adaptive solver.")]
AbsoluteTolerance = Annotated[float | None, typer.Option(help="Absolute tolerance of an adaptive solver.")]
StopTime = Annotated[float | None, typer.Option(help="Simulated time, s.", show_default="the model's")]
SampleTime = Annotated[float | None, typer.Option(help="Interval of the samples, s.")]
Threads = Annotated[int | None, typer.Option(help="Number of threads.", show_default="all cores")]
Trust = Annotated[bool, typer.Option("--trust", help="Run the Python files that the diagram names.")]


def given_settings(**settings: float | str | None) -> dict[str, Any]:
    """The settings that are given on the command line."""
    return {name: value for name, value in settings.items() if value is not None}

"""``armblocks fit``: fits parameters of a diagram to measured signals."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from armblocks.cli.assignments import chosen_parameters, parse_value
from armblocks.cli.completion import ModelName, ParameterSetName
from armblocks.cli.identify import print_notes
from armblocks.cli.progress import FitProgress
from armblocks.cli.run_options import (
    AbsoluteTolerance,
    RelativeTolerance,
    Solver,
    Step,
    Trust,
    given_settings,
)
from armblocks.cli.terminal import STRONG, messages_console, results_console, table
from armblocks.errors import InputError, counted
from armblocks.pictures.numbers import table_number

if TYPE_CHECKING:
    from armblocks import FitResult

NOT_DETERMINED = 1


def fit(
    model: ModelName,
    data: Annotated[
        list[Path],
        typer.Argument(
            metavar="DATA…",
            help="Tables of experiments with a time column and a column for each measured signal.",
        ),
    ],
    parameter: Annotated[
        list[str],
        typer.Option(
            "--parameter",
            "-p",
            metavar="BLOCK.PARAMETER[=START]",
            help="A parameter to fit, and where the search begins; may be repeated.",
        ),
    ],
    bounds: Annotated[
        list[str] | None,
        typer.Option(
            metavar="BLOCK.PARAMETER=LOW:HIGH",
            help="Bounds of a fitted parameter, either may be empty; may be repeated.",
        ),
    ] = None,
    noise: Annotated[
        list[str] | None,
        typer.Option(
            metavar="SIGNAL=DEVIATION", help="Known standard deviation of a signal; may be repeated."
        ),
    ] = None,
    evaluations: Annotated[int, typer.Option(help="Maximum number of evaluations.")] = 200,
    solver: Solver = None,
    step: Step = None,
    rtol: RelativeTolerance = None,
    atol: AbsoluteTolerance = None,
    assignments: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="BLOCK.PARAMETER=VALUE", help="Change a parameter that is not fitted."),
    ] = None,
    parameter_set: ParameterSetName = None,
    save: Annotated[Path | None, typer.Option(help="Write the diagram with the fitted values.")] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Write measured signals, fitted signals and residuals, .svg or .png.")
    ] = None,
    trust: Trust = False,
) -> None:
    """Fit parameters of a diagram to measured signals.

    Prints the values with standard errors and 95 % intervals, and how much of each signal is explained. Names
    of columns are the names of signals. Ctrl-C ends the search with the best values so far.

    Exit code 0: done, 1: the measurements do not determine some parameters, or the search ended early, 2:
    invalid input.
    """
    import armblocks as ab

    diagram = ab.load_diagram(model, trust=trust)
    names, start = _parameters(parameter)
    given = given_settings(solver=solver, step=step, rtol=rtol, atol=atol)
    with FitProgress(diagram.name, messages_console(), evaluations) as progress:
        result = ab.fit(
            diagram,
            names,
            [str(path) for path in data],
            bounds=dict(_bound(text) for text in bounds or ()),
            start=start,
            noise=dict(_deviation(text) for text in noise or ()),
            values=chosen_parameters(diagram, parameter_set, assignments) or None,
            evaluations=evaluations,
            progress=progress,
            **given,
        )
    _finish(result, save, plot)


def _finish(result: FitResult, save: Path | None, plot: Path | None) -> None:
    """Print the result, write its files, and exit with the code of the result."""
    import armblocks as ab

    console = results_console()
    print_fit(result, console)
    if save is not None:
        ab.save_diagram(result.diagram, save)
        console.print(f"diagram: {save}", soft_wrap=True)
    if plot is not None:
        result.plot(save=plot)
        console.print(f"figure: {plot}", soft_wrap=True)
    if result.not_identified or result.stopped:
        raise typer.Exit(NOT_DETERMINED)


def _parameters(texts: list[str]) -> tuple[list[str], dict[str, float]]:
    names: list[str] = []
    start: dict[str, float] = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if name in names:
            raise InputError(f"'{name}' occurs twice", where="--parameter", fix="keep one of the two")
        names.append(name)
        if equals:
            start[name] = _number(value, f"--parameter {name}")
    return names, start


def _bound(text: str) -> tuple[str, tuple[float, float]]:
    name, equals, value = (part.strip() for part in text.partition("="))
    ends = value.split(":")
    if not (name and equals and len(ends) == 2):
        raise InputError(
            f"'{text}' is not of the form block.parameter=low:high",
            where="--bounds",
            allowed="two numbers with a colon between them; without a number there is no bound",
            fix="write for example --bounds plant.mass=0:10",
        )
    low, high = (end.strip() for end in ends)
    where = f"--bounds {name}"
    return name, (
        _number(low, where) if low else -float("inf"),
        _number(high, where) if high else float("inf"),
    )


def _deviation(text: str) -> tuple[str, float]:
    name, equals, value = (part.strip() for part in text.rpartition("="))
    if not (name and equals):
        raise InputError(
            f"'{text}' is not of the form signal=deviation",
            where="--noise",
            allowed="the name of a measured signal and a standard deviation",
            fix="write for example --noise plant/y=0.01",
        )
    return name, _number(value, f"--noise {name}")


def _number(text: str, where: str) -> float:
    value = parse_value(text, where)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"'{text}' is not a number", where=where, allowed="a number", fix="give a number")
    return float(value)


def print_fit(result: FitResult, console: Console) -> None:
    """Print parameters and signals of a fit."""
    evaluations = counted(result.evaluations, "evaluation")
    console.print(f"{result.diagram.name}: {result.message} after {evaluations}", style=STRONG)
    names = ("value", "standard error", "lower 95 %", "upper 95 %", "start")
    shown = table(("parameter", "left"), *((name, "right") for name in names))
    for row in result.table():
        values = [float(row[name]) for name in names]
        cells = [table_number(value, 5) if math.isfinite(value) else "" for value in values]
        shown.add_row(str(row["parameter"]), *cells)
    console.print(shown)
    console.print()
    signals = table(("signal", "left"), ("noise", "right"), ("unit", "left"), ("explained", "right"))
    several = any(signal.experiment > 1 for signal in result.signals)
    for signal in result.signals:
        name = f"{signal.name} ({signal.experiment})" if several else signal.name
        signals.add_row(name, table_number(signal.noise, 4), signal.unit, f"{signal.explained:.2f} %")
    console.print(signals)
    print_notes([result.summary, *result.findings], console)

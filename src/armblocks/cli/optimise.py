"""``armblocks optimise``: finds parameter values that minimise an objective under constraints."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from armblocks.cli.assignments import chosen_parameters
from armblocks.cli.completion import ModelName, ParameterSetName
from armblocks.cli.identify import print_notes
from armblocks.cli.progress import SearchProgress
from armblocks.cli.run_options import (
    AbsoluteTolerance,
    RelativeTolerance,
    SampleTime,
    Solver,
    Step,
    StopTime,
    Threads,
    Trust,
    given_settings,
)
from armblocks.cli.sweep import unique, varied
from armblocks.cli.terminal import STRONG, messages_console, results_console, table
from armblocks.errors import InputError

if TYPE_CHECKING:
    from armblocks import OptimisationResult

NO_MINIMUM = 1


def optimise(
    model: ModelName,
    vary: Annotated[
        list[str],
        typer.Option(
            metavar="BLOCK.PARAMETER=LOW:HIGH",
            help="A variable with bounds, or loguniform(low,high) for a logarithmic scale; may be repeated.",
        ),
    ],
    minimise: Annotated[
        str, typer.Option(metavar="FORMULA", help="The objective, such as 'itae({ref/y} - {plant/y})'.")
    ],
    subject_to: Annotated[
        list[str] | None,
        typer.Option(metavar="CONSTRAINT", help="A constraint, 'peak(pid/y) <= 12'; may be repeated."),
    ] = None,
    over: Annotated[
        list[str] | None,
        typer.Option(
            metavar="BLOCK.PARAMETER=VALUES",
            help="An uncertain parameter, with values as in --vary of sweep; may be repeated.",
        ),
    ] = None,
    runs: Annotated[int | None, typer.Option(help="Number of scenarios with random parameters.")] = None,
    statistic: Annotated[str, typer.Option(help="mean, worst, or a quantile such as 0.9.")] = "mean",
    share: Annotated[float, typer.Option(help="Share of scenarios in which constraints hold.")] = 1.0,
    method: Annotated[str, typer.Option(help="auto, gradient or search.")] = "auto",
    starts: Annotated[int, typer.Option(help="Number of starts of the method gradient.")] = 1,
    seed: Annotated[int, typer.Option(help="Seed of random points.")] = 0,
    evaluations: Annotated[int | None, typer.Option(help="Maximum number of evaluated points.")] = None,
    stop_time: StopTime = None,
    solver: Solver = None,
    step: Step = None,
    sample_time: SampleTime = None,
    rtol: RelativeTolerance = None,
    atol: AbsoluteTolerance = None,
    threads: Threads = None,
    assignments: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="BLOCK.PARAMETER=VALUE", help="Change another parameter."),
    ] = None,
    parameter_set: ParameterSetName = None,
    save: Annotated[Path | None, typer.Option(help="Write the diagram with the best values.")] = None,
    plot: Annotated[Path | None, typer.Option(help="Write the history of the search, .svg or .png.")] = None,
    trust: Trust = False,
) -> None:
    """Find the parameter values of a diagram that minimise an objective under constraints.

    Prints the variables, the active constraints with multipliers, and why the search ended. Ctrl-C ends the
    search with the best values so far.

    Exit code 0: done, 1: no minimum is confirmed, or a constraint does not hold, 2: invalid input.
    """
    import armblocks as ab

    diagram = ab.load_diagram(model, trust=trust)
    settings = given_settings(
        stop_time=stop_time, solver=solver, step=step, sample_time=sample_time, rtol=rtol, atol=atol
    )
    with SearchProgress(diagram.name, messages_console()) as progress:
        result = ab.optimise(
            diagram,
            unique((_variable(text) for text in vary), "--vary"),
            minimise,
            subject_to,
            over=unique((varied(text, "--over") for text in over), "--over") if over else None,
            runs=runs,
            statistic=_statistic(statistic),
            share=share,
            method=method,
            starts=starts,
            seed=seed,
            evaluations=evaluations,
            parameters=chosen_parameters(diagram, parameter_set, assignments) or None,
            threads=threads,
            progress=progress,
            **settings,
        )
    _finish(result, save, plot)


def _finish(result: OptimisationResult, save: Path | None, plot: Path | None) -> None:
    """Print the result, write its files, and exit with the code of the result."""
    import armblocks as ab

    console = results_console()
    print_optimisation(result, console)
    if save is not None:
        ab.save_diagram(result.diagram, save)
        console.print(f"diagram: {save}", soft_wrap=True)
    if plot is not None:
        result.plot(save=plot)
        console.print(f"figure: {plot}", soft_wrap=True)
    if not (result.converged and result.feasible):
        raise typer.Exit(NO_MINIMUM)


def _variable(text: str) -> tuple[str, object]:
    """The name and the bounds of one variable."""
    name, equals, ends = (part.strip() for part in text.partition("="))
    if equals and ends.startswith(("uniform", "loguniform")):
        return varied(text, "--vary")
    bounds = [part.strip() for part in ends.split(":")]
    try:
        low, high = (float(bound) for bound in bounds)
    except ValueError:
        raise InputError(
            f"'{text}' is not of the form block.parameter=low:high",
            where="--vary",
            allowed="two numbers with a colon between them, or loguniform(low,high)",
            fix="write for example --vary pid.P=0.1:10",
        ) from None
    return name, (low, high)


def _statistic(text: str) -> str | float:
    try:
        return float(text)
    except ValueError:
        return text


def print_optimisation(result: OptimisationResult, console: Console) -> None:
    """Print the variables, the constraints, and the end of the search."""
    from armblocks.face.optimise_result import (
        CONSTRAINT_HEADS,
        VARIABLE_HEADS,
        constraint_rows,
        variable_rows,
    )

    console.print(result.headline, style=STRONG, soft_wrap=True, highlight=False)
    groups = [(VARIABLE_HEADS, variable_rows(result)), (CONSTRAINT_HEADS, constraint_rows(result))]
    for heads, rows in groups:
        if rows:
            texts = ("variable", "unit", "constraint", "active")
            shown = table(*((head, "left" if head in texts else "right") for head in heads))
            for row in rows:
                shown.add_row(*row)
            console.print(shown)
    print_notes(list(result.findings), console)

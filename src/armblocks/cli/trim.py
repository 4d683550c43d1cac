"""``armblocks trim``: finds an equilibrium operating point of a diagram."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console

from armblocks.cli.assignments import chosen_parameters, parse_value
from armblocks.cli.completion import ModelName, ParameterSetName
from armblocks.cli.terminal import STRONG, results_console, table
from armblocks.errors import InputError, SimulationError, counted

if TYPE_CHECKING:
    from armblocks import Diagram
    from armblocks.analysis.trim import TrimResult


def trim(
    model: ModelName,
    fixed: Annotated[
        list[str] | None,
        typer.Option("--fix", metavar="STATE=VALUE", help="A state with a fixed value; may be repeated."),
    ] = None,
    free: Annotated[
        list[str] | None,
        typer.Option("--free", metavar="BLOCK.PARAMETER", help="A free parameter; may be repeated."),
    ] = None,
    outputs: Annotated[
        list[str] | None,
        typer.Option(
            "--output", metavar="SIGNAL=VALUE", help="A required value of a signal; may be repeated."
        ),
    ] = None,
    moving: Annotated[
        list[str] | None,
        typer.Option(
            "--moving", metavar="STATE", help="A state without equilibrium condition; may be repeated."
        ),
    ] = None,
    guess: Annotated[
        list[str] | None,
        typer.Option("--guess", metavar="NAME=VALUE", help="Start value of the search; may be repeated."),
    ] = None,
    bounds: Annotated[
        list[str] | None,
        typer.Option("--bound", metavar="NAME=LOW,HIGH", help="Bounds of a state or free parameter."),
    ] = None,
    at: Annotated[float, typer.Option(help="Time of the run at which the search starts, s.")] = 0.0,
    assignments: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="BLOCK.PARAMETER=VALUE", help="Change a parameter; may be repeated."),
    ] = None,
    parameter_set: ParameterSetName = None,
    save: Annotated[
        Path | None, typer.Option(help="Save the point as .npz, for armblocks run --from-state.")
    ] = None,
    names: Annotated[
        bool, typer.Option("--names", help="Only list the available states, parameters and signals.")
    ] = False,
) -> None:
    """Find an equilibrium operating point of a diagram, and print it.

    With MODEL alone all states are free. If no equilibrium is found, the available names are listed.
    """
    import armblocks as ab

    diagram = ab.load_diagram(model)
    parameters = chosen_parameters(diagram, parameter_set, assignments)
    console = results_console()

    only_model = not any((fixed, free, outputs, moving, guess, bounds, save))
    if names or (only_model and not ab.compile_diagram(diagram).system.states.size):
        _list_names(diagram, model, at, parameters, console)
        return
    try:
        result = ab.trim(
            diagram,
            states=_pairs(fixed, "--fix"),
            free=free or (),
            outputs=_pairs(outputs, "--output"),
            moving=moving or (),
            guess=_pairs(guess, "--guess"),
            bounds={name: _bounds(name, value) for name, value in _pairs(bounds, "--bound").items()},
            at=at,
            parameters=parameters,
        )
    except SimulationError:
        if only_model:
            _list_names(diagram, model, at, parameters, console)
        raise
    print_trim(result, console)
    if save is not None:
        from armblocks.face.model import state_at

        state_at(diagram, result.point).save(save)
        console.print(f"saved: {save}", soft_wrap=True)


def _list_names(
    diagram: Diagram, model: str, at: float, parameters: Mapping[str, object], console: Console
) -> None:
    import armblocks as ab
    from armblocks.cli.trimmable import print_trimmable
    from armblocks.face.linearizing import operating_point_at, resolved_diagram

    resolved = resolved_diagram(diagram, parameters, "trim")
    start = operating_point_at(resolved, at)
    print_trimmable(ab.compile_diagram(resolved).system, start, model, console)


def _pairs(texts: Sequence[str] | None, option: str) -> dict[str, Any]:
    """Values by name, from ``NAME=VALUE``."""
    values: dict[str, Any] = {}
    for text in texts or ():
        name, equals, value = text.partition("=")
        if not (equals and name.strip() and value.strip()):
            raise InputError(
                f"'{text}' is not of the form NAME=VALUE",
                where=option,
                allowed="NAME=VALUE",
                fix=f"write {option} NAME=VALUE",
            )
        parsed = parse_value(value.strip(), where=f"{option} {name}")
        if isinstance(parsed, str | bool):
            raise InputError(
                f"'{value.strip()}' is not a number",
                where=f"{option} {name}",
                allowed="numbers",
                fix="give a number, such as 0.5",
            )
        values[name.strip()] = parsed
    return values


def _bounds(name: str, value: object) -> tuple[float, float]:
    import numpy as np

    numbers = np.atleast_1d(np.asarray(value, dtype=np.float64))
    if numbers.shape != (2,):
        raise InputError(
            f"the bounds of '{name}' have {counted(numbers.size, 'number')}",
            where="--bound",
            allowed="NAME=LOW,HIGH",
            fix="give the lower and the upper bound",
        )
    return float(numbers[0]), float(numbers[1])


def print_trim(result: TrimResult, console: Console) -> None:
    """Print the residual, then the values of all unknowns."""
    import numpy as np

    console.print(
        f"{result.point.name} at {result.point.time:g} s: at rest, "
        f"{counted(len(result.residuals), 'equation')} to "
        f"{result.largest_residual:.2g} in {counted(result.iterations, 'iteration')}",
        style=STRONG,
    )
    for title, values in (
        ("free parameter", result.free),
        ("state", result.point.states),
        ("discrete", result.point.discrete),
        ("unknown", result.point.algebraic),
    ):
        if not values:
            continue
        rows = table((title, "left"), ("value", "left"))
        for name, value in values.items():
            numbers = np.ravel(result.shown(name, value)).tolist()
            rows.add_row(name, " ".join(f"{number:.9g}" for number in numbers))
        console.print()
        console.print(rows)
    if result.at_bounds:
        console.print(f"at a bound: {', '.join(result.at_bounds)}", soft_wrap=True)

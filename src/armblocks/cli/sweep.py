"""``armblocks sweep``: runs a diagram with many combinations of parameters, and writes a table."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console

from armblocks.cli.assignments import chosen_parameters, parse_value
from armblocks.cli.completion import ModelName, ParameterSetName
from armblocks.cli.progress import SweepProgress
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
from armblocks.cli.terminal import STRONG, messages_console, results_console, table
from armblocks.errors import InputError, counted

if TYPE_CHECKING:
    from armblocks import SweepResult

_CALL = re.compile(r"(\w+)(?:\(([^()]*)\))?")
_DISTRIBUTIONS = ("uniform", "loguniform", "normal", "seeds", "geomspace", "linspace")
_ALLOWED = (
    "first:last:count, a list 1,2,5, uniform(a,b), loguniform(a,b), normal(mean,deviation), seeds, or "
    "geomspace(a,b,count)"
)


def sweep(
    model: ModelName,
    vary: Annotated[
        list[str],
        typer.Option(
            metavar="BLOCK.PARAMETER=VALUES",
            help="Vary a parameter; may be repeated. VALUES: first:last:count, a list 1,2,5, uniform(a,b), "
            "loguniform(a,b), normal(mean,deviation) or seeds.",
        ),
    ],
    measure: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[NAME=]MEASURE",
            help="A measure of each run, such as overshoot(motor/speed, final=1); may be repeated.",
        ),
    ] = None,
    keep: Annotated[
        list[str] | None,
        typer.Option(metavar="SIGNAL", help="Write the samples of this signal, too; may be repeated."),
    ] = None,
    runs: Annotated[int | None, typer.Option(help="Number of runs, with random parameters.")] = None,
    design: Annotated[str | None, typer.Option(help="grid, paired, random, sobol, halton or latin.")] = None,
    seed: Annotated[int, typer.Option(help="Seed of the design.")] = 0,
    stop_time: StopTime = None,
    solver: Solver = None,
    step: Step = None,
    sample_time: SampleTime = None,
    rtol: RelativeTolerance = None,
    atol: AbsoluteTolerance = None,
    max_steps: Annotated[int | None, typer.Option(help="Maximum number of steps of a run.")] = None,
    threads: Threads = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Compute on the cluster of this Dask scheduler.")
    ] = None,
    assignments: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="BLOCK.PARAMETER=VALUE", help="Change a parameter of all runs."),
    ] = None,
    parameter_set: ParameterSetName = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Write the table to this .parquet or .csv file; continues an interrupted sweep."),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Write report.html, with pictures and worst cases, here."),
    ] = None,
    trust: Trust = False,
) -> None:
    """Run a diagram with many combinations of parameters, and print the measures of the runs."""
    import armblocks as ab

    diagram = ab.load_diagram(model, trust=trust)
    given = given_settings(
        stop_time=stop_time, solver=solver, step=step, sample_time=sample_time, rtol=rtol, atol=atol
    )
    with SweepProgress(diagram.name, messages_console()) as progress:
        result = ab.sweep(
            diagram,
            unique((varied(text) for text in vary), "--vary"),
            measures=unique((_named(text) for text in measure or ()), "--measure"),
            keep=keep or (),
            runs=runs,
            design=design,
            seed=seed,
            parameters=chosen_parameters(diagram, parameter_set, assignments) or None,
            max_steps=max_steps,
            threads=threads,
            scheduler=scheduler,
            out=out,
            progress=progress,
            **given,
        )
    _show(result, report)
    if not result.complete:
        raise KeyboardInterrupt


def _show(result: SweepResult, report: Path | None) -> None:
    """Print a sweep, and write its report if a folder is given."""
    console = results_console()
    print_sweep(result, console)
    if report is not None and len(result):
        page = result.write_report(report).page
        console.print(f"report: {page}", highlight=False, soft_wrap=True)


def unique(pairs: Iterable[tuple[str, Any]], option: str) -> dict[str, Any]:
    """The values by name; raises ``InputError`` for a name that occurs twice."""
    named: dict[str, Any] = {}
    for name, value in pairs:
        if name in named:
            raise InputError(
                f"'{name}' occurs twice",
                where=option,
                allowed="each name once",
                fix=f"remove one {option}, or give it another name",
            )
        named[name] = value
    return named


def varied(text: str, option: str = "--vary") -> tuple[str, Any]:
    """The parameter and the values of one ``--vary``, or of another option."""
    path, equals, values = (part.strip() for part in text.partition("="))
    if not (equals and path and values):
        raise InputError(
            f"'{text}' is not of the form block.parameter=values",
            where=option,
            allowed=_ALLOWED,
            fix=f"write for example {option} load.mass=0:180:1000",
        )
    return path, _values(values, f"{option} {path}")


def _values(text: str, where: str) -> Any:
    import armblocks as ab

    call = _CALL.fullmatch(text)
    if call is not None and call[1] in _DISTRIBUTIONS:
        arguments = [_number(part, where) for part in (call[2] or "").split(",") if part.strip()]
        if call[1] in ("geomspace", "linspace") and len(arguments) == 3:
            return getattr(ab, call[1])(*arguments[:2], _count(arguments[2], where))
        return getattr(ab, call[1])(*arguments)
    parts = text.split(":")
    if len(parts) == 3:
        first, last, count = (_number(part, where) for part in parts)
        return ab.linspace(first, last, _count(count, where))
    return [parse_value(part.strip(), where) for part in _entries(text)]


def _count(number: float, where: str) -> int:
    """A number of values."""
    if not (1 <= number <= 1e9 and number == int(number)):
        raise InputError(
            f"the number of values is {number:g}",
            where=where,
            allowed="first:last:count with an integer count of 1 or more",
            fix="write for example 0:180:1000",
        )
    return int(number)


def _entries(text: str) -> list[str]:
    """The parts of a list between commas outside of brackets."""
    parts, depth = [""], 0
    for character in text:
        depth += (character in "([") - (character in ")]")
        if character == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += character
    return parts


def _number(text: str, where: str) -> float:
    value = parse_value(text.strip(), where)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(
            f"'{text.strip()}' is not a number", where=where, allowed=_ALLOWED, fix="give a number"
        )
    return float(value)


def _named(text: str) -> tuple[str, str]:
    """The name and the text of a measure; if the name is omitted, the text is the name."""
    name, equals, rest = text.partition("=")
    if equals and "(" not in name:
        return name.strip(), rest.strip()
    return text.strip(), text.strip()


def print_sweep(result: SweepResult, console: Console) -> None:
    """Print the number of runs by status, and the range of each measure."""
    import numpy as np

    status = result["status"]
    console.print(
        f"{result.name}: {counted(len(status), 'run')}"
        + ("" if result.complete else f" of {result.planned}"),
        style=STRONG,
    )
    rows = table(("measure", "left"), ("least", "right"), ("median", "right"), ("mean", "right"))
    rows.add_column("largest", justify="right")
    rows.add_column("run", justify="right")
    for name in result.measures:
        values = result[name]
        finite = values[np.isfinite(values)]
        if finite.size:
            numbers = (finite.min(), np.median(finite), finite.mean(), finite.max())
            worst = str(result.largest(name)[0])
            rows.add_row(name, *(f"{number:.6g}" for number in numbers), worst)
    if rows.row_count:
        console.print(rows)
    _print_exceptions(result, console)
    if result.remark:
        console.print(result.remark, soft_wrap=True)
    if result.path is not None:
        place = result.path if result.complete else f"{result.path}.parts"
        console.print(f"table: {place}", highlight=False, soft_wrap=True)


def _print_exceptions(result: SweepResult, console: Console) -> None:
    """Print the number of runs with each status except completed, and the message of the first run."""
    status, numbers = result["status"], result["run"]
    for kind in dict.fromkeys(status[status != "completed"].tolist()):
        chosen: Sequence[int] = (status == kind).nonzero()[0].tolist()
        message = result["message"][chosen[0]]
        console.print(f"{kind}: {counted(len(chosen), 'run')}; run {numbers[chosen[0]]}: {message}")

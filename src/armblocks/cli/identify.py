"""``armblocks identify``: estimates the parameters of a robot from logged motions and torques."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console

from armblocks.cli.completion import complete_robots
from armblocks.cli.terminal import STRONG, results_console, table
from armblocks.errors import counted
from armblocks.pictures.numbers import table_number

if TYPE_CHECKING:
    from armblocks import IdentificationResult

NOT_DETERMINED = 1
OTHER_COLUMNS = 64
"""Width of the columns between the names and the sums of parameters."""
LEAST_SUM = 30
"""Minimum width of the column of sums, which narrower terminals do not show."""


def identify(
    robot: Annotated[
        str,
        typer.Argument(
            help="A shipped robot, or a robot file of any format.", autocompletion=complete_robots
        ),
    ],
    logs: Annotated[
        list[Path],
        typer.Argument(
            metavar="LOG…",
            help="Tables of experiments with columns t, q1 …, tau1 … and optionally qd1 …, qdd1 ….",
        ),
    ],
    link: Annotated[
        list[str] | None,
        typer.Option(
            help="A link with unknown mass, centre of mass and inertia; may be repeated.",
            show_default="all links",
        ),
    ] = None,
    friction: Annotated[
        str, typer.Option(help="asymmetric, coulomb, viscous or none (friction of the description).")
    ] = "asymmetric",
    rotor_inertia: Annotated[bool, typer.Option(help="Estimate the inertia of the rotors.")] = True,
    payload: Annotated[float, typer.Option(help="Known mass at the tool in all logs, kg.")] = 0.0,
    cutoff: Annotated[
        float | None, typer.Option(help="Cut-off frequency of the filter of the motion, Hz.")
    ] = None,
    decimate: Annotated[int, typer.Option(help="Filter and keep every K-th sample.", metavar="K")] = 1,
    min_speed: Annotated[
        float, typer.Option(help="Minimum speed of a joint at samples that are used, rad/s or m/s.")
    ] = 0.0,
    robust: Annotated[bool, typer.Option("--robust", help="Huber's weights, for outliers.")] = False,
    validate: Annotated[
        Path | None, typer.Option(help="Another log, with which the torques are compared.")
    ] = None,
    save: Annotated[Path | None, typer.Option(help="Write the identified robot, robot.json.")] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Write measured torques, fitted torques and residuals, .svg or .png.")
    ] = None,
) -> None:
    """Estimate the parameters of a robot from logged positions and torques.

    Prints the base parameters with their standard errors beside the values of the description, and the noise
    of each joint. Wide terminals also show each base parameter as a sum of parameters.

    Exit code 0: done, 1: the motion does not determine some parameters, 2: invalid input.
    """
    import armblocks as ab

    arm = ab.load_robot(robot)
    result = ab.identify(
        arm,
        [str(log) for log in logs],
        links=link or None,
        friction=friction,  # pyright: ignore[reportArgumentType] - checked there
        rotor_inertia=rotor_inertia,
        payload=payload or None,
        cutoff=cutoff,
        decimate=decimate,
        min_speed=min_speed,
        robust=robust,
    )
    known = payload or None
    compared = None if validate is None else result.validate(str(validate), cutoff=cutoff, payload=known)
    console = results_console()
    print_identification(result, console, compared)
    if save is not None:
        console.print(f"robot: {ab.save_robot(result.robot, save)}", soft_wrap=True)
    if plot is not None:
        result.plot(save=plot)
        console.print(f"figure: {plot}", soft_wrap=True)
    if result.not_identified:
        raise typer.Exit(NOT_DETERMINED)


def print_identification(result: IdentificationResult, console: Console, compared: Any = None) -> None:
    """Print parameters and joints; ``compared``: errors (n,) of the torques of another log, N m or N."""
    heading = f"{result.name}: {counted(len(result.parameters), 'base parameter')} from "
    console.print(heading + counted(len(result.time), "sample"), style=STRONG)
    rows = result.table()
    room = console.width - OTHER_COLUMNS - max(len(str(row["parameter"])) for row in rows)
    shown = table(
        *(("parameter", "left"), ("value", "right"), ("std. error", "right"), ("%", "right")),
        *(("description", "right"), ("unit", "left")),
    )
    with_sums = room >= LEAST_SUM
    if with_sums:
        shown.add_column("sum")
    for row in rows:
        cells = [row[name] for name in ("value", "standard error", "%", "description")]
        texts = [table_number(float(value), 4) if math.isfinite(float(value)) else "" for value in cells]
        sums = [_shortened(str(row["sum"]), room)] if with_sums else []
        shown.add_row(str(row["parameter"]), *texts, str(row["unit"]), *sums)
    console.print(shown)
    console.print()
    heads = [("joint", "left"), ("noise", "right"), ("unit", "left"), ("of torque", "right")]
    joints = table(*heads, *([("in the other log", "right")] if compared is not None else []))
    for k, (joint, unit) in enumerate(zip(result.joints, result.joint_units)):
        noise, share = table_number(float(result.noise[k]), 4), f"{float(result.errors[k]):.2f} %"
        other = [] if compared is None else [f"{table_number(float(compared[k]), 4)} {unit}"]
        joints.add_row(joint, noise, unit, share, *other)
    console.print(joints)
    print_notes([result.summary, *result.findings], console)


def _shortened(text: str, width: int) -> str:
    return text if len(text) <= width else text[: width - 2].rpartition(" ")[0].rstrip(" +-") + " …"


def print_notes(lines: list[str], console: Console) -> None:
    """Print sentences below a table."""
    console.print()
    for line in lines:
        console.print(line)

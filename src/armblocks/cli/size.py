"""``armblocks size``: compares candidate motors and gears of a robot for a trajectory and a payload."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.text import Text

from armblocks.cli.completion import complete_robots
from armblocks.cli.terminal import ERROR, GOOD, STRONG, results_console, table
from armblocks.errors import counted
from armblocks.pictures.numbers import table_number

if TYPE_CHECKING:
    from armblocks.report.drive_load import DriveLoad

FAILED = 1


def size(
    robot: Annotated[
        str,
        typer.Argument(
            help="A shipped robot, or a robot file of any format.", autocompletion=complete_robots
        ),
    ],
    trajectory: Annotated[
        Path, typer.Option(help="Table of the motion with columns t, q1 … and optionally qd1 …, qdd1 ….")
    ],
    motors: Annotated[Path, typer.Option(help="CSV catalogue of motors with their gears.")],
    payload: Annotated[float, typer.Option(help="Mass at the tool, kg.")] = 0.0,
    pause: Annotated[float, typer.Option(help="Pause after the motion, s.")] = 0.0,
    brakes: Annotated[
        bool, typer.Option("--brakes", help="Brakes hold the arm in the pause, not the motors.")
    ] = False,
    report: Annotated[
        Path | None, typer.Option(help="Folder for sizing.html, sizing.csv and figures.")
    ] = None,
) -> None:
    """Compare candidate motors and gears with the loads of a trajectory.

    The table has a row for each joint and candidate: the limit with the smallest margin, and the utilisation
    of the limits of speed, peak torque and RMS torque.

    Exit code 0: each joint has a candidate within all limits, 1: a joint has none, 2: invalid input.
    """
    import armblocks as ab

    sizing = ab.size_drives(
        ab.load_robot(robot),
        ab.load_trajectory(trajectory),
        ab.load_drives(motors),
        payload=payload or None,
        pause=pause,
        brakes_in_pause=brakes,
    )
    console = results_console()
    console.print(sizing.heading, style=STRONG, soft_wrap=True)
    shown = table(
        *(("joint", "left"), ("drive", "left"), ("", "left"), ("tightest", "left"), ("margin", "right")),
        *(("speed", "right"), ("peak", "right"), ("RMS", "right"), ("cycles/h", "right")),
    )
    for load in sizing.loads:
        shown.add_row(*_cells(load))
    console.print(shown)
    missing = 0
    for joint, load in sizing.suggested.items():
        missing += load is None
        chosen = Text(load.drive.name) if load else Text("no candidate passes", ERROR)
        console.print(Text.assemble(f"{joint}: ", chosen), soft_wrap=True)
    if report is not None:
        files = sizing.write(report)
        console.print(f"report: {report}, {counted(len(files), 'file')}", soft_wrap=True)
    if missing:
        raise typer.Exit(FAILED)


def _cells(load: DriveLoad) -> list[str | Text]:
    tightest = load.tightest
    used = [
        f"{table_number(100.0 * load.used(name), 3)} %" for name in ("speed", "peak torque", "RMS torque")
    ]
    return [
        load.joint,
        load.drive.name,
        Text("pass", GOOD) if load.passes else Text("FAIL", ERROR),
        tightest.name,
        f"{table_number(100.0 * tightest.margin, 3)} %",
        *(cell.replace("nan %", "") for cell in used),
        table_number(load.most_cycles_per_hour, 4),
    ]

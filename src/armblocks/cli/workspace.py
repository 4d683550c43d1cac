"""``armblocks workspace``: the region that an arm reaches, with maps of measures."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from armblocks.cli.completion import complete_robots
from armblocks.cli.robot_options import named_values
from armblocks.cli.terminal import STRONG, results_console, table
from armblocks.errors import InputError, counted


def workspace(
    robot: Annotated[
        str,
        typer.Argument(
            help="A shipped robot, or a robot file of any format.", autocompletion=complete_robots
        ),
    ],
    samples: Annotated[int, typer.Option(help="Number of configurations.")] = 1_000_000,
    measure: Annotated[
        list[str] | None,
        typer.Option(
            help="manipulability, singularity, condition, limits or payload; may be repeated.",
            show_default="manipulability",
        ),
    ] = None,
    axes: Annotated[str | None, typer.Option(help="Rows of the Jacobian: all, trans or rot.")] = None,
    frame: Annotated[str | None, typer.Option(help="A frame or link instead of the tool.")] = None,
    cell: Annotated[float | None, typer.Option(help="Side of the cells, m.")] = None,
    limits: Annotated[
        list[str] | None,
        typer.Option(
            "--range", metavar="NAME=LOW,HIGH", help="Range of a coordinate, rad or m; may be repeated."
        ),
    ] = None,
    seed: Annotated[int, typer.Option(help="Selects the sequence of configurations.")] = 0,
    threads: Annotated[
        int | None, typer.Option(help="Number of threads; by default the number of CPUs.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="A file (.csv, .parquet, .npz, .svg, .png, .pdf), or a folder for page, tables and figures."
        ),
    ] = None,
) -> None:
    """Sample the region that the tool reaches, with maps of measures.

    Prints reach, bounds and volume, and the range of each measure. The samples themselves are not kept, so
    that memory does not grow with their number.

    Exit code 0: done, 2: invalid input.
    """
    import armblocks as ab

    found = ab.workspace(
        ab.load_robot(robot),
        samples,
        measures=measure or ["manipulability"],
        axes=axes,
        frame=frame,
        cell=cell,
        ranges=_ranges(limits),
        seed=seed,
        threads=threads or os.cpu_count() or 1,
    )
    console = results_console()
    console.print(f"workspace of {found.name}", style=STRONG, soft_wrap=True)
    for title, text in found.facts():
        console.print(f"{title}: {text}", soft_wrap=True, highlight=False)
    shown = table(
        *(("measure", "left"), ("unit", "left"), ("least", "right")),
        *(("median of cell maxima", "right"), ("most", "right")),
    )
    for row in found.measure_rows():
        shown.add_row(*row)
    console.print(shown)
    if out is None:
        return
    if out.suffix:
        console.print(f"file: {found.save(out)}", soft_wrap=True)
    else:
        console.print(f"folder: {out}, {counted(len(found.write(out)), 'file')}", soft_wrap=True)


def _ranges(texts: list[str] | None) -> dict[str, tuple[float, ...]]:
    ranges: dict[str, tuple[float, ...]] = {}
    for name, text in named_values(texts, "--range").items():
        try:
            ranges[name] = tuple(float(part) for part in text.split(","))
        except ValueError:
            raise InputError(
                f"'{text}' is not a pair of numbers",
                where=f"--range {name}",
                allowed="LOW,HIGH in rad or m",
                fix=f"write for example --range {name}=-1.5,1.5",
            ) from None
    return ranges

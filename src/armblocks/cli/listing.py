"""``armblocks list``: lists the shipped items, one line each."""

from __future__ import annotations

import warnings
from enum import StrEnum
from typing import Annotated

import typer
from rich.table import Table

from armblocks.cli.blocks import blocks_table
from armblocks.cli.terminal import results_console, table
from armblocks.errors import InertiaWarning


class Kind(StrEnum):
    """The kinds of items that can be listed."""

    ROBOTS = "robots"
    BLOCKS = "blocks"
    EXAMPLES = "examples"
    LIBRARIES = "libraries"
    SOLVERS = "solvers"


def list_names(kind: Annotated[Kind, typer.Argument(help="The kind of items to list.")]) -> None:
    """List the shipped robots, example diagrams and libraries of subsystems, the blocks, or the solvers."""
    rows = {
        Kind.ROBOTS: _robots,
        Kind.BLOCKS: _blocks,
        Kind.EXAMPLES: _examples,
        Kind.LIBRARIES: _libraries,
        Kind.SOLVERS: _solvers,
    }[kind]()
    results_console().print(rows)


def _robots() -> Table:
    from armblocks.formats import list_robots
    from armblocks.formats.robot_facts import shipped_summary

    rows = table(("robot", "left"), ("joints", "left"), ("description", "left"))
    for name in list_robots():
        robot = shipped_summary(name)
        words = (robot.manufacturer, robot.title, robot.comment)
        rows.add_row(name, robot.joint_letters, "; ".join(word for word in words if word))
    return rows


def _blocks() -> Table:
    from armblocks.blocks import BLOCKS

    return blocks_table(list(BLOCKS.values()))


def _examples() -> Table:
    import armblocks as ab

    rows = table(("example", "left"), ("blocks", "right"), ("stop time", "right"), ("description", "left"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InertiaWarning)
        for name in ab.list_examples():
            diagram = ab.load_diagram(name)
            stop = f"{diagram.settings.stop_time:g} s"
            rows.add_row(name, str(len(diagram.blocks)), stop, diagram.description)
    return rows


def _libraries() -> Table:
    import armblocks as ab

    rows = table(("library", "left"), ("subsystem", "left"), ("parameters", "left"), ("description", "left"))
    for library in ab.list_libraries():
        for name, subsystem in ab.load_library(library).items():
            inner = subsystem.diagram
            rows.add_row(
                library, name, ", ".join(parameter.name for parameter in inner.mask), inner.description
            )
    return rows


def _solvers() -> Table:
    from armblocks.simulation.tableaux import TABLEAUX

    rows = table(
        ("solver", "left"), ("also", "left"), ("order", "right"), ("step", "left"), ("method", "left")
    )
    for tableau in TABLEAUX:
        step = "adaptive" if tableau.adaptive else "fixed"
        rows.add_row(tableau.name, ", ".join(tableau.aliases), str(tableau.order), step, tableau.title)
    return rows

"""``armblocks list``: what comes with armblocks, by name, with one line each."""

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
    """What can be listed."""

    ROBOTS = "robots"
    BLOCKS = "blocks"
    EXAMPLES = "examples"


def list_names(kind: Annotated[Kind, typer.Argument(help="What to list.")]) -> None:
    """List the shipped robots, the blocks, or the shipped example diagrams."""
    console = results_console()
    rows = {Kind.ROBOTS: _robots, Kind.BLOCKS: _blocks, Kind.EXAMPLES: _examples}[kind]()
    console.print(rows)


def _robots() -> Table:
    import armblocks as ab

    rows = table(("robot", "left"), ("joints", "left"), ("what it is", "left"))
    # Each of them is loaded only to be named; its inertias are a matter for those who use it.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InertiaWarning)
        for name in ab.list_robots():
            robot = ab.load_robot(name).robot
            about = "; ".join(text for text in (robot.manufacturer, robot.comment) if text)
            rows.add_row(name, robot.joint_letters, about)
    return rows


def _blocks() -> Table:
    from armblocks.blocks import BLOCKS

    return blocks_table(list(BLOCKS.values()))


def _examples() -> Table:
    import armblocks as ab

    rows = table(("example", "left"), ("blocks", "right"), ("stop time", "right"), ("what it shows", "left"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InertiaWarning)
        for name in ab.list_examples():
            diagram = ab.load_diagram(name)
            stop = f"{diagram.settings.stop_time:g} s"
            rows.add_row(name, str(len(diagram.blocks)), stop, diagram.description)
    return rows

"""``armblocks list``: what comes with armblocks, by name, with one line each."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from armblocks.cli.terminal import results_console, table


class Kind(StrEnum):
    """What can be listed."""

    ROBOTS = "robots"
    BLOCKS = "blocks"
    EXAMPLES = "examples"


def list_names(kind: Annotated[Kind, typer.Argument(help="What to list.", show_choices=True)]) -> None:
    """List the shipped robots, the blocks, or the shipped example diagrams."""
    import armblocks as ab

    lists = {Kind.ROBOTS: ab.list_robots, Kind.BLOCKS: ab.list_blocks, Kind.EXAMPLES: ab.list_examples}
    rows = table(("name", "left"), ("what it is", "left"))
    for name, text in lists[kind]().items():
        rows.add_row(name, text)
    results_console().print(rows)

"""Terminal output of the commands: errors, warnings, tables.

Colours are legible on light and dark backgrounds (contrast of at least 4:1 on both). No information depends
on colour alone, and no text is dimmed. Results go to standard output; progress, warnings and errors go
to standard error.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Generator
from contextlib import contextmanager
from typing import TextIO

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from armblocks.errors import ArmblocksError, ArmblocksWarning

ERROR = "bold color(160)"
WARNING = "bold color(166)"
ACCENT = "color(166)"
GOOD = "bold color(28)"
STRONG = "bold"

_UNLIMITED_WIDTH = 100_000
"""Width of errors outside a terminal: lines are not wrapped, because logs are searched by line."""


def results_console() -> Console:
    """Standard output: 80 columns outside a terminal, unless ``COLUMNS`` is set.

    Markup is disabled: square brackets in messages and docstrings are vectors.
    """
    return Console(highlight=False, markup=False, emoji=False)


def messages_console() -> Console:
    """Standard error; lines are wrapped only for a terminal."""
    console = Console(stderr=True, highlight=False, markup=False, emoji=False)
    if not console.is_terminal:
        console.width = _UNLIMITED_WIDTH
    return console


def table(*columns: tuple[str, str], title: str | None = None) -> Table:
    """An empty table; each column is its heading and ``"left"`` or ``"right"``."""
    empty = Table(
        title=title,
        title_justify="left",
        title_style=STRONG,
        box=box.SIMPLE_HEAD,
        header_style=STRONG,
        padding=(0, 1, 0, 0),
        pad_edge=False,
        show_edge=False,
    )
    for heading, side in columns:
        empty.add_column(heading, justify="right" if side == "right" else "left", overflow="fold")
    return empty


def show_error(error: ArmblocksError) -> None:
    """Print the four parts of a message, one below the other."""
    console = messages_console()
    console.print(Text.assemble(("error: ", ERROR), (error.what, STRONG)), soft_wrap=not console.is_terminal)
    grid = Table.grid(padding=(0, 2))
    grid.add_column(no_wrap=True)
    grid.add_column(overflow="fold")
    for label, text in (("where", error.where), ("allowed", error.allowed), ("fix", error.fix)):
        if text:
            grid.add_row(Text(f"  {label}"), Text(text))
    if grid.row_count:
        console.print(grid)


def debugging() -> bool:
    """Whether ``ARMBLOCKS_DEBUG`` enables tracebacks."""
    return os.environ.get("ARMBLOCKS_DEBUG", "") not in ("", "0")


@contextmanager
def tidy_warnings(console: Console) -> Generator[None]:
    """Show each armblocks warning once, as one line on ``console``; others as Python does."""
    shown_texts: set[str] = set()
    default_show = warnings.showwarning

    def show(
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        file: TextIO | None = None,
        line: str | None = None,
    ) -> None:
        if not issubclass(category, ArmblocksWarning):
            default_show(message, category, filename, lineno, file, line)
        elif str(message) not in shown_texts:
            shown_texts.add(str(message))
            console.print(
                Text.assemble(("warning: ", WARNING), str(message)), soft_wrap=not console.is_terminal
            )

    with warnings.catch_warnings():
        warnings.simplefilter("always", ArmblocksWarning)
        warnings.showwarning = show
        yield

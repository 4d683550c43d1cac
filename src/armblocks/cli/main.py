"""The entry point of the command line: commands, and handling of errors, warnings and Ctrl-C.

Exit codes: 0 done, 1 a defect of armblocks (with a traceback), 2 invalid input (a message, no traceback), 130
interrupted with Ctrl-C. Some commands also exit with 1:

- ``diff`` if the diagrams differ,
- ``lint`` if there are findings,
- ``size`` if a joint has no candidate drive within all limits,
- ``identify`` and ``fit`` if the data do not determine some parameters,
- ``optimise`` if no minimum was found.
"""

from __future__ import annotations

import gc
import inspect
import re
from collections.abc import Callable
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from armblocks.cli import (
    bench,
    blocks,
    convert,
    diagram,
    diff,
    docs,
    fit,
    identify,
    linearize,
    lint,
    listing,
    optimise,
    run,
    show,
    size,
    studio,
    sweep,
    trim,
    workspace,
)
from armblocks.cli.terminal import debugging, messages_console, show_error, tidy_warnings
from armblocks.errors import ArmblocksError

INVALID_INPUT = 2
INTERRUPTED = 130
GARBAGE_THRESHOLD = 50_000
"""Number of new objects between runs of Python's cyclic garbage collector."""


class Commands(TyperGroup):
    """All commands. Errors are converted to a message and an exit code here."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command given by the arguments."""
        try:
            with tidy_warnings(messages_console()):
                return super().invoke(ctx)
        except ArmblocksError as error:
            if debugging():
                raise
            show_error(error)
            raise typer.Exit(INVALID_INPUT) from None
        except KeyboardInterrupt:
            messages_console().print("interrupted")
            raise typer.Exit(INTERRUPTED) from None


app = typer.Typer(
    name="armblocks",
    cls=Commands,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Industrial arms and block diagrams, traced once and compiled to native code.",
)
COMMANDS: dict[str, Callable[..., None]] = {
    "run": run.run,
    "sweep": sweep.sweep,
    "linearize": linearize.linearize,
    "trim": trim.trim,
    "diff": diff.diff,
    "diagram": diagram.diagram,
    "convert": convert.convert,
    "show": show.show,
    "lint": lint.lint,
    "size": size.size,
    "identify": identify.identify,
    "fit": fit.fit,
    "optimise": optimise.optimise,
    "workspace": workspace.workspace,
    "list": listing.list_names,
    "blocks": blocks.describe_blocks,
    "docs": docs.docs,
    "bench": bench.bench,
    "studio": studio.studio,
}


def _help(command: Callable[..., None]) -> str:
    """The docstring with the lines of each paragraph joined: the terminal determines the line breaks."""
    return re.sub(r"(?<=\S)\n(?=\S)", " ", inspect.cleandoc(command.__doc__ or ""))


for _name, _command in COMMANDS.items():
    app.command(_name, help=_help(_command))(_command)


def _print_version(requested: bool) -> None:
    if requested:
        from importlib.metadata import version

        typer.echo(f"armblocks {version('armblocks')}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool,
        typer.Option("--version", help="Print the version and exit.", callback=_print_version, is_eager=True),
    ] = False,
) -> None:
    """Options before the command."""


def main() -> None:
    """The entry point of the installed ``armblocks`` script."""
    # Imports and reports create many objects and few cycles. With the default threshold of 700, garbage
    # collection takes a tenth of their time.
    gc.set_threshold(GARBAGE_THRESHOLD)
    app()

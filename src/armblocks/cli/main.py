"""The entry point of the command line: commands, and handling of errors, warnings and Ctrl-C.

Exit codes: 0 done, 1 a defect of armblocks (with a traceback), 2 invalid input (a message, no traceback), 130
interrupted with Ctrl-C. ``diff`` also exits with 1 if its diagrams differ, ``lint`` if it has findings, and
``size`` if a joint has no candidate drive within all limits.
"""

from __future__ import annotations

import gc
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
    linearize,
    lint,
    listing,
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
app.command("run")(run.run)
app.command("sweep")(sweep.sweep)
app.command("linearize")(linearize.linearize)
app.command("trim")(trim.trim)
app.command("diff")(diff.diff)
app.command("diagram")(diagram.diagram)
app.command("convert")(convert.convert)
app.command("show")(show.show)
app.command("lint")(lint.lint)
app.command("size")(size.size)
app.command("workspace")(workspace.workspace)
app.command("list")(listing.list_names)
app.command("blocks")(blocks.describe_blocks)
app.command("docs")(docs.docs)
app.command("bench")(bench.bench)
app.command("studio")(studio.studio)


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

"""``armblocks lint``: the findings about a robot file, with file, line, rule and remedy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table
from rich.text import Text

from armblocks.cli.completion import complete_robots
from armblocks.cli.robot_options import PackageFolders, XacroArguments, named_values
from armblocks.cli.terminal import GOOD, STRONG, WARNING, results_console

if TYPE_CHECKING:
    from rich.console import Console

    from armblocks.formats.file_findings import FileFinding

FOUND = 1


def lint(
    robot: Annotated[
        str,
        typer.Argument(
            help="A robot file of any format, or a shipped robot.", autocompletion=complete_robots
        ),
    ],
    name: Annotated[
        str | None, typer.Option(help="Robot to select from a script with several robots.")
    ] = None,
    package: PackageFolders = None,
    argument: XacroArguments = None,
) -> None:
    """Check a robot file: parts that are not read, impossible and implausible values.

    Exit code 0: no findings, 1: some, 2: the file cannot be read.
    """
    from armblocks.formats import lint_robot

    findings = lint_robot(
        robot,
        name=name,
        packages=named_values(package, "--package"),
        arguments=named_values(argument, "--argument"),
    )
    console = results_console()
    for finding in findings:
        _print_finding(finding, console)
    if not findings:
        console.print(f"{robot}: no findings", style=GOOD, soft_wrap=True)
        return
    noun = "finding" if len(findings) == 1 else "findings"
    console.print(f"{robot}: {len(findings)} {noun}", style=STRONG, soft_wrap=True)
    raise typer.Exit(FOUND)


def _print_finding(finding: FileFinding, console: Console) -> None:
    heading = Text.assemble(
        (f"{finding.where}: ", STRONG), finding.what, (f" [{finding.rule.code}]", WARNING)
    )
    console.print(heading, soft_wrap=not console.is_terminal)
    grid = Table.grid(padding=(0, 2))
    grid.add_column(no_wrap=True)
    grid.add_column(overflow="fold")
    grid.add_row(Text("  allowed"), Text(finding.rule.allowed))
    grid.add_row(Text("  fix"), Text(finding.rule.remedy))
    console.print(grid)

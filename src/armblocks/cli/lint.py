"""``armblocks lint``: the findings about a robot file, with file, line, rule and remedy."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table
from rich.text import Text

from armblocks.cli.completion import complete_robots
from armblocks.cli.robot_options import PackageFolders, XacroArguments, named_values
from armblocks.cli.terminal import GOOD, STRONG, WARNING, results_console
from armblocks.errors import FormatError, counted

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console

    from armblocks.formats import CorrectedFile
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
    fix: Annotated[
        bool,
        typer.Option("--fix", help="Write a corrected copy, by default NAME.fixed.SUFFIX beside the file."),
    ] = False,
    output: Annotated[Path | None, typer.Option("--output", help="With --fix: the file to write.")] = None,
    in_place: Annotated[
        bool, typer.Option("--in-place", help="With --fix: replace the file itself.")
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="With --fix: replace an existing copy.")] = False,
) -> None:
    """Check a robot file: parts that are not read, impossible and implausible values.

    --fix corrects the findings whose remedy is unambiguous, in a copy of the file.

    Exit code 0: no findings (with --fix: none remain), 1: some, 2: the file cannot be read or written.
    """
    from armblocks.formats import correct_robot, lint_robot

    packages, arguments = named_values(package, "--package"), named_values(argument, "--argument")
    console = results_console()
    if fix:
        target = _target(Path(robot), output, in_place=in_place, force=force)
        corrected = correct_robot(robot, name=name, packages=packages, arguments=arguments)
        _write(robot, target, corrected, console)
        # The line numbers of the remaining findings refer to the copy.
        findings = [
            replace(found, file=str(target)) if corrected.changes and found.file == robot else found
            for found in corrected.remaining
        ]
        robot = str(target) if corrected.changes else robot
    elif output is not None or in_place or force:
        raise FormatError(
            "nothing is written without --fix",
            where="armblocks lint",
            allowed="--output, --in-place and --force together with --fix",
            fix="add --fix, or omit these options",
        )
    else:
        findings = lint_robot(robot, name=name, packages=packages, arguments=arguments)
    _report(robot, findings, console, "remaining " if fix else "")


def _target(source: Path, output: Path | None, *, in_place: bool, force: bool) -> Path:
    """The file to write. Raises ``FormatError`` if it exists, or if it is the source without --in-place."""
    if in_place and output is not None:
        raise FormatError(
            "both --output and --in-place are given",
            where="armblocks lint",
            allowed="one of them",
            fix="omit one of them",
        )
    if in_place:
        return source
    target = output or source.with_name(f"{source.stem}.fixed{source.suffix}")
    if target.suffix.lower() != source.suffix.lower():
        raise FormatError(
            f"the copy has the suffix '{target.suffix}'",
            where=str(target),
            allowed=f"'{source.suffix}', the suffix of the file",
            fix="give the copy the same suffix; armblocks convert writes other formats",
        )
    if target.exists() and source.exists() and target.samefile(source):
        raise FormatError(
            "the copy would replace the file itself",
            where=str(target),
            allowed="another name, or --in-place",
            fix="use --in-place to replace the file",
        )
    if target.exists() and not force:
        raise FormatError(
            "the file already exists",
            where=str(target),
            allowed="a new file",
            fix="choose another name with --output, or replace the file with --force",
        )
    return target


def _write(robot: str, target: Path, corrected: CorrectedFile, console: Console) -> None:
    """Write the corrected file, and print the corrections."""
    from armblocks.files import write_atomically

    for finding, what in corrected.changes:
        heading = Text.assemble((f"{finding.where}: ", STRONG), what, (f" [{finding.rule.code}]", GOOD))
        console.print(heading, soft_wrap=not console.is_terminal)
    if not corrected.changes:
        console.print(f"{robot}: nothing to correct, no file written", style=STRONG, soft_wrap=True)
        return
    write_atomically(target, corrected.data)
    corrections = counted(len(corrected.changes), "correction")
    console.print(f"{target}: {corrections}, written", style=GOOD, soft_wrap=True)


def _report(robot: str, findings: Sequence[FileFinding], console: Console, word: str) -> None:
    """Print the findings. Exits with 1 if there are any."""
    for finding in findings:
        _print_finding(finding, console)
    if not findings:
        console.print(f"{robot}: no {word}findings", style=GOOD, soft_wrap=True)
        return
    count = counted(len(findings), f"{word}finding")
    console.print(f"{robot}: {count}", style=STRONG, soft_wrap=True)
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

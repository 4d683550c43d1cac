"""Shell completion of shipped names, in addition to files.

Names are read from folder listings, so that completion imports no library of armblocks.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def complete_models(typed: str) -> list[str]:
    """Shipped diagrams, and diagram files in the typed folder."""
    from armblocks.formats.shipped import list_examples

    return [*_beginning(typed, list_examples()), *_files(typed)]


def complete_anything(typed: str) -> list[str]:
    """Shipped robots, diagrams and libraries, and files."""
    from armblocks.formats.shipped import list_examples, list_libraries, list_robots

    return [*_beginning(typed, (*list_robots(), *list_examples(), *list_libraries())), *_files(typed)]


def complete_robots(typed: str) -> list[str]:
    """Shipped robots, and files."""
    from armblocks.formats.shipped import list_robots

    return [*_beginning(typed, list_robots()), *_files(typed)]


def _beginning(typed: str, names: tuple[str, ...]) -> list[str]:
    return [name for name in names if name.startswith(typed)]


def _files(typed: str) -> list[str]:
    """Folders, and files with a suffix of robots or diagrams, in the typed folder."""
    from armblocks.formats import ROBOT_SUFFIXES

    folder, slash, beginning = typed.rpartition("/")
    try:
        entries = sorted(Path(f"{folder}/" if slash else ".").iterdir())
    except OSError:
        return []
    return [
        f"{folder}{slash}{entry.name}{'/' if entry.is_dir() else ''}"
        for entry in entries
        if entry.name.startswith(beginning)
        and not entry.name.startswith(".")
        and (entry.is_dir() or entry.suffix.lower() in ROBOT_SUFFIXES)
    ]


ModelName = Annotated[
    str,
    typer.Argument(
        help="A shipped example's name, or the path of a diagram file.", autocompletion=complete_models
    ),
]
"""The argument of the commands that take a diagram."""
ParameterSetName = Annotated[
    str | None,
    typer.Option(
        "--parameter-set",
        metavar="NAME",
        help="Use the values of a parameter set of the model, before --set.",
    ),
]

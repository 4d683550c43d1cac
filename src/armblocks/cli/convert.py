"""``armblocks convert``: a robot, diagram or library in another file format."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from armblocks.cli.completion import complete_anything
from armblocks.cli.robot_options import PackageFolders, TipName, XacroArguments, named_values
from armblocks.cli.terminal import results_console
from armblocks.errors import FormatError

_SUFFIXES = {"diagram": (".json", ".py"), "library": (".json",)}
"""The suffixes of the formats in which diagrams and libraries are written."""


def convert(
    source: Annotated[
        str,
        typer.Argument(
            help="A shipped name, or the path of a robot, diagram or library file.",
            autocompletion=complete_anything,
        ),
    ],
    target: Annotated[
        Path,
        typer.Argument(
            help="The file to write: .json, for a robot also .urdf, .sdf, .xml (MJCF), for a diagram .py."
        ),
    ],
    name: Annotated[
        str | None, typer.Option("--name", help="Robot to select from a script with several robots.")
    ] = None,
    tip: TipName = None,
    package: PackageFolders = None,
    argument: XacroArguments = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing file.")] = False,
    trust: Annotated[
        bool, typer.Option("--trust", help="Run the Python files that the diagram names.")
    ] = False,
) -> None:
    """Write a robot (.json, .urdf, .sdf, .xml), a diagram (.json, .py) or a library (.json)."""
    import armblocks as ab
    from armblocks.files import write_atomically
    from armblocks.formats import ROBOT_FORMATS, DocumentKind, kind_of_document

    if Path(source).suffix.lower() == ".py":
        raise FormatError(
            "a Python program is not converted, because it would have to be run",
            where=source,
            allowed="robots (.json, .m), diagrams and libraries (.json), shipped names",
            fix='run it with an additional call ab.save_diagram(diagram, "model.json")',
        )
    kind = kind_of_document(source)
    written = [suffix for format in ROBOT_FORMATS if format.write is not None for suffix in format.suffixes]
    suffixes = _SUFFIXES.get(kind.value, tuple(written))
    if target.suffix.lower() not in suffixes:
        raise FormatError(
            f"a {kind.value} cannot be written as '{target.suffix or target.name}'",
            where=str(target),
            allowed=", ".join(suffixes),
            fix="give the target another suffix",
        )
    if target.exists() and not force:
        raise FormatError(
            "the file already exists",
            where=str(target),
            allowed="a new file",
            fix="choose another name, or replace the file with --force",
        )
    if kind is DocumentKind.ROBOT:
        robot = ab.load_robot(
            source,
            name=name,
            tip=tip,
            packages=named_values(package, "--package"),
            arguments=named_values(argument, "--argument"),
        )
        ab.save_robot(robot, target)
    elif kind is DocumentKind.LIBRARY:
        ab.save_library(ab.load_library(source, trust=trust), target)
    elif target.suffix.lower() == ".py":
        write_atomically(target, ab.to_python(ab.load_diagram(source, trust=trust)).encode())
    else:
        ab.save_diagram(ab.load_diagram(source, trust=trust), target)
    results_console().print(f"wrote {target}", soft_wrap=True)

"""Options of the commands that read robot files: the tip, ROS packages, arguments of xacro files."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import typer

from armblocks.errors import InputError

TipName = Annotated[str | None, typer.Option("--tip", metavar="LINK", help="The link that carries the tool.")]
PackageFolders = Annotated[
    list[str] | None,
    typer.Option("--package", metavar="NAME=FOLDER", help="Folder of a ROS package; may be repeated."),
]
XacroArguments = Annotated[
    list[str] | None,
    typer.Option("--argument", metavar="NAME=VALUE", help="Argument of a xacro file; may be repeated."),
]


def named_values(texts: Sequence[str] | None, option: str) -> dict[str, str]:
    """The values of a repeated option by name. Raises ``InputError`` for a text without a name."""
    values: dict[str, str] = {}
    for text in texts or ():
        name, equals, value = text.partition("=")
        if not (name.strip() and equals):
            raise InputError(
                f"'{text}' is not of the form NAME=VALUE",
                where=option,
                allowed="a name, =, and a value",
                fix=f"write for example {option} name=value",
            )
        values[name.strip()] = value
    return values

"""``armblocks studio``: edit and run models in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from armblocks.cli.completion import complete_models
from armblocks.cli.terminal import messages_console
from armblocks.errors import FormatError, InputError
from armblocks.extras import require


def studio(
    model: Annotated[
        str,
        typer.Argument(
            help="A shipped example's name, or a diagram file.",
            show_default="an example",
            autocompletion=complete_models,
        ),
    ] = "",
    folder: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the files that the studio can open and save.", show_default="this folder"
        ),
    ] = None,
    port: Annotated[
        int, typer.Option(help="Port on this machine; 0 uses a free port.", min=0, max=65535)
    ] = 0,
    new_session: Annotated[
        bool,
        typer.Option("--new-session", help="Require the new link: earlier sessions lose access."),
    ] = False,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")
    ] = True,
) -> None:
    """Open the studio in the browser: edit and run diagrams, view scopes and the arm. Ctrl-C ends it."""
    require("studio", "the studio")
    from armblocks.formats import list_examples
    from armblocks.studio.built_page import build_in_checkout
    from armblocks.studio.server.launch import serve

    root = folder or Path.cwd()
    if model and model not in list_examples():
        path = Path(model)
        if not path.is_file():
            raise FormatError(
                "there is no such file and no such example",
                where=model,
                allowed=f"a diagram file, or one of {', '.join(list_examples())}",
                fix="check the name",
            )
        root = folder or path.resolve().parent
        if not path.resolve().is_relative_to(root.resolve()):
            raise InputError(
                f"the model '{path}' is not in the folder",
                where=f"armblocks studio --folder {root}",
                allowed="a file in this folder or its subfolders: the studio accesses no others",
                fix=f"omit --folder, or give {path.resolve().parent}",
            )
        model = path.resolve().relative_to(root.resolve()).as_posix()
    console = messages_console()
    build_in_checkout(lambda text: console.print(text, soft_wrap=True))

    def announce(link: str) -> None:
        console.print(f"The studio is at {link}", soft_wrap=True, highlight=False)
        console.print("The link is valid once. Ctrl-C ends the studio.")

    serve(root, model, port=port, open_browser=browser, announce=announce, new_session=new_session)

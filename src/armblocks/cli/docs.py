"""``armblocks docs``: the documentation in the browser, without a network."""

from __future__ import annotations

import subprocess
import sys
import webbrowser
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from armblocks.cli.terminal import messages_console, results_console
from armblocks.errors import FormatError, UnknownNameError
from armblocks.extras import installed

PACKAGE = Path(__file__).parents[1]
INSTALLED = PACKAGE / "shipped" / "docs"
"""Where a wheel has the pages."""
BUILD = PACKAGE.parents[1] / "docs" / "build_site.py"
"""The script that builds the pages; only a checkout has it."""
TOOLS = ("sphinx", "furo", "myst_parser")
"""What the script needs: the extra ``docs``."""


def complete_pages(typed: str) -> list[str]:
    """Names of the pages that are there."""
    folder = INSTALLED if INSTALLED.is_dir() else BUILD.parent / "_build" / "html"
    return [name for name in pages(folder) if name.startswith(typed)]


def docs(
    page: Annotated[
        str,
        typer.Argument(
            help="A page, such as simulation or installation, or a block, such as Gain.",
            show_default="the first page",
            autocompletion=complete_pages,
        ),
    ] = "index",
    path: Annotated[
        bool, typer.Option("--path", help="Print where the page lies, and open no browser.")
    ] = False,
) -> None:
    """Open the documentation in the browser. It lies on this machine and loads nothing from elsewhere."""
    console = messages_console()
    folder = built_pages(lambda text: console.print(text, soft_wrap=True), INSTALLED, BUILD)
    found = pages(folder)
    if page not in found:
        raise UnknownNameError("page of the documentation", page, found)
    if path or not webbrowser.open(found[page].as_uri()):
        results_console().print(str(found[page]), soft_wrap=True)


def pages(folder: Path) -> dict[str, Path]:
    """Every page by name, blocks by theirs; a guide goes before a block of the same name."""
    files = [*sorted(folder.glob("reference/blocks/*.html")), *sorted(folder.glob("reference/*.html"))]
    return {path.stem: path for path in [*files, *sorted(folder.glob("*.html"))]}


def built_pages(notify: Callable[[str], None], installed_pages: Path, script: Path) -> Path:
    """The folder of the built pages. A checkout that has none builds them; ``notify`` gets a line before.

    Raises ``FormatError`` where there are none and none can be built.
    """
    if (installed_pages / "index.html").is_file():
        return installed_pages
    folder = script.parent / "_build" / "html"
    if (folder / "index.html").is_file():
        return folder
    if not script.is_file():
        raise FormatError(
            "this installation has no documentation: it was installed with ARMBLOCKS_SKIP_DOCS=1",
            where=str(installed_pages),
            allowed="everything but this command works",
            fix="install a wheel that has it, or read the folder docs of the sources",
        )
    if not all(installed(tool) for tool in TOOLS):
        raise FormatError(
            "this checkout has no built documentation, and Sphinx and its theme are not installed",
            where=str(folder),
            allowed="the sources of the pages can be read as they are, in the folder docs",
            fix=f'{sys.executable} -m pip install --editable "{script.parents[1]}[docs]"',
        )
    notify("This checkout has no built documentation yet: it is built now, once (about a minute).")
    done = subprocess.run([sys.executable, str(script)], stdin=subprocess.DEVNULL, stdout=sys.stderr.fileno())
    if done.returncode != 0:
        raise FormatError(
            "the documentation could not be built; the reason stands above",
            where=str(script),
            allowed="the sources of the pages can be read as they are, in the folder docs",
            fix=f"run 'python {script}' and mend what it names",
        )
    return folder

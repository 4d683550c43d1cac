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
INSTALLED_PAGES = PACKAGE / "shipped" / "docs"
"""The folder of the pages in a wheel."""
BUILD_SCRIPT = PACKAGE.parents[1] / "docs" / "build_site.py"
"""The script that builds the pages; only a checkout has it."""
TOOLS = ("sphinx", "furo", "myst_parser")
"""The libraries of the extra ``docs``, which the script needs."""


def complete_pages(typed: str) -> list[str]:
    """Names of the existing pages."""
    folder = INSTALLED_PAGES if INSTALLED_PAGES.is_dir() else BUILD_SCRIPT.parent / "_build" / "html"
    return [name for name in pages(folder) if name.startswith(typed)]


def docs(
    page: Annotated[
        str,
        typer.Argument(
            help="A page, such as simulation, a block, such as Gain, or a robot, such as panda.",
            show_default="the first page",
            autocompletion=complete_pages,
        ),
    ] = "index",
    path: Annotated[
        bool, typer.Option("--path", help="Print the path of the page without opening a browser.")
    ] = False,
) -> None:
    """Open the documentation in the browser, without network access."""
    console = messages_console()
    folder = built_pages(lambda text: console.print(text, soft_wrap=True), INSTALLED_PAGES, BUILD_SCRIPT)
    known_pages = pages(folder)
    if page not in known_pages:
        raise UnknownNameError("page of the documentation", page, known_pages)
    if path or not webbrowser.open(known_pages[page].as_uri()):
        results_console().print(str(known_pages[page]), soft_wrap=True)


def pages(folder: Path) -> dict[str, Path]:
    """All pages by name, including blocks and robots. For equal names, the guide takes precedence."""
    kinds = ("robots", "blocks")
    files = [path for kind in kinds for path in sorted(folder.glob(f"reference/{kind}/*.html"))]
    files += sorted(folder.glob("reference/*.html"))
    return {path.stem: path for path in [*files, *sorted(folder.glob("*.html"))]}


def built_pages(notify: Callable[[str], None], installed_pages: Path, script: Path) -> Path:
    """The folder of the built pages; in a checkout without pages, they are built first.

    ``notify`` is called with one line of text before the build. Raises ``FormatError`` if there are
    no pages and they cannot be built.
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
            allowed="everything except this command works",
            fix="install a wheel that has it, or read the folder docs of the sources",
        )
    if not all(installed(tool) for tool in TOOLS):
        raise FormatError(
            "this checkout has no built documentation, and Sphinx and its theme are not installed",
            where=str(folder),
            allowed="the sources of the pages are readable text, in the folder docs",
            fix=f'{sys.executable} -m pip install --editable "{script.parents[1]}[docs]"',
        )
    notify("Building the documentation of this checkout, once (about a minute).")
    completed = subprocess.run(
        [sys.executable, str(script)], stdin=subprocess.DEVNULL, stdout=sys.stderr.fileno()
    )
    if completed.returncode != 0:
        raise FormatError(
            "the documentation could not be built; the reason is printed above",
            where=str(script),
            allowed="the sources of the pages are readable text, in the folder docs",
            fix=f"run 'python {script}' and correct the reported error",
        )
    return folder

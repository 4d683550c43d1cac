"""The built front end of the studio: its folder, and its build in a checkout at first use.

Wheels contain the front end. A checkout does not; ``frontend/build_page.py`` builds it there.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from armblocks.errors import FormatError

PAGE_FOLDER = Path(__file__).parent / "web"
BUILD_SCRIPT = Path(__file__).parents[3] / "frontend" / "build_page.py"
"""The script that builds the front end; it exists only in a checkout."""


def built_page(folder: Path = PAGE_FOLDER, script: Path = BUILD_SCRIPT) -> Path:
    """Return the folder of the built front end; raise ``FormatError`` with the remedy if it is missing."""
    if not (folder / "index.html").is_file():
        raise FormatError(
            "this installation has no studio page: it was installed without Node.js",
            where=str(folder),
            allowed="everything except the studio and the notebook widgets",
            fix=f"run 'python {script}'" if script.is_file() else "install a wheel that has the front end",
        )
    return folder


def build_in_checkout(
    notify: Callable[[str], None], folder: Path = PAGE_FOLDER, script: Path = BUILD_SCRIPT
) -> None:
    """Build the front end if it is missing and its sources are present; call ``notify`` with one line first.

    The build writes its progress to standard error. Raises ``FormatError`` if the build fails.
    """
    if (folder / "index.html").is_file() or not script.is_file():
        return
    notify("Building the studio page of this checkout, once (about a minute).")
    completed = subprocess.run(
        [sys.executable, str(script)], stdin=subprocess.DEVNULL, stdout=sys.stderr.fileno()
    )
    if completed.returncode != 0:
        raise FormatError(
            "the front end of the studio could not be built; the reason is printed above",
            where=str(script),
            allowed="Node.js 20.19 or newer, or pip to fetch it; and a connection to the npm registry",
            fix="install Node.js, or install armblocks from a wheel, which has the front end",
        )

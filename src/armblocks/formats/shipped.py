"""Names and folders of the shipped robots, diagrams and libraries; no files are read."""

from __future__ import annotations

from pathlib import Path

from armblocks.errors import FormatError

SUFFIX = ".json"
"""Suffix of diagrams and libraries."""
ROBOT_FILE = "robot.json"
"""Name of the robot's file in the folder with the robot's name."""


def list_robots() -> tuple[str, ...]:
    """Names of the shipped robots, sorted."""
    folder = shipped_folder("robots")
    return tuple(sorted(entry.name for entry in folder.iterdir() if (entry / ROBOT_FILE).is_file()))


def list_examples() -> tuple[str, ...]:
    """Names of the shipped diagrams, sorted."""
    return tuple(sorted(path.stem for path in shipped_folder("examples").glob(f"*{SUFFIX}")))


def list_libraries() -> tuple[str, ...]:
    """Names of the shipped libraries, sorted."""
    return tuple(sorted(path.stem for path in shipped_folder("libraries").glob(f"*{SUFFIX}")))


def shipped_folder(kind: str) -> Path:
    """The folder of the shipped ``robots`` or ``examples``: in the installed package, or in a checkout.

    Raises ``FormatError`` if the installation is incomplete.
    """
    package = Path(__file__).resolve().parent.parent
    for folder in (package / "shipped" / kind, package.parent.parent / kind):
        if folder.is_dir():
            return folder
    raise FormatError(
        f"the shipped {kind} are missing", where=str(package), fix="install armblocks again, from a wheel"
    )

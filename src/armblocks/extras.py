"""Imports of optional libraries at first use. The error for a missing library names its extra.

The core of armblocks (robots, diagrams, runs, reports, command line) needs no optional library.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Generator
from contextlib import contextmanager

from armblocks.errors import MissingLibraryError

LIBRARIES = {
    "analysis": ("scipy",),
    "cluster": ("distributed",),
    "data": ("pandas", "pyarrow", "scipy"),
    "figures": ("matplotlib",),
    "film": ("PIL", "imageio_ffmpeg"),
    "notebook": ("anywidget", "traitlets"),
    "studio": ("pydantic", "starlette", "uvicorn", "websockets"),
    "symbolic": ("sympy",),
    "xacro": ("xacro",),
}
"""The libraries of each extra, by import name."""


@contextmanager
def from_extra(extra: str, use: str) -> Generator[None]:
    """Context in which libraries of ``extra`` are imported for ``use``, such as ``"Parquet files"``.

    Raises ``MissingLibraryError`` where a library is not installed. Other import errors pass unchanged.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        library = (error.name or "").partition(".")[0]
        if library not in LIBRARIES[extra]:
            raise
        raise MissingLibraryError(library, extra, use) from None


def require(extra: str, use: str) -> None:
    """Raise ``MissingLibraryError`` where a library of ``extra`` is not installed. Imports nothing."""
    for library in LIBRARIES[extra]:
        if not installed(library):
            raise MissingLibraryError(library, extra, use)


def installed(library: str) -> bool:
    """Whether a library is installed."""
    try:
        return importlib.util.find_spec(library) is not None
    except ModuleNotFoundError:
        return False

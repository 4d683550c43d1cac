"""Libraries that come with an extra of the package: imported where they are used, named where missing.

The core of armblocks (robots, diagrams, runs, reports, command line) works without any of them.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Generator
from contextlib import contextmanager

from armblocks.errors import MissingLibraryError

LIBRARIES = {
    "analysis": ("scipy",),
    "data": ("pandas", "pyarrow", "scipy"),
    "figures": ("matplotlib",),
    "notebook": ("anywidget", "traitlets"),
    "studio": ("pydantic", "starlette", "uvicorn", "websockets"),
}
"""What each extra brings, by the names under which the libraries are imported."""


@contextmanager
def from_extra(extra: str, use: str) -> Generator[None]:
    """Within the block, libraries of ``extra`` are imported for ``use``, words such as ``"Parquet files"``.

    Raises ``MissingLibraryError`` where one is not installed. Other failures of an import pass unchanged.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        library = (error.name or "").partition(".")[0]
        if library not in LIBRARIES[extra]:
            raise
        raise MissingLibraryError(library, extra, use) from None


def require(extra: str, use: str) -> None:
    """Raise ``MissingLibraryError`` where a library of ``extra`` is not installed; nothing is imported."""
    for library in LIBRARIES[extra]:
        if not installed(library):
            raise MissingLibraryError(library, extra, use)


def installed(library: str) -> bool:
    """Whether a library is there to be imported."""
    try:
        return importlib.util.find_spec(library) is not None
    except ModuleNotFoundError:
        return False

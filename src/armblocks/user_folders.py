"""The cache folder and the data folder of the current user."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

NAME = "armblocks"


def cache_folder() -> Path | None:
    """The folder for files that can be recomputed; ``None`` where the user has no home folder."""
    from platformdirs import user_cache_path  # imported here: takes 10 ms

    return _absolute(lambda: user_cache_path(NAME, appauthor=False))


def state_folder() -> Path | None:
    """The folder for files that must survive a restart; ``None`` where the user has no home folder."""
    from platformdirs import user_state_path

    return _absolute(lambda: user_state_path(NAME, appauthor=False))


def _absolute(find: Callable[[], Path]) -> Path | None:
    """The folder that ``find`` returns; ``None`` where the user has no home folder.

    Without a home folder some versions of platformdirs raise an error, others return a path with ``~``.
    """
    try:
        folder = find()
    except RuntimeError:
        return None
    return folder if folder.is_absolute() else None

"""The folders that a system has for the files that programs keep for their user."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

NAME = "armblocks"


def cache_folder() -> Path | None:
    """The folder for what can be computed again; ``None`` where the user has no home folder."""
    from platformdirs import user_cache_path  # takes 10 ms, which a start without a cache saves

    return _absolute(lambda: user_cache_path(NAME, appauthor=False))


def state_folder() -> Path | None:
    """The folder for what is to survive a restart; ``None`` where the user has no home folder."""
    from platformdirs import user_state_path

    return _absolute(lambda: user_state_path(NAME, appauthor=False))


def _absolute(find: Callable[[], Path]) -> Path | None:
    """Without a home folder some versions of platformdirs raise, others answer with a path from ``~``."""
    try:
        folder = find()
    except RuntimeError:
        return None
    return folder if folder.is_absolute() else None

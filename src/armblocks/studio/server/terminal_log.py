"""The terminal log of the studio's server: locations of errors, without secrets.

A terminal is copied into reports and its log kept by others, so no key stands in it but the login link that
``armblocks studio`` prints itself, and no content of files: of an error its place and its type are said, and
not its words, which may quote what was read.
"""

from __future__ import annotations

import logging
import traceback
from collections.abc import Callable
from types import TracebackType
from typing import Any

Raised = tuple[type[BaseException], BaseException, TracebackType | None] | tuple[None, None, None]


class DiscreetFormatter(logging.Formatter):
    """Formats what is logged without secrets and without the words of exceptions."""

    def __init__(self, secrets: Callable[[], tuple[str, ...]]) -> None:
        super().__init__("%(levelname)s: %(message)s")
        self._secrets = secrets

    def formatException(self, ei: Raised) -> str:
        """Where it was raised, in each of the calls, and what kind of exception it is."""
        kind, _, place = ei
        frames = "".join(traceback.format_tb(place))
        return f"{frames}{kind.__name__ if kind is not None else ''}".rstrip()

    def format(self, record: logging.LogRecord) -> str:
        """The whole text, secrets left out."""
        record.exc_text = None  # what another formatter may have made of it
        text = super().format(record)
        for secret in self._secrets():
            text = text.replace(secret, "…")
        return text


def log_settings(secrets: Callable[[], tuple[str, ...]]) -> dict[str, Any]:
    """Settings of ``logging.config`` for the server's process; ``secrets`` gives what must not be said."""
    return {
        "version": 1,
        "disable_existing_loggers": False,
        "formatters": {"discreet": {"()": DiscreetFormatter, "secrets": secrets}},
        "handlers": {"terminal": {"class": "logging.StreamHandler", "formatter": "discreet"}},
        "root": {"handlers": ["terminal"], "level": "WARNING"},
    }

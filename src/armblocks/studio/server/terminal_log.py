"""The terminal log of the studio's server: locations of errors, without secrets.

Users copy terminal output into bug reports, so it contains no secrets except the login link that ``armblocks
studio`` prints, and no file contents. For an exception, only its type and traceback are logged, because its
message may quote file contents.
"""

from __future__ import annotations

import logging
import traceback
from collections.abc import Callable
from types import TracebackType
from typing import Any

ExceptionInfo = tuple[type[BaseException], BaseException, TracebackType | None] | tuple[None, None, None]


class RedactingFormatter(logging.Formatter):
    """Formats log records without secrets and without exception messages."""

    def __init__(self, secrets: Callable[[], tuple[str, ...]]) -> None:
        super().__init__("%(levelname)s: %(message)s")
        self._secrets = secrets

    def formatException(self, ei: ExceptionInfo) -> str:
        """Return the traceback and the type of the exception, without its message."""
        kind, _, trace = ei
        frames = "".join(traceback.format_tb(trace))
        return f"{frames}{kind.__name__ if kind is not None else ''}".rstrip()

    def format(self, record: logging.LogRecord) -> str:
        """Return the formatted record with secrets replaced by an ellipsis."""
        record.exc_text = None  # discards a text cached by another formatter
        text = super().format(record)
        for secret in self._secrets():
            text = text.replace(secret, "…")
        return text


def log_settings(secrets: Callable[[], tuple[str, ...]]) -> dict[str, Any]:
    """Settings of ``logging.config`` for the server process; ``secrets`` returns the texts to be removed."""
    return {
        "version": 1,
        "disable_existing_loggers": False,
        "formatters": {"redacting": {"()": RedactingFormatter, "secrets": secrets}},
        "handlers": {"terminal": {"class": "logging.StreamHandler", "formatter": "redacting"}},
        "root": {"handlers": ["terminal"], "level": "WARNING"},
    }

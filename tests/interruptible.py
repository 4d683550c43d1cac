"""Processes that end on Ctrl-C, however the tests themselves were started."""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any


def start_interruptible(command: Sequence[str], **options: Any) -> subprocess.Popen[str]:
    """Start a process with text pipes in which SIGINT has its default action.

    A program inherits an ignored SIGINT, and keeps it: ``nohup pytest &`` in a script starts the tests so
    (POSIX.1-2017, Shell Command Language, 2.11), and the processes that they start would not end on Ctrl-C.
    """
    before = signal.getsignal(signal.SIGINT)
    if before is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return subprocess.Popen(command, text=True, **options)
    finally:
        if before is signal.SIG_IGN:
            signal.signal(signal.SIGINT, before)


@contextmanager
def killed_at_the_end(process: subprocess.Popen[str]) -> Iterator[subprocess.Popen[str]]:
    """Leave no process and no open pipe behind, also where a test fails: they would fail a later one."""
    with process:
        try:
            yield process
        finally:
            if process.poll() is None:
                process.kill()

"""Processes that end on Ctrl-C, independent of how the tests were started."""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any


def start_interruptible(command: Sequence[str], **options: Any) -> subprocess.Popen[str]:
    """Start a process with text pipes in which SIGINT has its default action.

    A child process inherits an ignored SIGINT. A shell script that runs ``nohup pytest &`` starts the tests
    with SIGINT ignored (POSIX.1-2017, Shell Command Language, 2.11). Child processes of the tests would not
    end on Ctrl-C.
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
    """End the process and close its pipes, also after a failed test: otherwise a later test could fail."""
    with process:
        try:
            yield process
        finally:
            if process.poll() is None:
                process.kill()

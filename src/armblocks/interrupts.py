"""Interrupts (Ctrl-C) that libraries discard.

CasADi looks for signals during its computations. The ``KeyboardInterrupt`` that Python raises there may be
discarded, or another error may replace it. Within :func:`kept`, interrupts are noted as well: :func:`check`
raises an interrupt that was discarded, and so does the end of the block.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Generator
from contextlib import contextmanager
from types import FrameType

_noted: list[int] = []
"""The signals of interrupts that have not been answered."""


@contextmanager
def kept() -> Generator[None]:
    """A block that does not end without a ``KeyboardInterrupt`` if one was raised inside, and not answered.

    Only in the main thread, where Python raises interrupts, and only with Python's own handler of SIGINT.
    """
    in_main_thread = threading.current_thread() is threading.main_thread()
    if not in_main_thread or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    _noted.clear()
    signal.signal(signal.SIGINT, _note)
    try:
        yield
    except KeyboardInterrupt:
        raise
    except Exception as error:
        if _noted:
            raise KeyboardInterrupt from error
        raise
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    check()


def check() -> None:
    """Raise ``KeyboardInterrupt`` in the main thread if an interrupt was discarded."""
    if _noted and threading.current_thread() is threading.main_thread():
        _noted.clear()
        raise KeyboardInterrupt


def answered() -> None:
    """The caller has caught an interrupt and acts on it."""
    _noted.clear()


def _note(number: int, frame: FrameType | None) -> None:
    _noted.append(number)
    signal.default_int_handler(number, frame)

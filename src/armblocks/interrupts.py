"""Interrupts (Ctrl-C) that libraries discard.

CasADi looks for signals during its computations. The ``KeyboardInterrupt`` that Python raises there may be
discarded, or another error may replace it. The context :func:`kept` records interrupts: :func:`check` and the
end of the context raise an interrupt that was discarded.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Generator
from contextlib import contextmanager
from types import FrameType

_noted: list[int] = []
"""The interrupts that have not been handled."""


@contextmanager
def kept() -> Generator[None]:
    """Context that raises ``KeyboardInterrupt`` at its end if an interrupt inside was discarded.

    The context has an effect only in the main thread, where Python raises interrupts, and only with Python's
    own handler of SIGINT.
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
    """Mark the recorded interrupt as handled by the caller."""
    _noted.clear()


def _note(number: int, frame: FrameType | None) -> None:
    _noted.append(number)
    signal.default_int_handler(number, frame)

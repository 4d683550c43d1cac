"""Corrections of files: descriptions of the changes, and angles that are certainly in degrees."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from armblocks.formats.file_findings import FileFinding

_LEAST_DEGREES, _MOST_DEGREES = 30.0, 720.0


class Change(NamedTuple):
    """A correction: the ``finding`` that it removes, and ``what`` was changed."""

    finding: FileFinding
    what: str


class Correction(NamedTuple):
    """The ``data`` of a corrected file, and its ``changes``."""

    data: bytes
    changes: tuple[Change, ...] = ()


def are_degrees(values: Sequence[float]) -> bool:
    """Whether angles that should be in rad are certainly in degrees.

    All are multiples of half a degree up to two turns, and the largest has at least 30 degrees: as rad it
    would be almost five turns, given as an exact multiple of 0.5.
    """
    largest = max(map(abs, values), default=0.0)
    whole = all(math.fmod(2.0 * value, 1.0) == 0.0 for value in values)
    return whole and _LEAST_DEGREES <= largest <= _MOST_DEGREES


def number_text(value: float) -> str:
    """The shortest text that reads back to the number."""
    return repr(float(value) + 0.0)


def numbers_text(values: Sequence[float]) -> str:
    """Numbers, separated by spaces."""
    return " ".join(map(number_text, values))

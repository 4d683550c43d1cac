"""Rows of a CSV file in plain Python, for installations without pyarrow. The text is the same as pyarrow's.

pyarrow writes the shortest digits that read back to the same double. Magnitudes from 1e-6 to 1e10 have the
form ``0.000012``, all others the form ``1.2e-7`` or ``1.2e+10``.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

FIXED_FROM, FIXED_TO = 1e-6, 1e10
"""Magnitudes between which a number is written without an exponent."""
_REPR_FIXED_FROM = 1e-4
"""Magnitude below which ``repr`` writes an exponent."""


def csv_rows(columns: Sequence[NDArray[np.float64]]) -> str:
    """The rows of a table of columns, each (N,), ended by line feeds. A table without rows is ``""``."""
    rows = zip(*(column.tolist() for column in columns), strict=True)
    return "".join(f"{','.join(map(number_text, row))}\n" for row in rows)


def number_text(number: float) -> str:
    """A double as pyarrow writes it into a CSV file."""
    text = repr(number)
    size = abs(number)
    if _REPR_FIXED_FROM <= size < FIXED_TO or size == 0.0 or text in ("nan", "inf", "-inf"):
        return text.removesuffix(".0")
    digits, exponent = _digits(text.lstrip("-"))
    sign = "-" if number < 0.0 else ""
    if FIXED_FROM <= size < FIXED_TO:
        return f"{sign}0.{'0' * (-exponent - 1)}{digits}"
    fraction = f".{digits[1:]}" if len(digits) > 1 else ""
    return f"{sign}{digits[0]}{fraction}e{exponent:+d}"


def _digits(text: str) -> tuple[str, int]:
    """The significant digits of a positive number, and the power of ten of the first digit."""
    mantissa, _, power = text.partition("e")
    whole, _, fraction = mantissa.partition(".")
    digits = whole + fraction
    leading = len(digits) - len(digits.lstrip("0"))
    return digits.strip("0"), len(whole) - 1 - leading + int(power or 0)

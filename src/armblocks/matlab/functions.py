"""The table of all functions and constants of formulas and scripts.

A function is one entry in ``number_functions`` or ``array_functions``. Its implementation uses
:class:`~.function_kinds.Arithmetic`, so that it serves numbers and symbols. Elementary functions of
constants are correctly rounded in both (:mod:`armblocks.rounded_functions`).
"""

from __future__ import annotations

from collections.abc import Mapping

from armblocks.matlab.array_functions import FUNCTIONS_OF_ARRAYS, RIGID_MOTIONS
from armblocks.matlab.function_kinds import Function
from armblocks.matlab.number_functions import CONSTANTS_BY_NAME, FUNCTIONS_OF_NUMBERS

TABLE: Mapping[str, Function] = {
    **CONSTANTS_BY_NAME,
    **FUNCTIONS_OF_NUMBERS,
    **FUNCTIONS_OF_ARRAYS,
    **RIGID_MOTIONS,
}
"""All functions and constants by name."""

RESERVED = frozenset(name for name, function in TABLE.items() if function.reserved)
"""Names that no parameter may have."""

"""The operators with their precedence: the table for the parser and for writing trees as text.

Source: MathWorks, *Operator Precedence*. All operators of a level are left-associative: ``2^3^2`` is
``(2^3)^2``, and ``a/b/c`` is ``(a/b)/c``. A sign binds less than a power, ``-2^2`` is ``-(2^2)``; a sign
after ``^`` belongs to the exponent, ``2^-1``. Comparisons do not chain: ``1 < u < 3`` is an error, because
MATLAB compares the result of ``1 < u`` with 3, which is rarely intended.

Python's spellings are alternatives of the same operators. The word ``not`` is the exception: it binds as in
Python, less than a comparison, so that ``not u > 3`` is ``~(u > 3)``, whereas ``~u > 3`` is ``(~u) > 3`` as
in MATLAB. Directly followed by a bracket, ``not(u) > 3``, it is MATLAB's function.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum


class Level(IntEnum):
    """Precedences from the loosest to the tightest."""

    OR_ELSE = 1
    AND_THEN = 2
    NOT_WORD = 3
    OR = 4
    AND = 5
    COMPARISON = 6
    RANGE = 7
    SUM = 8
    PRODUCT = 9
    SIGN = 10
    POWER = 11
    OPERAND = 12


INFIX: Mapping[str, Level] = {
    "||": Level.OR_ELSE,
    "&&": Level.AND_THEN,
    "|": Level.OR,
    "&": Level.AND,
    **dict.fromkeys(("==", "~=", "<", "<=", ">", ">="), Level.COMPARISON),
    ":": Level.RANGE,
    **dict.fromkeys(("+", "-"), Level.SUM),
    **dict.fromkeys(("*", "/", "\\", ".*", "./", ".\\"), Level.PRODUCT),
    **dict.fromkeys(("^", ".^"), Level.POWER),
}
"""Operators between two operands, in MATLAB's spelling."""

ALTERNATIVES: Mapping[str, str] = {"!=": "~=", "**": "^", "!": "~"}
"""Other spellings of operators, from Python and from Simulink's Fcn block."""
WORDS: Mapping[str, str] = {"and": "&&", "or": "||"}
"""Python's words for operators."""
SIGNS = ("+", "-", "~")
"""Operators before one operand."""
LOGIC = frozenset(("&&", "||", "&", "|"))
COMPARISONS = frozenset(("==", "~=", "<", "<=", ">", ">="))

"""The structured form of a function: data without behaviour, between the language and its back ends.

A function is a tree of statements: operations in their order, conditional parts, and regions that may be left
or repeated. :class:`~armblocks.routines.Routine` builds the tree; a back end such as
:mod:`armblocks.routines.llvm` writes it as text. A value that differs between two paths is stored in a
:class:`Local`, so the tree needs no phi nodes.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum


class Kind(Enum):
    """Type of a value. The operation that uses an ``ADDRESS`` determines the type of its target."""

    REAL = "real"
    """An IEEE double."""
    INTEGER = "integer"
    """A 64-bit signed integer; sums and products wrap around."""
    BOOLEAN = "boolean"
    ADDRESS = "address"
    INT32 = "int32"
    """A 32-bit signed integer: in memory, and between functions."""
    BYTE = "byte"
    """A byte, in memory only."""
    LANES = "lanes"
    """A double in each lane of the program."""
    MASK = "mask"
    """A condition in each lane."""
    INTEGER_LANES = "integer lanes"
    """A 64-bit integer in each lane."""


class Operation(Enum):
    """An operation without side effects. Real operations round once, to nearest, in every lane."""

    ADD = "add"
    SUBTRACT = "subtract"
    MULTIPLY = "multiply"
    DIVIDE = "divide"
    """Quotient of reals, or of integers, which is truncated toward zero."""
    DIVIDE_UNSIGNED = "divide unsigned"
    REMAINDER_UNSIGNED = "remainder unsigned"
    SHIFT_LEFT = "shift left"
    """Shift of an integer to the left, by 0 to 63 places."""
    SHIFT_RIGHT = "shift right"
    """Shift of an integer to the right, by 0 to 63 places, which keeps the sign."""
    NEGATE = "negate"
    ABSOLUTE = "absolute"
    SQUARE_ROOT = "square root"
    FMA = "fma"
    """``a b + c``, rounded once."""
    LESS = "less"
    LESS_EQUAL = "less or equal"
    EQUAL = "equal"
    NOT_EQUAL = "not equal"
    """Unlike every other comparison, true if an operand is NaN."""
    GREATER = "greater"
    GREATER_EQUAL = "greater or equal"
    ORDERED = "ordered"
    """Whether neither operand is NaN."""
    AND = "and"
    """Conjunction of conditions, or bitwise and of integers."""
    OR = "or"
    NOT = "not"
    ANY = "any"
    """Whether a mask holds in any lane."""
    LANE_BITS = "lane bits"
    """An integer whose bit k is the condition of lane k."""
    SPREAD = "spread"
    """A double in all lanes."""
    SELECT = "select"
    """The second operand where the first holds, else the third; a mask selects in each lane."""
    TO_REAL = "to real"
    """An integer as a double."""
    TO_INTEGER = "to integer"
    """A double truncated to an integer, a 32-bit integer as an integer, a Boolean as 0 or 1."""
    TO_INT32 = "to int32"
    """The lower half of an integer."""
    BITS = "bits"
    """The bits of a double as an integer."""
    FROM_BITS = "from bits"
    """The double with these bits."""


@dataclass(frozen=True, slots=True, eq=False)
class Temporary:
    """The result of one statement, or a parameter where it has a ``name``."""

    kind: Kind
    name: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Local:
    """A variable of a function, or an array of variables; as an operand it is the address."""

    kind: Kind
    count: int = 1


@dataclass(frozen=True, slots=True)
class Constant:
    """A number, the same in all lanes. The only constant address is ``None``, the null address."""

    kind: Kind
    value: float | int | bool | None


@dataclass(frozen=True, slots=True)
class Table:
    """Constants of the program under a symbol; as an operand it is the address.

    ``filled_in``: values that are written when the program is loaded, instead of constants.
    """

    symbol: str
    numbers: tuple[float, ...] | tuple[int, ...] | tuple[None, ...]
    element: Kind
    filled_in: bool = False


Operand = Temporary | Local | Constant | Table


@dataclass(frozen=True, slots=True)
class Compute:
    """``result = operation(operands)``."""

    result: Temporary
    operation: Operation
    operands: tuple[Operand, ...]


@dataclass(frozen=True, slots=True)
class Locate:
    """``result`` is the address ``index`` elements of a kind after ``base``."""

    result: Temporary
    base: Operand
    index: Operand
    element: Kind


@dataclass(frozen=True, slots=True)
class Load:
    """``result`` is the number at an address.

    ``acquiring``: a load with acquire ordering, of a value that other threads write.
    """

    result: Temporary
    address: Operand
    acquiring: bool = False


@dataclass(frozen=True, slots=True)
class Store:
    """Write a number to an address."""

    value: Operand
    address: Operand


@dataclass(frozen=True, slots=True)
class FetchAdd:
    """Atomic addition to an integer; ``result`` is the previous value.

    It has acquire-release ordering.
    """

    result: Temporary
    address: Operand
    value: Operand


@dataclass(frozen=True, slots=True)
class Copy:
    """Copy bytes between two addresses; the regions do not overlap."""

    source: Operand
    target: Operand
    size: Operand


@dataclass(frozen=True, slots=True)
class Call:
    """Call a function of the program, an external function, or a function at an address."""

    results: tuple[Temporary, ...]
    function: str | Operand
    arguments: tuple[Operand, ...]


@dataclass(frozen=True, slots=True)
class Return:
    """Leave the function."""

    values: tuple[Operand, ...]


@dataclass(slots=True, eq=False)
class Mark:
    """A target of a :class:`Jump`: the start or the end of a region, or a stage."""

    name: str
    open: bool = False
    """Whether statements at the present position may jump to it."""
    used: bool = False
    """Whether a statement jumps to it."""


@dataclass(frozen=True, slots=True)
class Jump:
    """Jump to a mark of an enclosing region."""

    mark: Mark


@dataclass(frozen=True, slots=True)
class When:
    """Run one of two parts, either of which may be empty. ``rarely``: a hint that the condition seldom
    holds."""

    condition: Operand
    yes: list[Statement]
    no: list[Statement]
    rarely: bool = False


@dataclass(frozen=True, slots=True)
class Region:
    """Statements with marks at their start and end. Execution continues after the region."""

    body: list[Statement]
    start: Mark
    end: Mark


@dataclass(frozen=True, slots=True)
class Stage:
    """A mark between the statements of a region: a target of jumps in the region; execution also falls
    through to it."""

    mark: Mark


Statement = Compute | Locate | Load | Store | FetchAdd | Copy | Call | Return | Jump | When | Region | Stage


@dataclass(frozen=True, slots=True)
class Function:
    """One function.

    ``public``: whether it is called from outside. ``inlined``: whether it is inlined into its callers;
    ``None`` leaves the decision to the back end. ``distinct``: whether its addresses never overlap.
    """

    symbol: str
    parameters: tuple[Temporary, ...]
    results: tuple[Kind, ...]
    body: list[Statement] = field(default_factory=list[Statement])
    public: bool = False
    inlined: bool | None = None
    distinct: bool = False

"""The structured form of a function: data without behaviour, between the language and its back ends.

A function is a tree of statements: operations in their order, conditional parts, and regions that may be left
or repeated. :class:`~armblocks.routines.Routine` builds the tree; a back end such as
:mod:`armblocks.routines.llvm` turns it into text. A value that differs between two paths lives in a
:class:`Local`, so nothing merges where paths meet.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum


class Kind(Enum):
    """Type of a value; what an ``ADDRESS`` points to is said by the operation that uses it."""

    REAL = "real"
    """An IEEE double."""
    INTEGER = "integer"
    """A 64-bit signed integer; sums and products wrap around."""
    BOOLEAN = "boolean"
    ADDRESS = "address"
    INT32 = "int32"
    """A 32-bit signed integer: in memory, and between functions."""
    BYTE = "byte"
    """In memory alone: addresses count by bytes."""
    LANES = "lanes"
    """A double in each lane: so many as the program has."""
    MASK = "mask"
    """A condition in each lane."""


class Operation(Enum):
    """An operation without side effects. Real operations round once, to nearest, in every lane alike."""

    ADD = "add"
    SUBTRACT = "subtract"
    MULTIPLY = "multiply"
    DIVIDE = "divide"
    """Reals; integers toward zero."""
    DIVIDE_UNSIGNED = "divide unsigned"
    REMAINDER_UNSIGNED = "remainder unsigned"
    SHIFT_LEFT = "shift left"
    """Of integers, by 0 to 63 places."""
    SHIFT_RIGHT = "shift right"
    """Likewise, with the sign."""
    NEGATE = "negate"
    ABSOLUTE = "absolute"
    SQUARE_ROOT = "square root"
    FMA = "fma"
    """``a b + c``, rounded once."""
    LESS = "less"
    LESS_EQUAL = "less or equal"
    EQUAL = "equal"
    NOT_EQUAL = "not equal"
    """Reals: true also where either is NaN, unlike every other comparison."""
    GREATER = "greater"
    GREATER_EQUAL = "greater or equal"
    ORDERED = "ordered"
    """Neither is NaN."""
    AND = "and"
    """Of conditions, or of the bits of integers."""
    OR = "or"
    NOT = "not"
    ANY = "any"
    """Whether a mask holds in any lane."""
    SPREAD = "spread"
    """A double in all lanes."""
    SELECT = "select"
    """The second operand where the first holds, else the third; a mask chooses in each lane."""
    TO_REAL = "to real"
    """An integer as a double."""
    TO_INTEGER = "to integer"
    """A double cut to an integer, a 32-bit integer, a Boolean as 0 or 1."""
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
    """A variable of a function, or so many one after the other; as an operand it is their address."""

    kind: Kind
    count: int = 1


@dataclass(frozen=True, slots=True)
class Constant:
    """A number, the same in all lanes; an address only as ``None``, the null address."""

    kind: Kind
    value: float | int | bool | None


@dataclass(frozen=True, slots=True)
class Table:
    """Constants of the program under a symbol; as an operand it is their address.

    ``filled_in``: not constants, but values that whoever loads the program writes there.
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

    ``acquiring``: other threads write it, and what they wrote before is seen from here on.
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
    """Add to an integer that other threads write too, in one step; ``result`` is what it was before.

    What stands before it in one thread is seen by the threads that come to it later.
    """

    result: Temporary
    address: Operand
    value: Operand


@dataclass(frozen=True, slots=True)
class Copy:
    """Copy so many bytes from one address to another; the two do not overlap."""

    source: Operand
    target: Operand
    size: Operand


@dataclass(frozen=True, slots=True)
class Call:
    """Call a function of the program, one that the program only names, or the one at an address."""

    results: tuple[Temporary, ...]
    function: str | Operand
    arguments: tuple[Operand, ...]


@dataclass(frozen=True, slots=True)
class Return:
    """Leave the function."""

    values: tuple[Operand, ...]


@dataclass(slots=True, eq=False)
class Mark:
    """A place of the tree that a :class:`Jump` can go to: the start or the end of a region, or a stage."""

    name: str
    open: bool = False
    """Whether statements that are written now may jump to it."""
    used: bool = False
    """Whether a statement jumps to it."""


@dataclass(frozen=True, slots=True)
class Jump:
    """Go on at a mark of a region around this statement."""

    mark: Mark


@dataclass(frozen=True, slots=True)
class When:
    """Run one of two parts, either of which may be empty. ``rarely``: the condition hardly ever holds."""

    condition: Operand
    yes: list[Statement]
    no: list[Statement]
    rarely: bool = False


@dataclass(frozen=True, slots=True)
class Region:
    """Statements whose start and end are marks. The end of the body goes on behind the region."""

    body: list[Statement]
    start: Mark
    end: Mark


@dataclass(frozen=True, slots=True)
class Stage:
    """A mark between the statements of a region: jumps of the same region go here, and so does what stands
    before it."""

    mark: Mark


Statement = Compute | Locate | Load | Store | FetchAdd | Copy | Call | Return | Jump | When | Region | Stage


@dataclass(frozen=True, slots=True)
class Function:
    """One function.

    ``public``: its address is asked for from outside. ``inlined``: whether it is written into its callers;
    ``None`` leaves that to the back end. ``distinct``: its addresses never point to the same numbers.
    """

    symbol: str
    parameters: tuple[Temporary, ...]
    results: tuple[Kind, ...]
    body: list[Statement] = field(default_factory=list[Statement])
    public: bool = False
    inlined: bool | None = None
    distinct: bool = False

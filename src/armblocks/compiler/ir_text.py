"""LLVM IR as text: a module that collects definitions, and the body of one function over one or more lanes.

A body is straight-line code; loops and branches are routines (:mod:`armblocks.routines`). Text is emitted
directly, because building IR objects takes many times as long as printing them. A :class:`Body` hides the
number of lanes: ``body.add(a, b)`` is ``fadd double`` or ``fadd <8 x double>``. No fast-math flags are set
and ``fma`` is emitted only on request, so results do not depend on the number of lanes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from armblocks.routines.llvm import number_text


class Module:
    """Definitions and declarations by symbol, each once."""

    def __init__(self) -> None:
        self._parts: dict[str, str] = {}

    def __contains__(self, symbol: str) -> bool:
        return symbol in self._parts

    def add(self, symbol: str, text: str) -> None:
        """Add the text that defines ``symbol``; a second text for the same symbol is ignored."""
        self._parts.setdefault(symbol, text)

    def define(self, symbol: str, write: Callable[[], str]) -> None:
        """Add the text from ``write``, unless the symbol exists; ``write`` may add other definitions."""
        if symbol not in self._parts:
            self._parts[symbol] = ""  # reserved first, so that recursive requests do not define it twice
            self._parts[symbol] = write()

    def declare(self, result: str, symbol: str, *arguments: str) -> None:
        """Declare an external function or an intrinsic."""
        self.add(symbol, f"declare {result} @{symbol}({', '.join(arguments)})")

    @property
    def text(self) -> str:
        """The whole module, as LLVM reads it."""
        return "\n\n".join(self._parts.values()) + "\n"


class Body:
    """Instructions of one function. Values are texts: names such as ``%v7`` or constants.

    ``real`` is the type of numbers, ``word`` of 64-bit integers, ``bit`` of conditions.
    """

    def __init__(self, module: Module, lanes: int = 1) -> None:
        self.module = module
        self.lanes = lanes
        self.real = self.type("double")
        self.word = self.type("i64")
        self.bit = self.type("i1")
        self.lines: list[str] = []
        self.unsupported: str | None = None
        """The condition of lanes that must be evaluated again with one lane; None if there are none."""
        self._count = 0

    def type(self, scalar: str) -> str:
        """The type of one ``scalar`` per lane."""
        return scalar if self.lanes == 1 else f"<{self.lanes} x {scalar}>"

    def do(self, instruction: str) -> None:
        """An instruction without a result."""
        self.lines.append(f"  {instruction}")

    def let(self, instruction: str) -> str:
        """An instruction with a result; returns its name."""
        self._count += 1
        name = f"%v{self._count}"
        self.lines.append(f"  {name} = {instruction}")
        return name

    def _splat(self, scalar: str, literal: str) -> str:
        return literal if self.lanes == 1 else f"splat ({scalar} {literal})"

    def number(self, value: float) -> str:
        """A constant number, the same in all lanes."""
        return self._splat("double", number_text(value))

    def integer(self, value: int) -> str:
        """A constant 64-bit integer, the same in all lanes."""
        return self._splat("i64", str(value if value < 1 << 63 else value - (1 << 64)))

    def broadcast(self, scalar: str) -> str:
        """One double in all lanes."""
        if self.lanes == 1:
            return scalar
        first = self.let(f"insertelement {self.real} poison, double {scalar}, i64 0")
        return self.let(
            f"shufflevector {self.real} {first}, {self.real} poison, <{self.lanes} x i32> zeroinitializer"
        )

    # Arithmetic operations, each rounded once.

    def add(self, a: str, b: str) -> str:
        """``a + b``."""
        return self.let(f"fadd {self.real} {a}, {b}")

    def subtract(self, a: str, b: str) -> str:
        """``a - b``."""
        return self.let(f"fsub {self.real} {a}, {b}")

    def multiply(self, a: str, b: str) -> str:
        """``a b``."""
        return self.let(f"fmul {self.real} {a}, {b}")

    def divide(self, a: str, b: str) -> str:
        """``a / b``."""
        return self.let(f"fdiv {self.real} {a}, {b}")

    def negate(self, a: str) -> str:
        """``-a``."""
        return self.let(f"fneg {self.real} {a}")

    def fma(self, a: str, b: str, c: str) -> str:
        """``a b + c``, rounded once."""
        result = self.intrinsic("fma", a, b, c)
        # For -(a b + c) LLVM selects ARM64's FNMADD, which computes (-a) b + (-c). If the sum is exactly zero
        # that gives +0 instead of -0. LLVM may also create a negation from a select or a product with -1, so
        # the barrier is here. Vectors have no such instruction.
        return self.intrinsic("arithmetic.fence", result) if self.lanes == 1 else result

    def intrinsic(self, name: str, *operands: str) -> str:
        """``llvm.<name>`` of doubles."""
        suffix = "f64" if self.lanes == 1 else f"v{self.lanes}f64"
        symbol = f"llvm.{name}.{suffix}"
        self.module.declare(self.real, symbol, *[self.real] * len(operands))
        return self.let(f"call {self.real} @{symbol}({', '.join(f'{self.real} {x}' for x in operands)})")

    def limited_index(self, a: str, size: int) -> str:
        """``a`` truncated to a 64-bit integer and limited to 0 … size - 1 (0 for NaN)."""
        kind = "i64" if self.lanes == 1 else f"v{self.lanes}i64"
        real = "f64" if self.lanes == 1 else f"v{self.lanes}f64"
        to_word = f"llvm.fptosi.sat.{kind}.{real}"
        self.module.declare(self.word, to_word, self.real)
        index = self.let(f"call {self.word} @{to_word}({self.real} {a})")
        for name, bound in (("smax", 0), ("smin", size - 1)):
            symbol = f"llvm.{name}.{kind}"
            self.module.declare(self.word, symbol, self.word, self.word)
            index = self.let(
                f"call {self.word} @{symbol}({self.word} {index}, {self.word} {self.integer(bound)})"
            )
        return index

    def gather(self, addresses: Callable[[str, int], str], indices: str) -> str:
        """One double for each lane, from the address that ``addresses`` emits for its integer and lane."""
        if self.lanes == 1:
            return self.let(f"load double, ptr {addresses(indices, 0)}, align 8")
        vector = "poison"
        for lane in range(self.lanes):
            index = self.let(f"extractelement {self.word} {indices}, i64 {lane}")
            value = self.let(f"load double, ptr {addresses(index, lane)}, align 8")
            vector = self.let(f"insertelement {self.real} {vector}, double {value}, i64 {lane}")
        return vector

    def absolute(self, a: str) -> str:
        """``|a|``."""
        return self.intrinsic("fabs", a)

    def polynomial(self, x: str, coefficients: Sequence[float]) -> str:
        """The polynomial by Horner's rule; coefficients begin with the constant term."""
        result = self.number(coefficients[-1])
        for coefficient in reversed(coefficients[:-1]):
            result = self.fma(result, x, self.number(coefficient))
        return result

    # Conditions.

    def compare(self, predicate: str, a: str, b: str) -> str:
        """A condition by LLVM's predicate: ``olt``, ``ole``, ``oeq``, ``une``, ``uno`` …"""
        return self.let(f"fcmp {predicate} {self.real} {a}, {b}")

    def select(self, condition: str, yes: str, no: str) -> str:
        """``yes`` where the condition holds, else ``no``."""
        return self.let(f"select {self.bit} {condition}, {self.real} {yes}, {self.real} {no}")

    def both(self, a: str, b: str) -> str:
        """Conjunction of conditions."""
        return self.let(f"and {self.bit} {a}, {b}")

    def either(self, a: str, b: str) -> str:
        """Disjunction of conditions."""
        return self.let(f"or {self.bit} {a}, {b}")

    def mark_unsupported(self, condition: str) -> None:
        """Mark lanes in which this body's results are invalid and must be computed again with one lane."""
        self.unsupported = condition if self.unsupported is None else self.either(self.unsupported, condition)

    # Sums and products without error, as unevaluated pairs.

    def two_sum(self, a: str, b: str) -> tuple[str, str]:
        """``a + b`` and its rounding error."""
        total = self.add(a, b)
        part = self.subtract(total, a)
        rest = self.subtract(a, self.subtract(total, part))
        return total, self.add(rest, self.subtract(b, part))

    def fast_two_sum(self, a: str, b: str) -> tuple[str, str]:
        """``a + b`` and its rounding error; requires ``|a| >= |b|`` or ``a = 0``."""
        total = self.add(a, b)
        return total, self.add(self.subtract(a, total), b)

    def two_product(self, a: str, b: str) -> tuple[str, str]:
        """``a b`` and its rounding error."""
        product = self.multiply(a, b)
        return product, self.fma(a, b, self.negate(product))

    # Bits.

    def bits(self, a: str) -> str:
        """The bits of a number as an integer."""
        return self.let(f"bitcast {self.real} {a} to {self.word}")

    def from_bits(self, a: str) -> str:
        """The number that has these bits."""
        return self.let(f"bitcast {self.word} {a} to {self.real}")

    def word_op(self, operation: str, a: str, b: str) -> str:
        """An integer operation: ``and``, ``xor``, ``add``, ``shl``, ``lshr`` …"""
        return self.let(f"{operation} {self.word} {a}, {b}")

    def word_test(self, predicate: str, a: str, b: str) -> str:
        """An integer comparison: ``eq``, ``ne``, ``slt`` …"""
        return self.let(f"icmp {predicate} {self.word} {a}, {b}")

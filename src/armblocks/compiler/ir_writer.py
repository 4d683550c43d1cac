"""Writes the text of one LLVM function: values, memory, branches and loops over double precision numbers.

Mutable variables are stack slots, which LLVM turns into registers. Nothing is reassociated or contracted: a
fused multiply-add stands where it is written, so the same text gives the same bits on every machine.
"""

from __future__ import annotations

import struct
from collections.abc import Callable

UNROLL = 8
"""Loops of at most this many turns are written out, which lets LLVM keep small systems in registers."""

INTRINSICS = """declare double @llvm.fma.f64(double, double, double)
declare double @llvm.sqrt.f64(double)
declare double @llvm.fabs.f64(double)
"""


def literal(number: float) -> str:
    """A double as LLVM reads it, bit for bit."""
    return f"0x{struct.unpack('<Q', struct.pack('<d', number))[0]:016X}"


class IrWriter:
    """Collects the instructions of one function; every method appends and returns the name of its value."""

    def __init__(self) -> None:
        self._slots: list[str] = []
        self._lines: list[str] = []
        self._count = 0

    def text(self, header: str) -> str:
        """The whole function; ``header`` is its ``define`` line without the brace."""
        return "\n".join([f"{header} {{", "entry:", *self._slots, *self._lines, "}", ""])

    # -- values ------------------------------------------------------------------------------------------

    def _fresh(self) -> int:
        self._count += 1
        return self._count

    def value(self, instruction: str) -> str:
        """Any instruction that gives a value."""
        name = f"%v{self._fresh()}"
        self._lines.append(f"  {name} = {instruction}")
        return name

    def line(self, instruction: str) -> None:
        """Any instruction that gives none."""
        self._lines.append(f"  {instruction}")

    def add(self, a: str, b: str) -> str:
        return self.value(f"fadd double {a}, {b}")

    def subtract(self, a: str, b: str) -> str:
        return self.value(f"fsub double {a}, {b}")

    def multiply(self, a: str, b: str) -> str:
        return self.value(f"fmul double {a}, {b}")

    def divide(self, a: str, b: str) -> str:
        return self.value(f"fdiv double {a}, {b}")

    def fma(self, a: str, b: str, c: str) -> str:
        """``a b + c``, rounded once."""
        return self.value(f"call double @llvm.fma.f64(double {a}, double {b}, double {c})")

    def sqrt(self, a: str) -> str:
        return self.value(f"call double @llvm.sqrt.f64(double {a})")

    def absolute(self, a: str) -> str:
        return self.value(f"call double @llvm.fabs.f64(double {a})")

    def compare(self, relation: str, a: str, b: str) -> str:
        """``relation`` as in LLVM: ``olt``, ``oge``, …; ordered ones are false for NaN."""
        return self.value(f"fcmp {relation} double {a}, {b}")

    def compare_integers(self, relation: str, a: str, b: str) -> str:
        return self.value(f"icmp {relation} i64 {a}, {b}")

    def either(self, condition: str, yes: str, no: str) -> str:
        """``yes`` where the condition holds, else ``no``: both are evaluated."""
        return self.value(f"select i1 {condition}, double {yes}, double {no}")

    def minimum(self, a: str, b: str) -> str:
        """The smaller one; ``b`` where either is NaN."""
        return self.either(self.compare("olt", a, b), a, b)

    def maximum(self, a: str, b: str) -> str:
        """The larger one; ``b`` where either is NaN."""
        return self.either(self.compare("ogt", a, b), a, b)

    # -- memory ------------------------------------------------------------------------------------------

    def slot(self, kind: str, initial: str) -> str:
        """A mutable variable of kind ``double`` or ``i64``."""
        name = f"%s{self._fresh()}"
        self._slots.append(f"  {name} = alloca {kind}")
        self.line(f"store {kind} {initial}, ptr {name}")
        return name

    def get(self, pointer: str, kind: str = "double") -> str:
        return self.value(f"load {kind}, ptr {pointer}")

    def put(self, value: str, pointer: str, kind: str = "double") -> None:
        self.line(f"store {kind} {value}, ptr {pointer}")

    def at(self, base: str, index: str | int, kind: str = "double") -> str:
        """The address of element ``index`` after ``base``."""
        return self.value(f"getelementptr inbounds {kind}, ptr {base}, i64 {index}")

    def sum_integers(self, a: str, b: str | int) -> str:
        return self.value(f"add nsw i64 {a}, {b}")

    def increase(self, slot: str, by: int = 1) -> None:
        self.put(self.sum_integers(self.get(slot, "i64"), by), slot, "i64")

    # -- control -----------------------------------------------------------------------------------------

    def label(self, stem: str) -> str:
        """A new name for a block, to jump to before or after it is placed."""
        return f"{stem}{self._fresh()}"

    def place(self, label: str) -> None:
        """Start the block ``label`` here; the block before falls through to it."""
        if not self._lines or not self._lines[-1].startswith(("  br ", "  ret ")):
            self.jump(label)
        self._lines.append(f"{label}:")

    def jump(self, label: str) -> None:
        self.line(f"br label %{label}")

    def branch(self, condition: str, yes: str, no: str) -> None:
        self.line(f"br i1 {condition}, label %{yes}, label %{no}")

    def for_each(self, count: int, body: Callable[[str], None]) -> None:
        """``body(index)`` for ``index = 0 … count-1``."""
        if count <= UNROLL:
            for index in range(count):
                body(str(index))
            return
        turn, done = self.label("turn"), self.label("done")
        index_slot = self.slot("i64", "0")
        self.place(turn)
        index = self.get(index_slot, "i64")
        body(index)
        following = self.sum_integers(index, 1)
        self.put(following, index_slot, "i64")
        self.branch(self.compare_integers("slt", following, str(count)), turn, done)
        self.place(done)

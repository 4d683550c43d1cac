"""Functions with variables, memory and control flow as LLVM IR, over single numbers."""

from __future__ import annotations

from collections.abc import Callable

from armblocks.compiler.ir_text import Body, Module

UNROLL = 8
"""Loops of at most this many turns are written out, which lets LLVM keep small systems in registers."""


class Routine(Body):
    """A :class:`Body` of one lane with variables, blocks and loops.

    A variable is a stack slot, which LLVM turns into a register; its name is its address.
    """

    def __init__(self, module: Module) -> None:
        super().__init__(module)
        self._variables: list[str] = []

    def text(self, head: str) -> str:
        """The whole function; ``head`` is its ``define`` line without the brace."""
        return "\n".join([f"{head} {{", "entry:", *self._variables, *self.lines, "}"])

    # Numbers.

    def square_root(self, a: str) -> str:
        """The square root, exactly rounded."""
        return self.intrinsic("sqrt", a)

    def minimum(self, a: str, b: str) -> str:
        """The smaller one; ``b`` where either is NaN."""
        return self.select(self.compare("olt", a, b), a, b)

    def maximum(self, a: str, b: str) -> str:
        """The larger one; ``b`` where either is NaN."""
        return self.select(self.compare("ogt", a, b), a, b)

    def inverse_root(self, a: str, k: int) -> str:
        """``a^(-1/k)`` for ``a`` in 1e-300 … 1e300, to the last place or so.

        A first guess from the divided bits, its excess centred by 0.064, then twice ``y (1 - r)^(-1/k)`` with
        ``r = 1 - a y^k`` (below 0.25, then 1e-3), as its Taylor polynomial of degree 4. All operations are
        exactly rounded: no library's ``pow`` decides a step.
        """
        one = 1023 << 52
        offset = one + one // k - int(0.064 * (1 << 52))
        y = self.from_bits(self.word_op("sub", str(offset), self.word_op("udiv", self.bits(a), str(k))))
        coefficients = [1.0]
        for m in range(4):
            coefficients.append(coefficients[-1] * (1 / k + m) / (m + 1))
        for _ in range(2):
            power = y
            for _ in range(k - 1):
                power = self.multiply(power, y)
            r = self.subtract(self.number(1.0), self.multiply(a, power))
            y = self.multiply(y, self.polynomial(r, coefficients))
        return y

    # Memory.

    def variable(self, kind: str, initial: str) -> str:
        """A variable of type ``kind``; it gets its initial value here, at every passage."""
        name = f"%{self.fresh('variable')}"
        self._variables.append(f"  {name} = alloca {kind}")
        self.put(initial, name, kind)
        return name

    def get(self, address: str, kind: str = "double") -> str:
        """The value at an address."""
        return self.let(f"load {kind}, ptr {address}")

    def put(self, value: str, address: str, kind: str = "double") -> None:
        """Store a value."""
        self.do(f"store {kind} {value}, ptr {address}")

    def at(self, base: str, index: str | int, kind: str = "double") -> str:
        """The address of element ``index`` after ``base``."""
        return self.let(f"getelementptr inbounds {kind}, ptr {base}, i64 {index}")

    def increase(self, variable: str) -> None:
        """Add one to an integer variable."""
        self.put(self.word_op("add", self.get(variable, "i64"), "1"), variable, "i64")

    # Control.

    def place(self, label: str) -> None:
        """Begin the block ``label``; a block that has not ended yet goes on into it."""
        if not self.lines or not self.lines[-1].startswith(("  br ", "  ret ")):
            self.jump(label)
        self.label(label)

    def jump(self, label: str) -> None:
        """Go on at ``label``."""
        self.do(f"br label %{label}")

    def branch(self, condition: str, yes: str, no: str) -> None:
        """Go on at one of two labels."""
        self.do(f"br i1 {condition}, label %{yes}, label %{no}")

    def for_each(self, count: int, write: Callable[[str], None]) -> None:
        """What ``write(index)`` writes, for ``index = 0 … count-1``."""
        if count <= UNROLL:
            for index in range(count):
                write(str(index))
            return
        turn, done = self.fresh("turn"), self.fresh("done")
        variable = self.variable("i64", "0")
        self.place(turn)
        index = self.get(variable, "i64")
        write(index)
        following = self.word_op("add", index, "1")
        self.put(following, variable, "i64")
        self.branch(self.word_test("slt", following, str(count)), turn, done)
        self.place(done)

    def count(self, start: str, stop: str, write: Callable[[str], None]) -> None:
        """What ``write(index)`` writes, for ``index = start … stop - 1``, as a loop."""
        head, turn, done = self.fresh("head"), self.fresh("turn"), self.fresh("done")
        variable = self.variable("i64", start)
        self.place(head)
        index = self.get(variable, "i64")
        self.branch(self.word_test("slt", index, stop), turn, done)
        self.place(turn)
        write(index)
        self.put(self.word_op("add", index, "1"), variable, "i64")
        self.jump(head)
        self.place(done)

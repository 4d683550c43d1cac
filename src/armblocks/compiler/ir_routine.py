"""Functions with variables, memory and control flow as LLVM IR, over single numbers."""

from __future__ import annotations

from collections.abc import Callable

from armblocks.compiler.ir_text import Body, Module


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

    # Control.

    def label(self, name: str) -> None:
        """Begin a basic block."""
        self.lines.append(f"{name}:")

    def fresh(self, stem: str) -> str:
        """A name for a label that no other has."""
        self._count += 1
        return f"{stem}{self._count}"

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

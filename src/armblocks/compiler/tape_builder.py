"""Builds tapes: folds constants, shares common subexpressions, fuses multiply-adds, removes dead code.

Only rewritings with identical results for every input (except the sign of a NaN) are applied, with one
exception: ``a b + c`` becomes a fused multiply-add if the product has no other use and the traced function
does not require it to be rounded. This rule is the same on all machines.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Sequence

import numpy as np

from armblocks.compiler.opcodes import COMMUTATIVE, ELEMENTARY, VECTORS, Opcode
from armblocks.compiler.tape import Operation, Tape

_Node = tuple[Opcode, tuple[int, ...]]
_NOT_FOLDED = ELEMENTARY | VECTORS


class TapeBuilder:
    """Collects scalar operations and builds a checked :class:`Tape` without dead code.

    Values are named by handles (integers) that the methods return. Handles are not registers.
    """

    def __init__(self, input_sizes: Sequence[int]) -> None:
        self._input_sizes = tuple(input_sizes)
        self._starts = [0, *np.cumsum(self._input_sizes).tolist()]
        # None for an input, float for a constant, else the operation.
        self._nodes: list[_Node | float | None] = [None] * self._starts[-1]
        self._handles: dict[_Node | bytes, int] = {}
        self._rules: dict[Opcode, Callable[..., int | None]] = {
            Opcode.ADD: self._simplify_add,
            Opcode.SUBTRACT: self._simplify_subtract,
            Opcode.MULTIPLY: self._simplify_multiply,
            Opcode.DIVIDE: self._simplify_divide,
            Opcode.NEGATE: self._simplify_negate,
            Opcode.SELECT: self._simplify_select,
            Opcode.ABSOLUTE: self._simplify_absolute,
        }

    def input(self, slot: int, index: int) -> int:
        """The scalar at ``index`` of the flat input ``slot``."""
        return self._starts[slot] + index

    def constant(self, value: float) -> int:
        """A number; equal bits give the same handle."""
        return self._number(struct.pack("<d", value), float(value))

    def _number(self, key: bytes | _Node, node: float | _Node) -> int:
        handle = self._handles.get(key)
        if handle is None:
            handle = self._handles[key] = len(self._nodes)
            self._nodes.append(node)
        return handle

    def add(self, opcode: Opcode, *operands: int) -> int:
        """``opcode`` of the operands, simplified if the result stays bitwise the same."""
        nodes = self._nodes
        values = [node for operand in operands if isinstance(node := nodes[operand], float)]
        if len(values) == len(operands) and opcode not in _NOT_FOLDED:
            return self.constant(_fold(opcode, values))
        rule = self._rules.get(opcode)
        simpler = rule(*operands) if rule else None
        if simpler is not None:
            return simpler
        if opcode in COMMUTATIVE and operands[0] > operands[1]:
            operands = (operands[1], operands[0])
        return self._number((opcode, operands), (opcode, operands))

    def operands_of(self, handle: int, opcode: Opcode) -> tuple[int, ...] | None:
        """The operands of a value, if ``opcode`` computes it."""
        node = self._nodes[handle]
        return node[1] if isinstance(node, tuple) and node[0] is opcode else None

    def is_input(self, handle: int) -> bool:
        """Whether a value is an input."""
        return self._nodes[handle] is None

    def value(self, handle: int) -> float | None:
        """A value's number, if it is a constant."""
        node = self._nodes[handle]
        return node if isinstance(node, float) else None

    def _simplify_add(self, a: int, b: int) -> int | None:
        for x, y in ((a, b), (b, a)):
            number = self.value(y)
            if number is not None and _is_zero(number, -1.0):  # x + -0 is x; x + 0 differs if x is -0
                return x
            if negated := self.operands_of(y, Opcode.NEGATE):
                return self.add(Opcode.SUBTRACT, x, negated[0])
        merged = self._merge_branches(a, b)
        return self._merge_branches(b, a) if merged is None else merged

    def _merge_branches(self, a: int, b: int) -> int | None:
        """The conditional ``c ? yes : no`` for the sum ``(c ? yes : 0) + (c ? 0 : no)`` of CasADi."""
        first, second = self.operands_of(a, Opcode.SELECT), self.operands_of(b, Opcode.SELECT)
        if first is None or second is None or first[0] != second[0]:
            return None
        if self.value(first[2]) != 0.0 or self.value(second[1]) != 0.0:
            return None
        return self.add(Opcode.SELECT, first[0], first[1], second[2])

    def _simplify_subtract(self, a: int, b: int) -> int | None:
        number = self.value(b)
        if number is not None and _is_zero(number, 1.0):
            return a
        if negated := self.operands_of(b, Opcode.NEGATE):
            return self.add(Opcode.ADD, a, negated[0])
        return None

    def _simplify_multiply(self, a: int, b: int) -> int | None:
        for x, y in ((a, b), (b, a)):
            number = self.value(y)
            if number == 1.0:
                return x
            if number == -1.0:
                return self.add(Opcode.NEGATE, x)
            negated = self.operands_of(x, Opcode.NEGATE)
            if number is not None and negated:
                return self.add(Opcode.MULTIPLY, negated[0], self.constant(-number))
        left, right = self.operands_of(a, Opcode.NEGATE), self.operands_of(b, Opcode.NEGATE)
        return self.add(Opcode.MULTIPLY, left[0], right[0]) if left and right else None

    def _simplify_divide(self, a: int, b: int) -> int | None:
        number = self.value(b)
        if number is None or number == 0.0 or not math.isfinite(number):
            return None
        if number == 1.0:
            return a
        mantissa, exponent = math.frexp(number)
        # The reciprocal of a power of two is exact, if it and the number are normal.
        if abs(mantissa) == 0.5 and abs(exponent) < 1000:
            return self.add(Opcode.MULTIPLY, a, self.constant(1.0 / number))
        return None

    def _simplify_negate(self, a: int) -> int | None:
        if negated := self.operands_of(a, Opcode.NEGATE):
            return negated[0]
        product = self.operands_of(a, Opcode.MULTIPLY)
        for x, y in ((product[0], product[1]), (product[1], product[0])) if product else ():
            number = self.value(y)
            if number is not None:
                return self.add(Opcode.MULTIPLY, x, self.constant(-number))
        return None

    def _simplify_absolute(self, a: int) -> int | None:
        if signed := self.operands_of(a, Opcode.COPY_SIGN):
            return self.add(Opcode.ABSOLUTE, signed[0])
        return None

    def _simplify_select(self, condition: int, yes: int, no: int) -> int | None:
        number = self.value(condition)
        if number is not None:
            return yes if number != 0.0 else no
        if yes == no:
            return yes
        if inverse := self.operands_of(condition, Opcode.NOT):
            return self.add(Opcode.SELECT, inverse[0], no, yes)
        return None

    def build(self, outputs: Sequence[Sequence[int]], rounded: Sequence[int] = ()) -> Tape:
        """The tape with these handles as outputs, one sequence per output slot.

        ``rounded``: products that are not fused with a sum.
        """
        nodes = self._fuse(outputs, frozenset(rounded))
        reachable = _reachable(nodes, [handle for slot in outputs for handle in slot])
        constants = [handle for handle in reachable if isinstance(nodes[handle], float)]
        computed = [handle for handle in reachable if isinstance(nodes[handle], tuple)]
        register = {handle: handle for handle in range(self._starts[-1])}
        for handle in (*constants, *computed):
            register[handle] = len(register)
        operations: list[Operation] = []
        for handle in computed:
            node = nodes[handle]
            assert isinstance(node, tuple)
            operations.append(Operation(node[0], tuple(register[operand] for operand in node[1])))
        numbers = [nodes[handle] for handle in constants]
        return Tape(
            input_sizes=self._input_sizes,
            constants=tuple(number for number in numbers if isinstance(number, float)),
            operations=tuple(operations),
            outputs=tuple(tuple(register[handle] for handle in slot) for slot in outputs),
        )

    def _fuse(self, outputs: Sequence[Sequence[int]], rounded: frozenset[int]) -> list[_Node | float | None]:
        """Fuse each product that is used once, and need not be rounded, with the sum that uses it."""
        nodes = list(self._nodes)
        results = [handle for slot in outputs for handle in slot]
        uses = [0] * len(nodes)
        for handle in results:
            uses[handle] += 1
        for handle in _reachable(nodes, results):
            node = nodes[handle]
            for operand in node[1] if isinstance(node, tuple) else ():
                uses[operand] += 1

        def product(handle: int) -> tuple[int, ...] | None:
            node = nodes[handle]
            if uses[handle] > 1 or handle in rounded:
                return None
            return node[1] if isinstance(node, tuple) and node[0] is Opcode.MULTIPLY else None

        for handle, node in enumerate(nodes):
            if not isinstance(node, tuple) or node[0] not in (Opcode.ADD, Opcode.SUBTRACT):
                continue
            a, b = node[1]
            # Of two products the later product is fused, because the earlier product is available sooner.
            left, right = product(a), product(b)
            if left and right:
                left, right = (left, None) if a > b else (None, right)
            if node[0] is Opcode.ADD and (left or right):
                nodes[handle] = (Opcode.FMA, (*left, b)) if left else (Opcode.FMA, (*(right or ()), a))
            elif left:
                nodes[handle] = (Opcode.FMS, (*left, b))
            elif right:
                nodes[handle] = (Opcode.FNMA, (*right, a))
        return nodes


def _reachable(nodes: Sequence[_Node | float | None], results: Sequence[int]) -> list[int]:
    """Handles on which ``results`` depend, in order, without the inputs."""
    used = bytearray(len(nodes))
    for handle in results:
        used[handle] = 1
    for handle in range(len(nodes) - 1, -1, -1):
        node = nodes[handle]
        if used[handle] and isinstance(node, tuple):
            for operand in node[1]:
                used[operand] = 1
    return [handle for handle, node in enumerate(nodes) if used[handle] and node is not None]


def _is_zero(number: float, sign: float) -> bool:
    return number == 0.0 and math.copysign(1.0, number) == sign


def _fold(opcode: Opcode, values: list[float]) -> float:
    from armblocks.compiler.interpret import evaluate

    with np.errstate(all="ignore"):
        return float(evaluate(opcode, [np.array([value]) for value in values])[0])

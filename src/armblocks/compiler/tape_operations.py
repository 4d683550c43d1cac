"""The operations of a tape, or of a part of it, as LLVM IR for function bodies with one or more lanes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from armblocks.compiler.ir_text import Body
from armblocks.compiler.lane_memory import Line
from armblocks.compiler.linear_solution import emit_linear_solution
from armblocks.compiler.matrix_products import emit_matrix_product
from armblocks.compiler.opcodes import COMPARISONS, Opcode
from armblocks.compiler.tape import Tape

LoadInput = Callable[[int], str]
"""Returns the value, in all lanes, of a register that the body does not write."""
InputLine = Callable[[int], Line]
"""Returns the memory positions of an input register and the registers that follow it."""


@dataclass(frozen=True)
class Inputs:
    """Access of a body to the registers that it does not compute."""

    load: LoadInput
    line: InputLine


class Registers:
    """The values of a tape's registers, as numbers or as conditions."""

    def __init__(self, body: Body, tape: Tape, load: LoadInput) -> None:
        self._body = body
        self._tape = tape
        self._load = load
        self._numbers: dict[int, str] = {}
        self._conditions: dict[int, str] = {}
        self.vectors: dict[int, list[str]] = {}
        """The results of operations with several results, by register."""

    def set_number(self, register: int, value: str) -> None:
        """Write a register with a number."""
        self._numbers[register] = value

    def set_condition(self, register: int, value: str) -> None:
        """Write a register with a condition: its number is 1.0 or 0.0."""
        self._conditions[register] = value

    def has_number(self, register: int) -> bool:
        """Whether the register has been written."""
        return register in self._numbers

    def number(self, register: int) -> str:
        """The register's number."""
        value = self._numbers.get(register)
        if value is None:
            value = self._numbers[register] = self._make_number(register)
        return value

    def _make_number(self, register: int) -> str:
        body, tape = self._body, self._tape
        if register in self._conditions:
            return body.select(self._conditions[register], body.number(1.0), body.number(0.0))
        if register < tape.first_constant or register >= tape.first_operation:
            return self._load(register)
        return body.number(tape.constants[register - tape.first_constant])

    def condition(self, register: int) -> str:
        """Whether the register is not equal to zero; true for a NaN."""
        value = self._conditions.get(register)
        if value is None:
            body = self._body
            value = body.compare("une", self.number(register), body.number(0.0))
            self._conditions[register] = value
        return value


def emit_operations(
    body: Body,
    tape: Tape,
    inputs: Inputs,
    written: Callable[[int, Registers], None] | None = None,
    selection: range | None = None,
) -> Registers:
    """Emit all operations of the tape into ``body``; return the registers, from which outputs are read.

    ``written(register, registers)`` is called after each operation. If only the operations
    ``selection`` are emitted, ``inputs.load`` also returns registers that other parts have written.
    """
    from armblocks.compiler import elementary  # not needed if the code comes from the disk cache

    registers = Registers(body, tape, inputs.load)
    partners = tape.sine_cosine_pairs
    for k in range(len(tape.operations)) if selection is None else selection:
        opcode, operands = tape.operations[k]
        target = tape.first_operation + k
        if opcode in COMPARISONS:
            registers.set_condition(target, _emit_comparison(body, registers, opcode, operands))
        elif opcode is Opcode.SELECT:
            condition = registers.condition(operands[0])
            yes, no = registers.number(operands[1]), registers.number(operands[2])
            registers.set_number(target, body.select(condition, yes, no))
        elif opcode is Opcode.READ:
            first, count, index = operands
            size = int(tape.constants[count - tape.first_constant])
            position = body.limited_index(registers.number(index), size)
            registers.set_number(target, inputs.line(first).read(body, position))
        elif opcode is Opcode.SOLVE:
            members = emit_linear_solution(body, tape, operands, registers.number, inputs.line)
            registers.vectors[target] = members
        elif opcode is Opcode.PRODUCT:
            members = emit_matrix_product(body, tape, operands, registers.number, inputs.line)
            registers.vectors[target] = members
        elif opcode is Opcode.MEMBER:
            vector, member_index = operands
            member = int(tape.constants[member_index - tape.first_constant])
            registers.set_number(target, registers.vectors[vector][member])
        elif target in partners:
            if not registers.has_number(target):
                pair = elementary.sine_cosine(body, registers.number(operands[0]))
                for register, value in zip(partners[target], pair):
                    registers.set_number(register, value)
        else:
            values = [registers.number(operand) for operand in operands]
            registers.set_number(target, _emit_number(body, opcode, values))
        if written is not None:
            written(target, registers)
    return registers


_PREDICATES = {
    Opcode.LESS: "olt",
    Opcode.LESS_EQUAL: "ole",
    Opcode.EQUAL: "oeq",
    Opcode.NOT_EQUAL: "une",
}


def _emit_comparison(body: Body, registers: Registers, opcode: Opcode, operands: tuple[int, ...]) -> str:
    if opcode is Opcode.NOT:
        return body.compare("oeq", registers.number(operands[0]), body.number(0.0))
    if opcode in (Opcode.AND, Opcode.OR):
        left, right = (registers.condition(operand) for operand in operands)
        return body.both(left, right) if opcode is Opcode.AND else body.either(left, right)
    return body.compare(_PREDICATES[opcode], *(registers.number(operand) for operand in operands))


def _emit_number(body: Body, opcode: Opcode, values: list[str]) -> str:
    match opcode:
        case Opcode.ADD:
            return body.add(*values)
        case Opcode.SUBTRACT:
            return body.subtract(*values)
        case Opcode.MULTIPLY:
            return body.multiply(*values)
        case Opcode.DIVIDE:
            return body.divide(*values)
        case Opcode.NEGATE:
            return body.negate(values[0])
        case Opcode.FMA:
            return body.fma(*values)
        case Opcode.FMS:
            return body.fma(values[0], values[1], body.negate(values[2]))
        case Opcode.FNMA:
            return body.fma(body.negate(values[0]), values[1], values[2])
        case Opcode.SQUARE_ROOT:
            return body.intrinsic("sqrt", *values)
        case Opcode.ABSOLUTE:
            return body.absolute(*values)
        case Opcode.FLOOR:
            return body.intrinsic("floor", *values)
        case Opcode.CEILING:
            return body.intrinsic("ceil", *values)
        case Opcode.COPY_SIGN:
            return body.intrinsic("copysign", *values)
        case Opcode.SIGN:
            x, zero = values[0], body.number(0.0)
            negative = body.select(body.compare("olt", x, zero), body.number(-1.0), x)
            return body.select(body.compare("ogt", x, zero), body.number(1.0), negative)
        case Opcode.MINIMUM | Opcode.MAXIMUM:
            a, b = values
            extreme = body.select(body.compare("olt" if opcode is Opcode.MINIMUM else "ogt", a, b), a, b)
            return body.select(body.compare("uno", a, a), a, extreme)
        case _:
            from armblocks.compiler import elementary

            return elementary.call(body, opcode, values)

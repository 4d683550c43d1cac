"""A function as a flat scalar program, independent of CasADi and LLVM.

A tape consists of inputs, constants, operations and outputs. Every value has a register, and a register is
written once. Registers are numbered consecutively: first the inputs (slot after slot), then the constants,
then one for each operation. Operation ``k`` therefore writes register ``size of inputs + number of constants
+ k``.
"""

from __future__ import annotations

import math
import struct
from bisect import bisect_right
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from armblocks.compiler.opcodes import COMPARISONS, ELEMENTARY, Opcode
from armblocks.errors import CompileError

_MAGIC = b"armblocks tape 1"


class Operation(NamedTuple):
    """``opcode`` applied to the values of the registers ``operands``."""

    opcode: Opcode
    operands: tuple[int, ...]


@dataclass(frozen=True, kw_only=True)
class OperationCount:
    """Numbers of operations of one evaluation; ``functions``: name and number of each elementary function."""

    multiplies: int = 0
    adds: int = 0
    fused_multiply_adds: int = 0
    divisions: int = 0
    square_roots: int = 0
    comparisons: int = 0
    others: int = 0
    functions: tuple[tuple[str, int], ...] = ()

    @property
    def flops(self) -> int:
        """Multiplies, adds (a fused pair is two), divisions, square roots; functions are not counted."""
        plain = self.multiplies + self.adds + self.divisions + self.square_roots
        return plain + 2 * self.fused_multiply_adds

    @property
    def function_calls(self) -> int:
        """Number of calls of elementary functions."""
        return sum(count for _, count in self.functions)

    def __str__(self) -> str:
        parts = [
            f"{count} {word}"
            for count, word in (
                (self.fused_multiply_adds, "multiply-adds"),
                (self.multiplies, "multiplies"),
                (self.adds, "adds"),
                (self.divisions, "divisions"),
                (self.square_roots, "square roots"),
                (self.comparisons, "comparisons"),
                (self.others, "others"),
                *((count, name) for name, count in self.functions),
            )
            if count
        ]
        return ", ".join(parts) if parts else "nothing"


@dataclass(frozen=True)
class Tape:
    """A scalar program in static single assignment. Equal tapes have equal digests."""

    input_sizes: tuple[int, ...]
    constants: tuple[float, ...]
    operations: tuple[Operation, ...]
    outputs: tuple[tuple[int, ...], ...]
    """For each output slot the register of each of its scalars."""

    @cached_property
    def sine_cosine_pairs(self) -> dict[int, tuple[int, int]]:
        """Registers of sines and cosines of the same argument: both come from one reduction."""
        by_argument: dict[int, dict[Opcode, int]] = {}
        for k, (opcode, operands) in enumerate(self.operations):
            if opcode in (Opcode.SIN, Opcode.COS):
                by_argument.setdefault(operands[0], {})[opcode] = self.first_operation + k
        pairs = [(pair[Opcode.SIN], pair[Opcode.COS]) for pair in by_argument.values() if len(pair) == 2]
        return {register: pair for pair in pairs for register in pair}

    @cached_property
    def input_starts(self) -> tuple[int, ...]:
        """First register of each input slot, and at the end the first register after the inputs."""
        return (0, *(int(end) for end in np.cumsum(self.input_sizes)))

    def input_position(self, register: int) -> tuple[int, int]:
        """The slot of an input register, and its index there."""
        slot = bisect_right(self.input_starts, register) - 1
        return slot, register - self.input_starts[slot]

    @property
    def first_constant(self) -> int:
        """Register of the first constant."""
        return self.input_starts[-1]

    @property
    def first_operation(self) -> int:
        """Register that the first operation writes."""
        return self.first_constant + len(self.constants)

    @property
    def size(self) -> int:
        """Number of registers."""
        return self.first_operation + len(self.operations)

    @property
    def output_sizes(self) -> tuple[int, ...]:
        """Number of scalars of each output slot."""
        return tuple(len(registers) for registers in self.outputs)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the program, hexadecimal: the same on every machine."""
        import hashlib  # imported here because it loads OpenSSL, which is slow

        return hashlib.sha256(self.to_bytes()).hexdigest()

    @cached_property
    def count(self) -> OperationCount:
        """The numbers of operations of one evaluation."""
        counts: dict[Opcode, int] = {}
        for operation in self.operations:
            counts[operation.opcode] = counts.get(operation.opcode, 0) + 1

        def total(*opcodes: Opcode) -> int:
            return sum(counts.get(opcode, 0) for opcode in opcodes)

        named = {
            "multiplies": total(Opcode.MULTIPLY),
            "adds": total(Opcode.ADD, Opcode.SUBTRACT),
            "fused_multiply_adds": total(Opcode.FMA, Opcode.FMS, Opcode.FNMA) + self._products_in_matrices,
            "divisions": total(Opcode.DIVIDE),
            "square_roots": total(Opcode.SQUARE_ROOT),
            "comparisons": total(*COMPARISONS),
        }
        functions = tuple(
            (opcode.name.lower(), counts[opcode]) for opcode in sorted(ELEMENTARY) if opcode in counts
        )
        counted = total(Opcode.PRODUCT) + sum(count for _, count in functions)
        others = len(self.operations) + self._products_in_matrices - sum(named.values()) - counted
        return OperationCount(**named, others=others, functions=functions)

    @property
    def _products_in_matrices(self) -> int:
        """Number of multiply-adds of all matrix products."""
        products = (operands for opcode, operands in self.operations if opcode is Opcode.PRODUCT)
        sizes = (operands[1:3] for operands in products)
        return sum(math.prod(int(self.constants[r - self.first_constant]) for r in pair) for pair in sizes)

    def __str__(self) -> str:
        lines = [f"inputs {self.input_sizes}"]
        lines += [f"r{self.first_constant + k} = {value!r}" for k, value in enumerate(self.constants)]
        for k, (opcode, operands) in enumerate(self.operations):
            arguments = " ".join(f"r{operand}" for operand in operands)
            lines.append(f"r{self.first_operation + k} = {opcode.name.lower()} {arguments}")
        for k, registers in enumerate(self.outputs):
            lines.append(f"output {k}: " + " ".join(f"r{register}" for register in registers))
        return "\n".join(lines)

    def to_bytes(self) -> bytes:
        """The tape in a portable binary form (little-endian), which :meth:`from_bytes` reads."""
        flat = [value for slot in self.outputs for value in slot]
        code = [
            number
            for opcode, operands in self.operations
            for number in (opcode, *(() if opcode.arity else (len(operands),)), *operands)
        ]
        sizes = (self.input_sizes, self.output_sizes)
        head = struct.pack("<5q", *(len(part) for part in (*sizes, self.constants, code, flat)))
        numbers = np.array([*self.input_sizes, *self.output_sizes, *code, *flat], dtype="<i8")
        return _MAGIC + head + np.array(self.constants, dtype="<f8").tobytes() + numbers.tobytes()

    @classmethod
    def from_bytes(cls, data: bytes) -> Tape:
        """Inverse of :meth:`to_bytes`. Raises :class:`CompileError` on anything else."""
        try:
            if not data.startswith(_MAGIC):
                raise ValueError("not a tape")
            lengths: tuple[int, ...] = struct.unpack_from("<5q", data, len(_MAGIC))
            start = len(_MAGIC) + 40
            constants = np.frombuffer(data, "<f8", lengths[2], start)
            numbers: list[int] = np.frombuffer(data, "<i8", -1, start + 8 * lengths[2]).tolist()
            n_in, n_out, _, n_code, n_flat = lengths
            if len(numbers) != n_in + n_out + n_code + n_flat:
                raise ValueError("incomplete data")
            input_sizes = tuple(numbers[:n_in])
            output_sizes = numbers[n_in : n_in + n_out]
            operations = _decode(numbers[n_in + n_out : n_in + n_out + n_code])
            flat = numbers[n_in + n_out + n_code :]
        except (ValueError, KeyError, IndexError, struct.error) as error:
            raise CompileError(
                f"these bytes are not a tape: {error}",
                allowed="bytes from Tape.to_bytes",
                where="tape",
                fix="write the tape again with Tape.to_bytes",
            ) from error
        offsets = np.cumsum(output_sizes).tolist()
        outputs = tuple(tuple(flat[end - size : end]) for end, size in zip(offsets, output_sizes))
        return cls(input_sizes, tuple(constants.tolist()), operations, outputs)


def _decode(code: list[int]) -> tuple[Operation, ...]:
    operations: list[Operation] = []
    position = 0
    while position < len(code):
        opcode = Opcode(code[position])
        first = position + (1 if opcode.arity else 2)
        end = first + (opcode.arity or code[position + 1])
        if end > len(code):
            raise ValueError("incomplete data")
        operations.append(Operation(opcode, tuple(code[first:end])))
        position = end
    return tuple(operations)

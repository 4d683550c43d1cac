"""Traced functions and tapes for the tests of the compiler."""

import ctypes
from collections.abc import Callable, Sequence
from typing import Any

import casadi
import numpy as np
from casadi import SX

from armblocks.compiler.batch import emit_batch
from armblocks.compiler.ir_text import Module
from armblocks.compiler.layout import BatchLayout, Layout
from armblocks.compiler.native import load_code
from armblocks.compiler.opcodes import Opcode
from armblocks.compiler.tape import Operation, Tape
from armblocks.equations import TracedFunction, signature


def traced(equations: Callable[..., Any], *sizes: int, name: str = "f") -> TracedFunction:
    """A traced function of vectors ``a, b, …`` of these sizes with one output, the column ``y``."""
    letters = "abcdefgh"[: len(sizes)]
    symbols = [SX.sym(letter, size) for letter, size in zip(letters, sizes)]
    rows = SX(equations(*symbols)).shape[0]
    inputs = signature(*((letter, (size,)) for letter, size in zip(letters, sizes)))
    return TracedFunction.trace(name, inputs, signature(("y", (rows,))), equations)


def mixed() -> TracedFunction:
    """A function of two vectors of length 3 with arithmetic, functions and conditions: eleven results."""

    def equations(a: SX, b: SX) -> SX:
        angle = a[0] * b[1] - a[1]
        s, c = casadi.sin(angle), casadi.cos(angle)
        chosen = casadi.if_else(a[2] < b[2], s * b[0], casadi.sqrt(b[0] * b[0] + 1))
        return casadi.vertcat(
            s + c * a[2],
            chosen,
            casadi.atan2(a[0], b[0]) * c,
            casadi.fabs(a[1]) - b[1] * b[2] + a[0] * a[2],
            casadi.exp(-a[0] * a[0]) / (2 + b[2] * b[2]),
            casadi.fmod(a[1], b[1]),
            casadi.sign(a[0] - 0.5),
            casadi.fmax(a[0], b[0]),
            casadi.tan(b[2]),
            a[0],
            SX(7),
        )

    return traced(equations, 3, 3, name="mixed")


def single_operation(opcode: Opcode) -> Tape:
    """The tape of one operation on scalars."""
    arity = opcode.arity
    return Tape((1,) * arity, (), (Operation(opcode, tuple(range(arity))),), ((arity,),))


def native(tape: Tape, lanes: int) -> Callable[..., np.ndarray]:
    """Compile a tape with scalar inputs and one scalar output to a function of vectors of equal length."""
    count = len(tape.input_sizes)
    layout = BatchLayout(inputs=(Layout.ROWS,) * count, outputs=(Layout.ROWS,))

    def write() -> str:
        module = Module()
        emit_batch(module, tape, layout, lanes, "batch")
        return module.text

    code = load_code(("test", tape.digest, str(lanes)), write)
    pointers = [ctypes.c_void_p] * (count + 1)
    function = ctypes.CFUNCTYPE(None, *[ctypes.c_int64] * 3, *pointers)(code.address("batch"))

    def call(*values: Sequence[float] | np.ndarray) -> np.ndarray:
        arrays = [np.ascontiguousarray(value, dtype=np.float64) for value in values]
        result = np.empty_like(arrays[0])
        function(0, result.size, result.size, *(array.ctypes.data for array in (*arrays, result)))
        assert code  # keeps the machine code alive during the call
        return result

    return call


def same_bits(a: np.ndarray, b: np.ndarray) -> bool:
    """Return whether two arrays are equal bit for bit; all NaNs count as equal."""
    both_nan = np.isnan(a) & np.isnan(b)
    return bool(np.all((np.asarray(a).view(np.int64) == np.asarray(b).view(np.int64)) | both_nan))

"""Long tapes are split into several functions without a change of the results."""

from __future__ import annotations

import ctypes
from functools import cache

import casadi as ca
import numpy as np
import pytest
from casadi import SX

from armblocks.compiler import Kernel, compile_function, native, tape_parts
from armblocks.compiler.from_casadi import tape_from
from armblocks.compiler.interpret import interpret
from armblocks.compiler.ir_text import Module
from armblocks.compiler.llvm_ir import emit_function
from armblocks.compiler.native import Effort, compile_object, load_code
from armblocks.compiler.tape_parts import ACCESS_WEIGHT, PART_WEIGHT, divide, is_long
from armblocks.compiler.target import Target
from armblocks.equations import TracedFunction, signature
from armblocks.errors import InputError

LAG = 300
"""Distance to the oldest value that the recursion uses: longer than several parts."""


@cache
def long_function(count: int) -> TracedFunction:
    """A recursion that uses old values, with conditions, elementary functions and outputs throughout."""

    def equations(x: SX, u: SX) -> tuple[SX, SX]:
        values = [x[0], x[1]]
        for k in range(count):
            a, b, c = values[-1], values[-2], values[max(0, len(values) - LAG)]
            values.append(ca.if_else(a < b, 0.7 * a + 0.2 * c, 0.6 * b - 0.3 * a * u[k % 3] + 0.01 * k))
            if k % 97 == 0:
                values.append(ca.sin(values[-1]))
                values.append(ca.cos(values[-2]))
        return ca.vertcat(*values[::7], 3.0, x[1]), ca.vertcat(*values[-20:])

    return TracedFunction.trace(
        "long",
        signature(("x", (2,)), ("u", (3,))),
        signature(("y", (len(_count(count)),)), ("z", (20,))),
        equations,
    )


@cache
def divided_function() -> Kernel:
    """The long function, compiled in several parts."""
    return compile_function(long_function(600))


def _count(count: int) -> list[int]:
    total = 2 + count + 2 * ((count + 96) // 97)
    return [*range(0, total, 7), -1, -2]


def test_a_long_function_in_pieces_equals_the_undivided_one_bit_for_bit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    traced = long_function(600)
    tape = tape_from(traced)
    assert is_long(tape)
    rng = np.random.default_rng(0)
    x, u = rng.normal(size=(21, 2)), rng.normal(size=(21, 3))
    # A huge angle, for which the vector code calls the scalar code.
    x[20, 0] = 1e200
    divided = divided_function()
    actual = divided(x, u)
    singles = [divided(x[row], u[row]) for row in range(21)]
    message = [interpret(tape, [x[row], u[row]]) for row in (0, 7, 19)]
    monkeypatch.setenv("ARMBLOCKS_CACHE_DIR", "")
    monkeypatch.setattr(tape_parts, "MAX_WEIGHT", 10**9)
    whole = compile_function(traced)(x, u)
    for slot in (0, 1):
        np.testing.assert_array_equal(actual[slot], whole[slot])
        np.testing.assert_array_equal(actual[slot], [single[slot] for single in singles])
        # Functions differ by one or two units in the last place; the recursion damps earlier differences.
        expected = [values[slot] for values in message]
        np.testing.assert_allclose(actual[slot][[0, 7, 19]], expected, rtol=1e-12, atol=1e-13)


def test_every_operation_and_store_is_in_one_piece_of_limited_length() -> None:
    tape = tape_from(long_function(1500))
    stores = {
        k: (register,) for k, register in enumerate(register for part in tape.outputs for register in part)
    }
    division = divide(tape, stores)
    operations = [k for part in division.parts for k in range(part.first, part.last)]
    assert operations == list(range(len(tape.operations)))
    assert sorted(k for part in division.parts for k in part.stores) == sorted(stores)
    for part in division.parts:
        assert part.last - part.first + ACCESS_WEIGHT * len(part.stores) <= 2 * PART_WEIGHT
    # Storage is reused: the last 300 values are in use, not all 1500.
    assert division.size < 2 * LAG + PART_WEIGHT


@pytest.mark.parametrize("effort", ["LONG_MODULE", "VERY_LONG_MODULE"])
def test_less_optimisation_does_not_change_the_bits(effort: str, monkeypatch: pytest.MonkeyPatch) -> None:
    traced = long_function(600)
    x, u = np.random.default_rng(1).normal(size=(2, 11, 3))
    expected = divided_function()(x[:, :2], u)
    monkeypatch.setenv("ARMBLOCKS_CACHE_DIR", "")
    monkeypatch.setattr(native, "LONG_MODULE", 0)
    if effort == "VERY_LONG_MODULE":
        monkeypatch.setattr(native, "VERY_LONG_MODULE", 0)
    quick = compile_function(traced)(x[:, :2], u)
    for one, other in zip(expected, quick):
        np.testing.assert_array_equal(one, other)


def test_all_optimisation_efforts_give_the_same_bits() -> None:
    tape = tape_from(long_function(300))
    vectors = [np.random.default_rng(2).normal(size=size) for size in (*tape.input_sizes, *tape.output_sizes)]

    def write() -> str:
        module = Module()
        emit_function(module, tape, "f", linkage="")
        return module.text

    results: list[list[bytes]] = []
    for effort in Effort:
        code = load_code(("effort", tape.digest), write, effort)
        function = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * len(vectors))(code.address("f"))
        function(*(vector.ctypes.data for vector in vectors))
        results.append([vector.tobytes() for vector in vectors])
        for vector in vectors[len(tape.input_sizes) :]:
            vector[:] = np.nan
    assert len(results) == 2 and results[0] == results[1]
    message = interpret(tape, vectors[: len(tape.input_sizes)])
    for actual, expected in zip(results[0][len(tape.input_sizes) :], message):
        np.testing.assert_allclose(np.frombuffer(actual), expected, rtol=1e-12, atol=1e-13)


def test_an_environment_variable_limits_the_optimisation_effort(monkeypatch: pytest.MonkeyPatch) -> None:
    efforts: list[Effort] = []

    def compiled(text: str, target: Target, *, effort: Effort) -> bytes:
        efforts.append(effort)
        return compile_object(text, target, effort=effort)

    monkeypatch.setattr(native, "compile_object", compiled)
    monkeypatch.setenv("ARMBLOCKS_CACHE_DIR", "")
    for requested, used in (("", "FULL"), ("full", "FULL"), ("little", "LITTLE")):
        monkeypatch.setenv("ARMBLOCKS_EFFORT", requested)
        load_code(("empty",), lambda: "")
        load_code(("empty",), lambda: "", Effort.LITTLE)
        assert efforts == [Effort[used], Effort.LITTLE]
        efforts.clear()
    monkeypatch.setenv("ARMBLOCKS_EFFORT", "much")
    with pytest.raises(InputError, match=r"'much' is not a valid.*'little', 'full'.*remove the variable"):
        load_code(("empty",), lambda: "")


def test_the_longest_undivided_function_is_at_least_twice_as_long_as_a_piece() -> None:
    assert tape_parts.MAX_WEIGHT >= 2 * PART_WEIGHT

"""Tapes: representation, simplification, serialisation and interpretation."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_functions import mixed, same_bits

from armblocks.compiler.from_casadi import tape_from
from armblocks.compiler.interpret import interpret, multiply_add
from armblocks.compiler.opcodes import Opcode
from armblocks.compiler.tape import Operation, Tape
from armblocks.compiler.tape_builder import TapeBuilder
from armblocks.errors import CompileError, InputError

NUMBERS = st.floats(allow_nan=True, allow_infinity=True, width=64)


def opcodes(tape: Tape) -> list[Opcode]:
    return [operation.opcode for operation in tape.operations]


def test_registers_are_numbered_inputs_constants_operations() -> None:
    builder = TapeBuilder([2, 1])
    total = builder.add(Opcode.ADD, builder.input(0, 1), builder.constant(2.5))
    tape = builder.build([[builder.add(Opcode.DIVIDE, total, builder.input(1, 0)), total]])
    assert tape.constants == (2.5,)
    assert tape.operations == (Operation(Opcode.ADD, (1, 3)), Operation(Opcode.DIVIDE, (4, 2)))
    assert tape.outputs == ((5, 4),)
    assert str(tape) == ("inputs (2, 1)\nr3 = 2.5\nr4 = add r1 r3\nr5 = divide r4 r2\noutput 0: r5 r4")


def test_only_a_product_that_is_used_once_without_rounding_is_fused() -> None:
    builder = TapeBuilder([4])
    a, b, c, d = (builder.input(0, index) for index in range(4))
    product = builder.add(Opcode.MULTIPLY, a, b)
    tape = builder.build([[builder.add(Opcode.SUBTRACT, c, product)]])
    assert tape.operations == (Operation(Opcode.FNMA, (0, 1, 2)),)
    rounded_tape = builder.build([[builder.add(Opcode.SUBTRACT, c, product)]], rounded=[product])
    assert opcodes(rounded_tape) == [Opcode.MULTIPLY, Opcode.SUBTRACT]
    shared_tape = builder.build(
        [[builder.add(Opcode.ADD, product, c), builder.add(Opcode.SUBTRACT, product, d)]]
    )
    assert opcodes(shared_tape) == [Opcode.MULTIPLY, Opcode.ADD, Opcode.SUBTRACT]
    other = builder.add(Opcode.MULTIPLY, c, d)
    two_products = builder.build([[builder.add(Opcode.SUBTRACT, product, other)]])
    assert two_products.operations == (Operation(Opcode.MULTIPLY, (0, 1)), Operation(Opcode.FNMA, (2, 3, 4)))


def test_common_subexpressions_are_evaluated_once_in_either_operand_order() -> None:
    builder = TapeBuilder([2])
    a, b = builder.input(0, 0), builder.input(0, 1)
    assert builder.add(Opcode.ADD, a, b) == builder.add(Opcode.ADD, b, a)
    assert builder.add(Opcode.MINIMUM, a, b) != builder.add(Opcode.MINIMUM, b, a)
    assert builder.constant(0.0) != builder.constant(-0.0)


def test_dead_code_is_removed() -> None:
    builder = TapeBuilder([1])
    builder.add(Opcode.SIN, builder.input(0, 0))
    builder.constant(3.0)
    assert builder.build([[builder.input(0, 0)]]) == Tape((1,), (), (), ((0,),))


def test_the_two_terms_of_if_else_become_one_selection() -> None:
    builder = TapeBuilder([3])
    zero = builder.constant(0.0)
    condition, yes, no = (builder.input(0, index) for index in range(3))
    first = builder.add(Opcode.SELECT, condition, yes, zero)
    second = builder.add(Opcode.SELECT, builder.add(Opcode.NOT, condition), no, zero)
    tape = builder.build([[builder.add(Opcode.ADD, first, second)]])
    assert tape.operations == (Operation(Opcode.SELECT, (0, 1, 2)),)


@pytest.mark.parametrize("opcode", [Opcode.ADD, Opcode.SUBTRACT, Opcode.MULTIPLY, Opcode.DIVIDE])
@given(x=NUMBERS, c=st.one_of(NUMBERS, st.sampled_from([0.0, -0.0, 1.0, -1.0, 2.0, 0.25, 2.0**-1074])))
def test_simplification_does_not_change_the_bits(opcode: Opcode, x: float, c: float) -> None:
    for left in (False, True):
        builder = TapeBuilder([1])
        operands = (builder.constant(c), builder.input(0, 0))
        value = builder.add(opcode, *(operands if left else reversed(operands)))
        negated = builder.add(Opcode.NEGATE, value)
        actual = interpret(builder.build([[value, negated]]), [[x]])[0]
        a, b = (c, x) if left else (x, c)
        with np.errstate(all="ignore"):
            rounded_result = {
                Opcode.ADD: np.add,
                Opcode.SUBTRACT: np.subtract,
                Opcode.MULTIPLY: np.multiply,
                Opcode.DIVIDE: np.divide,
            }[opcode](a, b)
        assert same_bits(actual, np.array([rounded_result, -rounded_result]))


def test_constants_are_folded() -> None:
    builder = TapeBuilder([0])
    two, three = builder.constant(2.0), builder.constant(3.0)
    value = builder.add(Opcode.DIVIDE, builder.add(Opcode.MULTIPLY, two, three), builder.constant(4.0))
    assert builder.build([[value]]) == Tape((0,), (1.5,), (), ((0,),))


def test_bytes_and_digest_identify_a_tape() -> None:
    tape = tape_from(mixed())
    copy = Tape.from_bytes(tape.to_bytes())
    assert copy == tape
    assert copy.digest == tape.digest == tape_from(mixed()).digest
    changed = Tape(tape.input_sizes, (*tape.constants[:-1], 99.0), tape.operations, tape.outputs)
    assert changed.digest != tape.digest


@pytest.mark.parametrize("cut", [0, 10, 60, -8, -1])
def test_damaged_bytes_are_refused(cut: int) -> None:
    with pytest.raises(CompileError, match=r"these bytes are not a tape.*bytes from Tape\.to_bytes"):
        Tape.from_bytes(tape_from(mixed()).to_bytes()[:cut])


def test_the_operation_count_of_a_tape_is_that_of_its_operations() -> None:
    tape = tape_from(mixed())
    count = tape.count
    assert dict(count.functions) == {
        "sin": 1,
        "cos": 1,
        "tan": 1,
        "atan2": 1,
        "exp": 1,
        "modulo": 1,
    }
    assert count.function_calls == 6
    assert count.square_roots == 1
    assert count.divisions == 1
    assert count.flops == (
        count.multiplies + count.adds + 2 * count.fused_multiply_adds + count.divisions + count.square_roots
    )
    assert "multiply-adds" in str(count)
    assert "1 atan2" in str(count)
    total = count.multiplies + count.adds + count.fused_multiply_adds + count.divisions
    total += count.square_roots + count.comparisons + count.others + count.function_calls
    assert total == len(tape.operations)
    assert str(Tape((), (), (), ()).count) == "nothing"


@given(st.tuples(NUMBERS, NUMBERS, NUMBERS))
def test_the_interpreter_rounds_a_multiply_add_only_once(numbers: tuple[float, float, float]) -> None:
    a, b, c = numbers
    with np.errstate(all="ignore"):
        actual = float(multiply_add(*(np.array([number]) for number in numbers))[0])
        rounded_twice = float(np.float64(a) * b + c)
    if not all(map(math.isfinite, numbers)):
        # With an infinite addend the sum is the addend, even where the rounded product would overflow.
        expected = c if math.isfinite(a) and math.isfinite(b) else rounded_twice
    elif (exact := Fraction(a) * Fraction(b) + Fraction(c)) == 0:
        expected = rounded_twice if 0.0 in numbers else 0.0
    else:
        try:
            expected = float(exact)
        except OverflowError:
            expected = math.inf if exact > 0 else -math.inf
        expected = math.copysign(expected, 1 if exact > 0 else -1)
    assert same_bits(np.array([actual]), np.array([expected]))


def test_the_interpreter_broadcasts_inputs_and_checks_their_sizes() -> None:
    tape = tape_from(mixed())
    batch = interpret(tape, [np.ones((4, 3)), np.arange(3.0)])[0]
    assert batch.shape == (4, 11)
    assert np.array_equal(batch[2], interpret(tape, [np.ones(3), np.arange(3.0)])[0])
    with pytest.raises(InputError, match=r"inputs of sizes \(3, 2\).*sizes \(3, 3\) on the last axis"):
        interpret(tape, [np.ones(3), np.ones(2)])
    unfused = interpret(tape, [np.full(3, 1 / 3), np.full(3, 1 / 7)], fused=False)[0]
    np.testing.assert_allclose(
        unfused, interpret(tape, [np.full(3, 1 / 3), np.full(3, 1 / 7)])[0], rtol=1e-14
    )


def test_the_absolute_value_of_copysign_ignores_the_sign() -> None:
    builder = TapeBuilder([2])
    a, b = (builder.input(0, index) for index in range(2))
    signed = builder.add(Opcode.COPY_SIGN, builder.constant(-2.2), b)
    other = builder.add(Opcode.COPY_SIGN, a, b)
    tape = builder.build([[builder.add(Opcode.ABSOLUTE, signed), builder.add(Opcode.ABSOLUTE, other)]])
    assert tape == Tape((2,), (2.2,), (Operation(Opcode.ABSOLUTE, (0,)),), ((2, 3),))

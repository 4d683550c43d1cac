"""Routines give the same results in machine code, in the tree interpreter and in Python."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from tree_interpreter import Interpreter

from armblocks.compiler.native import load_code
from armblocks.routines.arithmetic import (
    fma,
    in_all_lanes,
    inverse_root,
    maximum,
    minimum,
    polynomial,
    select,
    sign,
    square_root,
)
from armblocks.routines.lanes import LaneArray, Lanes
from armblocks.routines.llvm import definitions
from armblocks.routines.memory import Address, Integers, Reals
from armblocks.routines.routine import UNROLL, Program, Routine, external
from armblocks.routines.values import Boolean, Int32, Integer, Real

CTYPES = {float: ctypes.c_double, int: ctypes.c_int64, list: ctypes.c_void_p, None: None}


def both(write: Callable[..., Any], *arguments: Any, result: type | None = None, lanes: int = 1) -> Any:
    """Run a function in machine code and in the interpreter; return their equal results.

    Lists are changed in place. A list of tuples is an array with one row of lanes for each tuple.
    """
    program = Program(lanes)
    program.define(write, "run", public=True)
    parts = definitions(program)
    code = load_code(("routines test", *parts.values()), lambda: "\n\n".join(parts.values()))
    arrays = [aligned_array(argument) if isinstance(argument, list) else None for argument in arguments]
    kinds = [CTYPES[type(argument)] for argument in arguments]
    function = ctypes.CFUNCTYPE(CTYPES[result], *kinds)(code.address("run"))
    native = function(*(x if a is None else a.ctypes.data for x, a in zip(arguments, arrays)))
    copies = [list(argument) if isinstance(argument, list) else argument for argument in arguments]
    interpreted = Interpreter(program).call("run", *((c, 0) if isinstance(c, list) else c for c in copies))
    np.testing.assert_equal(native, interpreted)
    for array, copy, argument in zip(arrays, copies, arguments):
        if array is not None:
            np.testing.assert_array_equal(array, copy)
            argument[:] = copy
    return native


def aligned_array(numbers: list[Any]) -> np.ndarray:
    """The numbers as an array; rows of lanes are aligned to their size."""
    if not isinstance(numbers[0], tuple):
        return np.array(numbers, dtype=type(numbers[0]))
    lanes = len(numbers[0])
    memory = np.empty((len(numbers) + 1) * lanes)
    first = -memory.ctypes.data // 8 % lanes
    array = memory[first : first + len(numbers) * lanes].reshape(-1, lanes)
    array[:] = numbers
    return array


def test_arithmetic_equals_that_of_python_floats() -> None:
    def run(r: Routine, a: Real, b: Real, out: Reals) -> None:
        values = [
            a + b,
            a - b,
            2.0 - a,
            a * b,
            a / b,
            1.0 / b,
            -a,
            abs(a),
            square_root(abs(b)),
            fma(a, b, 0.5),
        ]
        values += [minimum(a, b), maximum(a, 0.25), sign(b), select(a < b, a, -1.0)]
        values += [fma(2.0, b, polynomial(a, (1.0, 2.0, 3.0))), polynomial(a, (7.0,)) * b, r.constant(4.0)]
        for k, value in enumerate(values):
            out[k] = value

    out = [0.0] * 17
    a, b = 1.25, -3.0
    both(run, a, b, out)
    assert out == [
        *(a + b, a - b, 2.0 - a, a * b, a / b, 1.0 / b, -a, abs(a), math.sqrt(3.0), a * b + 0.5),
        *(b, a, -1.0, -1.0, 2.0 * b + 1.0 + 2.0 * a + 3.0 * a * a, 7.0 * b, 4.0),
    ]


def test_comparisons_with_nan_fail_except_not_equal() -> None:
    def run(r: Routine, a: Real, b: Real, out: Integers) -> None:
        tests: list[Boolean] = [a < b, a <= b, a == b, a >= b, a > b, b.ordered, b.finite, a != b]
        tests += [~(a == b), (a < b) | (a != b), (a == a) & (b != b)]
        for k, condition in enumerate(tests):
            out[k] = condition.count()

    out = [0] * 11
    both(run, 1.0, math.nan, out)
    assert out == [0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1]


def test_integers_wrap_around_and_divide_toward_zero() -> None:
    def run(r: Routine, i: Integer, out: Integers) -> None:
        values = [i + 1, 1 + i, i - 3, 3 - i, i * i, 2 * i, i // 2, i & 6, i.to_real().to_integer()]
        values += [select(i < 0, i, 5), select(i >= 0, 1, i), i.unsigned_quotient(2)]
        values += [
            i << 3,
            i >> 1,
            i >> (i & 3),
            i.unsigned_remainder(10),
            i.unsigned_remainder(i + 8),
            i | 16,
        ]
        values += [((1 << 62) + (i - i)) * 4 + 1, (i.to_real().bits() + 0).from_bits().to_integer()]
        tests = [i < 0, i <= -7, i == -7, i != -7, i > 0, i >= 0]
        for k, value in enumerate([*values, *(test.count() for test in tests)]):
            out[k] = value

    out = [0] * 26
    both(run, -7, out)
    plain = (1 << 64) - 7
    shifted = [-56, -4, -7 >> 1, plain % 10, 0, -7 | 16]
    assert out == [-6, -6, -10, 10, 49, -14, -3, 0, -7, -7, -7, plain // 2, *shifted, 1, -7, 1, 1, 1, 0, 0, 0]


@pytest.mark.parametrize("lanes", [1, 2, 4, 8])
def test_lanes_compute_independently_and_share_control_flow(lanes: int) -> None:
    """The larger of ``x`` and its reciprocal, doubled until no lane is below 10 (at most 20 times)."""

    def run(r: Routine, x: LaneArray, one: Real, out: LaneArray) -> Integer:
        def larger(r: Routine, a: Lanes, one: Real) -> Lanes:
            known = (a == a) & ~(a != a) & a.ordered | (a > 1.0)
            return select(known, select(a > 1.0 / a, a, in_all_lanes(one) / a), 99.0)

        last = r.variable(r.call(r.program.define(larger, inlined=False), x[0], one))
        turns = r.integer(0)
        with r.loop() as loop:
            loop.leave_unless((last.value < 10.0).any)
            loop.leave_when(turns.value >= 20)
            last.value = fma(last.value, 2.0, 0.0)
            turns.value = turns.value + 1
        rows = x.after(turns.value - turns.value + 1)
        out[0], out[1], out[2] = last.value, square_root(abs(-rows[0])), rows[0] - 1.0
        return turns.value + (one > 0.0).count()

    first = (3.0, 0.5, math.nan, 0.25, -4.0, 1e9, 7.0, 1.0)[:lanes]
    second = (-4.0, 2.25, -0.0, 16.0, math.inf, 1.0, 9.0, 0.25)[:lanes]
    out = [(0.0,) * lanes] * 3
    start = [99.0 if math.isnan(a) else max(a, 1.0 / a) for a in first]
    turns = next((k for k in range(20) if min(start) * 2.0**k >= 10.0), 20)
    assert both(run, [first, second], 1.0, out, result=int, lanes=lanes) == turns + 1
    assert out[0] == tuple(a * 2.0**turns for a in start)
    assert out[1] == tuple(math.sqrt(abs(b)) for b in second)
    assert out[2] == tuple(b - 1.0 for b in second)


@pytest.mark.parametrize("lanes", [1, 2, 8])
def test_integers_in_lanes(lanes: int) -> None:
    def run(r: Routine, rows: LaneArray, out: LaneArray) -> Integer:
        counts = rows[0].bits()
        more = select((counts & 3) == 0, 100 - counts, counts + 5)
        out[0] = more.from_bits()
        out[1] = inverse_root(rows[1], 5)
        out[2] = select(rows[1] > 1.0, (rows[1].bits() - 1).from_bits(), 0.0)
        out[3] = select(counts >= 7, counts & 0, counts.unsigned_quotient(3)).from_bits()
        return (counts < 6).bits() + 1000 * (rows[1] > 1.0).bits()

    numbers = tuple(np.arange(4, 4 + lanes).view(np.float64).tolist())
    roots = (2.5, 1e-30, 3.0, 1.0, 1e30, 0.7, 32.0, 5.0)[:lanes]
    expected = sum(1 << k for k in range(min(2, lanes)))
    expected += 1000 * sum((root > 1.0) << k for k, root in enumerate(roots))
    out = [(0.0,) * lanes] * 4
    assert both(run, [numbers, roots], out, result=int, lanes=lanes) == expected


@pytest.mark.parametrize("n", [0, 1, UNROLL, UNROLL + 1, 30])
def test_unrolled_and_looped_iterations_are_equal(n: int) -> None:
    def run(r: Routine, x: Reals, y: Reals) -> Real:
        total = r.real(0.0)
        for i in r.each(n):
            y[i] = 2.0 * x[i]
            total.value = total.value + x.after(i)[0]
        return total.value

    x = [float(k + 1) for k in range(max(n, 1))]
    y = [0.0] * len(x)
    assert both(run, x, y, result=float) == n * (n + 1) / 2
    assert y[:n] == [2.0 * value for value in x[:n]]


def test_break_and_continue_act_on_their_loop() -> None:
    """Sum the numbers up to ``n`` that are not divisible by 3, until the sum exceeds 100."""

    def run(r: Routine, n: Integer) -> Integer:
        total, k = r.integer(0), r.integer(0)
        with r.loop() as loop:
            k.value = k.value + 1
            loop.leave_unless(k.value <= n)
            loop.again_when(k.value - k.value // 3 * 3 == 0)
            total.value = total.value + k.value
            with r.when(total.value > 100):
                loop.leave()
        return total.value

    for n in (0, 2, 10, 1000):
        total = 0
        for k in range(1, n + 1):
            if k % 3:
                total += k
                if total > 100:
                    break
        assert both(run, n, result=int) == total


def test_an_outer_region_is_left_from_a_nested_one() -> None:
    def run(r: Routine, x: Reals, value: Real) -> Integer:
        index = r.integer(-1)
        with r.part() as search:
            for row in r.range(0, 3):
                for column in r.range(row, 3):
                    with r.when(x[row * 3 + column] == value):
                        index.value = row * 3 + column
                        search.leave()
            index.value = -2
        with r.when(index.value >= 0), r.when(value < 0.0):
            r.return_(index.value * 100)
        with r.otherwise():
            index.value = index.value * 10
        return index.value

    x = [1.0, 5.0, -2.0, 9.0, 4.0, 7.0, 9.0, 9.0, 8.0]
    assert [both(run, x, value, result=int) for value in (5.0, -2.0, 9.0, 8.0)] == [1, 200, -20, 8]


def test_stages_can_be_entered_at_each_stage_and_continue_with_the_next() -> None:
    def run(r: Routine, first: Integer, out: Integers) -> None:
        count = r.integer(0)

        def note(number: int) -> None:
            out[count.value] = number
            count.value = count.value + 1

        with r.stages("one", "two", "three") as stages:
            with r.when(first == 1):
                stages.go("one")
            with r.when(first == 2):
                stages.go("two")
            stages.go("three")
            stages.begin("one")
            note(1)
            stages.begin("two")
            note(2)
            with r.when(count.value < 4):
                stages.go("one")
            stages.begin("three")
            note(3)

    for first, expected in ((1, [1, 2, 1, 2, 3, 0]), (2, [2, 1, 2, 1, 2, 3]), (3, [3, 0, 0, 0, 0, 0])):
        out = [0] * 6
        both(run, first, out)
        assert out == expected


def test_functions_call_one_another_and_read_tables() -> None:
    def run(r: Routine, x: Reals, n: Integer) -> Real:
        def weighted_sum(r: Routine, x: Reals, flip: Boolean) -> Real:
            weights, indices = r.reals("weights", [2.0, 3.0]), r.integers("places", [1, 0])
            first = fma(weights[0], x[indices[0]], weights[1] * x[indices[1]])
            return select(flip, -first, first)

        def store(r: Routine, x: Reals, value: Real) -> None:
            x[0] = value

        function = r.program.define(weighted_sum, inlined=False)
        keep = r.program.define(store)
        assert r.program.define(weighted_sum) == r.program.define(weighted_sum)
        last = r.real(0.0)
        for i in r.range(0, n):
            r.call(keep, last.memory, r.call(function, x.after(i), i > 0))
        r.copy(x.after(1), x, 2)
        return last.value + r.call(function, x=x, flip=False)

    x = [1.0, 10.0, 100.0]
    assert both(run, x, 2, result=float) == -(2.0 * 100.0 + 3.0 * 10.0) + 2.0 * 100.0 + 3.0 * 10.0
    assert x == [10.0, 100.0, 100.0]


def test_external_functions_are_called_by_name() -> None:
    @external
    def derivative(r: Routine, t: Real, x: Reals) -> Real: ...

    def run(r: Routine, x: Reals) -> Real:
        return r.call(derivative, x[1], x) + 1.0

    program = Program()
    program.define(run)
    interpreter = Interpreter(program, derivative=lambda t, x: t * x[0][0])
    assert interpreter.call("run", ([3.0, 4.0], 0)) == 13.0
    assert "call double @derivative(double %v" in definitions(program)["run"]


def test_functions_have_several_results_and_rarely_taken_branches() -> None:
    def run(r: Routine, x: Real, n: Integer, out: Reals) -> Integer:
        def parts(r: Routine, x: Real, n: Integer) -> tuple[Real, Integer, Boolean]:
            with r.when(x < 0.0, rarely=True):
                r.return_(-x, n + 1, n > 3)
            return x * 2.0, n, x.ordered

        value, count, condition = r.call(r.program.define(parts, inlined=True), x, n)
        out[0] = value
        return select(condition, count, -1)

    for x, n, value, count in ((-1.5, 3, 1.5, -1), (-1.5, 4, 1.5, 5), (2.0, 7, 4.0, 7)):
        out = [0.0]
        assert both(run, x, n, out, result=int) == count
        assert out == [value]


def test_functions_with_many_arrays_divide_the_work_by_a_shared_counter() -> None:
    """Sum blocks of three elements until the shared counter in ``job`` reaches its end."""

    def run(r: Routine, job: Integers, out: Reals, x: Reals) -> Integer:
        def add(r: Routine, start: Integer, *arrays: Reals) -> None:
            out, inputs = arrays[0], arrays[1:]
            for i in r.range(start, start + 5, 2):
                for array in inputs:
                    out[0] = out[0] + array[i]

        summed = r.program.define(add, distinct=True, rest=("out", "a", "b"))
        with r.loop() as turn:
            start = job.fetch_add(0, 6)
            turn.leave_unless(start < job.acquire(1))
            r.call(summed, start, out, x, x.after(1))
        return job.fetch_add(1, -1)

    job, out, x = [0, 12], [0.0], [float(k * k) for k in range(13)]
    assert both(run, job, out, x, result=int) == 12
    assert (job, out) == ([18, 11], [sum(x[:12])])


def test_fields_of_structures_are_read_by_their_offsets() -> None:
    """The sum of a vector: its length is in the upper half of a word, its address in the word before."""

    def run(r: Routine, structure: Address, out: Integers) -> Real:
        room = r.local_integers(3)
        for k, value in enumerate((structure.int32(8), structure.int32(12), 7)):
            room[k] = value
        r.copy(room, out, 3)
        numbers = r.address(r.null)
        with r.when(numbers.value.is_null):
            numbers.value = structure.pointer(0)
        second = numbers.value.after(8)
        same_address = second == numbers.value.reals.after(1).start
        choice = select(same_address & (numbers.value <= second), numbers.value, r.null)
        out[3] = (same_address & (choice != second) & ~choice.is_null).count() + structure.integers.after(1)[
            0
        ]
        total = r.real(0.0)
        for i in r.range(0, room[1]):
            total.value = total.value + choice.reals[i]
        return total.value

    program = Program()
    program.define(run, public=True)
    text = "\n\n".join(definitions(program).values())
    code = load_code(("routines test", text), lambda: text)
    numbers, out = np.array([1.5, 2.0, 4.0]), np.zeros(4, np.int64)
    word = (2 << 32) + (1 << 32) - 5  # the lower half is -5
    structure = np.array([numbers.ctypes.data, word])
    native = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p)(code.address("run"))
    listed = [0] * 4
    vector = (numbers.tolist(), 0)
    assert native(structure.ctypes.data, out.ctypes.data) == 3.5
    assert Interpreter(program).call("run", ([vector, word], 0), (listed, 0)) == 3.5
    assert out.tolist() == listed == [-5, 2, 7, word + 1]


def test_functions_are_called_by_their_addresses() -> None:
    """Parameters and result of C's type ``int``, and a table of addresses that is filled after loading."""

    @external
    def scaled(r: Routine, x: Real, by: Int32) -> Int32: ...

    def run(r: Routine, x: Real, by: Integer) -> Integer:
        functions = r.filled_in("functions", 2)
        with r.when(functions[0].is_null):
            r.return_(r.constant_integer(-1))
        return r.call(scaled.at(functions.after(1)[0]), x, by.to_int32()).to_integer()

    program = Program()
    program.define(run, public=True)
    text = "\n\n".join(definitions(program).values())
    code = load_code(("routines test", text), lambda: text)
    native = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_double, ctypes.c_int64)(code.address("run"))
    assert native(2.5, -4) == -1
    function = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_double, ctypes.c_int32)(lambda x, by: int(x * by))
    address = ctypes.cast(function, ctypes.c_void_p).value
    (ctypes.c_void_p * 2).from_address(code.address("functions"))[:] = [address, address]
    assert native(2.5, (1 << 32) - 4) == -10


def test_null_addresses_are_passed_and_declarations_may_be_repeated() -> None:
    @external
    def take(r: Routine, x: Reals) -> None: ...

    def run(r: Routine, a: Real) -> Real:
        r.call(take, r.null_array)
        return abs(abs(a))

    program = Program()
    program.define(run)
    text = definitions(program)
    assert "call void @take(ptr null)" in text["run"]
    assert text["llvm.fabs.f64"] == "declare double @llvm.fabs.f64(double)"


def test_a_routine_value_as_a_python_condition_raises_an_error() -> None:
    def run(r: Routine, a: Real) -> Real:
        return -a if a > 0.0 else a

    with pytest.raises(TypeError, match="not known while the routine is written"):
        Program().define(run)


def test_otherwise_needs_a_when() -> None:
    def run(r: Routine, a: Real) -> None:
        with r.when(a > 0.0):
            pass
        r.real(1.0)
        with r.otherwise():
            pass

    with pytest.raises(SyntaxError, match="'otherwise' has no 'when' directly before it"):
        Program().define(run)


def test_a_python_break_in_a_routine_loop_raises_an_error() -> None:
    def run(r: Routine, n: Integer) -> None:
        for _ in r.range(0, n):
            break

    with pytest.raises(AssertionError, match="break"):
        Program().define(run)


@pytest.mark.parametrize("k", [2, 3, 5, 8])
def test_the_inverse_root_is_accurate_to_one_unit_in_the_last_place(k: int) -> None:
    def run(r: Routine, a: Real) -> Real:
        return inverse_root(a, k)

    program = Program()
    program.define(run, public=True)
    text = "\n\n".join(definitions(program).values())
    code = load_code(("inverse root test", text), lambda: text)
    root = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(code.address("run"))
    numbers = np.concatenate([np.logspace(-300, 300, 601), np.random.default_rng(1).uniform(0.5, 20.0, 400)])
    # In exact arithmetic, so that only the error of the root counts: one unit in its last place, k times.
    worst = max(abs(Fraction(a) * Fraction(root(a)) ** k - 1) for a in numbers.tolist())
    assert worst < 1.5 * k * 2.0**-52
    for a in numbers[::97].tolist():
        assert Interpreter(program).call("run", a) == root(a)

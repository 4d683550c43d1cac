"""Sine, cosine, tangent.

The argument is reduced to ``|r| <= pi/4`` by subtracting ``k pi/2`` in three parts with fused multiply-adds
(Cody and Waite). The first difference is exact, and the rounding error of the second is kept beside ``r``.
This is valid up to ``|x| = 2**31``. Larger angles are multiplied by the bits of ``2/pi`` that affect the
result (Payne and Hanek 1983), in one lane. A block of samples with such an angle is evaluated again with one
lane.
"""

from __future__ import annotations

from typing import NamedTuple

from armblocks.compiler.elementary.coefficients import (
    COSINE,
    HALF_PI,
    ROUNDER,
    SINE,
    TWO_OVER_PI,
    TWO_OVER_PI_WORDS,
)
from armblocks.compiler.ir_text import Body, Module
from armblocks.compiler.program_text import add_program
from armblocks.routines.routine import Program, Routine, external
from armblocks.routines.values import Boolean, Integer, Real

_MAX_MODERATE_ANGLE = 2.0**31
_SIGN_BIT = 1 << 63
_HUGE = "armblocks_reduce_huge_angle"
_REDUCTION = "armblocks_reduce_angle"
_PARTS = "{ double, double, i64 }"
"""Angle, rest and quarter of :class:`_Reduced`."""


class _Reduced(NamedTuple):
    """``|x| = quarter pi/2 + angle + rest``; only the two lowest bits of ``quarter`` matter."""

    angle: str
    rest: str
    quarter: str


def sine_cosine(body: Body, x: str) -> tuple[str, str]:
    """``sin x, cos x``."""
    reduced = _reduce(body, body.absolute(x))
    squared = body.multiply(reduced.angle, reduced.angle)
    high, low = _sine_parts(body, reduced, squared)
    one, rest = _cosine_parts(body, reduced, squared)
    plain_sine, plain_cosine = body.add(high, low), body.add(one, rest)
    odd = _is_odd(body, reduced.quarter)
    sine = _signed(body, body.select(odd, plain_cosine, plain_sine), _sine_sign(body, x, reduced.quarter))
    cosine = _signed(body, body.select(odd, plain_sine, plain_cosine), _cosine_sign(body, reduced.quarter))
    return sine, cosine


def sine(body: Body, x: str) -> str:
    """``sin x``."""
    return sine_cosine(body, x)[0]


def cosine(body: Body, x: str) -> str:
    """``cos x``."""
    return sine_cosine(body, x)[1]


def tangent(body: Body, x: str) -> str:
    """``tan x``: sine divided by cosine, both with the rounding error of their last addition."""
    reduced = _reduce(body, body.absolute(x))
    squared = body.multiply(reduced.angle, reduced.angle)
    sine, sine_rest = body.fast_two_sum(*_sine_parts(body, reduced, squared))
    cosine, cosine_rest = body.fast_two_sum(*_cosine_parts(body, reduced, squared))
    odd = _is_odd(body, reduced.quarter)
    numerator, numerator_rest = body.select(odd, cosine, sine), body.select(odd, cosine_rest, sine_rest)
    denominator, denominator_rest = body.select(odd, sine, cosine), body.select(odd, sine_rest, cosine_rest)
    quotient = body.divide(numerator, denominator)
    minus = body.negate(quotient)
    residual = body.fma(minus, denominator, numerator)
    residual = body.add(residual, body.fma(minus, denominator_rest, numerator_rest))
    result = body.add(quotient, body.divide(residual, denominator))
    flipped = body.word_op("shl", reduced.quarter, body.integer(63))
    return _signed(body, result, body.word_op("xor", flipped, _sign_of(body, x)))


def _reduce(body: Body, magnitude: str) -> _Reduced:
    rounded = body.fma(magnitude, body.number(TWO_OVER_PI), body.number(ROUNDER))
    count = body.subtract(rounded, body.number(ROUNDER))
    first = body.fma(count, body.number(-HALF_PI[0]), magnitude)
    angle = body.fma(count, body.number(-HALF_PI[1]), first)
    rest = body.fma(count, body.number(-HALF_PI[1]), body.subtract(first, angle))
    rest = body.fma(count, body.number(-HALF_PI[2]), rest)
    quarter = body.bits(rounded)
    huge = body.compare("ogt", magnitude, body.number(_MAX_MODERATE_ANGLE))
    if body.lanes > 1:
        body.mark_unsupported(huge)
        return _Reduced(angle, rest, quarter)

    _define_reduction(body.module)
    arguments = f"double {magnitude}, i1 {huge}, double {angle}, double {rest}, i64 {quarter}"
    parts = body.let(f"call {_PARTS} @{_REDUCTION}({arguments})")
    return _Reduced(*[body.let(f"extractvalue {_PARTS} {parts}, {k}") for k in range(3)])


def _define_reduction(module: Module) -> None:
    """Add a function that selects the reduction of moderate or of huge angles."""

    def reduction(
        r: Routine, magnitude: Real, huge: Boolean, angle: Real, rest: Real, quarter: Integer
    ) -> tuple[Real, Real, Integer]:
        with r.when(huge, rarely=True):
            r.return_(*r.call(external(_huge_reduction, _HUGE), magnitude))
        return angle, rest, quarter

    if _REDUCTION not in module:
        module.add(_HUGE, _huge_text(module))
        program = Program()
        program.define(reduction, _REDUCTION, inlined=True)
        add_program(module, program)


def _huge_reduction(r: Routine, magnitude: Real) -> tuple[Real, Real, Integer]:
    """The parts of a huge angle; :func:`_huge_text` writes the body."""
    raise NotImplementedError


def _sine_parts(body: Body, reduced: _Reduced, squared: str) -> tuple[str, str]:
    cubed = body.multiply(reduced.angle, squared)
    return reduced.angle, body.fma(cubed, body.polynomial(squared, SINE), reduced.rest)


def _cosine_parts(body: Body, reduced: _Reduced, squared: str) -> tuple[str, str]:
    factor = body.fma(squared, body.polynomial(squared, COSINE), body.number(-0.5))
    first_order = body.negate(body.multiply(reduced.angle, reduced.rest))
    return body.number(1.0), body.fma(squared, factor, first_order)


def _is_odd(body: Body, quarter: str) -> str:
    lowest = body.word_op("and", quarter, body.integer(1))
    return body.word_test("ne", lowest, body.integer(0))


def _sign_of(body: Body, x: str) -> str:
    return body.word_op("and", body.bits(x), body.integer(_SIGN_BIT))


def _sine_sign(body: Body, x: str, quarter: str) -> str:
    """Sine is odd, and negative in quarters 2 and 3."""
    shifted = body.word_op("shl", quarter, body.integer(62))
    return body.word_op("and", body.word_op("xor", shifted, body.bits(x)), body.integer(_SIGN_BIT))


def _cosine_sign(body: Body, quarter: str) -> str:
    """Cosine is negative in quarters 1 and 2: where the two bits differ."""
    next_one = body.word_op("add", quarter, body.integer(1))
    shifted = body.word_op("shl", next_one, body.integer(62))
    return body.word_op("and", shifted, body.integer(_SIGN_BIT))


def _signed(body: Body, value: str, sign: str) -> str:
    return body.from_bits(body.word_op("xor", body.bits(value), sign))


def _huge_text(module: Module) -> str:
    """Text of the reduction of ``|x| >= 2**31``, infinity and NaN included, for one lane.

    With ``|x| = mantissa 2**exponent``, those bits of 2/pi that contribute 4 or more to the product change
    the quarter by multiples of four and are omitted. The next 192 bits suffice: the error is below 2**-137,
    and no double is closer to a multiple of pi/2 than 2**-61 of a quarter.
    """
    module.add(
        "armblocks_two_over_pi",
        f"@armblocks_two_over_pi = internal constant [{len(TWO_OVER_PI_WORDS) + 1} x i64] ["
        + ", ".join(f"i64 {word}" for word in (0, *TWO_OVER_PI_WORDS))
        + "]",
    )
    body = Body(module)
    bits = body.bits("%x")
    fraction = body.word_op("and", bits, str((1 << 52) - 1))
    mantissa = body.word_op("or", fraction, str(1 << 52))
    biased = body.word_op("lshr", bits, "52")
    # A word of zeros precedes the table, because the window may begin above the binary point.
    begin = body.word_op("sub", biased, str(1075 + 2 - 64))
    word_index, shift = body.word_op("lshr", begin, "6"), body.word_op("and", begin, "63")
    words = [_table_word(body, word_index, k) for k in range(4)]
    back = body.word_op("sub", "63", shift)
    window = [
        body.word_op(
            "or",
            body.word_op("shl", words[k], shift),
            body.word_op("lshr", body.word_op("lshr", words[k + 1], "1"), back),
        )
        for k in range(3)
    ]
    high, middle, low = _low_192_bits(body, mantissa, window)
    # Two bits of quarter, then the fraction of a quarter; rounding to the nearest quarter makes it signed.
    # (Complementing all bits negates, with an error of one unit of 2**-128.)
    upper = body.word_op("or", body.word_op("shl", high, "2"), body.word_op("lshr", middle, "62"))
    lower = body.word_op("or", body.word_op("shl", middle, "2"), body.word_op("lshr", low, "62"))
    negative = body.word_op("ashr", upper, "63")
    quarter = body.word_op("sub", body.word_op("lshr", high, "62"), negative)
    upper, lower = body.word_op("xor", upper, negative), body.word_op("xor", lower, negative)
    fraction_of_quarter, rest = _sum_of_words(body, upper, lower)
    angle, error = body.two_product(fraction_of_quarter, body.number(HALF_PI[0]))
    error = body.fma(
        fraction_of_quarter, body.number(HALF_PI[1]), body.fma(rest, body.number(HALF_PI[0]), error)
    )
    angle, error = body.fast_two_sum(angle, error)
    sign = body.word_op("and", negative, str(-(1 << 63)))
    infinite = body.compare("oeq", "%x", body.number(float("inf")))
    angle = body.select(infinite, body.number(float("nan")), _signed(body, angle, sign))
    error = _signed(body, error, sign)
    value = body.let(f"insertvalue {_PARTS} poison, double {angle}, 0")
    value = body.let(f"insertvalue {_PARTS} {value}, double {error}, 1")
    value = body.let(f"insertvalue {_PARTS} {value}, i64 {quarter}, 2")
    body.do(f"ret {_PARTS} {value}")
    head = f"define internal {_PARTS} @{_HUGE}(double %x) noinline cold nounwind {{"
    return "\n".join([head, "entry:", *body.lines, "}"])


def _table_word(body: Body, word_index: str, offset: int) -> str:
    index = body.word_op("add", word_index, str(offset))
    address = body.let(f"getelementptr inbounds i64, ptr @armblocks_two_over_pi, i64 {index}")
    return body.let(f"load i64, ptr {address}, align 8")


def _low_192_bits(body: Body, factor: str, words: list[str]) -> tuple[str, str, str]:
    """``factor`` times the 192-bit number of three words (highest first), modulo 2**192."""
    wide = body.let(f"zext i64 {factor} to i128")
    products = [
        body.let(f"mul i128 {wide}, {body.let(f'zext i64 {word} to i128')}") for word in (words[1], words[2])
    ]
    carried = body.let(f"lshr i128 {products[1]}, 64")
    low = body.let(f"trunc i128 {products[1]} to i64")
    joined = body.let(f"add i128 {products[0]}, {carried}")
    middle = body.let(f"trunc i128 {joined} to i64")
    carry = body.let(f"trunc i128 {body.let(f'lshr i128 {joined}, 64')} to i64")
    high = body.word_op("add", body.word_op("mul", factor, words[0]), carry)
    return high, middle, low


def _sum_of_words(body: Body, upper: str, lower: str) -> tuple[str, str]:
    """``(upper 2**64 + lower) / 2**128`` as an unevaluated pair of doubles."""
    parts: list[str] = []
    for word, exponent in ((upper, -32), (lower, -96)):
        for part, scale in (
            (body.word_op("lshr", word, "32"), 2.0**exponent),
            (body.word_op("and", word, str((1 << 32) - 1)), 2.0 ** (exponent - 32)),
        ):
            number = body.let(f"uitofp i64 {part} to double")
            parts.append(body.multiply(number, body.number(scale)))
    total, error = body.fast_two_sum(parts[0], parts[1])
    total, second_error = body.two_sum(total, parts[2])
    return body.fast_two_sum(total, body.add(body.add(error, second_error), parts[3]))

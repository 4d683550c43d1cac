"""Remainders of division, exact.

For a quotient below 2**53, one fused multiply-add gives the exact remainder, or the remainder minus the
divisor. Larger quotients need long division with integers, in one lane.
"""

from __future__ import annotations

from armblocks.compiler.ir_text import Body, Module
from armblocks.compiler.program_text import add_program
from armblocks.routines.arithmetic import select
from armblocks.routines.routine import Program, Routine
from armblocks.routines.values import Boolean, Integer, Real

_INFINITY = float("inf")
_MIN_SUBNORMAL = 5e-324
_LARGE, _LONG_DIVISION = "armblocks_modulo_of_large", "armblocks_long_division"


def modulo(body: Body, x: str, y: str) -> str:
    """C's ``fmod``: the remainder of truncated division, sign of ``x``. NaN for y = 0 or infinite x."""
    return body.intrinsic("copysign", _modulo(body, body.absolute(x), body.absolute(y)), x)


def remainder(body: Body, x: str, y: str) -> str:
    """The IEEE 754 remainder x - n y; n is the integer nearest to x / y, even for a tie.

    NaN for y = 0 or infinite x.
    """
    a, b = body.absolute(x), body.absolute(y)
    rest = _modulo(body, a, body.add(b, b))  # if 2 b overflows, the result is a
    first_step = body.select(_exceeds_half(body, rest, b, "ogt"), body.subtract(rest, b), rest)
    second_step = body.select(
        _exceeds_half(body, first_step, b, "oge"), body.subtract(first_step, b), first_step
    )
    # If the first step was not taken, the second must not be: a tie goes to the even quotient 0.
    result = body.select(_exceeds_half(body, rest, b, "ogt"), second_step, rest)
    sign = body.word_op("and", body.bits(x), body.integer(1 << 63))
    return body.from_bits(body.word_op("xor", body.bits(result), sign))


def _exceeds_half(body: Body, value: str, b: str, predicate: str) -> str:
    """Whether ``value`` is above (or at) ``b / 2``; both sides are exact."""
    tiny = body.compare("olt", b, body.number(2.0**-1000))
    doubled = body.compare(predicate, body.add(value, value), b)
    halved = body.compare(predicate, value, body.multiply(b, body.number(0.5)))
    return body.let(f"select {body.bit} {tiny}, {body.bit} {doubled}, {body.bit} {halved}")


def _modulo(body: Body, a: str, b: str) -> str:
    """``a mod b`` of magnitudes."""
    zero, infinity = body.number(0.0), body.number(_INFINITY)
    quotient = body.divide(a, b)
    count = body.intrinsic("floor", quotient)
    rest = body.fma(body.negate(count), b, a)
    rest = body.select(body.compare("olt", rest, zero), body.add(rest, b), rest)
    rest = body.select(body.compare("olt", a, b), a, rest)
    valid = body.both(body.compare("olt", a, infinity), body.compare("ogt", b, zero))
    rest = body.select(valid, rest, body.number(float("nan")))
    large = body.both(valid, body.compare("oge", quotient, body.number(2.0**53)))
    if body.lanes > 1:
        body.mark_unsupported(large)
        return rest

    _define_large(body.module)
    return body.let(f"call double @{_LARGE}(double {rest}, i1 {large}, double {a}, double {b})")


def _define_large(module: Module) -> None:
    """Add a function that selects the remainder for a quotient below 2**53, or long division."""

    def modulo_of_large(r: Routine, rest: Real, large: Boolean, a: Real, b: Real) -> Real:
        with r.when(large, rarely=True):
            r.return_(r.call(r.program.define(long_division, _LONG_DIVISION, inlined=False), a, b))
        return rest

    if _LARGE not in module:
        program = Program()
        program.define(modulo_of_large, _LARGE, inlined=True)
        add_program(module, program)


def long_division(r: Routine, a: Real, b: Real) -> Real:
    """``a mod b`` for finite ``a >= b > 0``: integer mantissas, 11 bits of the quotient per iteration."""
    dividend, exponent = _mantissa_and_exponent(a)
    divisor, unit = _mantissa_and_exponent(b)
    rest = r.integer(dividend.unsigned_remainder(divisor))
    left = r.integer(exponent - unit)
    with r.loop() as iteration:
        remaining = left.value
        iteration.leave_unless(remaining > 0)
        step = select(remaining < 11, remaining, 11)
        rest.value = (rest.value << step).unsigned_remainder(divisor)
        left.value = remaining - step
    # rest 2**unit, exactly: a multiple of the smallest subnormal number, times a power of two in two halves
    power = unit - 1
    half = power >> 1
    return rest.value.to_real() * _MIN_SUBNORMAL * _power_of_two(half) * _power_of_two(power - half)


def _mantissa_and_exponent(x: Real) -> tuple[Integer, Integer]:
    """``x = mantissa 2**exponent``, up to a factor that is the same for all positive finite numbers."""
    bits = x.bits()
    fraction, biased = bits & ((1 << 52) - 1), bits >> 52
    subnormal = biased == 0
    return select(subnormal, fraction, fraction | (1 << 52)), select(subnormal, 1, biased)


def _power_of_two(exponent: Integer) -> Real:
    return ((exponent + 1023) << 52).from_bits()

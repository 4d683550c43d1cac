"""Remainders of division, exact.

For a quotient below 2**53 one fused multiply-add gives the remainder exactly, once more or less the divisor.
Larger quotients are divided by integers, in one lane.
"""

from __future__ import annotations

from armblocks.compiler.ir_text import Body, Module

_INFINITY = float("inf")
_LONG_DIVISION = "armblocks_long_division"


def modulo(body: Body, x: str, y: str) -> str:
    """C's ``fmod``: the remainder of truncated division, sign of ``x``. NaN for y = 0 or infinite x."""
    return body.intrinsic("copysign", _modulo(body, body.absolute(x), body.absolute(y)), x)


def remainder(body: Body, x: str, y: str) -> str:
    """IEEE 754 remainder: of division to the nearest integer, ties to even. NaN for y = 0 or infinite x."""
    a, b = body.absolute(x), body.absolute(y)
    rest = _modulo(body, a, body.add(b, b))  # a divisor that overflows leaves a as it is
    once = body.select(_exceeds_half(body, rest, b, "ogt"), body.subtract(rest, b), rest)
    twice = body.select(_exceeds_half(body, once, b, "oge"), body.subtract(once, b), once)
    # If the first step was not taken, the second must not be: a tie goes to the even quotient 0.
    result = body.select(_exceeds_half(body, rest, b, "ogt"), twice, rest)
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
        body.doubt(large)
        return rest

    def write() -> list[str]:
        body.module.define(_LONG_DIVISION, lambda: _write_long_division(body.module))
        return [body.let(f"call double @{_LONG_DIVISION}(double {a}, double {b})")]

    return body.rarely(large, [("double", rest)], write)[0]


def _write_long_division(module: Module) -> str:
    """Text of ``a mod b`` for finite ``a >= b > 0``: integer mantissas, 11 bits of quotient a turn."""
    body = Body(module)
    mantissas: list[str] = []
    exponents: list[str] = []
    for name in ("%a", "%b"):
        bits = body.bits(name)
        fraction = body.word_op("and", bits, str((1 << 52) - 1))
        biased = body.word_op("lshr", bits, "52")
        subnormal = body.word_test("eq", biased, "0")
        whole = body.word_op("or", fraction, str(1 << 52))
        mantissas.append(body.let(f"select i1 {subnormal}, i64 {fraction}, i64 {whole}"))
        exponents.append(body.let(f"select i1 {subnormal}, i64 1, i64 {biased}"))
    distance = body.word_op("sub", *exponents)
    first = body.word_op("urem", *mantissas)
    loop = f"""  br label %head
head:
  %rest = phi i64 [ {first}, %entry ], [ %next, %turn ]
  %left = phi i64 [ {distance}, %entry ], [ %less, %turn ]
  %more = icmp sgt i64 %left, 0
  br i1 %more, label %turn, label %done
turn:
  %short = icmp slt i64 %left, 11
  %step = select i1 %short, i64 %left, i64 11
  %moved = shl i64 %rest, %step
  %next = urem i64 %moved, {mantissas[1]}
  %less = sub i64 %left, %step
  br label %head
done:
  ; rest 2**(exponent of b), exact: units of the smallest number, times a power of two in two halves
  %number = uitofp i64 %rest to double
  %units = add i64 {exponents[1]}, -1
  %half = lshr i64 %units, 1
  %other = sub i64 %units, %half
  %halfbiased = add i64 %half, 1023
  %otherbiased = add i64 %other, 1023
  %halfbits = shl i64 %halfbiased, 52
  %otherbits = shl i64 %otherbiased, 52
  %halfpower = bitcast i64 %halfbits to double
  %otherpower = bitcast i64 %otherbits to double
  %small = fmul double %number, 0x0000000000000001
  %larger = fmul double %small, %halfpower
  %result = fmul double %larger, %otherpower
  ret double %result"""
    head = f"define internal double @{_LONG_DIVISION}(double %a, double %b) noinline cold nounwind {{"
    return "\n".join([head, "entry:", *body.lines, loop, "}"])

"""Elementary functions as IR, with identical operations for every number of lanes.

Each function is written once over a :class:`~armblocks.compiler.ir_text.Body` with additions,
multiplications, fused multiply-adds, divisions, square roots, comparisons and bit operations only, all of
which IEEE 754 defines to the bit. Results are therefore identical for every number of lanes and every
processor, and no C library is called. Errors stay below 2 units in the last place (mostly below 1) over the
whole range; the tests measure them. Signed zeros, infinities, NaN and subnormal numbers follow C99 (Annex F).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from armblocks.compiler.elementary import (
    exponential,
    inverse_trigonometric,
    logarithmic,
    quotient,
    special,
    trigonometric,
)
from armblocks.compiler.ir_text import Body
from armblocks.compiler.opcodes import Opcode

_FUNCTIONS: dict[Opcode, Callable[..., str]] = {
    Opcode.SIN: trigonometric.sine,
    Opcode.COS: trigonometric.cosine,
    Opcode.TAN: trigonometric.tangent,
    Opcode.ASIN: inverse_trigonometric.arc_sine,
    Opcode.ACOS: inverse_trigonometric.arc_cosine,
    Opcode.ATAN: inverse_trigonometric.arc_tangent,
    Opcode.ATAN2: inverse_trigonometric.arc_tangent_of_quotient,
    Opcode.SINH: exponential.hyperbolic_sine,
    Opcode.COSH: exponential.hyperbolic_cosine,
    Opcode.TANH: exponential.hyperbolic_tangent,
    Opcode.ASINH: logarithmic.inverse_hyperbolic_sine,
    Opcode.ACOSH: logarithmic.inverse_hyperbolic_cosine,
    Opcode.ATANH: logarithmic.inverse_hyperbolic_tangent,
    Opcode.EXP: exponential.exponential,
    Opcode.EXPM1: exponential.exponential_minus_one,
    Opcode.LOG: logarithmic.logarithm,
    Opcode.LOG1P: logarithmic.logarithm_of_one_plus,
    Opcode.POWER: special.power,
    Opcode.HYPOT: special.hypotenuse,
    Opcode.ERF: special.error_function,
    Opcode.MODULO: quotient.modulo,
    Opcode.REMAINDER: quotient.remainder,
}


def call(body: Body, opcode: Opcode, values: Sequence[str]) -> str:
    """Emit ``opcode`` of ``values``.

    Sine and cosine are emitted in place, other functions as a call that LLVM may inline.
    """
    if opcode in (Opcode.SIN, Opcode.COS):
        return _FUNCTIONS[opcode](body, *values)
    return _call(body, opcode, values)


def sine_cosine(body: Body, x: str) -> tuple[str, str]:
    """Sine and cosine of one argument, sharing the reduction."""
    return trigonometric.sine_cosine(body, x)


_WITH_RARE_CASES = frozenset({Opcode.TAN, Opcode.MODULO, Opcode.REMAINDER})
"""Functions that evaluate rare arguments (huge angles, huge quotients) with one lane only."""


def _call(body: Body, opcode: Opcode, values: Sequence[str]) -> str:
    symbol = f"armblocks_{opcode.name.lower()}_{body.lanes}"
    has_rare_cases = body.lanes > 1 and opcode in _WITH_RARE_CASES
    result = f"{{ {body.real}, {body.bit} }}" if has_rare_cases else body.real

    def define() -> str:
        inner = Body(body.module, body.lanes)
        parameters = [f"%x{k}" for k in range(len(values))]
        value = _FUNCTIONS[opcode](inner, *parameters)
        if inner.unsupported is not None:
            half = inner.let(f"insertvalue {result} poison, {body.real} {value}, 0")
            value = inner.let(f"insertvalue {result} {half}, {body.bit} {inner.unsupported}, 1")
        inner.do(f"ret {result} {value}")
        head = ", ".join(f"{body.real} {parameter}" for parameter in parameters)
        head = f"define internal {result} @{symbol}({head}) nounwind {{"
        return "\n".join([head, "entry:", *inner.lines, "}"])

    body.module.define(symbol, define)
    returned = body.let(f"call {result} @{symbol}({', '.join(f'{body.real} {value}' for value in values)})")
    if not has_rare_cases:
        return returned
    body.mark_unsupported(body.let(f"extractvalue {result} {returned}, 1"))
    return body.let(f"extractvalue {result} {returned}, 0")

"""Traced random numbers: L'Ecuyer's MRG32k3a in exact double arithmetic, and the normal quantile.

The generator combines two recurrences of order three (P. L'Ecuyer, Good parameters and implementations for
combined multiple recursive random number generators, Operations Research 47(1), 1999). All its products stay
below 2^53, so that doubles represent them exactly and every machine generates the same bits. The period is
2^191. It is divided into streams as in L'Ecuyer, Simard, Chen, Kelton, An object-oriented random-number
package, Operations Research 50(6), 2002: seed s begins at s 2^127, and the elements of a vector lie 2^76
draws apart, so that streams do not overlap.
"""

from __future__ import annotations

from collections.abc import Sequence

from casadi import SX, floor, if_else, log, reshape, sqrt, vertcat

from armblocks.diagram import Signals, State
from armblocks.equations import Shape

SEED_BITS = 16
"""Seeds are integers below 2 to the power of this number."""

_M1, _M2 = 4294967087.0, 4294944443.0
_A12, _A13N, _A21, _A23N = 1403580.0, 810728.0, 527612.0, 1370589.0
_START = 12345.0
"""Each initial term of both recurrences."""

_Matrix = tuple[tuple[int, ...], ...]
_NAMES = tuple(f"s{recurrence}{lag}" for recurrence in (1, 2) for lag in (3, 2, 1))


def stream_states(shape: Shape) -> tuple[State, ...]:
    """The six states of a generator for each element: the last three terms of both recurrences."""
    return tuple(State(name, shape, "a term of the generator's recurrence") for name in _NAMES)


def stream_start(seed: SX, shape: Shape) -> dict[str, SX]:
    """The initial states of the streams of a seed, one stream for each element of ``shape``."""
    count = shape[0] * (shape[1] if len(shape) > 1 else 1) if shape else 1
    terms: list[list[SX]] = []
    for matrix, modulus in ((_RECURRENCE_1, int(_M1)), (_RECURRENCE_2, int(_M2))):
        seed_jump = _squared(matrix, 127, modulus)
        state = [SX(_START)] * 3
        remaining = floor(seed)
        for _ in range(SEED_BITS):
            half = floor(remaining / 2.0)
            odd = remaining - 2.0 * half
            state = [
                if_else(odd, after, before)
                for after, before in zip(_product(seed_jump, state, modulus), state)
            ]
            remaining, seed_jump = half, _squared(seed_jump, 1, modulus)
        element_jump, elements = _squared(matrix, 76, modulus), [state]
        for _ in range(count - 1):
            elements.append(_product(element_jump, elements[-1], modulus))
        terms += [[element[k] for element in elements] for k in range(3)]
    return {name: _shaped(values, shape) for name, values in zip(_NAMES, terms)}


def draw(x: Signals) -> tuple[SX, dict[str, SX]]:
    """A number in the open interval (0, 1) for each element, and the next states."""
    s1 = _modulo(_A12 * x["s12"] - _A13N * x["s13"], _M1)
    s2 = _modulo(_A21 * x["s21"] - _A23N * x["s23"], _M2)
    difference = s1 - s2
    number = if_else(difference > 0.0, difference, difference + _M1) / (_M1 + 1.0)
    after = {"s13": x["s12"], "s12": x["s11"], "s11": s1, "s23": x["s22"], "s22": x["s21"], "s21": s2}
    return number, after


def normal_quantile(probability: SX) -> SX:
    """The quantile of the standard normal distribution for a probability in (0, 1); relative error 1e-16.

    M. J. Wichura, Algorithm AS 241: The percentage points of the normal distribution, Applied Statistics
    37(3), 1988 (PPND16).
    """
    q = probability - 0.5
    centre = 0.180625 - q * q
    tail = sqrt(-log(if_else(q < 0.0, probability, 1.0 - probability)))
    near, far = tail - 1.6, tail - 5.0
    outside = if_else(tail <= 5.0, _ratio(near, _NEAR), _ratio(far, _FAR))
    return if_else(centre >= 0.0, q * _ratio(centre, _CENTRE), if_else(q < 0.0, -outside, outside))


def _modulo(value: SX, modulus: float) -> SX:
    """The remainder of ``value / modulus``."""
    # Exact for |value| < 2^53: the quotient is below 2^21, where doubles are less than 1 / modulus apart.
    return value - modulus * floor(value / modulus)


def _product(matrix: _Matrix, vector: Sequence[SX], modulus: int) -> list[SX]:
    """The product of a matrix of 32-bit integers and a vector, modulo ``modulus``.

    Each entry is split into two parts, so that all sums are exact.
    """
    product = list[SX]()
    for row in matrix:
        high = sum((float(entry >> 17) * value for entry, value in zip(row, vector)), SX(0.0))
        low = sum((float(entry & 0x1FFFF) * value for entry, value in zip(row, vector)), SX(0.0))
        product.append(_modulo(131072.0 * _modulo(high, modulus) + low, modulus))
    return product


def _squared(matrix: _Matrix, times: int, modulus: int) -> _Matrix:
    """The power 2^times of the matrix, modulo ``modulus``."""
    for _ in range(times):
        columns = tuple(zip(*matrix))
        matrix = tuple(
            tuple(sum(a * b for a, b in zip(row, column)) % modulus for column in columns) for row in matrix
        )
    return matrix


def _shaped(values: Sequence[SX], shape: Shape) -> SX:
    """The values in row-major order as a symbolic matrix."""
    column = vertcat(*values)
    return reshape(column, shape[1], shape[0]).T if len(shape) > 1 else column


def _ratio(x: SX, coefficients: tuple[Sequence[float], Sequence[float]]) -> SX:
    """The ratio of two polynomials in x."""
    numerator, denominator = (SX(0.0), SX(0.0))
    for a, b in zip(*coefficients):
        numerator, denominator = numerator * x + a, denominator * x + b
    return numerator / denominator


# Transition matrices from the terms (n-3, n-2, n-1) to (n-2, n-1, n).
_RECURRENCE_1: _Matrix = ((0, 1, 0), (0, 0, 1), (int(_M1 - _A13N), int(_A12), 0))
_RECURRENCE_2: _Matrix = ((0, 1, 0), (0, 0, 1), (int(_M2 - _A23N), 0, int(_A21)))

# Numerators and denominators of AS 241, highest power first.
_CENTRE = (
    (
        2.5090809287301226727e3,
        3.3430575583588128105e4,
        6.7265770927008700853e4,
        4.5921953931549871457e4,
        1.3731693765509461125e4,
        1.9715909503065514427e3,
        1.3314166789178437745e2,
        3.3871328727963666080e0,
    ),
    (
        5.2264952788528545610e3,
        2.8729085735721942674e4,
        3.9307895800092710610e4,
        2.1213794301586595867e4,
        5.3941960214247511077e3,
        6.8718700749205790830e2,
        4.2313330701600911252e1,
        1.0,
    ),
)
_NEAR = (
    (
        7.74545014278341407640e-4,
        2.27238449892691845833e-2,
        2.41780725177450611770e-1,
        1.27045825245236838258e0,
        3.64784832476320460504e0,
        5.76949722146069140550e0,
        4.63033784615654529590e0,
        1.42343711074968357734e0,
    ),
    (
        1.05075007164441684324e-9,
        5.47593808499534494600e-4,
        1.51986665636164571966e-2,
        1.48103976427480074590e-1,
        6.89767334985100004550e-1,
        1.67638483018380384940e0,
        2.05319162663775882187e0,
        1.0,
    ),
)
_FAR = (
    (
        2.01033439929228813265e-7,
        2.71155556874348757815e-5,
        1.24266094738807843860e-3,
        2.65321895265761230930e-2,
        2.96560571828504891230e-1,
        1.78482653991729133580e0,
        5.46378491116411436990e0,
        6.65790464350110377720e0,
    ),
    (
        2.04426310338993978564e-15,
        1.42151175831644588870e-7,
        1.84631831751005468180e-5,
        7.86869131145613259100e-4,
        1.48753612908506148525e-2,
        1.36929880922735805310e-1,
        5.99832206555887937690e-1,
        1.0,
    ),
)

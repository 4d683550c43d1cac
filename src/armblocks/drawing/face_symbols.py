"""The sign on a block's face: a curve, a fraction, or a few characters as the field writes them.

``SIGNS`` is the one place: a block adds a line there, with what its parameters say if they matter. A block
without an entry shows its title.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from armblocks.diagram import Block
from armblocks.pictures.numbers import axis_number


@dataclass(frozen=True)
class Words:
    """One short line."""

    text: str
    italic: bool = False


@dataclass(frozen=True)
class Lines:
    """Several lines, each as it is."""

    texts: tuple[str, ...]


@dataclass(frozen=True)
class Title:
    """The name of a block, broken where words end."""

    text: str


@dataclass(frozen=True)
class Fraction:
    """One expression above another; ``limited`` between two stops."""

    above: str
    below: str
    limited: bool = False


@dataclass(frozen=True)
class Graph:
    """A curve over small axes: points from (0, 0), lower left, to (1, 1)."""

    points: tuple[tuple[float, float], ...]


_LONGEST_FORMULA = 16
"""Characters of a formula that a face shows in the place of its value."""
Sign: TypeAlias = Words | Lines | Title | Fraction | Graph


def sign_of(block: Block) -> Sign:
    """What a block shows, by its kind and its parameters."""
    entry = SIGNS.get(block.type_name())
    if entry is None:
        return Title(block.title)
    return entry(block) if callable(entry) else entry


# -- curves --------------------------------------------------------------------------------------------------


def _graph(*points: tuple[float, float]) -> Graph:
    return Graph(points)


def _s_curve() -> Graph:
    s = [k / 20 for k in range(21)]
    return _graph(*((u, 10 * u**3 - 15 * u**4 + 6 * u**5) for u in s))


def _swing(cycles: float, growth: float = 0.0) -> Graph:
    """A sine around the middle, whose frequency grows along the way."""
    points = [k / 64 for k in range(65)]
    return _graph(*((u, 0.5 + 0.5 * math.sin(2 * math.pi * cycles * u * (1 + growth * u))) for u in points))


def _stairs(levels: Sequence[float]) -> Graph:
    """A value that is held between jumps at equal distances."""
    share = 1 / len(levels)
    return _graph(*((u, level) for k, level in enumerate(levels) for u in (k * share, (k + 1) * share)))


def _pulses(widths: Sequence[float]) -> Graph:
    """Pulses at equal distances, each as wide as it says."""
    share = 1 / len(widths)
    corners = [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)]
    return _graph(
        *((share * (k + width * u), v) for k, width in enumerate(widths) for u, v in corners), (1.0, 0.0)
    )


_WAVES = {
    "sine": _swing(2.0),
    "square": _pulses((0.5, 0.5)),
    "sawtooth": _graph((0, 0.5), (0.25, 0), (0.25, 1), (0.75, 0), (0.75, 1), (1, 0.5)),
}
_BANDS = {
    "low_pass": _graph((0, 0.85), (0.4, 0.85), (0.55, 0.75), (1, 0)),
    "high_pass": _graph((0, 0), (0.45, 0.75), (0.6, 0.85), (1, 0.85)),
    "band_pass": _graph((0, 0), (0.32, 0.75), (0.42, 0.85), (0.58, 0.85), (0.68, 0.75), (1, 0)),
    "band_stop": _graph(
        (0, 0.85), (0.25, 0.85), (0.36, 0.75), (0.5, 0), (0.64, 0.75), (0.75, 0.85), (1, 0.85)
    ),
}
_NOISE = (0.5, 0.75, 0.3, 0.55, 0.05, 0.6, 1.0, 0.4, 0.65, 0.2, 0.45, 0.9, 0.35, 0.0, 0.6, 0.5)
_SATURATION = _graph((0, 0), (0.3, 0), (0.7, 1), (1, 1))
_DEAD_ZONE = _graph((0, 0), (0.33, 0.5), (0.67, 0.5), (1, 1))
_RATE_LIMIT = _graph((0, 0), (0.2, 0), (0.6, 1), (1, 1))
_TABLE = _graph((0, 0), (0.25, 0.75), (0.5, 0.6), (0.75, 0.95), (1, 1))


# -- what parameters say -------------------------------------------------------------------------------------


def value_text(value: object) -> str:
    """A scalar as it is, small vectors in brackets, larger things as their size."""
    array = np.asarray(value, dtype=np.float64)
    if array.size == 1:
        return axis_number(float(f"{float(array.reshape(-1)[0]):.4g}"))
    if array.ndim == 1 and array.size <= 4:
        return "[" + " ".join(axis_number(float(f"{float(v):.3g}")) for v in array) + "]"
    return "×".join(str(n) for n in array.shape) + (" vector" if array.ndim == 1 else "")


def stated_text(block: Block, name: str) -> str:
    """What somebody has written for a parameter: its formula where that is short, else its value."""
    text = dict(block.formulas).get(name, "")
    return text if 0 < len(text) <= _LONGEST_FORMULA else value_text(block.parameter_value(name))


def polynomial(name: str, coefficients: object, letter: str = "s", *, delays: bool = False) -> str:
    """``s² + 2s + 1``; the powers rise with ``delays``, to negative ones; ``b(s)`` where that is too long."""
    values = np.asarray(coefficients, dtype=np.float64).reshape(-1).tolist()
    highest = 0 if delays else len(values) - 1
    terms: list[str] = []
    for k, value in enumerate(values):
        if value == 0 and len(values) > 1:
            continue
        degree = highest - k
        symbol = "" if degree == 0 else letter + ("" if degree == 1 else _superscript(degree))
        magnitude = axis_number(abs(float(f"{value:.3g}")))
        text = symbol if symbol and magnitude == "1" else magnitude + symbol
        sign = "−" if value < 0 else "+"
        terms.append(text if not terms and value >= 0 else f"{sign} {text}" if terms else f"−{text}")
    text = " ".join(terms) or "0"
    return text if len(text) <= 20 else f"{name}({letter}{'⁻¹' * delays})"


def _superscript(number: int) -> str:
    return "".join("⁰¹²³⁴⁵⁶⁷⁸⁹⁻"["0123456789-".index(digit)] for digit in str(number))


def _roots(roots: object, letter: str) -> str:
    """``s (s + 1)``; ``1`` without any, ``Π(s − …)`` where there are more than two."""
    values = np.asarray(roots, dtype=np.complex128).reshape(-1).tolist()
    if len(values) > 2 or any(abs(value.imag) > 0 for value in values):
        return f"{len(values)} roots"
    factors = [
        letter if v == 0 else f"({polynomial('a', (1.0, -v.real), letter)})" for v in sorted(values, key=abs)
    ]
    return " ".join(factors) or "1"


def _times(gain: object, text: str) -> str:
    shown = value_text(gain)
    if shown == "1":
        return text
    return shown if text == "1" else f"{shown} {text}"


def _lag(time: object, letter: str = "s") -> str:
    return f"{'' if value_text(time) == '1' else value_text(time)}{letter} + 1"


def _ratio(zeros: object, poles: object, gain: object, letter: str) -> Fraction:
    return Fraction(_times(gain, _roots(zeros, letter)), _roots(poles, letter))


def _plus(value: object) -> str:
    text = value_text(value)
    return f"− {text[1:]}" if text.startswith("−") else f"+ {text}"


def _minus(value: object) -> str:
    return _plus(-np.asarray(value, dtype=np.float64))


_RELATIONS = {"==": "=", "~=": "≠", "<": "<", "<=": "≤", ">": ">", ">=": "≥"}
_FUNCTIONS = {
    "square": "u²",
    "cube": "u³",
    "reciprocal": "1/u",
    "sqrt": "√u",
    "cbrt": "∛u",
    "signedSqrt": "±√|u|",
    "rSqrt": "1/√u",
    "abs": "|u|",
    "negate": "−u",
    "exp": "exp u",
    "10^u": "10ᵘ",
    "log": "ln u",
    "log10": "log u",
}
_SUMS = {
    "forward_euler": ("T", "z − 1"),
    "backward_euler": ("T z", "z − 1"),
    "trapezoidal": ("T (z + 1)", "2 (z − 1)"),
}
_EDGES = {
    "change": "≠",
    "increase": "↑",
    "decrease": "↓",
    "rise positive": "↑ > 0",
    "rise nonnegative": "↑ ≥ 0",
    "fall negative": "↓ < 0",
    "fall nonpositive": "↓ ≤ 0",
}


def _function(block: Any) -> Words:
    return Words(_FUNCTIONS.get(block.function, f"{block.function}(u)"), italic=True)


def _integral(power: str, *, limited: bool = False) -> Fraction:
    return Fraction("1", power, limited)


SIGNS: dict[str, Sign | Callable[[Any], Sign]] = {
    # sources
    "BandLimitedWhiteNoise": _graph(*((k / 15, v) for k, v in enumerate(_NOISE))),
    "Chirp": _swing(1.2, 1.6),
    "Clock": Words("t"),
    "Constant": lambda block: Words(stated_text(block, "value")),
    "CounterFreeRunning": _stairs((0.0, 0.33, 0.67, 1.0, 0.0)),
    "CounterLimited": _stairs((0.0, 0.5, 1.0, 0.0, 0.5, 1.0)),
    "DigitalClock": _stairs((0.0, 0.25, 0.5, 0.75, 1.0)),
    "FromFile": _graph((0, 0.2), (0.3, 0.9), (0.6, 0.4), (1, 0.7)),
    "FromTable": _graph((0, 0.2), (0.3, 0.9), (0.6, 0.4), (1, 0.7)),
    "Ground": Words("0"),
    "Pulse": _graph((0, 0), (0.3, 0), (0.3, 1), (0.7, 1), (0.7, 0), (1, 0)),
    "PulseGenerator": _pulses((0.5, 0.5)),
    "Ramp": _graph((0, 0), (0.3, 0), (1, 1)),
    "RandomNumber": _stairs(_NOISE[:9]),
    "RepeatingSequence": _graph((0, 0), (0.5, 1), (0.5, 0), (1, 1), (1, 0)),
    "RepeatingSequenceInterpolated": _graph((0, 0), (0.2, 1), (0.5, 0.3), (0.5, 0), (0.7, 1), (1, 0.3)),
    "RepeatingSequenceStair": _stairs((0.2, 1.0, 0.6, 0.2, 1.0, 0.6)),
    "SignalGenerator": lambda block: _WAVES[block.waveform],
    "SineWave": _swing(1.0),
    "Step": _graph((0, 0), (0.45, 0), (0.45, 1), (1, 1)),
    "UniformRandomNumber": _stairs((0.9, 0.2, 0.6, 0.1, 1.0, 0.45, 0.75, 0.0)),
    # maths
    "Abs": Words("|u|"),
    "AlgebraicConstraint": Words("f(z) = 0"),
    "Atan2": Words("atan2"),
    "Bias": lambda block: Words(f"u {_plus(block.bias)}"),
    "CartesianToPolar": Words("xy→rθ"),
    "CumulativeSum": Words("Σ↓"),
    "DegreesToRadians": Words("° → rad"),
    "Divide": Words("÷"),
    "DotProduct": Words("u · v"),
    "Extremum": lambda block: Words(block.function, italic=True),
    "Hypot": Words("√(u²+v²)"),
    "MathFunction": _function,
    "MatrixGain": lambda block: Words("K·u" if np.size(block.gain) > 4 else value_text(block.gain)),
    "MatrixProduct": Words("A·B"),
    "MinMax": lambda block: Words(block.function, italic=True),
    "MinMaxRunningResettable": lambda block: Words(f"{block.function}(u, y)", italic=True),
    "Modulo": Words("mod"),
    "Norm": Words("‖u‖"),
    "PolarToCartesian": Words("rθ→xy"),
    "Polynomial": Words("P(u)"),
    "Power": Words("uᵛ"),
    "ProductOfElements": Words("Π"),
    "RadiansToDegrees": Words("rad → °"),
    "Rounding": _function,
    "Sign": _graph((0, 0), (0.5, 0), (0.5, 1), (1, 1)),
    "SineWaveFunction": _swing(1.0),
    "Sqrt": _function,
    "SumOfElements": Words("Σ"),
    "Trigonometry": _function,
    "UnaryMinus": Words("−u"),
    "WeightedSampleTime": lambda block: Words(f"u {block.operation} w T"),
    # continuous
    "AnalogFilter": lambda block: _BANDS[block.filter_type],
    "Derivative": Fraction("du", "dt"),
    "FirstOrderHold": _graph((0, 0.1), (0.33, 0.5), (0.33, 0.35), (0.67, 0.95), (0.67, 0.8), (1, 1)),
    "FirstOrderLag": lambda block: Fraction(value_text(block.gain), _lag(block.time_constant)),
    "Integrator": _integral("s"),
    "IntegratorLimited": _integral("s", limited=True),
    "LeadLag": lambda block: Fraction(_lag(block.lead_time), _lag(block.lag_time)),
    "PID": Words("PID(s)"),
    "PID2DOF": Lines(("PID(s)", "2DOF")),
    "ResettableIntegrator": _integral("s"),
    "SecondOrderIntegrator": _integral("s²"),
    "SecondOrderIntegratorLimited": _integral("s²", limited=True),
    "SecondOrderLag": Fraction("ω²", "s² + 2ζωs + ω²"),
    "StateSpace": Lines(("x' = A x + B u", "y = C x + D u")),
    "TransferFunction": lambda block: Fraction(
        polynomial("b", block.numerator), polynomial("a", block.denominator)
    ),
    "TransportDelay": Words("u(t − T)"),
    "VariableTimeDelay": Words("u(t − d)"),
    "VariableTransportDelay": Words("u(t − τ)"),
    "ZeroPole": lambda block: _ratio(block.zeros, block.poles, block.gain, "s"),
    # discrete
    "Delay": lambda block: Words(f"z{_superscript(-block.length)}"),
    "Difference": Words("1 − z⁻¹"),
    "DigitalFilter": lambda block: _BANDS[block.filter_type],
    "DiscreteDerivative": lambda block: Fraction(_times(block.gain, "(z − 1)"), "T z"),
    "DiscreteFilter": lambda block: Fraction(
        polynomial("b", block.numerator, "z", delays=True),
        polynomial("a", block.denominator, "z", delays=True),
    ),
    "DiscreteFir": lambda block: Words(polynomial("b", block.coefficients, "z", delays=True)),
    "DiscreteIntegrator": lambda block: Fraction(
        _times(block.gain, _SUMS[block.method][0]),
        _SUMS[block.method][1],
        bool(np.any(np.isfinite(block.lower)) or np.any(np.isfinite(block.upper))),
    ),
    "DiscretePID": Words("PID(z)"),
    "DiscretePID2DOF": Lines(("PID(z)", "2DOF")),
    "DiscreteStateSpace": Lines(("x⁺ = A x + B u", "y = C x + D u")),
    "DiscreteTransferFunction": lambda block: Fraction(
        polynomial("b", block.numerator, "z"), polynomial("a", block.denominator, "z")
    ),
    "DiscreteZeroPole": lambda block: _ratio(block.zeros, block.poles, block.gain, "z"),
    "TransferFunctionFirstOrder": lambda block: Fraction(
        f"{value_text(1.0 - np.asarray(block.pole, dtype=np.float64))} z", f"z {_minus(block.pole)}"
    ),
    "TransferFunctionLeadOrLag": lambda block: Fraction(f"z {_minus(block.zero)}", f"z {_minus(block.pole)}"),
    "TransferFunctionRealZero": lambda block: Fraction(f"z {_minus(block.zero)}", "z"),
    "UnitDelay": Words("z⁻¹"),
    "VariableIntegerDelay": Words("z⁻ᵈ"),
    "ZeroOrderHold": _stairs((0.2, 0.7, 1.0, 0.6)),
    # discontinuities
    "Backlash": _graph((0, 0), (0.55, 1), (1, 1), (0.45, 0), (0, 0)),
    "CoulombFriction": _graph((0, 0), (0.5, 0.3), (0.5, 0.7), (1, 1)),
    "DeadZone": _DEAD_ZONE,
    "DeadZoneDynamic": _DEAD_ZONE,
    "PWM": _pulses((0.2, 0.5, 0.8)),
    "Quantizer": _stairs((0.0, 0.33, 0.67, 1.0)),
    "RateLimiter": _RATE_LIMIT,
    "RateLimiterContinuous": _RATE_LIMIT,
    "Relay": _graph((0, 0), (0.7, 0), (0.7, 1), (1, 1), (0.3, 1), (0.3, 0)),
    "Saturation": _SATURATION,
    "SaturationDynamic": _SATURATION,
    "StickSlipFriction": _graph((0, 0.12), (0.4, 0.22), (0.5, 0), (0.5, 1), (0.6, 0.78), (1, 0.88)),
    "WrapToZero": _graph((0, 0), (0.6, 1), (0.6, 0), (1, 0)),
    # logic and lookup
    "CompareToConstant": lambda block: Words(f"{_RELATIONS[block.relation]} {value_text(block.constant)}"),
    "CompareToZero": lambda block: Words(f"{_RELATIONS[block.relation]} 0"),
    "EdgeDetection": lambda block: Words(_EDGES[block.edge]),
    "DFlipFlop": Lines(("D", "Flip-Flop")),
    "Expression": lambda block: Words(block.formula, italic=True),
    "IntervalTest": _graph((0, 0), (0.3, 0), (0.3, 1), (0.7, 1), (0.7, 0), (1, 0)),
    "IntervalTestDynamic": _graph((0, 0), (0.3, 0), (0.3, 1), (0.7, 1), (0.7, 0), (1, 0)),
    "JKFlipFlop": Lines(("J-K", "Flip-Flop")),
    "LogicalOperator": lambda block: Words(block.operator),
    "LookupTable1D": _TABLE,
    "LookupTable2D": Words("T(u₁, u₂)"),
    "LookupTableDynamic": _TABLE,
    "PythonFunction": lambda block: Lines(("Python", f"{block.function.name}()")),
    "RelationalOperator": lambda block: Words(_RELATIONS[block.relation]),
    "SRFlipFlop": Lines(("S-R", "Flip-Flop")),
    # matrices
    "CrossProduct": Words("u × v"),
    "Determinant": Words("det"),
    "DiagonalMatrix": Words("diag"),
    "ExtractDiagonal": Words("diag(A)"),
    "LinearSolve": Words("A⁻¹ B"),
    "MatrixConcatenate": Words("[A B]"),
    "MatrixInverse": Words("A⁻¹"),
    "MatrixPower": Words("Aⁿ"),
    "Trace": Words("tr"),
    "Transpose": Words("Aᵀ"),
    # poses
    "AngleAxis2T": Words("θ, a→T"),
    "Eul2T": Words("eul→T"),
    "PoseInverse": Words("T⁻¹"),
    "PoseProduct": Words("T₁ T₂"),
    "Quaternion2T": Words("q→T"),
    "QuaternionInverse": Words("q⁻¹"),
    "QuaternionNormalize": Words("q / |q|"),
    "QuaternionProduct": Words("u v"),
    "QuaternionRate": Words("½ q ω"),
    "Rp2T": Words("R, p→T"),
    "Rpy2T": Words("rpy→T"),
    "T2AngleAxis": Words("T→θ, a"),
    "T2Quaternion": Words("T→q"),
    "T2Rp": Words("T→R, p"),
    "T2eul": Words("T→eul"),
    "T2rpy": Words("T→rpy"),
    "T2xyz": Words("T→xyz"),
    "TransformPoint": Words("T p"),
    "Xyz2T": Words("xyz→T"),
    # robots
    "Coriolis": Words("C(q, qd)"),
    "Gravload": Words("g(q)"),
    "Inertia": Words("M(q)"),
    "JTraj": _s_curve(),
    "Jacob0": Words("J(q)"),
    "Jacobe": Words("Jₑ(q)"),
    "JacobianInverse": Words("J⁻¹"),
    "Manipulability": Words("√|J Jᵀ|"),
    "MultiSegment": _graph((0, 0), (0.35, 0.9), (0.45, 0.95), (0.55, 0.9), (1, 0.3)),
    "Rne": Words("rne"),
    "RobotEnergy": Words("E(q, qd)"),
    "Trapezoidal": _graph((0, 0), (0.25, 0.12), (0.75, 0.88), (1, 1)),
    # sinks
    "Spectrum": _graph(
        (0, 0), (0.22, 0.1), (0.28, 1), (0.34, 0.1), (0.6, 0.06), (0.66, 0.5), (0.72, 0.06), (1, 0)
    ),
    "Terminator": Words("⊣"),
    "ToFile": lambda block: Words(block.file.rpartition("/")[2]),
    "ToWorkspace": lambda block: Words(block.variable),
}

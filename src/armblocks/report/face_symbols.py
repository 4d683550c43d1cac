"""The short sign of a block on its face: a curve, or a few characters as the field writes them.

A block without an entry shows its title.
"""

from __future__ import annotations

import math

_Curve = list[tuple[float, float]]


def _s_curve() -> _Curve:
    s = [k / 20 for k in range(21)]
    return [(u, 10 * u**3 - 15 * u**4 + 6 * u**5) for u in s]


def _swing(cycles: float, growth: float = 0.0) -> _Curve:
    """A sine around the middle, whose frequency grows along the way."""
    points = [k / 64 for k in range(65)]
    return [(u, 0.5 + 0.5 * math.sin(2 * math.pi * cycles * u * (1 + growth * u))) for u in points]


def _stairs(steps: int) -> _Curve:
    return [(k / steps, level / steps) for k in range(steps + 1) for level in ((k - 1, k) if k else (0,))]


CURVES: dict[str, _Curve] = {
    "Backlash": [(0, 0.15), (0.25, 0.15), (0.8, 1), (1, 1), (0.75, 1), (0.2, 0.15)],
    "Chirp": _swing(1.2, 1.6),
    "CoulombFriction": [(0, 0), (0.5, 0.3), (0.5, 0.7), (1, 1)],
    "CounterLimited": [*_stairs(3), (1, 0)],
    "DeadZone": [(0, 0), (0.33, 0.5), (0.67, 0.5), (1, 1)],
    "DigitalClock": _stairs(4),
    "FromTable": [(0, 0.2), (0.3, 0.9), (0.6, 0.4), (1, 0.7)],
    "JTraj": _s_curve(),
    "LookupTable1D": [(0, 0), (0.25, 0.75), (0.5, 0.6), (0.75, 0.95), (1, 1)],
    "LookupTableDynamic": [(0, 0), (0.25, 0.75), (0.5, 0.6), (0.75, 0.95), (1, 1)],
    "Pulse": [(0, 0), (0.3, 0), (0.3, 1), (0.7, 1), (0.7, 0), (1, 0)],
    "PulseGenerator": [
        (0, 0),
        (0, 1),
        (0.25, 1),
        (0.25, 0),
        (0.5, 0),
        (0.5, 1),
        (0.75, 1),
        (0.75, 0),
        (1, 0),
    ],
    "Quantizer": _stairs(4),
    "Ramp": [(0, 0), (0.3, 0), (1, 1)],
    "RateLimiter": [(0, 0), (0.2, 0), (0.6, 1), (1, 1)],
    "Relay": [(0, 0), (0.7, 0), (0.7, 1), (1, 1), (0.3, 1), (0.3, 0)],
    "Saturation": [(0, 0), (0.3, 0), (0.7, 1), (1, 1)],
    "Sign": [(0, 0), (0.5, 0), (0.5, 1), (1, 1)],
    "SineWave": _swing(1.0),
    "Spectrum": [(0, 0), (0.22, 0.1), (0.28, 1), (0.34, 0.1), (0.6, 0.06), (0.66, 0.5), (0.72, 0.06), (1, 0)],
    "Step": [(0, 0), (0.45, 0), (0.45, 1), (1, 1)],
    "Trapezoidal": [(0, 0), (0.25, 0.12), (0.75, 0.88), (1, 1)],
    "MultiSegment": [(0, 0), (0.35, 0.9), (0.45, 0.95), (0.55, 0.9), (1, 0.3)],
    "ZeroOrderHold": [
        (0, 0.2),
        (0.25, 0.2),
        (0.25, 0.7),
        (0.5, 0.7),
        (0.5, 1),
        (0.75, 1),
        (0.75, 0.6),
        (1, 0.6),
    ],
}
TEXTS: dict[str, str] = {
    "Abs": "|u|",
    "AngleAxis2T": "θ, a→T",
    "Atan2": "atan2",
    "CartesianToPolar": "xy→rθ",
    "Clock": "t",
    "CompareToZero": "≤ 0",
    "Coriolis": "C(q, qd)",
    "CrossProduct": "u × v",
    "CumulativeSum": "Σ↓",
    "DegreesToRadians": "° → rad",
    "Determinant": "det",
    "DiagonalMatrix": "diag",
    "Difference": "1 − z⁻¹",
    "DiscreteStateSpace": "x⁺ = A x + B u",
    "Divide": "÷",
    "DotProduct": "u · v",
    "Eul2T": "eul→T",
    "ExtractDiagonal": "diag(A)",
    "Extremum": "max A",
    "Gravload": "g(q)",
    "Ground": "0",
    "Hypot": "√(u²+v²)",
    "Inertia": "M(q)",
    "Jacob0": "J(q)",
    "Jacobe": "Jₑ(q)",
    "JacobianInverse": "J⁻¹",
    "LinearSolve": "A⁻¹ B",
    "LookupTable2D": "T(u1, u2)",
    "MatrixConcatenate": "[A B]",
    "MatrixInverse": "A⁻¹",
    "MatrixPower": "Aⁿ",
    "Modulo": "mod",
    "Norm": "‖u‖",
    "Polynomial": "P(u)",
    "PolarToCartesian": "rθ→xy",
    "PoseInverse": "T⁻¹",
    "PoseProduct": "T₁ T₂",
    "Power": "uᵛ",
    "ProductOfElements": "Π",
    "Quaternion2T": "q→T",
    "QuaternionInverse": "q⁻¹",
    "QuaternionNormalize": "q / |q|",
    "QuaternionProduct": "u v",
    "QuaternionRate": "½ q ω",
    "RadiansToDegrees": "rad → °",
    "Rne": "rne",
    "RobotEnergy": "E(q, qd)",
    "Rp2T": "R, p→T",
    "Rpy2T": "rpy→T",
    "SumOfElements": "Σ",
    "T2AngleAxis": "T→θ, a",
    "T2Quaternion": "T→q",
    "T2Rp": "T→R, p",
    "T2eul": "T→eul",
    "T2rpy": "T→rpy",
    "T2xyz": "T→xyz",
    "Terminator": "⊣",
    "Trace": "tr",
    "TransformPoint": "T p",
    "Transpose": "Aᵀ",
    "UnaryMinus": "−u",
    "UnitDelay": "z⁻¹",
    "Xyz2T": "xyz→T",
}

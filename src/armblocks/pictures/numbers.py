"""Formatting of numbers for display: ticks, steps, SI prefixes, typographic minus."""

from __future__ import annotations

import math

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
MINUS = "\u2212"
_PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T"}


def nice_step(rough: float) -> float:
    """The smallest step of 1, 2 or 5 times a power of ten that is not below ``rough``."""
    if not (rough > 0 and math.isfinite(rough)):
        return 1.0
    power = 10.0 ** math.floor(math.log10(rough))
    for factor in (1.0, 2.0, 5.0):
        if factor * power >= rough * (1 - 1e-9):
            return factor * power
    return 10.0 * power


def nice_ticks(low: float, high: float, count: int, *, degrees: bool = False) -> list[float]:
    """Round values within ``low`` .. ``high`` in about ``count`` steps; large angles in fractions of a
    turn."""
    rough = (high - low) / max(count, 1)
    below = nice_step(rough / 2.5)
    steps = [nice_step(below * factor) for factor in (1.0, 1.5, 3.0, 6.0)]
    if degrees and high - low > 60:
        steps = [15.0, 30.0, 45.0, 90.0, 180.0, 360.0, *(s for s in steps if s > 360)]
    step = min(steps, key=lambda s: abs(math.log(s / rough)))
    first = math.ceil(low / step - 1e-9)
    last = math.floor(high / step + 1e-9)
    return [k * step + 0.0 for k in range(first, last + 1)]


def log_ticks(low: float, high: float) -> tuple[list[float], list[float]]:
    """Positions on a logarithmic axis: those with a number (powers of ten; on a short axis also 2 and 5
    times), and finer ones without a number."""
    first, last = math.floor(math.log10(low) + 1e-9), math.ceil(math.log10(high) - 1e-9)
    inside = [
        factor * 10.0**power
        for power in range(first, last + 1)
        for factor in range(1, 10)
        if low * (1 - 1e-9) <= factor * 10.0**power <= high * (1 + 1e-9)
    ]
    decades = math.log10(high / low)
    step = max(1, math.ceil(decades / 9.0))
    named = (1, 2, 5) if decades < 2.0 else (1,)

    def is_named(value: float) -> bool:
        power = math.floor(math.log10(value) + 1e-9)
        return round(value / 10.0**power) in named and power % step == 0

    labels = [value for value in inside if is_named(value)]
    finer = [value for value in inside if value not in labels] if decades < 7.0 else []
    return labels, finer


def power_of_ten(value: float) -> str:
    """``0.01``, ``100``; numbers with many digits, such as ``1e5``, with a raised exponent."""
    power = math.log10(value)
    if abs(power - round(power)) < 1e-9 and not -3 <= round(power) <= 4:
        return "10" + str(round(power)).translate(_RAISED)
    return axis_number(value)


def axis_number(value: float, digits: int = 6) -> str:
    """A tick label: up to ``digits`` significant digits, no trailing zeros, thin groups for long numbers."""
    if not math.isfinite(value):
        return "not a number" if math.isnan(value) else ("∞" if value > 0 else MINUS + "∞")
    text = f"{value + 0.0:.{digits}g}"  # removes the sign of -0.0
    if "e" in text:
        mantissa, exponent = text.split("e")
        return f"{mantissa}e{int(exponent)}".replace("-", MINUS)
    whole, _, fraction = text.partition(".")
    left = whole.lstrip("-")
    if len(left) > 4:
        groups: list[str] = []
        while left:
            groups.insert(0, left[-3:])
            left = left[:-3]
        whole = ("-" if value < 0 else "") + "\u202f".join(groups)
    return (whole + ("." + fraction if fraction else "")).replace("-", MINUS)


def table_number(value: float, digits: int = 4) -> str:
    """A number for a table: ``digits`` significant digits without trailing zeros, zero as 0."""
    if value == 0 or not math.isfinite(value):
        return axis_number(value)
    return axis_number(value, digits)


def si_prefix(largest: float) -> tuple[float, str]:
    """Factor and SI prefix with which ``largest`` is between 1 and 1000: ``(1e-3, "k")`` for 5000."""
    if not (largest > 0 and math.isfinite(largest)):
        return 1.0, ""
    power = 3 * math.floor(math.log10(largest * (1 + 1e-12)) / 3)
    power = min(max(power, -12), 12)
    return 10.0**-power, _PREFIXES[power]


def wall_time(seconds: float) -> tuple[str, str]:
    """A duration with three digits, and its unit: s, or ms, µs … below one second."""
    factor, prefix = si_prefix(seconds) if 0 < seconds < 1 else (1.0, "")
    return axis_number(float(f"{seconds * factor:.3g}")), f"{prefix}s"

"""Formatting of numbers for display: ticks, steps, SI prefixes, typographic minus."""

from __future__ import annotations

import math
from collections.abc import Sequence

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
MINUS = "\u2212"
_PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T"}


def nice_step(target: float) -> float:
    """The smallest step of 1, 2 or 5 times a power of ten that is not below ``target``."""
    if not (target > 0 and math.isfinite(target)):
        return 1.0
    power = 10.0 ** math.floor(math.log10(target))
    for factor in (1.0, 2.0, 5.0):
        if factor * power >= target * (1 - 1e-9):
            return factor * power
    return 10.0 * power


def nice_ticks(low: float, high: float, count: int, *, degrees: bool = False) -> list[float]:
    """Round values within ``low`` .. ``high`` in about ``count`` steps; large ranges of
    degrees in fractions of a revolution."""
    half_range = 0.5 * high - 0.5 * low  # finite for all finite ends
    target = half_range / (0.5 * max(count, 1))
    below = nice_step(target / 2.5)
    steps = [nice_step(below * factor) for factor in (1.0, 1.5, 3.0, 6.0)]
    if degrees and half_range > 30.0:
        steps = [15.0, 30.0, 45.0, 90.0, 180.0, 360.0, *(s for s in steps if s > 360)]
    step = min(steps, key=lambda s: abs(math.log(s / target)))
    first = math.ceil(low / step - 1e-9)
    last = math.floor(high / step + 1e-9)
    return [k * step + 0.0 for k in range(first, last + 1) if math.isfinite(k * step)]


def log_ticks(low: float, high: float) -> tuple[list[float], list[float]]:
    """Major and minor ticks of a logarithmic axis. Major ticks have a number: powers of ten, on a short axis
    also 2 and 5 times these.
    """
    first, last = math.floor(math.log10(low) + 1e-9), math.ceil(math.log10(high) - 1e-9)
    inside = [
        factor * 10.0**power
        for power in range(first, last + 1)
        for factor in range(1, 10)
        if low * (1 - 1e-9) <= factor * 10.0**power <= high * (1 + 1e-9)
    ]
    decades = math.log10(high / low)
    step = max(1, math.ceil(decades / 9.0))
    labelled = (1, 2, 5) if decades < 2.0 else (1,)

    def is_named(value: float) -> bool:
        power = math.floor(math.log10(value) + 1e-9)
        return round(value / 10.0**power) in labelled and power % step == 0

    labels = [value for value in inside if is_named(value)]
    minor = [value for value in inside if value not in labels] if decades < 7.0 else []
    return labels, minor


def power_of_ten(value: float) -> str:
    """A tick label: ``0.01``, ``100``; for ``1e5`` and other long numbers 10 with a superscript exponent."""
    power = math.log10(value)
    if abs(power - round(power)) < 1e-9 and not -3 <= round(power) <= 4:
        return "10" + str(round(power)).translate(_SUPERSCRIPTS)
    return axis_number(value)


def axis_number(value: float, digits: int = 6) -> str:
    """A tick label: up to ``digits`` significant digits, no trailing zeros, digits in groups of three."""
    if not math.isfinite(value):
        return "not a number" if math.isnan(value) else ("∞" if value > 0 else MINUS + "∞")
    text = f"{value + 0.0:.{digits}g}"  # removes the sign of -0.0
    if "e" in text:
        mantissa, exponent = text.split("e")
        return f"{mantissa}e{int(exponent)}".replace("-", MINUS)
    integer_part, _, fraction = text.partition(".")
    left = integer_part.lstrip("-")
    if len(left) > 4:
        groups: list[str] = []
        while left:
            groups.insert(0, left[-3:])
            left = left[:-3]
        integer_part = ("-" if value < 0 else "") + "\u202f".join(groups)
    return (integer_part + ("." + fraction if fraction else "")).replace("-", MINUS)


def axis_numbers(values: Sequence[float]) -> list[str]:
    """The labels of all ticks of one axis, with as many digits as distinguish them, and at least six."""
    digits = next(
        n for n in range(6, 18) if n == 17 or len({axis_number(v, n) for v in values}) == len(values)
    )
    return [axis_number(value, digits) for value in values]


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

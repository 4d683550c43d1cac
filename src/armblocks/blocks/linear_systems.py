"""Linear systems from zeros and poles, and filters that are defined by their zeros and poles.

A system is realised as a cascade of sections with one or two poles each. The polynomials are not multiplied
out, because the poles of high-order polynomials are ill-conditioned. Every section is scaled so that its
states have about the magnitude of the input.

A. V. Oppenheim, R. W. Schafer, Discrete-Time Signal Processing, 3rd edition, 2010, section 6.3 (cascades),
7.2 and appendix B (filters, bilinear transformation).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.blocks.complex_arithmetic import magnitude, product, quotient, square_root
from armblocks.errors import InputError, counted
from armblocks.rounded_functions import asinh, cos, cosh, power, sin, sinh, tan

Matrix = NDArray[np.float64]
Roots = NDArray[np.complex128]


@dataclass(frozen=True, kw_only=True)
class ZeroPoleGain:
    """The transfer function gain (s - zero1) (s - zero2) … / ((s - pole1) …), with real coefficients."""

    zeros: Roots
    poles: Roots
    gain: float


@dataclass(frozen=True, kw_only=True)
class LinearSystem:
    """A linear system with one input and output: x' (or the next x) = A x + B u, y = C x + D u."""

    A: Matrix
    B: Matrix
    C: Matrix
    D: float


def complex_roots(rows: ArrayLike, where: str, name: str) -> Roots:
    """The complex zeros or poles (n,) from (n,) real numbers or (n, 2) rows (real, imaginary).

    Raises ``InputError`` if a complex root lacks its conjugate.
    """
    values = np.asarray(rows, dtype=np.float64)
    if values.ndim == 2 and values.shape[1] != 2:
        raise InputError(
            f"{name} has shape {values.shape}",
            where=where,
            allowed="(n,), or (n, 2): real, imaginary",
            fix="give a row of two numbers for each complex root",
        )
    roots = values.astype(np.complex128) if values.ndim == 1 else values[:, 0] + 1j * values[:, 1]
    upper, lower = roots[roots.imag > 0.0], roots[roots.imag < 0.0]
    if sorted(upper, key=_sort_key) != sorted(np.conj(lower), key=_sort_key):
        raise InputError(
            f"{name} are {roots.tolist()}",
            where=where,
            allowed="complex numbers in conjugate pairs",
            fix="add the missing conjugates",
        )
    return roots


def check_proper(zeros: Roots, poles: Roots, where: str) -> None:
    """Raise ``InputError`` for a system without poles, or with more zeros than poles."""
    if len(poles) == 0 or len(zeros) > len(poles):
        raise InputError(
            f"the system has {counted(len(zeros), 'zero')} and {counted(len(poles), 'pole')}",
            where=where,
            allowed="at least one pole, and no more zeros than poles",
            fix="use a Gain where there is no pole; a system with more zeros than poles is not causal",
        )


def realised(system: ZeroPoleGain) -> LinearSystem:
    """The system as a cascade of sections."""
    total = LinearSystem(A=np.zeros((0, 0)), B=np.zeros(0), C=np.zeros(0), D=1.0)
    scale = system.gain
    for zeros, poles in _sections(system.zeros, system.poles):
        section, factor = _section(zeros, poles)
        total, scale = _in_series(total, section), scale / factor
    return LinearSystem(A=total.A, B=total.B, C=scale * total.C, D=scale * total.D)


def _sort_key(root: complex) -> tuple[float, float]:
    """The sorting key of a root."""
    return (root.real, root.imag)


def _sections(zeros: Roots, poles: Roots) -> list[tuple[list[complex], list[complex]]]:
    """The zeros and poles of each section: one or two poles, and at most as many zeros."""
    pole_groups = _groups(poles)
    zero_groups = _groups(zeros)
    pairs = [group for group in zero_groups if len(group) == 2]
    # A pair of zeros needs a section with two poles. Real poles are paired while conjugate pairs are missing.
    while sum(len(group) == 2 for group in pole_groups) < len(pairs):
        first, second = [group for group in pole_groups if len(group) == 1][:2]
        pole_groups = [group for group in pole_groups if group is not first and group is not second]
        pole_groups.append(first + second)
    sections: list[tuple[list[complex], list[complex]]] = [([], group) for group in pole_groups]
    for group in sorted(zero_groups, key=len, reverse=True):
        free = [section for section in sections if len(section[0]) + len(group) <= len(section[1])]
        nearest = min(free, key=lambda section: magnitude(section[1][0] - group[0]))
        nearest[0].extend(group)
    return sections


def _groups(roots: Roots) -> list[list[complex]]:
    """The conjugate pairs, then the real roots, in a defined order."""
    real = [[complex(root)] for root in sorted(roots[roots.imag == 0.0], key=_sort_key)]
    upper = sorted(roots[roots.imag > 0.0], key=_sort_key)
    return [[complex(root), complex(root).conjugate()] for root in upper] + real


def _section(zeros: Sequence[complex], poles: Sequence[complex]) -> tuple[LinearSystem, float]:
    """The section, multiplied by a factor for a gain of about 1, and this factor."""
    size = max(map(magnitude, poles)) or 1.0
    factor = math.prod([size] * len(poles)) / math.prod(max(magnitude(zero), size) for zero in zeros)
    numerator, denominator = factor * _polynomial(zeros), _polynomial(poles)
    numerator = np.concatenate([np.zeros(len(denominator) - len(numerator)), numerator])
    direct = float(numerator[0])
    rest: Matrix = (numerator - direct * denominator)[1:]
    first = poles[0]
    if len(poles) == 1:
        a, b, c = [[first.real]], [size], [rest[0] / size]
    elif first.imag:
        # x1 + i x2 is the state of the complex pole sigma - i omega.
        sigma, omega = first.real, first.imag
        a, b = [[sigma, omega], [-omega, sigma]], [size, 0.0]
        c = [rest[0] / size, -(rest[1] + rest[0] * sigma) / omega / size]
    else:
        a, b = [[first.real, size], [0.0, poles[1].real]], [0.0, size]
        c = [(rest[1] + rest[0] * first.real) / (size * size), rest[0] / size]
    return LinearSystem(A=np.array(a), B=np.array(b), C=np.array(c), D=direct), factor


def _polynomial(roots: Sequence[complex]) -> Matrix:
    """Coefficients of the monic polynomial, highest power first; at most two roots, conjugate or real."""
    if len(roots) == 2:
        return np.array([1.0, -(roots[0] + roots[1]).real, product(roots).real])
    return np.array([1.0, *(-root.real for root in roots)])


def _in_series(one: LinearSystem, two: LinearSystem) -> LinearSystem:
    """The series connection of two systems."""
    n, m = len(one.B), len(two.B)
    A = np.zeros((n + m, n + m))
    A[:n, :n], A[n:, n:], A[n:, :n] = one.A, two.A, np.outer(two.B, one.C)
    return LinearSystem(
        A=A,
        B=np.concatenate([one.B, two.B * one.D]),
        C=np.concatenate([two.D * one.C, two.C]),
        D=one.D * two.D,
    )


# Filters. Frequencies are in rad/s; for digital filters they are prewarped for the bilinear transformation.


def low_pass(design: str, order: int, ripple: float, attenuation: float) -> ZeroPoleGain:
    """The low-pass prototype: its pass band ends (``chebyshev2``: stop band begins) at 1 rad/s.

    ``ripple`` and ``attenuation`` are in dB.
    """
    angles = math.pi * (2.0 * np.arange(1, order + 1) - 1.0) / (2.0 * order)
    sines, cosines = (np.array([function(angle) for angle in angles.tolist()]) for function in (sin, cos))
    circle_poles = _complex(-sines, cosines)
    no_zeros = np.zeros(0, dtype=np.complex128)
    if design == "butterworth":
        return ZeroPoleGain(zeros=no_zeros, poles=_paired(circle_poles), gain=1.0)
    excess_loss = power(10.0, (ripple if design == "chebyshev1" else attenuation) / 10.0) - 1.0
    mu = asinh(math.sqrt(excess_loss if design == "chebyshev2" else 1.0 / excess_loss)) / order
    ellipse_poles = _paired(_complex(sinh(mu) * -sines, cosh(mu) * cosines))
    if design == "chebyshev1":
        gain = product(-ellipse_poles).real
        return ZeroPoleGain(
            zeros=no_zeros,
            poles=ellipse_poles,
            gain=gain / math.sqrt(1.0 + excess_loss) if order % 2 == 0 else gain,
        )
    poles = _paired(_quotients(1.0, ellipse_poles))
    middle = order // 2 if order % 2 else None
    heights = [1.0 / cos(angle) for k, angle in enumerate(angles.tolist()) if k != middle]
    zeros = _paired(_complex(np.zeros(len(heights)), np.array(heights)))
    gain = quotient(product(-poles), product(-zeros)).real
    return ZeroPoleGain(zeros=zeros, poles=poles, gain=gain)


def frequency_transformed(base: ZeroPoleGain, kind: str, edge: float, upper_edge: float) -> ZeroPoleGain:
    """The low-pass prototype, transformed to ``low_pass``, ``high_pass``, ``band_pass`` or ``band_stop``."""
    z, p, k, excess = base.zeros, base.poles, base.gain, len(base.poles) - len(base.zeros)
    if kind == "low_pass":
        return ZeroPoleGain(zeros=z * edge, poles=p * edge, gain=k * math.prod([edge] * excess))
    inverted_gain = k * quotient(product(-z), product(-p)).real
    if kind == "high_pass":
        zeros = np.concatenate([_quotients(edge, z), np.zeros(excess)])
        return ZeroPoleGain(zeros=_paired(zeros), poles=_paired(_quotients(edge, p)), gain=inverted_gain)
    width, centre = upper_edge - edge, math.sqrt(edge * upper_edge)
    if kind == "band_pass":
        zeros = np.concatenate([_split(z * width / 2.0, centre), np.zeros(excess)])
        poles = _split(p * width / 2.0, centre)
        return ZeroPoleGain(zeros=_paired(zeros), poles=_paired(poles), gain=k * math.prod([width] * excess))
    notches = np.concatenate([np.full(excess, 1j * centre), np.full(excess, -1j * centre)])
    zeros = np.concatenate([_split(_quotients(width / 2.0, z), centre), notches])
    poles = _split(_quotients(width / 2.0, p), centre)
    return ZeroPoleGain(zeros=_paired(zeros), poles=_paired(poles), gain=inverted_gain)


def warped(fraction: float) -> float:
    """The prewarped frequency, which :func:`sampled` maps to this fraction of the Nyquist frequency."""
    return tan(math.pi * fraction / 2.0)


def sampled(system: ZeroPoleGain) -> ZeroPoleGain:
    """The bilinear transformation s = (z - 1) / (z + 1)."""
    z, p = system.zeros, system.poles
    excess = len(p) - len(z)
    return ZeroPoleGain(
        zeros=_paired(np.concatenate([_quotients(1.0 + z, 1.0 - z), np.full(excess, -1.0)])),
        poles=_paired(_quotients(1.0 + p, 1.0 - p)),
        gain=system.gain * quotient(product(1.0 - z), product(1.0 - p)).real,
    )


def _complex(real: Matrix, imaginary: Matrix) -> Roots:
    roots = np.empty(len(real), dtype=np.complex128)
    roots.real, roots.imag = real, imaginary
    return roots


def _quotients(dividends: complex | Roots, divisors: Roots) -> Roots:
    """Elementwise quotients of one dividend, or of as many dividends as divisors."""
    pairs = zip(np.broadcast_to(dividends, divisors.shape).tolist(), divisors.tolist())
    return np.array([quotient(complex(a), b) for a, b in pairs], dtype=np.complex128)


def _split(roots: Roots, centre: float) -> Roots:
    """The pairs of roots to which the band transformation maps the roots of the prototype."""
    offset = np.array([square_root(product([root, root]) - centre * centre) for root in roots], complex)
    return np.concatenate([roots + offset, roots - offset])


def _paired(roots: ArrayLike) -> Roots:
    """The roots as exact conjugate pairs and exactly real roots, without asymmetric rounding errors."""
    values = np.asarray(roots, dtype=np.complex128)
    tolerance = np.array([1e-9 * magnitude(root) for root in values])
    real = values[np.abs(values.imag) <= tolerance].real + 0j
    upper = values[values.imag > tolerance]
    paired: Roots = np.concatenate([upper, np.conj(upper), real]).astype(np.complex128)
    return paired

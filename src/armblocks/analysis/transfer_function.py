"""The transfer function from one input to one output, as zeros, poles and gain."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks.analysis.frequency import evaluate
from armblocks.analysis.modes import poles
from armblocks.analysis.reduction import minimal
from armblocks.analysis.state_space import StateSpaceModel
from armblocks.analysis.zeros import zeros
from armblocks.errors import InputError, counted

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, kw_only=True, eq=False)
class TransferFunction:
    """``gain prod(s - zeros) / prod(s - poles)``, in ``z`` where ``dt`` is not 0.

    The roots define the transfer function; the coefficients of the polynomials are computed from them.
    """

    zeros: Complex
    poles: Complex
    gain: float
    dt: float = 0.0

    @property
    def numerator(self) -> Array:
        """Coefficients, highest power first."""
        return self.gain * _multiplied_out(self.zeros)

    @property
    def denominator(self) -> Array:
        """Coefficients, highest power first; the first is 1."""
        return _multiplied_out(self.poles)

    def __call__(self, s: complex) -> complex:
        """The value at a complex number."""
        return complex(self.gain * np.prod(s - self.zeros) / np.prod(s - self.poles))

    def __repr__(self) -> str:
        letter = "z" if self.dt else "s"
        numerator_text = polynomial(self.numerator, letter, self.zeros)
        denominator_text = polynomial(self.denominator, letter, self.poles)
        width = max(len(numerator_text), len(denominator_text))
        lines = (numerator_text.center(width).rstrip(), "-" * width, denominator_text.center(width).rstrip())
        return "\n".join(lines)


def transfer_function(system: StateSpaceModel) -> TransferFunction:
    """The transfer function of a system with one input and one output, without common zeros and poles.

    Raises ``InputError`` for other systems.
    """
    if not system.is_siso:
        raise InputError(
            f"the system has {counted(system.D.shape[1], 'input')} and "
            f"{counted(system.D.shape[0], 'output')}",
            where=system.name,
            allowed="one of each",
            fix="choose with system.select(output, input)",
        )
    reduced = minimal(system)
    found_zeros, found_poles = zeros(reduced), poles(reduced)
    # The gain is computed from the value at a point far from all roots, where no factor is small.
    point = (
        2.0 * max(1e-300, float(np.abs(np.concatenate([found_zeros, found_poles])).max(initial=0.0))) or 1.0
    )
    point = point if len(found_zeros) + len(found_poles) else 1.0
    value = complex(evaluate(reduced, np.array([point], dtype=np.complex128))[0, 0, 0])
    # The factors are divided in pairs, so that no intermediate result overflows.
    gain = value
    for k in range(max(len(found_zeros), len(found_poles))):
        gain *= (point - found_poles[k]) if k < len(found_poles) else 1.0
        gain /= (point - found_zeros[k]) if k < len(found_zeros) else 1.0
    return TransferFunction(zeros=found_zeros, poles=found_poles, gain=float(np.real(gain)), dt=system.dt)


def _multiplied_out(roots: Complex) -> Array:
    """Coefficients of ``prod(s - roots)``; the roots come in conjugate pairs."""
    return np.atleast_1d(np.poly(roots)).real.astype(np.float64)


def polynomial(coefficients: Array, letter: str, roots: Complex) -> str:
    """A polynomial as text with six digits, such as ``3 s^2 + s - 2``.

    Coefficients that are only rounding errors of the roots are omitted. The k-th coefficient is the
    sum of all products of k roots. If ``r`` is the largest magnitude of a root
    and each root has an error of at most ``e r``, the coefficient changes by at most ``e k r^k`` times the
    number of products.
    """
    largest = float(np.abs(roots).max(initial=0.0))
    parts: list[str] = []
    for k, value in enumerate(coefficients.tolist()):
        power = len(coefficients) - 1 - k
        rounding = 4e-15 * k * math.comb(len(coefficients) - 1, k) * largest**k
        if abs(value) <= rounding * abs(float(coefficients[0])):
            continue
        number = f"{abs(value):.6g}"
        unit = "" if power == 0 else letter if power == 1 else f"{letter}^{power}"
        text = unit if unit and number == "1" else " ".join(part for part in (number, unit) if part)
        sign = ("-" if value < 0 else "") if not parts else (" - " if value < 0 else " + ")
        parts.append(sign + text)
    return "".join(parts) or "0"

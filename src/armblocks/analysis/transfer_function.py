"""The transfer function from one input to one output, as zeros, poles and gain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks.analysis.modes import poles
from armblocks.analysis.reduction import minimal
from armblocks.analysis.shown_values import shown_poles, shown_zeros
from armblocks.analysis.state_space import StateSpaceModel
from armblocks.analysis.zeros import zeros_and_gain
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
    _system: StateSpaceModel | None = None

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
        system = self._system
        numerator_text = polynomial(shown_zeros(system) if system else self.zeros, letter, self.gain)
        denominator_text = polynomial(shown_poles(system) if system else self.poles, letter)
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
    found_zeros, gain = zeros_and_gain(reduced)
    return TransferFunction(zeros=found_zeros, poles=poles(reduced), gain=gain, dt=system.dt, _system=reduced)


def _multiplied_out(roots: Complex) -> Array:
    """Coefficients of ``prod(s - roots)``; the roots come in conjugate pairs."""
    return np.atleast_1d(np.poly(roots)).real.astype(np.float64)


def polynomial(roots: Complex, letter: str, factor: float = 1.0) -> str:
    """The polynomial ``factor prod(s - roots)`` as text with six digits, such as ``3 s^2 + s - 2``.

    Coefficients that are only rounding errors of the roots are omitted. The k-th coefficient is the
    sum of all products of k roots. If each root has a relative error of at most ``e``, the coefficient
    changes by at most ``e k`` times the sum of the magnitudes of these products. This sum is a coefficient of
    the polynomial whose roots are the negative magnitudes of the roots.
    """
    coefficients = _multiplied_out(roots)
    magnitudes = _multiplied_out(-np.abs(roots).astype(np.complex128))
    parts: list[str] = []
    for k, value in enumerate((factor * coefficients).tolist()):
        power = len(coefficients) - 1 - k
        if abs(coefficients[k]) <= 4e-15 * k * magnitudes[k] or value == 0.0:
            continue
        number = f"{abs(value):.6g}"
        unit = "" if power == 0 else letter if power == 1 else f"{letter}^{power}"
        text = unit if unit and number == "1" else " ".join(part for part in (number, unit) if part)
        sign = ("-" if value < 0 else "") if not parts else (" - " if value < 0 else " + ")
        parts.append(sign + text)
    return "".join(parts) or "0"

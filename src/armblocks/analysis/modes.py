"""Poles and the properties of their modes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks.analysis.state_space import StateSpaceModel
from armblocks.extras import from_extra

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, kw_only=True)
class Mode:
    """A pole and the properties of its mode.

    ``frequency``: the natural frequency ``|s|``, rad/s. ``damping``: the ratio ``-Re s / |s|``, 1 by
    convention for ``s = 0``. ``time_constant``: ``-1 / Re s``, s; infinite on the imaginary axis, negative
    for an unstable pole. For a discrete system ``s = log(z) / dt``.
    """

    pole: complex
    frequency: float
    damping: float
    time_constant: float


def poles(system: StateSpaceModel) -> Complex:
    """Eigenvalues of A, slowest first; the conjugate with positive imaginary part comes first.

    They are computed for each irreducible diagonal block of A. The eigenvalue of a state that is in no loop
    is then exact, and a fast part of a system does not reduce the accuracy of a slow part.
    """
    with from_extra("analysis", "poles of a linear system"):
        from scipy.linalg import eigvals

    if not system.order:
        return np.empty(0, dtype=np.complex128)
    parts = [eigvals(system.A[np.ix_(part, part)]) for part in irreducible_parts(system.A)]
    return in_order(np.concatenate(parts), discrete=system.is_discrete)


def irreducible_parts(A: Array) -> list[list[int]]:
    """Groups of states that affect each other, directly or through other states.

    The groups can be ordered such that A is block triangular.
    """
    with from_extra("analysis", "poles of a linear system"):
        from scipy.sparse.csgraph import connected_components

    count, labels = connected_components(A != 0.0, directed=True, connection="strong")
    return [np.flatnonzero(labels == label).tolist() for label in range(count)]


def in_order(roots: Complex, *, discrete: bool = False) -> Complex:
    """The roots sorted by their distance from 0 (discrete: from 1), conjugates next to each other."""
    origin = 1.0 if discrete else 0.0
    distance = np.abs(roots - origin)
    # Conjugates have the same distance up to rounding, which must not determine their order.
    rounded = [float(f"{value:.9e}") for value in distance.tolist()]
    real = [float(f"{value:.9e}") for value in roots.real.tolist()]
    order = sorted(range(len(roots)), key=lambda k: (rounded[k], real[k], -float(roots[k].imag)))
    return roots[order]


def modes(system: StateSpaceModel) -> tuple[Mode, ...]:
    """A mode for each pole, in the order of ``poles``."""
    return tuple(mode_of(complex(pole), system.dt) for pole in poles(system))


def mode_of(pole: complex, dt: float = 0.0) -> Mode:
    """The properties of one pole."""
    s = pole
    if dt > 0.0:
        s = complex(np.log(pole)) / dt if pole != 0.0 else complex(-math.inf, 0.0)
    frequency = abs(s)
    damping = 1.0 if frequency == 0.0 or math.isinf(frequency) else -s.real / frequency
    time_constant = math.inf if s.real == 0.0 else -1.0 / s.real
    return Mode(pole=pole, frequency=frequency, damping=damping + 0.0, time_constant=time_constant)

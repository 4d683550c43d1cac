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

MAX_UNREFINED = 1e-5
"""Eigenvalues of a smaller magnitude, in norms of the matrix, are refined."""
MAX_REFINEMENTS = 8
"""Maximum number of Newton steps for an eigenvalue."""
CONVERGED = 1e-10
"""Relative size of the last Newton step; the error is its square because of the quadratic convergence."""


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
    if not system.order:
        return np.empty(0, dtype=np.complex128)
    parts = [eigenvalues(system.A[np.ix_(part, part)]) for part in irreducible_parts(system.A)]
    return in_order(np.concatenate(parts), discrete=system.is_discrete)


def eigenvalues(matrix: Array) -> Complex:
    """The eigenvalues of a matrix; simple small eigenvalues are refined.

    The error of the usual algorithm is proportional to the norm of the matrix, which can be much larger
    than an eigenvalue. Such eigenvalues are improved by Newton's method with deflation of the other
    eigenvalues (Aberth, Math. Comp. 27, 1973, 339-344) for ``det(s I - A)``, whose logarithmic derivative is
    the trace of ``(s I - A)^-1``.
    """
    with from_extra("analysis", "poles and zeros of a linear system"):
        from scipy.linalg import eigvals, matrix_balance

    if matrix.shape[0] == 1:
        return matrix[0].astype(np.complex128)
    scaled: Array = matrix_balance(matrix, permute=False)[0]
    roots: Complex = eigvals(scaled)
    small = np.abs(roots) < MAX_UNREFINED * float(np.linalg.norm(scaled))
    for k in np.flatnonzero(small & (roots.imag >= 0.0)).tolist():
        refined = _refined(scaled, roots, k)
        roots[roots == roots[k].conjugate()] = refined.conjugate()
        roots[k] = refined
    return roots


def _refined(matrix: Array, roots: Complex, k: int) -> complex:
    """An improved eigenvalue; unchanged if Newton's method does not converge near it."""
    start = root = complex(roots[k])
    others = np.delete(roots, k)
    gap = float(np.abs(others - root).min())
    for _ in range(MAX_REFINEMENTS):
        try:
            inverse = np.linalg.inv(root * np.eye(matrix.shape[0]) - matrix)
        except np.linalg.LinAlgError:
            return root
        with np.errstate(all="ignore"):
            step = complex(1.0 / (np.trace(inverse) - np.sum(1.0 / (root - others))))
        if not abs(step) <= gap / 4.0:
            return start
        root -= step
        if abs(step) <= CONVERGED * abs(root):
            return root if start.imag else complex(root.real, 0.0)
    return start


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

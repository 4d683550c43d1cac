"""Displayed values of poles, zeros, gains, margins and matrices: rounding errors are displayed as 0.

The exact value of a computed number near zero may be zero. This module decides which numbers cannot be
distinguished from zero. Computed and stored values are unchanged; text, tables and figures display the values
of this module.

An eigenvalue computed in floating point is an exact eigenvalue of a matrix ``A + E``, ``|E| <= eta``, with
``eta`` a small multiple of the unit roundoff times ``|A|`` (Golub and Van Loan, Matrix Computations, 4th ed.,
7.5.6). The set of all such eigenvalues is the pseudospectrum of A: the numbers ``mu`` with ``sigma_min(A - mu
I) <= eta`` (Trefethen and Embree, Spectra and Pseudospectra, 2005, ch. 2). A root is displayed as 0, as real
or as imaginary if the straight line from it to 0, to the real or to the imaginary axis is inside the
pseudospectrum: rounding alone can then cause the difference. This is also valid for multiple roots, whose
rounding errors are as large as a root of ``eta``.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from armblocks.analysis.frequency import dcgain
from armblocks.analysis.modes import Mode, eigenvalues, in_order, irreducible_parts, mode_of
from armblocks.analysis.reduction import minimal
from armblocks.analysis.scaling import balanced, scaled
from armblocks.analysis.state_space import StateSpaceModel
from armblocks.analysis.zeros import zero_pencils
from armblocks.extras import from_extra

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

ROUNDOFFS = 10.0
"""Rounding errors that each of n rows may contribute, in units of the roundoff."""
EPSILON = float(np.finfo(np.float64).eps)
LINE_POSITIONS = (1.0, 0.75, 0.5, 0.25)
"""Positions on the line from a root to its candidate at which the pseudospectrum is checked."""
MAX_ERROR_RATIO = 100.0
"""A candidate is checked if its distance is at most this many times the first-order error of the root."""


class _Pencil:
    """The roots of ``det(M - s N)`` and their uncertainty."""

    def __init__(self, M: Array, N: Array, tolerance: float) -> None:
        with from_extra("analysis", "poles and zeros"):
            from scipy.linalg import eig

        self.M, self.N, self.tolerance = M, N, tolerance
        self.roots, left, right = eig(M, N, left=True, right=True)
        cosines = np.abs(np.einsum("ik,ij,jk->k", left.conj(), N, right))
        lengths = np.linalg.norm(left, axis=0) * np.linalg.norm(right, axis=0)
        with np.errstate(divide="ignore"):
            self.reaches = MAX_ERROR_RATIO * tolerance * lengths / cosines

    def shown(self, root: complex, candidates: Sequence[complex]) -> complex:
        """The first candidate that cannot be distinguished from the root, else the root."""
        reach = float(self.reaches[int(np.argmin(np.abs(self.roots - root)))])
        for candidate in candidates:
            if candidate == root or (
                abs(candidate - root) <= reach
                and all(
                    self._is_in_pseudospectrum(root + position * (candidate - root))
                    for position in LINE_POSITIONS
                )
            ):
                return candidate
        return root

    def _is_in_pseudospectrum(self, s: complex) -> bool:
        """Whether this number is in the pseudospectrum, so that rounding alone can make it a root."""
        sizes = np.linalg.svd(self.M - s * self.N, compute_uv=False)
        return bool(sizes[-1] <= self.tolerance)


def _candidates(root: complex, discrete: bool) -> tuple[complex, ...]:
    real = complex(root.real, 0.0)
    if not discrete:
        return 0j, real, complex(0.0, root.imag)
    on_circle = (root / abs(root),) if root else ()
    return 0j, 1 + 0j, real, *on_circle


def shown_poles(system: StateSpaceModel) -> Complex:
    """:meth:`LinearSystem.poles` (nx,), without rounding errors about 0, 1, the axes and the unit circle."""
    roots_shown: list[complex] = []
    for part in irreducible_parts(system.A):
        block = system.A[np.ix_(part, part)]
        if len(part) == 1:
            roots_shown.append(complex(block[0, 0]))  # exact
            continue
        no_ports = np.empty((0, len(part)))
        matrix, _, _ = balanced(block, no_ports.T, no_ports)
        norm = float(np.linalg.norm(matrix))
        pencil = _Pencil(matrix, np.eye(len(part)), ROUNDOFFS * len(part) * EPSILON * norm)
        roots = eigenvalues(block).tolist()
        roots_shown += [pencil.shown(root, _candidates(root, system.is_discrete)) for root in roots]
    return in_order(np.array(roots_shown, dtype=np.complex128), discrete=system.is_discrete)


def shown_zeros(system: StateSpaceModel) -> Complex:
    """:meth:`LinearSystem.zeros`, without rounding errors about 0, 1, the axes and the unit circle."""
    roots: list[complex] = []
    for matrices in zero_pencils(system):
        pencil = _Pencil(matrices.M, matrices.N, matrices.tolerance)
        roots += [
            pencil.shown(root, _candidates(root, system.is_discrete)) for root in matrices.roots().tolist()
        ]
    return in_order(np.array(roots, dtype=np.complex128))


def shown_modes(system: StateSpaceModel) -> tuple[Mode, ...]:
    """The modes of the displayed poles, as :meth:`LinearSystem.damp`."""
    modes: list[Mode] = []
    for pole in shown_poles(system).tolist():
        mode = mode_of(complex(pole), system.dt)
        if system.is_discrete and on_stability_boundary(pole, discrete=True):
            # On the unit circle the decay rate is exactly 0, but log(|z|) has a rounding error.
            mode = dataclasses.replace(mode, damping=0.0 if mode.frequency else 1.0, time_constant=math.inf)
        modes.append(mode)
    return tuple(modes)


def on_stability_boundary(pole: complex, *, discrete: bool) -> bool:
    """Whether a displayed pole is on the imaginary axis, or on the unit circle."""
    return abs(abs(pole) - 1.0) <= 2.0 * EPSILON if discrete else pole.real == 0.0


def growth(system: StateSpaceModel) -> float:
    """The largest real part of the displayed poles; for a sampled system the largest ``|z| - 1``.

    It is 0 on the stability boundary, and ``-inf`` without poles.
    """
    discrete = system.is_discrete
    rates = [
        0.0
        if on_stability_boundary(pole, discrete=discrete)
        else (abs(pole) - 1.0 if discrete else pole.real)
        for pole in shown_poles(system).tolist()
    ]
    return max(rates, default=-math.inf)


def is_stable(system: StateSpaceModel) -> bool:
    """See :attr:`LinearSystem.is_stable`."""
    return growth(system) < 0.0


def response_errors(system: StateSpaceModel, s: complex) -> tuple[float, float]:
    """A bound of the rounding error of the response at ``s``, and the magnitude of its derivative there.

    The system has one input and one output.
    """
    n = system.order
    direct = abs(float(system.D[0, 0]))
    if not n:
        return EPSILON * direct, 0.0
    a, b, c = balanced(system.A, system.B, system.C)
    matrix = s * np.eye(n) - a
    try:
        right, left = np.linalg.solve(matrix, b)[:, 0], np.linalg.solve(matrix.T, c[0])
    except np.linalg.LinAlgError:
        return math.inf, math.inf
    v, w = float(np.linalg.norm(left)), float(np.linalg.norm(right))
    size = v * w * float(np.linalg.norm(matrix)) + v * float(np.linalg.norm(b)) + w * float(np.linalg.norm(c))
    return ROUNDOFFS * n * EPSILON * (size + direct), abs(complex(left @ right))


def shown_dcgain(system: StateSpaceModel) -> Array:
    """:meth:`LinearSystem.dcgain` (ny, nu); 0 where it is 0 to the accuracy of the computation."""
    gains = dcgain(system).copy()
    s = 1.0 if system.is_discrete else 0.0
    for row, column in np.argwhere(np.isfinite(gains) & (gains != 0.0)).tolist():
        part = minimal(system.select([system.outputs[row]], [system.inputs[column]]))
        if abs(gains[row, column]) <= response_errors(part, s)[0]:
            gains[row, column] = 0.0
    return gains


def shown_matrices(system: StateSpaceModel) -> tuple[Array, Array, Array, Array]:
    """A, B, C and D, with entries set to 0 that are rounding errors relative to their row and their column.

    States, inputs and outputs are compared in units in which all numbers have similar sizes. The result does
    therefore not depend on the units of the system.
    """
    n = system.order
    parts = scaled(system.A, system.B, system.C, system.D)
    matrix = np.block([[parts.A, parts.B], [parts.C, parts.D]])
    rows = np.linalg.norm(matrix, axis=1, keepdims=True)
    columns = np.linalg.norm(matrix, axis=0, keepdims=True)
    unscaled = np.block([[system.A, system.B], [system.C, system.D]])
    shown = np.where(np.abs(matrix) <= EPSILON * np.minimum(rows, columns), 0.0, unscaled)
    return shown[:n, :n], shown[:n, n:], shown[n:, :n], shown[n:, n:]

"""Invariant zeros of a state-space system, also with several inputs and outputs.

The algorithm of Emami-Naeini and Van Dooren (Automatica 18, 1982, 415-430): the system is reduced, by
orthogonal transformations only, to one with an invertible ``D`` and the same finite zeros. Infinite zeros are
removed by rank decisions. In the generalised eigenvalue problem of the unreduced system they would reduce the
accuracy of the finite zeros.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from armblocks.analysis.modes import in_order
from armblocks.analysis.scaling import balanced
from armblocks.analysis.state_space import StateSpaceModel
from armblocks.extras import from_extra

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


def invariant_zeros(A: Array, B: Array, C: Array, D: Array) -> Complex:
    """The finite numbers s for which ``[[A - s I, B], [C, D]]`` has a lower rank than for almost all s."""
    with from_extra("analysis", "zeros of a linear system"):
        from scipy.linalg import eigvals

    pencil = zero_pencil(A, B, C, D)
    return np.empty(0, dtype=np.complex128) if pencil is None else in_order(eigvals(*pencil[:2]))


def zeros(system: StateSpaceModel) -> Complex:
    """The invariant zeros of a system."""
    return invariant_zeros(system.A, system.B, system.C, system.D)


def zero_pencil(A: Array, B: Array, C: Array, D: Array) -> tuple[Array, Array, float] | None:
    """``M``, ``N`` and the size of their rounding errors: the zeros are the roots of ``det(M - s N)``.

    ``None`` if there are no zeros.
    """
    if not A.size or not B.size or not C.size:
        return None
    a, b, c = balanced(A, B, C)
    # Inputs and outputs are scaled to similar sizes, which does not change the zeros.
    b, d = _columns_scaled(b, D)
    c, d = (part.T for part in _columns_scaled(c.T, d.T))
    system_matrix = np.block([[a, b], [c, d]])
    tolerance = (
        10.0 * max(system_matrix.shape) * np.finfo(np.float64).eps * float(np.linalg.norm(system_matrix))
    )
    a, b, c, d = _reduced(a, b, c, d, tolerance)
    if a.size:
        # The same reduction of the dual system, whose inputs are the outputs.
        a, c, b, d = (part.T for part in _reduced(a.T, c.T, b.T, d.T, tolerance))
    n = a.shape[0]
    if not n:
        return None
    if not d.size:
        return a, np.eye(n), tolerance
    # [C D] W = [0 *] eliminates the inputs without dividing by D.
    _, _, right = np.linalg.svd(np.hstack([c, d]))
    null_space = right[d.shape[0] :].T
    return np.hstack([a, b]) @ null_space, null_space[:n], tolerance


def _columns_scaled(upper: Array, lower: Array) -> tuple[Array, Array]:
    """Both matrices with the columns of ``[upper; lower]`` scaled to unit length."""
    sizes = np.sqrt((upper**2).sum(axis=0) + (lower**2).sum(axis=0))
    factors = 1.0 / np.where(sizes > 0.0, sizes, 1.0)
    return upper * factors, lower * factors


def _rank(values: Array, tolerance: float) -> int:
    return int((values > tolerance).sum())


def _reduced(a: Array, b: Array, c: Array, d: Array, tolerance: float) -> tuple[Array, Array, Array, Array]:
    """A system with the same finite zeros whose ``D`` has full row rank."""
    while a.shape[0] and d.shape[0]:
        left, sizes, _ = np.linalg.svd(d)
        rank = _rank(sizes, tolerance)
        if rank == d.shape[0]:
            break
        c, d = left.T @ c, left.T @ d
        without_feedthrough = c[rank:]
        c, d = c[:rank], d[:rank]
        _, sizes, right = np.linalg.svd(without_feedthrough)
        output_rank = _rank(sizes, tolerance)
        if not output_rank:
            break
        rotation = np.vstack(
            [right[output_rank:], right[:output_rank]]
        ).T  # first the states that do not affect these outputs
        a, b, c = rotation.T @ a @ rotation, rotation.T @ b, c @ rotation
        remaining = a.shape[0] - output_rank
        c, d = np.vstack([c[:, :remaining], a[remaining:, :remaining]]), np.vstack([d, b[remaining:]])
        a, b = a[:remaining, :remaining], b[:remaining]
    return a, b, c, d

"""Controllability and observability Gramians of a stable system.

A Gramian W solves the Lyapunov equation ``A W + W A' + B B' = 0``, or ``W = A W A' + B B'`` for a sampled
system. The method of Hammarling (IMA J. Numer. Anal. 2, 1982, 303-323) computes a factor F with ``W = F F'``
from a triangular form of A. W is therefore positive semidefinite also with rounding errors.

Units of states do not affect the accuracy: the triangular form is computed for each irreducible diagonal
block of A, with balanced states. If the states of a block have very different Gramians, the block is scaled
by these and the solution is repeated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks.analysis.modes import irreducible_parts
from armblocks.analysis.scaling import balancing_factors
from armblocks.analysis.shown_values import is_stable
from armblocks.analysis.state_space import StateSpaceModel
from armblocks.errors import InputError
from armblocks.extras import from_extra

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

MAX_SCALINGS = 4
"""Maximum number of solutions, each with the states scaled by the solution before."""
GOOD_RESIDUAL = 1e-13
"""Relative residual, for each state, at which no other scaling is tried."""
MAX_RESIDUAL = 1e-8
"""Largest relative residual of a Gramian that is returned."""


def gramians(system: StateSpaceModel) -> tuple[Array, Array]:
    """The controllability and the observability Gramian (nx, nx), by the Lyapunov equations.

    Raises ``InputError`` for a system that is not stable, or whose Gramians cannot be computed to 8
    digits of its Lyapunov equations.
    """
    if not is_stable(system):
        raise InputError(
            "the system is not stable and has no Gramians",
            where=system.name,
            allowed="a stable system, because the integrals diverge for others",
            fix="use controllability() and observability()",
        )
    found: list[Array] = []
    for kind, A, B in (("controllability", system.A, system.B), ("observability", system.A.T, system.C.T)):
        gramian, residual = _gramian(A, B, discrete=system.is_discrete)
        if not residual <= MAX_RESIDUAL:
            raise InputError(
                f"the {kind} Gramian has a relative residual of {residual:.2g}",
                where=system.name,
                allowed=f"a residual of at most {MAX_RESIDUAL:g} in its Lyapunov equation",
                fix="use units in which inputs and outputs have moderate sizes, and remove states with "
                "poles close to the stability boundary",
            )
        found.append(gramian)
    return found[0], found[1]


def _gramian(A: Array, B: Array, *, discrete: bool) -> tuple[Array, float]:
    """The Gramian of ``A`` (n, n) and ``B`` (n, m), and its relative residual."""
    n = A.shape[0]
    parts = _in_order_of_effect(A)
    none = np.empty((0, n))
    factors = np.ones(n)
    for part in parts:
        block = A[np.ix_(part, part)]
        factors[part] = balancing_factors(block, none[:, part].T, none[:, part])
    best, smallest = np.zeros((n, n)), np.inf
    for _ in range(MAX_SCALINGS):
        a, b = A * factors / factors[:, None], B / factors[:, None]
        with np.errstate(all="ignore"):
            root = _root(_triangular(a, parts), b, discrete=discrete)
            scaled = root @ root.T
            residual = _relative_residual(a, b, scaled, discrete=discrete)
        if not residual < smallest:
            break
        best, smallest = scaled * factors * factors[:, None], residual
        if residual <= GOOD_RESIDUAL:
            break
        sizes = np.sqrt(np.diag(scaled))
        factors = factors * 2.0 ** np.round(np.log2(np.where(sizes > 0.0, sizes, 1.0)))
    return best, smallest


def _in_order_of_effect(A: Array) -> list[list[int]]:
    """The irreducible parts of A, ordered so that only later parts affect a part."""
    parts = irreducible_parts(A)
    member = np.zeros((len(parts), A.shape[0]))
    for k, part in enumerate(parts):
        member[k, part] = 1.0
    affected = member @ (A != 0.0) @ member.T > 0.0
    np.fill_diagonal(affected, False)
    ordered: list[int] = []
    placed = np.zeros(len(parts), dtype=np.bool_)
    while len(ordered) < len(parts):
        ready = np.flatnonzero(~placed & ~affected[:, ~placed].any(axis=1))
        ordered += ready.tolist()
        placed[ready] = True
    return [parts[k] for k in reversed(ordered)]


@dataclass(frozen=True, kw_only=True, eq=False)
class _TriangularForm:
    """``A = U T U^H`` with a unitary U and an upper triangular T, complex."""

    U: Complex
    T: Complex


def _triangular(A: Array, parts: list[list[int]]) -> _TriangularForm:
    """The triangular form of a matrix whose irreducible parts are in the order of ``_in_order_of_effect``."""
    with from_extra("analysis", "Gramians"):
        from scipy.linalg import schur

    n = A.shape[0]
    U, T = np.zeros((n, n), dtype=np.complex128), np.zeros((n, n), dtype=np.complex128)
    begin = 0
    for part in parts:
        columns = slice(begin, begin + len(part))
        T[columns, columns], U[part, columns] = schur(A[np.ix_(part, part)], output="complex")
        begin += len(part)
    begin = 0
    for part in parts:
        rows, after = slice(begin, begin + len(part)), slice(begin + len(part), n)
        T[rows, after] = U[part, rows].conj().T @ A[part] @ U[:, after]
        begin += len(part)
    return _TriangularForm(U=U, T=T)


def _root(form: _TriangularForm, B: Array, *, discrete: bool) -> Array:
    """A factor F (n, 2n) of the Gramian ``F F'``: Hammarling's method in complex numbers.

    The Gramian in the coordinates of the triangular form is ``R R^H``, R upper triangular. Its last column
    follows from the last row of the equation. The other columns are the factor for the first states, with
    changed inputs.
    """
    T, b = form.T, form.U.conj().T @ B
    n = T.shape[0]
    R = np.zeros((n, n), dtype=np.complex128)
    for k in range(n - 1, -1, -1):
        pole, inner, right = T[k, k], T[:k, :k], T[:k, k]
        decay = (1.0 - abs(pole)) * (1.0 + abs(pole)) if discrete else -2.0 * pole.real
        if not decay > 0.0:
            return np.full((n, 2 * n), np.nan)
        size = float(np.linalg.norm(b[k]))
        if size == 0.0:
            b = b[:k]
            continue
        direction = b[k] * (np.sqrt(decay) / size)
        R[k, k] = size / np.sqrt(decay)
        b = b[:k]
        step = right * R[k, k]
        if discrete:
            known = np.conj(pole) * step + b @ direction.conj()
            column = _solved(np.eye(k) - np.conj(pole) * inner, known)
            b = np.column_stack([inner @ column + step, b]) @ _complement(
                np.concatenate([[np.conj(pole)], direction.conj()])
            )
        else:
            column = _solved(inner + np.conj(pole) * np.eye(k), -step - b @ direction.conj())
            b = b - np.outer(column, direction)
        R[:k, k] = column
    factor = form.U @ R
    return np.hstack([factor.real, factor.imag])


def _solved(upper: Complex, right: Complex) -> Complex:
    """The solution of equations with an upper triangular matrix."""
    with from_extra("analysis", "Gramians"):
        from scipy.linalg import solve_triangular

    return solve_triangular(upper, right) if right.size else right


def _complement(v: Complex) -> Complex:
    """An orthonormal basis (m + 1, m) of the vectors orthogonal to the unit vector ``v``, by a reflection."""
    w = v.copy()
    w[0] += v[0] / abs(v[0]) if v[0] else 1.0
    reflection = np.eye(v.size) - 2.0 * np.outer(w, w.conj()) / np.vdot(w, w).real
    return reflection[:, 1:]


def _relative_residual(A: Array, B: Array, W: Array, *, discrete: bool) -> float:
    """The largest entry of the residual, relative to the sizes of its terms.

    An entry of the Gramian is at most ``s_i s_j`` with ``s = sqrt(diag(W))``. The result is the same in all
    units of states and inputs.
    """
    s = np.sqrt(np.diag(W))
    flow, inputs = np.abs(A) @ s, np.linalg.norm(B, axis=1)
    if discrete:
        residual = A @ W @ A.T + B @ B.T - W
        sizes = np.outer(flow, flow) + np.outer(s, s) + np.outer(inputs, inputs)
    else:
        product = A @ W
        residual = product + product.T + B @ B.T
        sizes = np.outer(flow, s) + np.outer(s, flow) + np.outer(inputs, inputs)
    if not np.isfinite(residual).all() or not np.isfinite(sizes).all():
        return np.inf
    return float(np.max(np.abs(residual)[sizes > 0.0] / sizes[sizes > 0.0], initial=0.0))

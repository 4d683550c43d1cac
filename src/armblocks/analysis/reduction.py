"""Controllable and observable states, and reduction of a system to them."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from armblocks.analysis.scaling import balanced
from armblocks.analysis.state_space import SystemT

Array = NDArray[np.float64]


def staircase(A: Array, B: Array) -> tuple[Array, int]:
    """An orthogonal basis (n, n) whose first ``k`` columns span the controllable subspace, and ``k``.

    The staircase algorithm (Van Dooren, IEEE Trans. Automatic Control 26, 1981, 111-129) determines
    ranks of blocks, not of powers of A as the controllability matrix.
    """
    n = A.shape[0]
    basis = np.eye(n)
    if not n or not B.size:
        return basis, 0
    scale = float(np.linalg.norm(A)) + float(np.linalg.norm(B))
    tolerance = 10.0 * n * np.finfo(np.float64).eps * scale
    dimension, block = 0, B
    while True:
        left, singular_values, _ = np.linalg.svd(block)
        rank = int((singular_values > tolerance).sum())
        if not rank:
            return basis, dimension
        basis[:, dimension:] = basis[:, dimension:] @ left
        rotated = basis.T @ A @ basis
        before, dimension = dimension, dimension + rank
        if dimension == n:
            return basis, n
        block = rotated[dimension:, before:dimension]


def reachable_dimensions(A: Array, B: Array) -> int:
    """Dimension of the controllable subspace; with ``A.T`` and ``C.T``, of the observable subspace."""
    a, b, _ = balanced(A, B, np.zeros((0, A.shape[0])))
    return staircase(a, b)[1]


def minimal(system: SystemT) -> SystemT:
    """The system without uncontrollable and unobservable states; the same object if there are none."""
    a, b, c = balanced(system.A, system.B, system.C)
    basis, controllable = staircase(a, b)
    basis = basis[:, :controllable]
    a, b, c = basis.T @ a @ basis, basis.T @ b, c @ basis
    basis, observable = staircase(a.T, c.T)
    if observable == system.order:
        return system
    basis = basis[:, :observable]
    return dataclasses.replace(
        system,
        A=basis.T @ a @ basis,
        B=basis.T @ b,
        C=c @ basis,
        states=(),
        state_units=(),
    )


def on_path(system: SystemT) -> SystemT:
    """The system with only the states on a path from an input to an output.

    The paths are those of the graph of the nonzero matrix entries.
    """
    links = system.A != 0.0

    def connected(begin: NDArray[np.bool_], matrix: NDArray[np.bool_]) -> NDArray[np.bool_]:
        nodes = begin
        while True:
            successors = nodes | (matrix @ nodes)
            if (successors == nodes).all():
                return nodes
            nodes = successors

    after_inputs = (system.B != 0.0).astype(np.intp).sum(axis=1) > 0
    before_outputs = (system.C != 0.0).astype(np.intp).sum(axis=0) > 0
    needed = connected(after_inputs, links) & connected(before_outputs, links.T)
    indices = np.flatnonzero(needed)
    return dataclasses.replace(
        system,
        A=system.A[np.ix_(indices, indices)],
        B=system.B[indices],
        C=system.C[:, indices],
        states=tuple(system.states[k] for k in indices),
        state_units=tuple(system.state_units[k] for k in indices),
    )

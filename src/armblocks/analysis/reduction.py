"""Controllable and observable states, and reduction of a system to them."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from armblocks.analysis.elimination import SystemMatrix
from armblocks.analysis.scaling import scaled
from armblocks.analysis.state_space import SystemT

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


def _controllable(matrix: SystemMatrix, states: Indices) -> Indices:
    """Transform the states such that some states are controllable and independent of the other states.

    Returns the indices of the controllable states. The staircase algorithm (Van Dooren, IEEE Trans. Automatic
    Control 26, 1981, 111-129) determines ranks of blocks, not of powers of A as the controllability matrix.
    ``matrix`` is changed.
    """
    rest = states
    reached: list[int] = []
    front: Indices = np.arange(matrix.order, matrix.values.shape[1], dtype=np.intp)
    while rest.size and front.size:
        next_front: list[int] = []
        while (pivot := matrix.largest(rest, front)) is not None:
            column = pivot[1]
            matrix.concentrate(rest, column)
            state = int(rest[np.argmax(np.abs(matrix.values[rest, column]))])
            rest, front = rest[rest != state], front[front != column]
            factors, variances = matrix.ratios((rest, column), (state, column))
            # The new states are x_k - factor_k x_state, so that x_state alone depends on this column.
            matrix.subtract_row(state, rest, factors, variances)
            matrix.values[rest, column] = matrix.variances[rest, column] = 0.0
            matrix.add_columns(rest, state, factors, variances)
            next_front.append(state)
        reached += next_front
        front = np.array(next_front, dtype=np.intp)
    return np.array(sorted(reached), dtype=np.intp)


def reachable_dimensions(A: Array, B: Array) -> int:
    """Dimension of the controllable subspace; with ``A.T`` and ``C.T``, of the observable subspace."""
    n = A.shape[0]
    matrix = SystemMatrix(scaled(A, B, np.zeros((0, n)), np.zeros((0, B.shape[1]))))
    return _controllable(matrix, np.arange(n, dtype=np.intp)).size


def minimal(system: SystemT) -> SystemT:
    """The system without uncontrollable and unobservable states; the same object if there are none."""
    on_paths = on_path(system)
    n = on_paths.order
    parts = scaled(on_paths.A, on_paths.B, on_paths.C, on_paths.D)
    matrix = SystemMatrix(parts)
    kept = _controllable(matrix, np.arange(n, dtype=np.intp))
    kept = _controllable(matrix.transposed(), kept)
    if kept.size == system.order:
        return system
    if kept.size == n:
        return dataclasses.replace(on_paths, states=(), state_units=())
    return dataclasses.replace(
        system,
        A=matrix.values[np.ix_(kept, kept)],
        B=matrix.values[kept, n:] / parts.inputs,
        C=matrix.values[n:, kept] / parts.outputs[:, None],
        states=(),
        state_units=(),
    )


def on_path(system: SystemT) -> SystemT:
    """The system with only the states on a path from an input to an output.

    Paths refer to the graph of the nonzero matrix entries.
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

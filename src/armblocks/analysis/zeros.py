"""Invariant zeros of a state-space system, also with several inputs and outputs.

The algorithm of Emami-Naeini and Van Dooren (Automatica 18, 1982, 415-430): the system is reduced to one with
an invertible ``D`` and the same finite zeros. Infinite zeros are removed by rank decisions. In the
generalised eigenvalue problem of the unreduced system they would reduce the accuracy of the finite zeros. The
reductions are eliminations (:mod:`armblocks.analysis.elimination`), not rotations, so that a slow part keeps
its accuracy beside a fast part.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armblocks.analysis.elimination import EPSILON, THRESHOLD, SystemMatrix
from armblocks.analysis.modes import eigenvalues, in_order, irreducible_parts
from armblocks.analysis.scaling import balanced, scaled
from armblocks.analysis.state_space import StateSpaceModel
from armblocks.extras import from_extra

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Indices = NDArray[np.intp]

MAX_GROWTH = 100.0
"""Maximum norm of ``A - B D^-1 C``, in norms of A, if zeros are computed as its eigenvalues only."""


class ZeroPencil(NamedTuple):
    """``det(M - s N) = 0`` at the zeros; ``tolerance`` is the size of the rounding errors of M.

    ``large`` is ``None``, or a matrix whose large eigenvalues are more accurate than the eigenvalues of the
    pencil.
    """

    M: Array
    N: Array
    tolerance: float
    large: Array | None = None

    def roots(self) -> Complex:
        """The zeros."""
        with from_extra("analysis", "zeros of a linear system"):
            from scipy.linalg import eigvals

        if self.large is None:
            return eigenvalues(self.M)
        # The errors are relative to the norm: small zeros are taken from the pencil, large zeros from the
        # matrix.
        small, large = (
            found[np.argsort(np.abs(found))] for found in (eigvals(self.M, self.N), eigvals(self.large))
        )
        limit = math.sqrt(float(np.linalg.norm(self.M)) * float(np.linalg.norm(self.large)))
        count = int((np.abs(large) <= limit).sum())
        return np.concatenate([small[:count], large[count:]])


class Reduction(NamedTuple):
    """A system with an invertible ``D`` and the zeros of another, as parts of a matrix.

    ``gain``: for a system with one input and one output the leading coefficient of its numerator, 0 if its
    transfer function is 0.
    """

    matrix: SystemMatrix
    states: Indices
    outputs: Indices
    inputs: Indices
    gain: float


def zeros(system: StateSpaceModel) -> Complex:
    """The invariant zeros: the numbers s for which ``[[A - s I, B], [C, D]]`` has a lower rank than usual."""
    return in_order(_joined([pencil.roots() for pencil in zero_pencils(system)]))


def zeros_and_gain(system: StateSpaceModel) -> tuple[Complex, float]:
    """The zeros, and the leading coefficient of the numerator, of a system with one input and one output."""
    reduction = _reduced(system)
    return in_order(_joined([pencil.roots() for pencil in _pencils(reduction)])), reduction.gain


def zero_pencils(system: StateSpaceModel) -> list[ZeroPencil]:
    """Independent eigenvalue problems, whose eigenvalues together are the zeros."""
    return _pencils(_reduced(system))


def _joined(found: list[Complex]) -> Complex:
    return np.concatenate([np.empty(0, dtype=np.complex128), *found])


def _reduced(system: StateSpaceModel) -> Reduction:
    n, (ny, nu) = system.order, system.D.shape
    parts = scaled(system.A, system.B, system.C, system.D)
    matrix = SystemMatrix(parts)
    states: Indices = np.arange(n, dtype=np.intp)
    outputs: Indices = np.arange(n, n + ny, dtype=np.intp)
    inputs: Indices = np.arange(n, n + nu, dtype=np.intp)
    gain, states, outputs = _full_row_rank(matrix, states, outputs, inputs)
    # The same reduction of the dual system, whose inputs are the outputs.
    _, states, inputs = _full_row_rank(matrix.transposed(), states, inputs, outputs)
    if system.is_siso:
        direct = float(matrix.values[outputs[0], inputs[0]]) if outputs.size else 0.0
        gain = gain * direct / float(parts.inputs[0]) / float(parts.outputs[0])
    return Reduction(matrix, states, outputs, inputs, gain)


def _full_row_rank(
    matrix: SystemMatrix, states: Indices, outputs: Indices, inputs: Indices
) -> tuple[float, Indices, Indices]:
    """Reduce to a system with the same finite zeros whose ``D`` has full row rank.

    Returns the product of the pivots among the entries of C, the remaining states and outputs. ``matrix`` is
    changed.
    """
    gain = 1.0
    pivots: list[tuple[int, int]] = []
    free = inputs
    while True:
        while (pivot := matrix.largest(outputs, free)) is not None:
            outputs, free = outputs[outputs != pivot[0]], free[free != pivot[1]]
            _eliminate_below(matrix, pivot, outputs)
            pivots.append(pivot)
        pivot = matrix.largest(outputs, states)
        if pivot is None:
            return gain, states, np.array([row for row, _ in pivots], dtype=np.intp)
        output = pivot[0]
        dual = matrix.transposed()
        dual.concentrate(states, output)
        state = int(states[np.argmax(np.abs(matrix.values[output, states]))])
        states = states[states != state]
        # With the state z = C[output] x / C[output, state] this output is a multiple of z. Where it is 0,
        # the derivative of z is 0 too, which is the new output.
        factors, variances = dual.ratios((states, output), (state, output))
        matrix.subtract_column(state, states, factors, variances)
        matrix.values[output, states] = matrix.variances[output, states] = 0.0
        matrix.add_rows(states, state, factors, variances)
        gain *= float(matrix.values[output, state])
        outputs = np.where(outputs == output, state, outputs)
        for known in pivots:
            _eliminate_below(matrix, known, np.array([state]))


def _eliminate_below(matrix: SystemMatrix, pivot: tuple[int, int], rows: Indices) -> None:
    """Subtract multiples of the row of the pivot from other rows, so that its column is 0 there."""
    row, column = pivot
    factors, variances = matrix.ratios((rows, column), pivot)
    matrix.subtract_row(row, rows, factors, variances)
    matrix.values[rows, column] = matrix.variances[rows, column] = 0.0


def _pencils(reduction: Reduction) -> list[ZeroPencil]:
    matrix, states, outputs, inputs, _ = reduction
    if not states.size:
        return []
    whole = np.concatenate([states, inputs])
    above, below = matrix.values[np.ix_(states, whole)], matrix.values[np.ix_(outputs, whole)]
    dual = matrix.transposed()
    while (pivot := matrix.largest(outputs, inputs)) is not None:
        outputs, inputs = outputs[outputs != pivot[0]], inputs[inputs != pivot[1]]
        _eliminate_below(dual, (pivot[1], pivot[0]), np.concatenate([states, inputs]))
    matrix.largest(states, states)  # sets rounding errors to 0
    dynamics = matrix.values[np.ix_(states, states)]
    n = states.size
    system_norm = float(np.linalg.norm(above)) + float(np.linalg.norm(below))
    if float(np.linalg.norm(dynamics)) > MAX_GROWTH * system_norm:
        # [C D] W = [0 *] eliminates the inputs without dividing by D.
        null_space = np.linalg.svd(below)[2][below.shape[0] :].T
        tolerance = THRESHOLD * whole.size * EPSILON * system_norm
        return [ZeroPencil(above @ null_space, null_space[:n], tolerance, dynamics)]
    pencils: list[ZeroPencil] = []
    for part in irreducible_parts(dynamics):
        no_ports = np.empty((0, len(part)))
        block = balanced(dynamics[np.ix_(part, part)], no_ports.T, no_ports)[0]
        tolerance = THRESHOLD * len(part) * EPSILON * float(np.linalg.norm(block))
        if len(part) == 1:
            tolerance = THRESHOLD * math.sqrt(float(matrix.variances[states[part[0]], states[part[0]]]))
        pencils.append(ZeroPencil(block, np.eye(len(part)), tolerance))
    return pencils

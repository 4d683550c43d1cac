"""Implicit equations; equations that are linear in their unknowns are solved here symbolically."""

from __future__ import annotations

from collections.abc import Sequence

import casadi
import numpy as np
from casadi import SX, Function, densify, depends_on, jacobian, substitute, symvar, vertcat
from numpy.typing import NDArray

from armblocks.diagram.components import strongly_connected
from armblocks.equations import substituted
from armblocks.equations.linear_solution import linear_solution
from armblocks.errors import AlgebraicLoopError


def solve_affine(w: SX, residual: SX) -> tuple[SX, list[int], list[tuple[list[int], SX]]]:
    """Eliminate the unknowns ``w (n,)`` of ``residual(w) = 0`` that can be solved symbolically.

    Returns all unknowns as functions of the remaining unknowns, the indices of the remaining unknowns, and
    the solved subsystems: the indices of their unknowns and the Jacobian of their residual. The subsystems
    are the strongly connected components of the dependency graph, in dependency order. A component whose
    residual is not linear in its unknowns remains.
    """
    solution, remaining = SX(w), list[int]()
    loops: list[tuple[list[int], SX]] = []
    derivatives = jacobian(residual, w)
    dependencies = _dependencies(residual, w)
    for loop in strongly_connected(dependencies):
        unknowns, derivative = w[loop], derivatives[loop, loop]
        if depends_on(derivative, unknowns) or has_discontinuity(residual[loop], unknowns):
            remaining.extend(loop)
            continue
        loops.append((loop, densify(derivative)))
        constant = substitute(residual[loop], unknowns, SX.zeros(len(loop)))
        solved = -_linear_solve(densify(constant), derivative)
        # Earlier solutions are substituted last, into a small expression, so that the work grows linearly.
        before = sorted({index for row in loop for index in dependencies[row]} - set(loop))
        solution[loop] = substituted(solved, w[before], solution[before]) if before else solved
    return solution, sorted(remaining), loops


def _linear_solve(right: SX, matrix: SX) -> SX:
    """``matrix^-1 right``: up to 2 x 2 by Cramer's rule, without pivots, else by pivoted elimination."""
    if matrix.numel() == 1:
        return right / densify(matrix)
    if matrix.numel() == 4:
        a, b, c, d = (densify(matrix)[i, j] for i in range(2) for j in range(2))
        first = d * right[0] - b * right[1]
        result = SX.zeros(2)
        result[0], result[1] = first, a * right[1] - c * right[0]
        return result / (a * d - b * c)
    return linear_solution(densify(matrix), right)


_DISCONTINUOUS = frozenset(
    getattr(casadi, name)
    for name in (
        *("OP_LT", "OP_LE", "OP_EQ", "OP_NE", "OP_NOT", "OP_AND", "OP_OR"),
        *("OP_FLOOR", "OP_CEIL", "OP_SIGN", "OP_FMOD", "OP_REMAINDER"),
    )
)
"""Discontinuous operations. Their derivatives do not show all dependences of the result on the operands."""


def has_discontinuity(expression: SX, unknowns: SX) -> bool:
    """Whether a discontinuous operation depends on the unknowns, as in ``if(u > 0, -1, 1)``."""
    function = _function_of(expression, unknowns)
    depends = [False] * function.sz_w()
    for k in range(function.n_instructions()):
        operation, inputs = function.instruction_id(k), function.instruction_input(k)
        if operation == casadi.OP_OUTPUT:
            continue
        if operation == casadi.OP_INPUT:
            dependent = inputs[0] == 0
        else:
            dependent = operation != casadi.OP_CONST and any(depends[i] for i in inputs)
            if dependent and operation in _DISCONTINUOUS:
                return True
        for output in function.instruction_output(k):  # a function call has several outputs
            depends[output] = dependent
    return False


def _function_of(expression: SX, unknowns: SX) -> Function:
    """The expression as a function of the unknowns, then of all its other symbols."""
    own = _symbols_in(unknowns)
    others = [entry for entry in symvar(expression) if entry.element_hash() not in own]
    return Function("f", [unknowns, vertcat(*others, SX(0, 1))], [expression])


def _dependencies(residual: SX, w: SX) -> list[list[int]]:
    """The indices of the unknowns in each residual, including unknowns in comparisons only."""
    sparsity = _function_of(residual, w).jac_sparsity(0, 0)
    dependencies: list[list[int]] = [[] for _ in range(residual.shape[0])]
    for row, column in zip(sparsity.row(), sparsity.get_col()):
        dependencies[row].append(column)
    return dependencies


def check_solvable(
    w: SX, residual: SX, p: SX, values: NDArray[np.float64], loops: Sequence[tuple[str, ...]], where: str
) -> None:
    """Raise ``AlgebraicLoopError`` for equations that are singular for the present parameter values.

    ``loops[i]``: the signals around the loop of unknown ``i``. Only equations that depend on parameters alone
    are checked here; other equations are checked during the run.
    """
    derivatives = jacobian(residual, w)
    parameters = _symbols_in(p)
    for loop in strongly_connected(_dependencies(residual, w)):
        unknowns, own, derivative = w[loop], residual[loop], derivatives[loop, loop]
        if not _symbols_in(derivative) <= parameters:
            continue
        matrix = _evaluated(derivative, p, values)
        scale = np.abs(matrix).max(initial=0.0)
        if not np.isfinite(scale) or np.linalg.matrix_rank(_equilibrated(matrix)) == len(loop):
            continue
        others = _symbols_in(own) - _symbols_in(unknowns)
        if not derivative.nnz() and not others <= parameters:
            raise AlgebraicLoopError(
                loops[loop[0]],
                where=where,
                why="with an equation that does not contain its unknown (index above 1)",
                allowed="equations that contain their unknown",
                fix="differentiate the equation with respect to time until it contains the unknown: "
                "twice for the force in a rod",
            )
        why = "with no solution or infinitely many"
        if others <= parameters:
            right = _evaluated(substitute(own, unknowns, SX.zeros(len(loop))), p, values).ravel()
            augmented_rank = np.linalg.matrix_rank(np.column_stack([matrix, right]))
            solvable = augmented_rank == np.linalg.matrix_rank(matrix)
            why = "with infinitely many solutions" if solvable else "with no solution"
        raise AlgebraicLoopError(
            loops[loop[0]],
            where=where,
            why=why,
            allowed="loops whose gain is not 1",
            fix="change a gain, or break the loop with an Integrator or a Unit Delay",
        )


def _symbols_in(expression: SX) -> set[int]:
    """The identities of the symbols of an expression."""
    return {entry.element_hash() for entry in symvar(expression)}


def _equilibrated(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """The matrix with the largest entry of every row, then of every column, near 1.

    Its numerical rank does not depend on units. Powers of two cause no rounding.
    """
    for axis in (1, 0):
        largest = np.abs(matrix).max(axis=axis, keepdims=True, initial=0.0)
        matrix = np.ldexp(matrix, -np.frexp(largest)[1])
    return matrix


def _evaluated(expression: SX, p: SX, values: NDArray[np.float64]) -> NDArray[np.float64]:
    (number,) = Function("f", [p], [densify(expression)]).call([values])
    return np.asarray(number)

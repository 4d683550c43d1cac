"""Implicit equations: those that are linear in their unknowns are solved here, in symbols."""

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
    """The unknowns ``w (n,)`` of ``residual(w) = 0`` as far as elimination gets.

    Returns all of them over the ones that remain, the places of those, and the circles that are solved: the
    places of their unknowns, and the derivative of their residual by them. Unknowns that depend on each other
    in circles are solved together, each circle by itself, in the order in which they need each other; a
    circle whose residual is not linear in its unknowns remains.
    """
    solution, remaining = SX(w), list[int]()
    circles: list[tuple[list[int], SX]] = []
    slopes = jacobian(residual, w)
    needs = _needs(residual, w)
    for circle in strongly_connected(needs):
        unknowns, slope = w[circle], slopes[circle, circle]
        if depends_on(slope, unknowns) or steps_with(residual[circle], unknowns):
            remaining.extend(circle)
            continue
        circles.append((circle, densify(slope)))
        constant = substitute(residual[circle], unknowns, SX.zeros(len(circle)))
        solved = -_divided(densify(constant), slope)
        # What was solved before is put in last, into a small expression, so that work grows with the count.
        before = sorted({place for row in circle for place in needs[row]} - set(circle))
        solution[circle] = substituted(solved, w[before], solution[before]) if before else solved
    return solution, sorted(remaining), circles


def _divided(right: SX, matrix: SX) -> SX:
    """``matrix^-1 right``. Up to 2 x 2 by Cramer's rule, which needs no pivots; beyond, with pivots."""
    if matrix.numel() == 1:
        return right / densify(matrix)
    if matrix.numel() == 4:
        a, b, c, d = (densify(matrix)[i, j] for i in range(2) for j in range(2))
        first = d * right[0] - b * right[1]
        result = SX.zeros(2)
        result[0], result[1] = first, a * right[1] - c * right[0]
        return result / (a * d - b * c)
    return linear_solution(densify(matrix), right)


_STEPS = frozenset(
    getattr(casadi, name)
    for name in (
        *("OP_LT", "OP_LE", "OP_EQ", "OP_NE", "OP_NOT", "OP_AND", "OP_OR"),
        *("OP_FLOOR", "OP_CEIL", "OP_SIGN", "OP_FMOD", "OP_REMAINDER"),
    )
)
"""Operations that jump: where an unknown goes through one, no derivative tells that an equation has it."""


def steps_with(expression: SX, unknowns: SX) -> bool:
    """Whether some operation that jumps depends on the unknowns, as in ``if(u > 0, -1, 1)``."""
    function = _function_of(expression, unknowns)
    depends = [False] * function.sz_w()
    for k in range(function.n_instructions()):
        operation, inputs = function.instruction_id(k), function.instruction_input(k)
        if operation == casadi.OP_OUTPUT:
            continue
        (place,) = function.instruction_output(k)
        if operation == casadi.OP_INPUT:
            depends[place] = inputs[0] == 0
            continue
        depends[place] = operation != casadi.OP_CONST and any(depends[i] for i in inputs)
        if depends[place] and operation in _STEPS:
            return True
    return False


def _function_of(expression: SX, unknowns: SX) -> Function:
    """The expression over the unknowns, then over everything else in it."""
    own = _symbols_in(unknowns)
    others = [entry for entry in symvar(expression) if entry.element_hash() not in own]
    return Function("f", [unknowns, vertcat(*others, SX(0, 1))], [expression])


def _needs(residual: SX, w: SX) -> list[list[int]]:
    """The unknowns in each residual, also those that only a comparison depends on."""
    sparsity = _function_of(residual, w).jac_sparsity(0, 0)
    needs: list[list[int]] = [[] for _ in range(residual.shape[0])]
    for row, column in zip(sparsity.row(), sparsity.get_col()):
        needs[row].append(column)
    return needs


def check_solvable(
    w: SX, residual: SX, p: SX, values: NDArray[np.float64], loops: Sequence[tuple[str, ...]], where: str
) -> None:
    """Raise ``AlgebraicLoopError`` for equations that are singular with the parameters as they are.

    ``loops[i]``: the signals around the loop of unknown ``i``. Only what follows from the parameters alone is
    found here; what depends on states or the time is noticed when it happens.
    """
    slopes = jacobian(residual, w)
    parameters = _symbols_in(p)
    for circle in strongly_connected(_needs(residual, w)):
        unknowns, own, slope = w[circle], residual[circle], slopes[circle, circle]
        if not _symbols_in(slope) <= parameters:
            continue
        matrix = _number(slope, p, values)
        scale = np.abs(matrix).max(initial=0.0)
        if not np.isfinite(scale) or np.linalg.matrix_rank(_equilibrated(matrix)) == len(circle):
            continue
        others = _symbols_in(own) - _symbols_in(unknowns)
        if not slope.nnz() and not others <= parameters:
            raise AlgebraicLoopError(
                loops[circle[0]],
                where=where,
                why="with an equation that does not contain its unknown (its index is above 1)",
                allowed="equations in which the unknown stands itself",
                fix="differentiate the equation in time until it does: twice for a rod and the force in it",
            )
        why = "with no solution or infinitely many"
        if others <= parameters:
            right = _number(substitute(own, unknowns, SX.zeros(len(circle))), p, values).ravel()
            widened = np.linalg.matrix_rank(np.column_stack([matrix, right]))
            solvable = widened == np.linalg.matrix_rank(matrix)
            why = "with infinitely many solutions" if solvable else "with no solution"
        raise AlgebraicLoopError(
            loops[circle[0]],
            where=where,
            why=why,
            allowed="loops whose gain is not 1",
            fix="change a gain, or break the loop with an Integrator or a Unit Delay",
        )


def _symbols_in(expression: SX) -> set[int]:
    """What identifies the symbols of an expression."""
    return {entry.element_hash() for entry in symvar(expression)}


def _equilibrated(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """The matrix with the largest entry of every row, then of every column, near 1.

    Its numerical rank does not depend on units. Powers of two leave all digits as they are.
    """
    for axis in (1, 0):
        largest = np.abs(matrix).max(axis=axis, keepdims=True, initial=0.0)
        matrix = np.ldexp(matrix, -np.frexp(largest)[1])
    return matrix


def _number(expression: SX, p: SX, values: NDArray[np.float64]) -> NDArray[np.float64]:
    (number,) = Function("f", [p], [densify(expression)]).call([values])
    return np.asarray(number)

"""Robot functions in independent coordinates, for robots with coupled joints.

With the constant matrix C of :class:`armblocks.robot.coordinate_map.CoordinateMap`, ``qd_tree = C qd``:
``tau = C' tau_tree``, ``J = J_tree C``, ``M = C' M_tree C``. The couplings hold exactly, without multipliers.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from casadi import DM, SX, mtimes, sparsify, vertcat
from numpy.typing import NDArray

from armblocks.robot.coordinate_map import CoordinateMap


def in_independent_coordinates(
    coordinates: CoordinateMap, inputs: Sequence[str], output: str, equations: Callable[..., SX]
) -> Callable[..., SX]:
    """The equations of a tree as equations in independent coordinates.

    Inputs named ``q``, ``qd``, ``qdd`` and outputs named ``tau``, ``J``, ``M``, ``C`` are transformed; other
    inputs and outputs do not depend on the choice of coordinates.
    """
    transforms = {"q": tree_coordinates, "qd": tree_speeds, "qdd": tree_speeds}

    def reduced_equations(*values: SX) -> SX:
        of_tree = [
            transforms[name](coordinates, value) if name in transforms else value
            for name, value in zip(inputs, values)
        ]
        return _reduced_output(coordinates, output, equations(*of_tree))

    return reduced_equations


def tree_coordinates(coordinates: CoordinateMap, q: SX) -> SX:
    """The coordinates of all joints of the tree, without offsets, for ``q`` (nq, 1)."""
    return _products(coordinates.positions, q)


def tree_speeds(coordinates: CoordinateMap, qd: SX) -> SX:
    """The speeds, or accelerations, of all joints of the tree for ``qd`` (nv, 1)."""
    return _products(coordinates.speeds, qd)


def generalised_forces(coordinates: CoordinateMap, tau: SX) -> SX:
    """The generalised forces of the independent coordinates, with the power of ``tau`` of the tree."""
    return mtimes(_sparse(coordinates.speeds).T, tau)


def reduced_columns(coordinates: CoordinateMap, J: SX) -> SX:
    """The matrix for independent speeds, from a matrix for speeds of the tree."""
    return mtimes(J, _sparse(coordinates.speeds))


def reduced_symmetric(coordinates: CoordinateMap, M: SX) -> SX:
    """``C' M C`` for a symmetric M; each pair of equal entries is computed once."""
    product = generalised_forces(coordinates, reduced_columns(coordinates, M))
    upper = SX(product)
    for i in range(upper.shape[0]):
        for j in range(i):
            upper[i, j] = upper[j, i]
    return upper


def _reduced_output(coordinates: CoordinateMap, name: str, value: SX) -> SX:
    match name:
        case "tau":
            return generalised_forces(coordinates, value)
        case "J":
            return reduced_columns(coordinates, value)
        case "M":
            return reduced_symmetric(coordinates, value)
        case "C":
            return generalised_forces(coordinates, reduced_columns(coordinates, value))
        case _:
            return value


def _products(matrix: NDArray[np.float64], values: SX) -> SX:
    """``matrix values``. Rows of opposite signs become an expression and its negative, computed once."""
    rows: list[SX] = []
    for row in matrix:
        factors = [(k, float(row[k])) for k in np.flatnonzero(row)]
        sign = -1.0 if factors and factors[0][1] < 0.0 else 1.0
        total = SX(0.0)
        for k, factor in factors:
            total = total + sign * factor * values[int(k)]
        rows.append(sign * total)
    return SX(vertcat(*rows))


def _sparse(matrix: NDArray[np.float64]) -> SX:
    """A constant matrix whose zeros are structural, so that products with them are omitted."""
    return SX(sparsify(DM(matrix)))

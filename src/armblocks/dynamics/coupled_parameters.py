"""Regrouped inertial parameters of robots whose couplings make joints depend on others.

In a parallelogram the rods have the angular velocity of the links beside them. Parameters of different bodies
then have the same effect on the independent coordinates, although no joint is between these bodies. Such
groups follow from the geometry of the whole mechanism. They are found numerically. The torque is linear in
the parameters: it is the product of a matrix, here at random states, and the vector of the parameters. If a
column of this matrix depends linearly on the columns before it, its parameter can be replaced.

All operations have a fixed order and are defined by IEEE 754, so that the parameters have the same bits on
every machine.

Source: Gautier, *Numerical calculation of the base inertial parameters of robots*, J. Robotic Systems 8(4),
1991.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import casadi
import numpy as np
from casadi import SX, Function, densify, jacobian, reshape, vec, vertcat
from numpy.typing import NDArray

from armblocks import rounded_functions
from armblocks.dynamics.joint_motion import entries, joint_motions
from armblocks.dynamics.reduction import generalised_forces, tree_coordinates, tree_speeds
from armblocks.dynamics.rnea import rnea
from armblocks.dynamics.robot_trace import column_sum
from armblocks.equations.constant_folding import operation_value, results_of_operations
from armblocks.robot.robot import Robot
from armblocks.robot.tree import BASE, Body, KinematicTree
from armblocks.spatial.inertia import RigidInertia
from armblocks.spatial.vectors import Scalar, Symmetric

Array = NDArray[np.float64]
PARAMETERS = 10
"""Inertial parameters of a body: mass, first moment x y z, second moment xx yy zz xy yz xz."""
_CIRCULAR = {int(casadi.OP_SIN): "sin", int(casadi.OP_COS): "cos"}
MASS, FIRST, SECOND = (0,), (1, 2, 3), (4, 5, 6, 7, 8, 9)
DEPENDENT, INDEPENDENT = 1e-11, 1e-7
"""Remainders of a column, relative to its norm: below the first number the column depends on others, above
the second it does not. Between them the parameters are not regrouped."""
ROUNDING = 1e-12
"""Shares of a parameter below this fraction of the others are rounding errors."""
CHECKED_STATES = 8
"""States at which the torques of the new parameters are compared."""


def regrouped_by_couplings(tree: KinematicTree, robot: Robot) -> KinematicTree:
    """A tree with the same equations of motion in the independent coordinates of ``robot``, and fewer terms.

    ``tree``: the tree of the robot without couplings. The parameters of the bodies between base and tip are
    preferred to the parameters of the rods beside them. The tree is returned unchanged if this removes no
    parameter.
    """
    effects = _Effects(tree, robot)
    states = -(-2 * PARAMETERS * tree.n // max(robot.nv, 1))
    given = _parameters(tree)
    found = _regrouped(effects.at(states), given, _preferred(tree))
    if found is None or np.count_nonzero(found) >= np.count_nonzero(given):
        return tree
    check = effects.at(CHECKED_STATES)
    error, size = np.zeros(len(check)), np.zeros(len(check))
    for k in range(len(given)):
        error += check[:, k] * (found[k] - given[k])
        size += abs(check[:, k] * given[k])
    if np.any(abs(error) > ROUNDING * size):
        return tree
    return _with_parameters(tree, found.tolist())


def _parameters(tree: KinematicTree) -> Array:
    """The parameters of all bodies in one column (10 n,)."""
    rows = [(body.inertia.mass, *body.inertia.first, *body.inertia.second) for body in tree.bodies]
    return np.array(rows, dtype=np.float64).ravel()


def _with_parameters(tree: KinematicTree, parameters: Sequence[Scalar]) -> KinematicTree:
    """The tree with ``parameters`` (10 n,) of all bodies; numbers or symbols."""
    bodies: list[Body] = []
    for k, body in enumerate(tree.bodies):
        m, x, y, z, *second = parameters[PARAMETERS * k : PARAMETERS * (k + 1)]
        bodies.append(replace(body, inertia=RigidInertia(m, (x, y, z), Symmetric(*second))))
    return replace(tree, bodies=tuple(bodies))


def _preferred(tree: KinematicTree) -> list[int]:
    """The order in which parameters are kept: the bodies from base to tip, then those beside them.

    Of the bodies beside them first moments are preferred, because they need the fewest operations.
    """
    path: list[int] = []
    body = tree.tip.body
    while body != BASE:
        path.insert(0, body)
        body = tree.bodies[body].parent
    beside = [k for k in range(tree.n) if k not in path]
    of_path = [PARAMETERS * body + k for body in path for k in (*MASS, *FIRST, *SECOND)]
    return of_path + [PARAMETERS * body + k for body in beside for k in (*FIRST, *MASS, *SECOND)]


class _Effects:
    """The torques of unit parameters at random states."""

    def __init__(self, tree: KinematicTree, robot: Robot) -> None:
        self._robot = robot
        self._random = np.random.default_rng(0)
        parameters = SX.sym("parameters", PARAMETERS * tree.n)
        unit = _with_parameters(tree, entries(parameters))
        coordinates = robot.coordinate_map
        q, qd, qdd = SX.sym("q", robot.nq), SX.sym("qd", robot.nv), SX.sym("qdd", robot.nv)
        joints = joint_motions(unit, tree_coordinates(coordinates, q))
        rates, accelerations = (entries(tree_speeds(coordinates, motion)) for motion in (qd, qdd))
        of_tree = column_sum(rnea(unit, joints, rates, accelerations, tree.gravity))
        effects = jacobian(generalised_forces(coordinates, of_tree), parameters)
        # The C library's sines and cosines differ in the last place from one machine to the next.
        angles: list[SX] = []
        values: list[SX] = []
        self._functions: list[Callable[..., float]] = []

        def value_of(number: int, operands: Sequence[SX]) -> SX:
            if number not in _CIRCULAR or operands[0].is_constant():
                return operation_value(number, operands)
            angles.append(operands[0])
            self._functions.append(
                rounded_functions.sin if number == casadi.OP_SIN else rounded_functions.cos
            )
            values.append(SX.sym("value"))
            return values[-1]

        function = Function("effects", [q, qd, qdd], [vec(densify(effects))])
        (column,) = results_of_operations(function, [q, qd, qdd], value_of)
        self._angles = Function("angles", [q], [vertcat(*angles, SX(0, 1))])
        self._effects = Function(
            "effects", [q, qd, qdd, vertcat(*values, SX(0, 1))], [reshape(column, *effects.shape)]
        )

    def at(self, states: int) -> Array:
        """The matrix of effects (states nv, 10 n) at the given number of random states."""
        return np.vstack([self._at_random_state() for _ in range(states)])

    def _at_random_state(self) -> Array:
        robot = self._robot
        q, qd, qdd = (self._random.uniform(-2.0, 2.0, size) for size in (robot.nq, robot.nv, robot.nv))
        angles = self._angles(q).full().ravel().tolist()
        values = [function(angle) for function, angle in zip(self._functions, angles)]
        return np.array(self._effects(q, qd, qdd, values).full())


def _regrouped(effects: Array, given: Array, order: Sequence[int]) -> Array | None:
    """The parameters with the same torques as ``given``, without the parameters of dependent columns.

    Gauss-Jordan elimination with row pivots; columns are taken in ``order``. ``None``: rounding errors decide
    whether a column depends on others.
    """
    work, sizes = effects.copy(), abs(effects).max(axis=0)
    kept: list[int] = []
    free = np.ones(len(work), dtype=bool)
    rows: list[int] = []
    dependent: list[int] = []
    for k in order:
        if sizes[k] <= ROUNDING * sizes.max():
            continue  # a parameter without effect
        row = int(np.argmax(np.where(free, abs(work[:, k]), -1.0)))
        remainder = abs(work[row, k]) / sizes[k] if free[row] else 0.0
        if remainder <= DEPENDENT:
            dependent.append(k)
            continue
        if remainder < INDEPENDENT:
            return None
        work[row] /= work[row, k]
        for other in range(len(work)):
            if other != row and work[other, k] != 0.0:
                work[other] -= work[other, k] * work[row]
        kept.append(k)
        rows.append(row)
        free[row] = False
    result, largest = np.zeros_like(given), np.zeros_like(given)
    for k, row in zip(kept, rows):
        shares = [float(given[k])]
        for j in dependent:
            share = float(work[row, j])
            if abs(share) * sizes[k] > ROUNDING * sizes[j]:
                shares.append(float(given[j] * share))
        result[k], largest[k] = math.fsum(shares), max(map(abs, shares))
    return np.where(abs(result) > ROUNDING * largest, result, 0.0)

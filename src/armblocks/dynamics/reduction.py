"""Robot functions in independent coordinates, for robots whose couplings make joints depend on others.

With the constant matrix C of :class:`armblocks.robot.coordinate_map.CoordinateMap`, ``qd_tree = C qd``:
``tau = C' tau_tree``, ``J = J_tree C``, ``M = C' M_tree C``. The couplings hold exactly, without multipliers.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps

import numpy as np
from casadi import DM, SX, mtimes, sparsify
from numpy.typing import NDArray

from armblocks.equations import Signature, TracedFunction, flatten, unflatten
from armblocks.equations.signatures import Slot
from armblocks.robot.coordinate_map import CoordinateMap
from armblocks.robot.robot import Robot

Trace = Callable[[Robot], TracedFunction]


def in_independent_coordinates(trace: Trace) -> Trace:
    """The trace of a function, which also accepts robots with couplings.

    Inputs ``q``, ``qd``, ``qdd`` and outputs ``tau``, ``J``, ``M``, ``C`` are those of the independent
    coordinates; other inputs and outputs do not depend on their choice.
    """

    @wraps(trace)
    def reduced_trace(robot: Robot) -> TracedFunction:
        if not robot.couplings:
            return trace(robot)
        return _reduced(trace(robot.uncoupled), robot)

    return reduced_trace


def tree_coordinates(coordinates: CoordinateMap, q: SX) -> SX:
    """The coordinates of all joints of the tree for ``q`` (nq, 1)."""
    return mtimes(_sparse(coordinates.positions), q) + SX(coordinates.offsets)


def tree_speeds(coordinates: CoordinateMap, qd: SX) -> SX:
    """The speeds, or accelerations, of all joints of the tree for ``qd`` (nv, 1)."""
    return mtimes(_sparse(coordinates.speeds), qd)


def generalised_forces(coordinates: CoordinateMap, tau: SX) -> SX:
    """The forces of the independent coordinates that do the work of ``tau`` of all joints of the tree."""
    return mtimes(_sparse(coordinates.speeds).T, tau)


def reduced_columns(coordinates: CoordinateMap, J: SX) -> SX:
    """A matrix that maps speeds of the tree, as a matrix that maps independent speeds."""
    return mtimes(J, _sparse(coordinates.speeds))


def _reduced(traced: TracedFunction, robot: Robot) -> TracedFunction:
    coordinates = robot.coordinate_map
    sizes = {"q": robot.nq, "qd": robot.nv, "qdd": robot.nv}
    inputs = Signature(
        tuple(Slot(s.name, (sizes[s.name],), s.unit) if s.name in sizes else s for s in traced.inputs)
    )
    n = robot.nv
    shapes = {"tau": (n,), "J": (6, n), "M": (n, n), "C": (n, n)}
    outputs = Signature(tuple(Slot(s.name, shapes.get(s.name, s.shape), s.unit) for s in traced.outputs))

    def equations(*values: SX) -> tuple[SX, ...]:
        of_tree = [
            tree_coordinates(coordinates, value)
            if slot.name == "q"
            else tree_speeds(coordinates, value)
            if slot.name in sizes
            else value
            for slot, value in zip(inputs, values)
        ]
        flat = [flatten(value, slot.shape) for value, slot in zip(of_tree, traced.inputs)]
        results = traced.casadi_function().call(flat, True, False)
        natural = [unflatten(result, slot.shape) for result, slot in zip(results, traced.outputs)]
        return tuple(
            _reduced_output(coordinates, slot.name, result) for slot, result in zip(outputs, natural)
        )

    return TracedFunction.trace(traced.name, inputs, outputs, equations)


def _reduced_output(coordinates: CoordinateMap, name: str, value: SX) -> SX:
    match name:
        case "tau":
            return generalised_forces(coordinates, value)
        case "J":
            return reduced_columns(coordinates, value)
        case "M" | "C":
            return generalised_forces(coordinates, reduced_columns(coordinates, value))
        case _:
            return value


def _sparse(matrix: NDArray[np.float64]) -> SX:
    """A constant matrix whose zeros are structural, so that products with them are omitted."""
    return SX(sparsify(DM(matrix)))

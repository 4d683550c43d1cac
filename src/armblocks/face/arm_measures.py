"""Measures of a configuration: manipulability, ellipsoids, operational-space inertia, limits, wrists."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import InputError, RobotError, UnknownNameError, counted
from armblocks.robot import FrictionModel, Robot
from armblocks.robot.fields import numbers

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

ROWS = {"all": slice(0, 6), "trans": slice(0, 3), "rot": slice(3, 6)}
"""Rows of the Jacobian by the name of the axes: linear, angular, or both."""
KINDS = ("yoshikawa", "asada", "condition", "smallest")
RANK = 1e-12
"""Singular values below this fraction of the largest singular value are zero."""


class _Function(Protocol):
    def __call__(self, q: ArrayLike) -> Array: ...


@dataclass(frozen=True, eq=False, kw_only=True)
class Ellipsoid(metaclass=ArgumentErrors):
    """Ellipsoids of velocities or forces: ``radii`` (m,), descending, and unit ``directions`` (m, m).

    ``directions[:, k]`` is the direction of ``radii[k]``, in world axes. For N configurations the arrays have
    a leading axis of N. A radius of forces is infinite in directions in which the arm balances any force
    without torques.
    """

    radii: Array
    directions: Array

    @property
    def volume(self) -> Array:
        """The product of the radii: the volume of the ellipsoid divided by the volume of the unit ball."""
        return np.asarray(self.radii.prod(axis=-1))


def axis_rows(axes: str, where: str) -> slice:
    """The rows of the Jacobian. Raises ``UnknownNameError``."""
    if axes not in ROWS:
        raise UnknownNameError("choice of axes", axes, ROWS, where=where)
    return ROWS[axes]


def manipulability_of(
    jacob0: _Function, inertia: _Function, q: ArrayLike, kind: str, axes: str, where: str
) -> Array:
    """The measure of the tool's mobility at ``q`` (nq,) or (N, nq), see :meth:`armblocks.Arm.maniplty`."""
    if kind not in KINDS:
        raise UnknownNameError("measure of manipulability", kind, KINDS, where=where)
    rows = axis_rows(axes, where)
    J = jacob0(q)
    if kind == "asada":
        return _asada(J, inertia(q), rows)
    values = np.asarray(np.linalg.svd(J[..., rows, :], compute_uv=False), dtype=np.float64)
    if kind == "yoshikawa":
        return np.asarray(values.prod(axis=-1))
    if kind == "smallest":
        return np.asarray(values[..., -1])
    largest = values[..., 0]
    return np.asarray(values[..., -1] / np.where(largest > 0, largest, 1.0))


def _asada(J: Array, M: Array, rows: slice) -> Array:
    """The smallest eigenvalue of the operational-space inertia over the largest; 0 at a singularity."""
    mobility = J @ np.linalg.solve(M, np.swapaxes(J, -1, -2))  # the inverse of the inertia
    values = np.linalg.eigvalsh(mobility)
    regular = values[..., 0] > RANK * values[..., -1]
    safe = np.where(regular[..., None, None], mobility, np.eye(6))
    inertia = np.linalg.inv(safe)[..., rows, rows]
    parts = np.linalg.eigvalsh(inertia)
    return np.asarray(np.where(regular, parts[..., 0] / parts[..., -1], 0.0))


def operational_inertia(jacob0: _Function, inertia: _Function, q: ArrayLike) -> Array:
    """``(J M⁻¹ J')⁻¹`` (6, 6); NaN where the rank of J is below 6."""
    J, M = jacob0(q), inertia(q)
    mobility = J @ np.linalg.solve(M, np.swapaxes(J, -1, -2))
    values = np.linalg.eigvalsh(mobility)
    regular = values[..., 0] > RANK * values[..., -1]
    safe = np.where(regular[..., None, None], mobility, np.eye(6))
    result = np.linalg.inv(safe)
    return np.where(regular[..., None, None], 0.5 * (result + np.swapaxes(result, -1, -2)), np.nan)


def velocity_ellipsoid(J: Array, axes: str, where: str) -> Ellipsoid:
    """The velocities of the tool for joint speeds of length 1."""
    part = J[..., axis_rows(axes, where), :]
    directions, values, _ = np.linalg.svd(part)
    missing = part.shape[-2] - values.shape[-1]
    if missing > 0:  # fewer joints than directions
        values = np.concatenate([values, np.zeros((*values.shape[:-1], missing))], axis=-1)
    return Ellipsoid(radii=values, directions=directions)


def force_ellipsoid(J: Array, axes: str, where: str) -> Ellipsoid:
    """The forces of the tool that joint torques of length 1 balance: inverse radii, same directions."""
    velocities = velocity_ellipsoid(J, axes, where)
    values = velocities.radii[..., ::-1]
    largest = values[..., -1:]
    with np.errstate(divide="ignore"):
        radii = np.where(values > RANK * largest, 1.0 / values, np.inf)
    return Ellipsoid(radii=radii, directions=velocities.directions[..., ::-1])


def outside_limits(robot: Robot, q: ArrayLike) -> Flags:
    """For each coordinate whether it is outside the limits of its joint, (nq,) or (N, nq)."""
    where = f"islimit of robot '{robot.name}'"
    rows = numbers(q, where=where)
    if rows.ndim not in (1, 2) or rows.shape[-1] != robot.nq:
        raise InputError(
            f"q has the shape {rows.shape}",
            where=where,
            allowed=f"({robot.nq},) or (N, {robot.nq})",
            fix=f"give {counted(robot.nq, 'coordinate')}",
        )
    low, high = robot.qlim.T
    return np.asarray(~((rows >= low) & (rows <= high)))


def perturbed(robot: Robot, amount: float, seed: int) -> Robot:
    """The robot with masses and inertias scaled at random, see :meth:`armblocks.Arm.perturb`."""
    if not 0.0 <= amount < 1.0:
        raise InputError(
            f"the perturbation is {amount:g}",
            where=f"perturb of robot '{robot.name}'",
            allowed="0 to less than 1: masses stay positive",
            fix="give 0.1 for 10 %",
        )
    random = np.random.default_rng(seed)
    changed = robot
    for link in robot.links:
        mass, inertia = (1.0 + amount * random.uniform(-1.0, 1.0) for _ in range(2))
        scaled = tuple(tuple(inertia * entry for entry in row) for row in link.inertia)
        changed = changed.with_link(link.name, mass=mass * link.mass, inertia=scaled)
    return replace(changed, name=f"P/{robot.name}")


def has_spherical_wrist(robot: Robot) -> bool:
    """Whether the last three joints before the tool are revolute and their axes meet in a point."""
    from armblocks.dynamics.closed_form.axes import chain_of

    try:
        chain = chain_of(robot, None)
    except RobotError:
        return False  # joints of other types, or joints beside the chain
    if len(chain.axes) < 3:
        return False
    first, second, third = wrist = chain.axes[-3:]
    if any(axis.prismatic for axis in wrist) or first.parallel(second) or second.parallel(third):
        return False
    return chain.common_point(*wrist) is not None


def friction_model_of(model: FrictionModel | str, where: str) -> FrictionModel:
    """The friction model, also from its name. Raises UnknownNameError."""
    if not isinstance(model, str):
        return model
    names = {known.value: known for known in FrictionModel}
    if model not in names:
        raise UnknownNameError("friction model", model, names, where=where)
    return names[model]

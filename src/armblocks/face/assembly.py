"""Consistent configurations of arms with constraints."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import InputError, counted
from armblocks.robot import Robot
from armblocks.robot.fields import numbers

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Assembly(metaclass=ArgumentErrors):
    """A state that satisfies the constraints of a robot.

    - ``q`` (nq,) rad or m, ``qd`` (n,) rad/s or m/s: the state.
    - ``degrees_of_freedom``: of the mechanism at regular configurations.
    - ``instantaneous_mobility``: degrees of freedom at ``q``, larger where ``q`` is singular.
    - ``redundant``: the number of redundant equations of each constraint.
    - ``residual``: the largest residual, m or cosine of an angle.
    - ``free_joints``: the joints that can move at a singular ``q``.
    - ``branches`` (b, n): for one degree of freedom, the directions of the motions through a singular ``q``,
      each of length 1. With two or more, ``q`` is a bifurcation, where the mechanism can change to another
      branch.
    """

    q: Array
    qd: Array
    degrees_of_freedom: int
    instantaneous_mobility: int
    redundant: dict[str, int]
    residual: float
    free_joints: tuple[str, ...] = ()
    branches: Array = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def bifurcation(self) -> bool:
        """Whether several motions of a mechanism with one degree of freedom cross at ``q``."""
        return len(self.branches) > 1

    @property
    def singular(self) -> bool:
        """Whether the mechanism can move in more directions at ``q`` than at other configurations."""
        return self.instantaneous_mobility > self.degrees_of_freedom

    def __str__(self) -> str:
        dof = self.degrees_of_freedom
        lines = [counted(dof, "degree of freedom", "degrees of freedom")]
        if self.singular:
            joints = ", ".join(self.free_joints)
            mobility = counted(self.instantaneous_mobility, "degree of freedom", "degrees of freedom")
            lines.append(f"singular: {mobility} at this configuration, of the joints {joints}")
            if self.bifurcation:
                lines.append(f"bifurcation: {len(self.branches)} branches of the motion cross here")
        for name, count in self.redundant.items():
            lines.append(f"constraint '{name}': {counted(count, 'redundant equation')}")
        return "\n".join(lines)


def assemble(robot: Robot, q: ArrayLike | None, qd: ArrayLike | None, locked: Sequence[str]) -> Assembly:
    """The state near ``q`` and ``qd`` that satisfies the constraints, see :meth:`Arm.assemble`."""
    from armblocks.dynamics.mechanism import mechanism

    guess = robot.neutral if q is None else coordinates(robot, "q", q, robot.nq)
    speeds = np.zeros(robot.nv) if qd is None else coordinates(robot, "qd", qd, robot.nv)
    functions = mechanism(robot)
    found = functions.assembled(guess, locked)
    mobility = functions.mobility(found)
    one = mobility.singular and mobility.degrees_of_freedom == 1
    directions = functions.branches(found) if one else []
    return Assembly(
        q=found,
        qd=functions.consistent_speeds(found, speeds, locked),
        degrees_of_freedom=mobility.degrees_of_freedom,
        instantaneous_mobility=mobility.instantaneous,
        redundant=dict(Counter(mobility.redundant)),
        residual=float(np.abs(functions.residuals(found)).max(initial=0.0)),
        free_joints=functions.free_joints(found) if mobility.singular else (),
        branches=np.array(directions).reshape(-1, robot.nv),
    )


def coordinates(robot: Robot, name: str, value: ArrayLike, size: int) -> Array:
    """The argument ``name`` as finite numbers (size,). Raises InputError."""
    vector = numbers(value, where=f"{name} of robot '{robot.name}'")
    if vector.shape != (size,) or not np.isfinite(vector).all():
        raise InputError(
            f"{name} has the shape {vector.shape}" if vector.shape != (size,) else f"{name} is not finite",
            where=f"robot '{robot.name}'",
            allowed=f"({size},), finite numbers",
            fix="give one number for each coordinate",
        )
    return vector

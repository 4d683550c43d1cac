"""Dynamics of an arm with the inertial parameters of links as arguments."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.compiler import Kernel, cached_kernel
from armblocks.errors import InputError
from armblocks.robot import Robot

Array = NDArray[np.float64]


class ParametricFunction(Protocol):
    """A function whose last argument is the parameters (k, 10), or (N, k, 10) of a batch."""

    def __call__(self, *arguments: ArrayLike, out: Array | None = None, threads: int = 1) -> Array: ...


class ParametricArm(metaclass=ArgumentErrors):
    """The dynamics of a robot as functions of the inertial parameters of some links.

    The code is compiled once for all values. The last argument of each method is ``parameters`` (k, 10), one
    row for each of the k ``links``: mass (kg), centre of mass x y z (m, in the frame of the link), inertia xx
    yy zz xy yz xz (kg m2, about the centre of mass, in link axes). ``defaults`` are the values of the
    description. The values are not checked: negative masses and impossible inertias are allowed.

    Arguments are positional, one sample or a batch of N samples; ``out=`` and ``threads=`` as for
    :class:`armblocks.Arm`, which makes this object: ``arm.parametric(["upper", "lower"])``.
    """

    def __init__(
        self, robot: Robot, links: Sequence[str], near: ArrayLike | None = None, key: str = ""
    ) -> None:
        self.robot = robot
        self.links = (links,) if isinstance(links, str) else tuple(links)
        for link in self.links:
            robot.link(link)
        if not self.links or len(set(self.links)) < len(self.links):
            raise InputError(
                "a link occurs twice" if self.links else "no link is named",
                where=f"parametric dynamics of robot '{robot.name}'",
                allowed="names of links, each once: " + ", ".join(link.name for link in robot.links),
                fix="name the links whose parameters are arguments",
            )
        self._near = None if near is None else np.asarray(near, dtype=float)
        self._key = key

    def __reduce__(self) -> tuple[type[ParametricArm], tuple[object, ...]]:
        """Pickle and copy the description alone; code is compiled again or loaded from the cache."""
        return ParametricArm, (self.robot, self.links, self._near, self._key)

    @property
    def defaults(self) -> Array:
        """The parameters of the description, a new (k, 10) array."""
        from armblocks.dynamics.inertial_inputs import parameter_rows

        return parameter_rows(self.robot, self.links)

    @cached_property
    def rne(self) -> ParametricFunction:
        """``rne(q, qd, qdd, parameters)`` → tau (n,) N m or N, as ``Arm.rne``."""
        return self._entry("rne")

    @cached_property
    def gravload(self) -> ParametricFunction:
        """``gravload(q, parameters)`` → tau (n,) N m or N, as ``Arm.gravload``."""
        return self._entry("gravload")

    @cached_property
    def inertia(self) -> ParametricFunction:
        """``inertia(q, parameters)`` → M (n, n), as ``Arm.inertia``."""
        return self._entry("inertia")

    @cached_property
    def accel(self) -> ParametricFunction:
        """``accel(q, qd, tau, parameters)`` → qdd (n,), as ``Arm.accel``.

        It is NaN or infinite for parameters without inertia at a joint.
        """
        return self._entry("accel")

    @cached_property
    def kinetic_energy(self) -> ParametricFunction:
        """``kinetic_energy(q, qd, parameters)`` → J, as ``Arm.kinetic_energy``."""
        return self._entry("kinetic_energy")

    @cached_property
    def potential_energy(self) -> ParametricFunction:
        """``potential_energy(q, parameters)`` → J, as ``Arm.potential_energy``."""
        return self._entry("potential_energy")

    def _entry(self, method: str) -> ParametricFunction:
        from armblocks.dynamics.inertial_inputs import trace_parametric

        near = None if self._near is None else self._near.tolist()
        key = f"parametric/{method}/{self._key}/{self.links}/near {near}"
        kernel: Kernel = cached_kernel(
            key, lambda: trace_parametric(method, self.robot, self.links, self._near)
        )
        return kernel.__call__

    def __repr__(self) -> str:
        return f"<ParametricArm {self.robot.name}: parameters of {', '.join(self.links)}>"

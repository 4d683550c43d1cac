"""The parameters of a robot that a torque log can determine, and the columns of their effect."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from armblocks.compiler import Kernel, cached_kernel
from armblocks.estimation.base_columns import BaseColumns, base_columns
from armblocks.estimation.consistency import Constraints
from armblocks.face.arm_kernels import ArmKernels
from armblocks.robot import Link, Motor, Robot
from armblocks.spatial.inertia import RigidInertia

Array = NDArray[np.float64]
Friction = Literal["asymmetric", "coulomb", "viscous", "none"]

FRICTION: dict[str, tuple[str, ...]] = {
    "asymmetric": ("B", "Tc+", "Tc-"),
    "coulomb": ("B", "Tc"),
    "viscous": ("B",),
    "none": (),
}
"""The estimated friction parameters of each joint; other parameters have the values of the description."""

INERTIAL = ("m", "mx", "my", "mz", "Ixx", "Iyy", "Izz", "Ixy", "Iyz", "Ixz")
_OF_MOTORS = ("Jm", "B", "Tc", "Tc+", "Tc-")
# Where only a sum of parameters has an effect, the first parameter in this order remains and the others are
# added to it.
_PREFERRED = ("B", "Tc", "Tc+", "Tc-", "Izz", "Ixx", "Ixy", "Iyz", "Ixz", "mx", "my", "Jm", "Iyy", "mz", "m")
_SEED = 20261127
_STATES = 60
_MOTOR_SHARE = 0.1
"""Smallest unit of a motor parameter, as a fraction of the value at which this parameter alone would give the
estimate of a base parameter."""


class TorqueModel:
    """``tau = X theta + rest``: the estimated parameters of a robot, with names ``link.quantity``.

    ``links``: links whose inertial parameters are estimated. Motor parameters refer to the motor's side.
    ``prior`` (p,): the values of the description.
    """

    def __init__(self, robot: Robot, links: Sequence[str], friction: str, *, rotor_inertia: bool) -> None:
        self.robot = robot
        self.links = tuple(links)
        self.names: list[str] = []
        self._sources: list[list[tuple[int, float]]] = []  # columns of the regressor, with factors
        prior: list[float] = []
        for k, name in enumerate(self.links):
            values = linear_parameters(robot.link(name))
            for i, quantity in enumerate(INERTIAL):
                self._add(f"{name}.{quantity}", [(10 * k + i, 1.0)])
                prior.append(float(values[i]))
        known = np.zeros(10 * len(self.links) + 4 * robot.uncoupled.n + 1)
        known[-1] = 1.0
        kept = FRICTION[friction]
        for link, columns in self._motor_columns():
            motor = link.motor or Motor()
            G = motor.gear_ratio
            viscous, coulomb = robot.friction_model.factors(G)
            forward, backward = motor.coulomb_friction
            entries: list[tuple[str, list[tuple[int, float]], float]] = [
                ("Jm", [(0, G * G)], motor.inertia),
                ("B", [(1, viscous)], motor.viscous_friction),
                ("Tc", [(2, coulomb), (3, -coulomb)], 0.5 * (forward - backward)),
                ("Tc+", [(2, coulomb)], forward),
                ("Tc-", [(3, coulomb)], backward),
            ]
            for name, terms, value in entries:
                raw = [
                    (columns[block][c], factor) for block, factor in terms for c in range(len(columns[block]))
                ]
                if (name == "Jm" and rotor_inertia) or name in kept:
                    self._add(f"{link.name}.{name}", raw)
                    prior.append(value)
                elif name != "Tc" and not (name.startswith("Tc") and "Tc" in kept):
                    for column, factor in raw:
                        known[column] = factor * value
        self.prior = np.array(prior)
        self._known = known

    def _add(self, name: str, columns: list[tuple[int, float]]) -> None:
        self.names.append(name)
        self._sources.append(columns)

    def _motor_columns(self) -> list[tuple[Link, list[list[int]]]]:
        """The joints with friction and rotor inertia, and for each block of the regressor their columns."""
        tree = self.robot.uncoupled
        m, first = tree.n, 10 * len(self.links)
        independent = {link.name for link in self.robot.moving_links}
        found: list[tuple[Link, list[list[int]]]] = []
        speed = 0
        for link in tree.moving_links:
            speeds = range(speed, speed + link.joint.nv)
            speed += link.joint.nv
            if link.name in independent or link.motor is not None:
                found.append((link, [[first + block * m + k for k in speeds] for block in range(4)]))
        return found

    @property
    def kernel(self) -> Kernel:
        """The compiled regressor of all columns."""
        from armblocks.dynamics.torque_regressor import trace_torque_regressor

        key = ArmKernels(self.robot, None, (Robot, ())).description_key
        return cached_kernel(
            f"torque regressor/{key}/{self.links}", lambda: trace_torque_regressor(self.robot, self.links)
        )

    def columns(self, q: Array, qd: Array, qdd: Array, chosen: Sequence[int]) -> tuple[Array, Array]:
        """``X (n, k, N)`` of the chosen parameters, and ``rest (n, N)``."""
        raw = self.kernel.columns(*map(np.ascontiguousarray, (q, qd, qdd)))
        X = np.empty((raw.shape[0], len(chosen), raw.shape[2]))
        for k, index in enumerate(chosen):
            (column, factor), *more = self._sources[index]
            X[:, k] = factor * raw[:, column]
            for other, weight in more:
                X[:, k] += weight * raw[:, other]
        used = np.flatnonzero(self._known)
        rest = np.einsum("c,jcN->jN", self._known[used], raw[:, used])
        return X, rest

    def base(self) -> tuple[BaseColumns, NDArray[np.bool_]]:
        """The base parameters, and which of them has an effect on the torque of each joint (n, b).

        Both are computed from the regressor at random states within the ranges of the joints.
        """
        random = np.random.default_rng(_SEED)
        count = max(_STATES, 4 * len(self.names) // self.robot.n)
        q = random_positions(self.robot, random, count)
        qd = random.normal(size=(count, self.robot.n))
        qdd = random.normal(size=(count, self.robot.n))
        X, _ = self.columns(q, qd, qdd, range(len(self.names)))
        order = sorted(range(len(self.names)), key=self._preference)
        base = base_columns(np.concatenate(X.transpose(0, 2, 1)), order)
        effect = np.abs(X[:, base.base]).max(axis=2)
        return base, effect > 1e-12 * np.maximum(effect.max(axis=0), 1e-300)

    def _preference(self, index: int) -> tuple[int, int]:
        """Links near the base come first, motors last: parameters are added to parameters of the parent."""
        quantity = self.names[index].rpartition(".")[2]
        link = index // 10 if index < 10 * len(self.links) else len(self.links)
        return link, _PREFERRED.index(quantity)

    def constraints(self, base: BaseColumns, values: Array, errors: Array) -> Constraints:
        """The conditions of physical consistency, with units of the size of the robot.

        ``values``, ``errors`` (b,): estimated base parameters and their standard errors, 0 if not identified.
        These estimates enlarge the units where the description has no friction, no masses, or far too small
        masses.
        """
        masses = [max(link.mass, 0.0) for link in map(self.robot.link, self.links)]
        typical = max(float(np.mean(masses)) if masses else 0.0, 1e-3)
        length = max(_typical_length(self.robot), 1e-2)
        scale = np.ones(len(self.names))
        for k, mass in enumerate(masses):
            unit = max(mass, 0.1 * typical)
            powers = np.array([0, 1, 1, 1, 2, 2, 2, 2, 2, 2])
            scale[10 * k : 10 * k + 10] = unit * length**powers
        first = 10 * len(self.links)
        scale[first:] = np.maximum(np.abs(self.prior[first:]), 1e-6)
        shares = np.abs(base.expansion(len(self.names)))
        certain = np.maximum(np.abs(values) - 3.0 * errors, 0.0)
        ratios = np.where(shares > 0.0, (certain / (shares @ scale))[:, None], 0.0)
        # The ten units of a body keep their proportions.
        of_bodies = ratios[:, :first].reshape(len(ratios), len(self.links), 10).max(axis=(0, 2), initial=1.0)
        scale[:first] *= np.repeat(of_bodies, 10)
        alone = (np.abs(values) + 3.0 * errors)[:, None] / np.where(shares > 0.0, shares, np.inf)
        scale[first:] = np.maximum(scale[first:], _MOTOR_SHARE * alone[:, first:].max(axis=0))
        quantities = [name.rpartition(".")[2] for name in self.names]
        positive = [k for k, name in enumerate(quantities) if k >= first and name != "Tc-"]
        negative = [k for k, name in enumerate(quantities) if k >= first and name == "Tc-"]
        return Constraints(
            bodies=np.arange(first, dtype=np.intp).reshape(-1, 10),
            positive=np.array(positive, dtype=np.intp),
            negative=np.array(negative, dtype=np.intp),
            scale=scale,
        )

    def robot_with(self, theta: Array) -> Robot:
        """The robot with the parameters ``theta`` (p,); all masses must be above 0."""
        robot = self.robot
        values = dict(zip(self.names, theta.tolist()))
        for k, name in enumerate(self.links):
            mass, centre, inertia = description_of(theta[10 * k : 10 * k + 10])
            robot = robot.with_link(name, mass=mass, centre_of_mass=centre, inertia=inertia)
        for link, _ in self._motor_columns():
            own = {key: values[f"{link.name}.{key}"] for key in _OF_MOTORS if f"{link.name}.{key}" in values}
            if not own:
                continue
            motor = link.motor or Motor()
            forward, backward = motor.coulomb_friction
            if "Tc" in own:
                forward, backward = own["Tc"], -own["Tc"]
            motor = replace(
                motor,
                inertia=own.get("Jm", motor.inertia),
                viscous_friction=own.get("B", motor.viscous_friction),
                coulomb_friction=(own.get("Tc+", forward), own.get("Tc-", backward)),
            )
            robot = robot.with_link(link.name, motor=motor)
        return robot


def linear_parameters(link: Link) -> Array:
    """The ten parameters of ``INERTIAL``: about the origin of the link frame."""
    mass, first, second = RigidInertia.about_centre(link.mass, link.centre_of_mass, link.inertia)
    return np.array([mass, *first, *second], dtype=np.float64)


def description_of(parameters: Array) -> tuple[float, Array, Array]:
    """Mass, centre of mass (3,) and inertia (3, 3) about this centre, of ten linear parameters."""
    mass, first = float(parameters[0]), parameters[1:4]
    xx, yy, zz, xy, yz, xz = parameters[4:]
    about_origin = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    centre = first / mass
    about_centre = about_origin - mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    return mass, centre, about_centre


def random_positions(robot: Robot, random: np.random.Generator, count: int) -> Array:
    """Positions (count, nq) within the ranges of the joints; without limits within 3 rad or 1 m."""
    low, high = robot.qlim.T
    wide = np.array([1.0 if entry.unit == "m" else 3.0 for entry in robot.positions])
    low = np.where(np.isfinite(low), low, np.where(np.isfinite(high), high - 2.0 * wide, -wide))
    high = np.where(np.isfinite(high), high, low + 2.0 * wide)
    return low + (high - low) * random.random((count, robot.nq))


def _typical_length(robot: Robot) -> float:
    """The mean distance between the frames of successive links, m."""
    lengths = [
        float(np.linalg.norm(np.add(link.before.translation, link.after.translation))) for link in robot.links
    ]
    centres = [float(np.linalg.norm(link.centre_of_mass)) for link in robot.links]
    return float(np.mean([*lengths, *centres]))

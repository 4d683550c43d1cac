"""Dynamics whose inertial parameters of chosen links are inputs: sweeps, tuning and identification.

The functions of :mod:`armblocks.dynamics.traces`, with one more input ``parameters`` (k, 10): one
row for each of k links, with its mass (kg), centre of mass x y z (m, in the frame of the link) and inertia xx
yy zz xy yz xz (kg m2, about the centre of mass, in link axes). They replace the numbers of the description.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from casadi import SX

from armblocks.dynamics.actuation import of_motors
from armblocks.dynamics.base_parameters import base_parameter_tree
from armblocks.dynamics.constrained import constrained_motion
from armblocks.dynamics.crba import crba
from armblocks.dynamics.energy import kinetic_energy, potential_energy
from armblocks.dynamics.forward import forward_dynamics
from armblocks.dynamics.friction import joint_friction, rotor_torques
from armblocks.dynamics.joint_motion import entries, joint_motions
from armblocks.dynamics.loads import with_inertias
from armblocks.dynamics.mechanism import Array
from armblocks.dynamics.rnea import rnea
from armblocks.dynamics.robot_trace import (
    body_of_speed,
    column_sum,
    differences,
    matrix_of_rows,
    robot_trace,
)
from armblocks.dynamics.springs import spring_energy, spring_torques
from armblocks.equations import TracedFunction
from armblocks.equations.signatures import Slot
from armblocks.robot.robot import Robot
from armblocks.robot.tree import Frame, KinematicTree
from armblocks.spatial.inertia import RigidInertia
from armblocks.spatial.vectors import Symmetric

_NO_INERTIA = ((0.0,) * 3,) * 3


def parameter_rows(robot: Robot, links: Sequence[str]) -> Array:
    """The parameters (k, 10) of links in the description."""
    rows: list[list[float]] = []
    for link in map(robot.link, links):
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = link.inertia
        rows.append([link.mass, *link.centre_of_mass, xx, yy, zz, xy, yz, xz])
    return np.array(rows).reshape(-1, 10)


class _Links:
    """The links with parameters as inputs, and the tree without their masses."""

    def __init__(self, robot: Robot, names: Sequence[str]) -> None:
        rest = tuple(
            replace(link, mass=0.0, centre_of_mass=(0.0,) * 3, inertia=_NO_INERTIA)
            if link.name in names
            else link
            for link in robot.links
        )
        self.robot = robot
        index = {link.name: k for k, link in enumerate(robot.links)}
        self._indices = [index[name] for name in names]
        without = replace(robot, links=rest)
        self._whole, self._tree = KinematicTree.of(without), base_parameter_tree(without)
        self.slots = (Slot("parameters", (len(names), 10), "kg, m, kg m2"),)

    def tree(self, parameters: SX, *, whole: bool = False) -> KinematicTree:
        """The tree with ``parameters`` (k, 10); ``whole``: with the links that are fixed to the base."""
        tree = self._whole if whole else self._tree
        added: list[tuple[Frame, RigidInertia]] = []
        for row, index in enumerate(self._indices):
            mass, x, y, z, *second = (parameters[row, k] for k in range(10))
            inertia = RigidInertia.at_centre(mass, Symmetric(*second)).shifted((x, y, z))
            added.append((tree.links[index], inertia))
        return with_inertias(tree, added)

    def torques(self, name: str, inputs: Sequence[str], near: Array | None) -> TracedFunction:
        """The torques of a motion. Without the inputs ``qd`` and ``qdd`` both are zero, without friction."""

        def equations(q: SX, *values: SX) -> SX:
            *motion, parameters = values
            tree = self.tree(parameters)
            rates, accelerations = (
                (entries(value) for value in motion) if motion else ([0.0] * tree.n, [0.0] * tree.n)
            )
            torques = [rnea(tree, joint_motions(tree, q), rates, accelerations, tree.gravity)]
            if motion:
                torques.append(rotor_torques(tree.robot, accelerations))
                torques.append(joint_friction(tree.robot, rates))
            return column_sum(*torques, spring_torques(tree, q))

        def of_tree(robot: Robot) -> TracedFunction:
            return robot_trace(name, robot, inputs, ("tau", (robot.n,), "N m"), equations, more=self.slots)

        return of_motors(of_tree)(self.robot, near)

    def inertia(self) -> TracedFunction:
        """The inertia matrix."""

        def equations(q: SX, parameters: SX) -> SX:
            tree = self.tree(parameters)
            M, bodies = crba(tree, joint_motions(tree, q)), body_of_speed(tree)
            return matrix_of_rows([[M[i][j] for j in bodies] for i in bodies])

        n = self.robot.n
        return robot_trace("inertia", self.robot, ("q",), ("M", (n, n), "kg m2"), equations, more=self.slots)

    def accel(self, near: Array | None) -> TracedFunction:
        """The accelerations under joint torques."""
        robot = self.robot

        def equations(q: SX, qd: SX, tau: SX, parameters: SX) -> SX:
            tree = self.tree(parameters)
            if robot.constraints:
                return constrained_motion(robot, tree, q, qd, tau, near=near, loads=(parameters,)).qdd
            rates = entries(qd)
            net = differences(entries(tau), joint_friction(robot, rates), spring_torques(tree, q))
            return column_sum(forward_dynamics(tree, q, rates, net))

        output = ("qdd", (robot.n,), "rad/s2")
        return robot_trace(
            "accel", robot, ("q", "qd", "tau"), output, equations, of_tree=False, more=self.slots
        )

    def kinetic_energy(self) -> TracedFunction:
        """The kinetic energy of bodies and rotors."""

        def equations(q: SX, qd: SX, parameters: SX) -> SX:
            tree = self.tree(parameters)
            return SX(kinetic_energy(tree, joint_motions(tree, q), entries(qd)))

        output = ("energy", (), "J")
        return robot_trace("kinetic_energy", self.robot, ("q", "qd"), output, equations, more=self.slots)

    def potential_energy(self) -> TracedFunction:
        """The potential energy in gravity and of the springs."""

        def equations(q: SX, parameters: SX) -> SX:
            tree = self.tree(parameters, whole=True)
            return SX(potential_energy(tree, joint_motions(tree, q)) + spring_energy(tree, q))

        output = ("energy", (), "J")
        return robot_trace("potential_energy", self.robot, ("q",), output, equations, more=self.slots)


PARAMETRIC: Mapping[str, Callable[[_Links, Array | None], TracedFunction]] = {
    "rne": lambda links, near: links.torques("rne", ("q", "qd", "qdd"), near),
    "gravload": lambda links, near: links.torques("gravload", ("q",), near),
    "inertia": lambda links, _: links.inertia(),
    "accel": lambda links, near: links.accel(near),
    "kinetic_energy": lambda links, _: links.kinetic_energy(),
    "potential_energy": lambda links, _: links.potential_energy(),
}
"""The functions by name."""


def trace_parametric(
    name: str, robot: Robot, links: Sequence[str], near: Array | None = None
) -> TracedFunction:
    """A function of ``PARAMETRIC`` whose last input are the parameters (k, 10) of k ``links``.

    Raises UnknownNameError for an unknown link.
    """
    for link in links:
        robot.link(link)
    return PARAMETRIC[name](_Links(robot, links), near)

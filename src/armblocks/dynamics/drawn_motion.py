"""The motion of a mechanism under joint torques and loads at frames: the equations of drawn mechanisms."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from casadi import SX, Function, vertcat

from armblocks.dynamics.base_parameters import regrouped
from armblocks.dynamics.constrained import (
    ConstrainedEquations,
    ConstrainedMotion,
    independent_relations,
    projected,
    restoring_rates,
)
from armblocks.dynamics.coupled_motion import coupled_accelerations
from armblocks.dynamics.forward import forward_dynamics
from armblocks.dynamics.frame_motions import FramesOfTree
from armblocks.dynamics.joint_motion import entries
from armblocks.dynamics.loads import with_inertias
from armblocks.dynamics.mechanism import Array
from armblocks.dynamics.reduction import tree_coordinates, tree_speeds
from armblocks.dynamics.rnea import Wrench
from armblocks.robot.constraints import Attachment
from armblocks.robot.robot import Robot
from armblocks.robot.tree import KinematicTree
from armblocks.spatial.inertia import RigidInertia
from armblocks.spatial.vectors import Symmetric, Vector


class Load(NamedTuple):
    """A force (N) and a moment (N m) on a frame of a robot, at its origin, in base axes."""

    at: Attachment
    force: Vector
    moment: Vector


class Accelerations(NamedTuple):
    """Accelerations (n, 1), and the rates of the states of an integration, of q (nq, 1) and qd (n, 1)."""

    qdd: SX
    q_rates: SX
    qd_rates: SX


class DrawnMotion:
    """The equations of a robot with bodies and loads at frames.

    ``state`` gives the consistent state, ``accelerations`` the motion. ``near`` (nq,): an assembled
    configuration, see :func:`armblocks.dynamics.constrained.independent_relations`. ``bodies``: the frames of
    bodies whose inertias are values of the run, in addition to the masses of the robot. Their values
    ``inertias`` are columns (10, 1) in the axes of the frames: mass (kg), first moment x y z (kg m), second
    moment xx yy zz xy yz xz about the origin (kg m2).
    """

    def __init__(self, robot: Robot, near: Array, bodies: Sequence[Attachment] = ()) -> None:
        self.robot = robot
        self._bodies = tuple(bodies)
        self._whole = KinematicTree.of(robot)
        self.tree = regrouped(self._whole)
        """The bodies and frames; without the inertias of the run, on which poses do not depend."""
        self._relations = independent_relations(robot, near)

    def state(self, q: SX, qd: SX, inertias: Sequence[SX]) -> tuple[SX, SX]:
        """The state that satisfies the closures, nearest to ``q`` (nq, 1) and ``qd`` (n, 1)."""
        if not self._relations:
            return q, qd
        at, speeds = SX.sym("q", self.robot.nq), SX.sym("qd", self.robot.nv)
        masses = _symbols(inertias)
        equations = ConstrainedEquations(self.robot, self.tree_with(masses), at, self._relations)
        consistent = Function("speeds", [at, speeds, *masses], [equations.consistent_speeds(speeds)])
        q = projected(self.robot, self.tree, q, self._relations)
        (qd,) = consistent.call([q, qd, *inertias], True, False)
        return q, qd

    def frames(self, q: SX, qd: SX, qdd: SX | None = None) -> FramesOfTree:
        """The motions of frames at a state of the independent coordinates."""
        if self.robot.couplings:
            coordinates = self.robot.coordinate_map
            q, qd = tree_coordinates(coordinates, q), tree_speeds(coordinates, qd)
            qdd = None if qdd is None else tree_speeds(coordinates, qdd)
        return FramesOfTree(self.tree, q, entries(qd), None if qdd is None else entries(qdd))

    def accelerations(self, q: SX, qd: SX, tau: SX, loads: Sequence[Load], inertias: Sequence[SX]) -> SX:
        """The accelerations (n, 1) at a consistent state under the joint torques ``tau`` (n, 1)."""
        frames = self.frames(q, qd)
        placed = [(self.tree.attached(load.at.link, load.at.pose), load.force, load.moment) for load in loads]
        wrenches = frames.on_bodies(placed)
        if not self._relations:
            tree = self.tree_with(inertias)
            if self.robot.couplings:
                return coupled_accelerations(self.robot, tree, q, qd, tau, wrenches)
            return SX(vertcat(*forward_dynamics(tree, q, entries(qd), entries(tau), wrenches)))
        # The bias of the relations is a derivative with respect to q at constant values of all others.
        at, speeds, given = (
            SX.sym("q", self.robot.nq),
            SX.sym("qd", self.robot.nv),
            SX.sym("tau", self.robot.nv),
        )
        masses = _symbols(inertias)
        equations = ConstrainedEquations(self.robot, self.tree_with(masses), at, self._relations)
        symbols = {body: SX.sym(f"wrench{body}", 6) for body in wrenches}
        acting = {body: _wrench(column) for body, column in symbols.items()}
        qdd, _ = equations.motion(speeds, given, acting)
        motion = Function("motion", [at, speeds, given, *symbols.values(), *masses], [qdd])
        columns = [SX(vertcat(*wrench.force, *wrench.moment)) for wrench in wrenches.values()]
        (result,) = motion.call([q, qd, tau, *columns, *inertias], True, False)
        return result

    def rates(self, q: SX, qd: SX, consistent: tuple[SX, SX], qdd: SX) -> Accelerations:
        """The rates of the states ``q``, ``qd``, whose consistent state is ``consistent``."""
        motion = ConstrainedMotion(*consistent, qdd, SX(0, 1))
        return Accelerations(qdd, *restoring_rates(self.robot, q, qd, motion))

    def tree_with(self, inertias: Sequence[SX]) -> KinematicTree:
        """The tree with the inertias of the run; its frames are those of ``tree``."""
        added = (
            (self._whole.attached(at.link, at.pose), _inertia(column))
            for at, column in zip(self._bodies, inertias)
        )
        return regrouped(with_inertias(self._whole, added))


def _symbols(columns: Sequence[SX]) -> list[SX]:
    return [SX.sym(f"inertia{k}", column.numel()) for k, column in enumerate(columns)]


def _inertia(column: SX) -> RigidInertia:
    mass, x, y, z, *second = entries(column)
    return RigidInertia(mass, (x, y, z), Symmetric(*second))


def _wrench(column: SX) -> Wrench:
    fx, fy, fz, nx, ny, nz = entries(column)
    return Wrench((fx, fy, fz), (nx, ny, nz))

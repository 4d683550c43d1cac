"""The regressor of inverse dynamics: joint torques are linear in the inertial and friction parameters.

``tau = Y(q, qd, qdd) pi + rest(q, qd, qdd)``. The parameters ``pi`` of a link are its mass, first moments and
second moments about the origin of the link frame, in link axes. In contrast to the mass, centre and central
inertia of the description, the torques are linear in them. Source: Khalil, Dombre, *Modeling, Identification
and Control of Robots*, 12.2 (dynamic identification model); Gautier, Khalil, *Direct calculation of minimum
set of inertial parameters of serial robots*, IEEE Trans. Robotics and Automation 1990.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from casadi import SX, densify, diag, horzcat, if_else, jacobian, vertcat

from armblocks.dynamics.base_parameters import regrouped
from armblocks.dynamics.joint_motion import entries, joint_motions
from armblocks.dynamics.rnea import rnea
from armblocks.dynamics.robot_trace import column_sum, robot_trace
from armblocks.dynamics.springs import spring_torques
from armblocks.equations import TracedFunction
from armblocks.errors import RobotError
from armblocks.robot.robot import Robot
from armblocks.robot.tree import BASE, KinematicTree
from armblocks.spatial.inertia import RigidInertia
from armblocks.spatial.vectors import Symmetric

INERTIAL = ("m", "mx", "my", "mz", "Ixx", "Iyy", "Izz", "Ixy", "Iyz", "Ixz")
"""The parameters of a link in the order of the columns: mass, first moments, second moments."""
MOTOR = ("inertia", "viscous", "forward", "backward")
"""The blocks of columns of the joints: factors of qdd, of qd, and 1 for a positive or a negative speed."""

_NO_INERTIA = ((0.0,) * 3,) * 3


def trace_torque_regressor(robot: Robot, links: Sequence[str]) -> TracedFunction:
    """``Y (n, 10 k + 4 m + 1)`` as a function of ``q, qd, qdd``, for the k named ``links``.

    Columns: ten for each link, in the order of ``INERTIAL``; then for the m degrees of freedom of the tree
    (joints that couplings determine included) the blocks of ``MOTOR`` at the joint side of the gear; last the
    torque of all other links, and of the springs. The torques act on the independent coordinates.

    Raises RobotError for a robot with closed loops, UnknownNameError for an unknown link.
    """
    if robot.closures:
        raise RobotError(
            f"the robot has the closed loop '{robot.closures[0].name}'",
            where=f"regressor of robot '{robot.name}'",
            allowed="chains, trees, and joints that couplings determine",
            fix="describe a parallelogram by couplings, or identify the open chain",
        )
    for link in links:
        robot.link(link)
    rest = tuple(
        replace(link, mass=0.0, centre_of_mass=(0.0,) * 3, inertia=_NO_INERTIA)
        if link.name in links
        else link
        for link in robot.links
    )
    tree = regrouped(KinematicTree.of(replace(robot, links=rest)))
    index = {link.name: k for k, link in enumerate(robot.links)}
    m = tree.n

    def equations(q: SX, qd: SX, qdd: SX) -> SX:
        pi = SX.sym("pi", 10 * len(links))
        loaded = _with_inertias(tree, [index[name] for name in links], pi)
        motions, rates, accelerations = joint_motions(tree, q), entries(qd), entries(qdd)
        of_links = column_sum(rnea(loaded, motions, rates, accelerations, tree.gravity))
        of_rest = column_sum(rnea(tree, motions, rates, accelerations, tree.gravity), spring_torques(tree, q))
        forward = vertcat(*(if_else(SX(rate) > 0.0, 1.0, 0.0) for rate in rates))
        backward = vertcat(*(if_else(SX(rate) < 0.0, 1.0, 0.0) for rate in rates))
        motors = [diag(vertcat(*accelerations)), diag(vertcat(*rates)), diag(forward), diag(backward)]
        # The derivative of a linear function does not contain pi.
        return densify(horzcat(jacobian(of_links, pi), *motors, of_rest))

    width = 10 * len(links) + len(MOTOR) * m + 1
    output = ("tau", (robot.n, width), "")
    return robot_trace("torque_regressor", robot, ("q", "qd", "qdd"), output, equations)


def _with_inertias(tree: KinematicTree, links: Sequence[int], pi: SX) -> KinematicTree:
    """The tree with the inertias ``pi`` (10 k) of links in addition."""
    bodies = list(tree.bodies)
    for row, index in enumerate(links):
        mass, x, y, z, *second = (pi[10 * row + k] for k in range(10))
        frame = tree.links[index]
        if frame.body == BASE:
            continue
        load = RigidInertia(mass, (x, y, z), Symmetric(*second)).moved(frame.pose)
        body = bodies[frame.body]
        bodies[frame.body] = replace(body, inertia=body.inertia.plus(load))
    return replace(tree, bodies=tuple(bodies))

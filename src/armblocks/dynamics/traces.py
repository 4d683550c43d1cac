"""All quantities of an arm as traced functions, and the table ``TRACES`` of these functions.

Shapes, units and frames of the inputs and outputs, here and in all functions below:

``q`` (nq,) rad or m, ``qd`` (n,) per second, ``qdd`` (n,) per second squared, ``tau`` (n,) N m or N, all in
the order of the robot's moving links. A ball joint has a quaternion w x y z in q; only its direction
counts, and an angular velocity in the axes of the distal frame in qd; NOTATION.md has the layout. ``n`` is
the number of degrees of freedom.
``wrench`` (6,): force (N) and moment (N m) of the tip on the environment, about the origin and in
the axes of the *last link's* frame (the toolbox's ``fext``, independent of the tool transform).
``payload`` (10,): mass (kg), centre x y z (m), inertia xx yy zz xy yz xz about that centre (kg m2), in the
axes of the *tool* frame.

Invalid robots are already rejected by :class:`armblocks.robot.Robot`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from casadi import SX, jacobian, mtimes, substitute, vertcat

from armblocks.dynamics.actuation import motor_forces, of_motors
from armblocks.dynamics.ball_joints import (
    difference,
    integrated,
    normalised,
    position_rates,
    structure_matrix,
)
from armblocks.dynamics.base_parameters import base_parameter_tree, regrouped
from armblocks.dynamics.closed_form.trace import trace_branches
from armblocks.dynamics.constrained import constrained_motion, restoring_rates
from armblocks.dynamics.crba import crba
from armblocks.dynamics.energy import first_moment, kinetic_energy, potential_energy
from armblocks.dynamics.forward import check_accelerations_exist, forward_dynamics
from armblocks.dynamics.friction import joint_friction, rotor_torques
from armblocks.dynamics.jacobian import jacobian_matrix, tool_columns, world_columns, yoshikawa
from armblocks.dynamics.jacobian_derivatives import JACOBIAN_DERIVATIVES
from armblocks.dynamics.joint_motion import entries, joint_motions
from armblocks.dynamics.joint_wrenches import reaction_wrenches
from armblocks.dynamics.kinematics import body_poses, constant_pose, frame_pose
from armblocks.dynamics.loads import tip_loads, tip_wrench, with_payload
from armblocks.dynamics.mechanism import Array
from armblocks.dynamics.pose_error import trace_pose_error_in_tool, trace_pose_error_in_world
from armblocks.dynamics.prescribed_motion import trace_hybrid_dynamics, trace_hybrid_dynamics_loaded
from armblocks.dynamics.reduction import (
    reduced_columns,
    tree_coordinates,
    tree_speeds,
)
from armblocks.dynamics.rnea import NO_WRENCH, rnea
from armblocks.dynamics.robot_trace import (
    body_of_speed,
    column_sum,
    differences,
    matrix_of_rows,
    robot_inputs,
    robot_trace,
)
from armblocks.dynamics.springs import spring_energy, spring_torques
from armblocks.equations import TracedFunction, signature
from armblocks.errors import RobotError
from armblocks.robot.robot import Robot
from armblocks.robot.tree import KinematicTree
from armblocks.spatial.inertia import RigidInertia
from armblocks.spatial.vectors import add, rotate, scale


def trace_fkine(robot: Robot, frame: str | None = None) -> TracedFunction:
    """``T (4, 4)``: pose of the tool, or of a frame of the robot, in the world; m."""
    tree = KinematicTree.of(robot).with_tool_at(frame)

    def equations(q: SX) -> SX:
        ground = constant_pose(tree.base)
        return frame_pose(tree.tool, body_poses(tree, entries(q), ground), ground).matrix()

    return robot_trace("fkine", robot, ("q",), ("T", (4, 4), "m"), equations)


def trace_link_poses(robot: Robot) -> TracedFunction:
    """``poses (L + 2, 4, 4)`` in the world: the base, every link in the robot's order, the tool; m."""
    tree = KinematicTree.of(robot)

    def equations(q: SX) -> SX:
        ground = constant_pose(tree.base)
        bodies = body_poses(tree, entries(q), ground)
        poses = [frame_pose(frame, bodies, ground) for frame in (*tree.links, tree.tool)]
        return SX(vertcat(*(pose.matrix() for pose in (ground, *poses))))

    return robot_trace("link_poses", robot, ("q",), ("poses", (len(robot.links) + 2, 4, 4), "m"), equations)


def trace_jacob0(robot: Robot, frame: str | None = None) -> TracedFunction:
    """``J (6, n)``: velocity of the tool's origin, then angular velocity of the tool, in world axes.

    ``frame``: the name of another frame of the robot that takes the place of the tool.
    """
    tree = KinematicTree.of(robot).with_tool_at(frame)

    def equations(q: SX) -> SX:
        return jacobian_matrix(world_columns(tree, entries(q)))

    return robot_trace("jacob0", robot, ("q",), ("J", (6, robot.n), ""), equations)


def trace_jacobe(robot: Robot, frame: str | None = None) -> TracedFunction:
    """``J (6, n)``: velocity of the tool's origin, then angular velocity of the tool, in tool axes.

    ``frame``: the name of another frame of the robot that takes the place of the tool.
    """
    tree = KinematicTree.of(robot).with_tool_at(frame)

    def equations(q: SX) -> SX:
        return jacobian_matrix(tool_columns(tree, q))

    return robot_trace("jacobe", robot, ("q",), ("J", (6, robot.n), ""), equations)


def trace_manipulability(robot: Robot) -> TracedFunction:
    """``w ()``: Yoshikawa's measure, see :func:`armblocks.dynamics.jacobian.yoshikawa`."""
    tree, coordinates = KinematicTree.of(robot), robot.coordinate_map

    def equations(q: SX) -> SX:
        if not robot.couplings:
            return yoshikawa(world_columns(tree, entries(q)))
        J = jacobian_matrix(world_columns(tree, entries(tree_coordinates(coordinates, q))))
        reduced = reduced_columns(coordinates, J)
        columns = [entries(SX(reduced[:, k])) for k in range(robot.nv)]
        return yoshikawa([((vx, vy, vz), (wx, wy, wz)) for vx, vy, vz, wx, wy, wz in columns])

    return robot_trace("manipulability", robot, ("q",), ("w", (), ""), equations, of_tree=False)


@of_motors
def trace_rne(robot: Robot) -> TracedFunction:
    """``tau (n,)`` of a motion, with rigid bodies, rotors, friction, springs and the robot's gravity."""
    tree = base_parameter_tree(robot)

    def equations(q: SX, qd: SX, qdd: SX) -> SX:
        rates, accelerations = entries(qd), entries(qdd)
        rigid = rnea(tree, joint_motions(tree, q), rates, accelerations, tree.gravity)
        of_motors = rotor_torques(tree.robot, accelerations), joint_friction(tree.robot, rates)
        return column_sum(rigid, *of_motors, spring_torques(tree, q))

    return robot_trace("rne", robot, ("q", "qd", "qdd"), ("tau", (robot.n,), "N m"), equations)


@of_motors
def trace_rne_loaded(robot: Robot) -> TracedFunction:
    """``tau (n,)`` as ``rne``, with a wrench at the tip and a payload at the tool."""
    tree = base_parameter_tree(robot)

    def equations(q: SX, qd: SX, qdd: SX, wrench: SX, payload: SX) -> SX:
        rates, accelerations = entries(qd), entries(qdd)
        loaded = with_payload(tree, payload)
        rigid = rnea(
            loaded, joint_motions(loaded, q), rates, accelerations, tree.gravity, tip_wrench(tree, wrench)
        )
        of_motors = rotor_torques(tree.robot, accelerations), joint_friction(tree.robot, rates)
        return column_sum(rigid, *of_motors, spring_torques(tree, q))

    inputs = ("q", "qd", "qdd", "wrench", "payload")
    return robot_trace("rne", robot, inputs, ("tau", (robot.n,), "N m"), equations)


@of_motors
def trace_gravload(robot: Robot) -> TracedFunction:
    """``tau (n,)`` that holds the arm at rest against gravity and its springs."""
    tree = base_parameter_tree(robot)

    def equations(q: SX) -> SX:
        no_motion = [0.0] * tree.n
        rigid = rnea(tree, joint_motions(tree, q), no_motion, no_motion, tree.gravity)
        return column_sum(rigid, spring_torques(tree, q))

    return robot_trace("gravload", robot, ("q",), ("tau", (robot.n,), "N m"), equations)


def trace_joint_wrenches(robot: Robot, near: Array | None = None) -> TracedFunction:
    """``wrenches (L + K, 6)`` as ``trace_joint_wrenches_loaded`` without loads."""
    return _joint_wrenches(robot, ("q", "qd", "qdd"), near)


def trace_joint_wrenches_loaded(robot: Robot, near: Array | None = None) -> TracedFunction:
    """``wrenches (L + K, 6)``: force (N), then moment (N m), of a motion with a wrench and a payload.

    Row k is the wrench that the parent exerts on link k through its joint, about the origin and in the axes
    of the distal frame of the joint. Its component along the axis is the torque of the rigid bodies, without
    friction and rotor inertia. The last rows belong to the closures: the wrench that the first link exerts
    on the second one, about the origin and in the axes of the second frame.
    """
    return _joint_wrenches(robot, ("q", "qd", "qdd", "wrench", "payload"), near)


def _joint_wrenches(robot: Robot, inputs: Sequence[str], near: Array | None) -> TracedFunction:
    tree, coordinates = KinematicTree.of(robot), robot.coordinate_map
    without_loops = replace(robot, constraints=robot.couplings)
    trace_of_tree = trace_rne if len(inputs) == 3 else trace_rne_loaded

    def equations(q: SX, qd: SX, qdd: SX, *loads: SX) -> SX:
        multipliers: list[SX] = []
        validity = SX(0.0)
        if robot.closures:
            free_torques = trace_of_tree(without_loops).casadi_function()
            (free,) = free_torques.call([q, qd, qdd, *loads], True, False)
            _, multipliers, validity = motor_forces(robot, q, free, qd, qdd, near)
        motion = [entries(tree_speeds(coordinates, value)) for value in (qd, qdd)]
        at_tip = tip_loads(robot, *loads) if loads else (NO_WRENCH, RigidInertia())
        tree_q = tree_coordinates(coordinates, q)
        wrenches = reaction_wrenches(tree, tree_q, motion[0], motion[1], multipliers, at_tip)
        return wrenches + validity

    rows = len(robot.links) + len(robot.closures)
    output = ("wrenches", (rows, 6), "")
    return robot_trace("joint_wrenches", robot, inputs, output, equations, of_tree=False)


def trace_inertia(robot: Robot) -> TracedFunction:
    """``M (n, n)``: joint-space inertia, rotors included; kg m2, kg m or kg."""
    tree = base_parameter_tree(robot)
    bodies = body_of_speed(tree)

    def equations(q: SX) -> SX:
        M = crba(tree, joint_motions(tree, q))
        return matrix_of_rows([[M[i][j] for j in bodies] for i in bodies])

    return robot_trace("inertia", robot, ("q",), ("M", (robot.n, robot.n), "kg m2"), equations)


def trace_coriolis(robot: Robot) -> TracedFunction:
    """``C (n, n)``: ``C qd`` is the velocity torque without friction, and ``dM/dt - 2 C`` is skew.

    The velocity torque is quadratic, ``c(q, qd) = C(q, qd) qd``; half its derivative with respect to ``qd``
    is the matrix of Christoffel symbols (Siciliano, Sciavicco, Villani, Oriolo, *Robotics*, 7.1.2 and 7.2.1).
    With ball joints, whose speeds are not rates of coordinates, the same connection is expressed in these
    speeds: ``C = (dc/dqd + M W) / 2`` with W of :func:`structure_matrix`.
    """
    tree = base_parameter_tree(robot)
    bodies = body_of_speed(tree)

    def equations(q: SX, qd: SX) -> SX:
        zero_gravity = (0.0, 0.0, 0.0)
        no_acceleration = [0.0] * tree.n
        # The speeds of the tree are expressions if couplings determine them, and symbols otherwise.
        speeds = SX.sym("speeds", tree.n) if robot.couplings else qd
        joints, rates = joint_motions(tree, q), entries(speeds)
        twice = jacobian(column_sum(rnea(tree, joints, rates, no_acceleration, zero_gravity)), speeds)
        W = structure_matrix(tree, rates)
        if W is not None:
            M = crba(tree, joints)
            twice = twice + mtimes(matrix_of_rows([[M[i][j] for j in bodies] for i in bodies]), W)
        C = SX(0.5 * twice)
        return SX(substitute(C, speeds, qd)) if robot.couplings else C

    return robot_trace("coriolis", robot, ("q", "qd"), ("C", (robot.n, robot.n), "N m s"), equations)


def trace_friction(robot: Robot) -> TracedFunction:
    """``tau (n,)`` that overcomes motor friction, with the sign of ``qd``; see :class:`FrictionModel`.

    The toolbox's ``friction`` has the opposite sign since release 9.
    """

    def equations(qd: SX) -> SX:
        return column_sum(joint_friction(robot.uncoupled, entries(qd)))

    return robot_trace("friction", robot, ("qd",), ("tau", (robot.n,), "N m"), equations)


def trace_accel(robot: Robot, near: Array | None = None) -> TracedFunction:
    """``qdd (n,)`` for given joint torques, with friction, gravity and rotor inertia.

    ``near``: coordinates near which closures are assembled to find their independent relations. Raises
    RobotError that names the joint if the inertia at a joint is zero.
    """
    tree = base_parameter_tree(robot)
    check_accelerations_exist(regrouped(KinematicTree.of(robot)))

    def equations(q: SX, qd: SX, tau: SX) -> SX:
        if robot.constraints:
            return constrained_motion(robot, tree, q, qd, tau, near=near).qdd
        rates = entries(qd)
        net_torque = differences(entries(tau), joint_friction(robot, rates), spring_torques(tree, q))
        return column_sum(forward_dynamics(tree, q, rates, net_torque))

    return robot_trace(
        "accel", robot, ("q", "qd", "tau"), ("qdd", (robot.n,), "rad/s2"), equations, of_tree=False
    )


def trace_accel_loaded(robot: Robot, near: Array | None = None) -> TracedFunction:
    """``qdd (n,)`` as ``accel``, with a wrench at the tip and a payload at the tool.

    Raises RobotError that names the joint if the inertia at a joint is zero for every payload.
    """
    tree = base_parameter_tree(robot)
    generic_payload = SX([1.0, 0.1, 0.2, 0.3, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    check_accelerations_exist(with_payload(regrouped(KinematicTree.of(robot)), generic_payload))

    def equations(q: SX, qd: SX, tau: SX, wrench: SX, payload: SX) -> SX:
        loaded, wrenches = with_payload(tree, payload), tip_wrench(tree, wrench)
        if robot.constraints:
            loads = (wrench, payload)
            motion = constrained_motion(robot, loaded, q, qd, tau, near=near, on_bodies=wrenches, loads=loads)
            return motion.qdd
        rates = entries(qd)
        net_torque = differences(entries(tau), joint_friction(robot, rates), spring_torques(tree, q))
        return column_sum(forward_dynamics(loaded, q, rates, net_torque, wrenches))

    inputs = ("q", "qd", "tau", "wrench", "payload")
    return robot_trace("accel", robot, inputs, ("qdd", (robot.n,), "rad/s2"), equations, of_tree=False)


def trace_constrained_motion(robot: Robot, near: Array | None = None) -> TracedFunction:
    """The consistent state nearest to ``q``, ``qd``, its motion under ``tau``, and the rates of a run.

    Outputs: ``q (nq,)``, ``qd (n,)``, ``qdd (n,)``; ``q_rates (nq,)``, ``qd_rates (n,)``: see
    :func:`armblocks.dynamics.constrained.restoring_rates`. ``near``: coordinates near which the constraints
    are assembled to find the independent relations. Raises RobotError that names the joint if the inertia at
    a joint is zero.
    """
    tree = KinematicTree.of(robot)
    check_accelerations_exist(regrouped(tree))

    def equations(q: SX, qd: SX, tau: SX) -> tuple[SX, ...]:
        motion = constrained_motion(robot, tree, q, qd, tau, near=near)
        return (motion.q, motion.qd, motion.qdd, *restoring_rates(robot, q, qd, motion))

    nq, n = (robot.nq,), (robot.n,)
    outputs = signature(
        ("q", nq, ""), ("qd", n, ""), ("qdd", n, ""), ("q_rates", nq, ""), ("qd_rates", n, "")
    )
    return TracedFunction.trace(
        "constrained_motion", robot_inputs(robot, ("q", "qd", "tau")), outputs, equations
    )


def trace_kinetic_energy(robot: Robot) -> TracedFunction:
    """``energy ()``, J, kinetic energy of bodies and rotors."""
    tree = base_parameter_tree(robot)

    def equations(q: SX, qd: SX) -> SX:
        return SX(kinetic_energy(tree, joint_motions(tree, q), entries(qd)))

    return robot_trace("kinetic_energy", robot, ("q", "qd"), ("energy", (), "J"), equations)


def trace_potential_energy(robot: Robot) -> TracedFunction:
    """``energy ()``, J, potential energy in gravity and of the springs.

    The part of gravity is zero if the centre of mass is at the world's origin.
    """
    tree = KinematicTree.of(robot)

    def equations(q: SX) -> SX:
        return SX(potential_energy(tree, joint_motions(tree, q)) + spring_energy(tree, q))

    return robot_trace("potential_energy", robot, ("q",), ("energy", (), "J"), equations)


def trace_centre_of_mass(robot: Robot) -> TracedFunction:
    """``centre (3,)`` of mass of all links in the world, m. Raises RobotError for a robot without mass."""
    tree = KinematicTree.of(robot)
    if not sum(link.mass for link in robot.links):
        raise RobotError(
            "no link has a mass, so there is no centre of mass",
            where=f"robot '{robot.name}'",
            allowed="at least one link with a mass above zero",
            fix="give the links their masses",
        )

    def equations(q: SX) -> SX:
        mass, moment = first_moment(tree, joint_motions(tree, q))
        centre = scale(1.0 / mass, moment)
        return SX(vertcat(*add(tree.base.translation, rotate(tree.base.rotation, centre))))

    return robot_trace("centre_of_mass", robot, ("q",), ("centre", (3,), "m"), equations)


def trace_position_rates(robot: Robot) -> TracedFunction:
    """``rates (nq,)``: dq/dt for the speeds ``qd``; equal to ``qd`` except for quaternions."""

    def equations(q: SX, qd: SX) -> SX:
        return column_sum(position_rates(robot, entries(q), entries(qd)))

    return robot_trace(
        "position_rates", robot, ("q", "qd"), ("rates", (robot.nq,), ""), equations, of_tree=False
    )


def trace_integrate(robot: Robot) -> TracedFunction:
    """``q (nq,)`` after the time ``dt`` (s) at constant ``qd``, with quaternions of length 1."""

    def equations(q: SX, qd: SX, dt: SX) -> SX:
        return column_sum(integrated(robot, entries(q), entries(qd), dt))

    return robot_trace(
        "integrate", robot, ("q", "qd", "dt"), ("q", (robot.nq,), ""), equations, of_tree=False
    )


def trace_difference(robot: Robot) -> TracedFunction:
    """``qd (n,)`` that leads from ``q0`` to ``q1`` in one second; a ball joint rotates by at most π."""

    def equations(q0: SX, q1: SX) -> SX:
        return column_sum(difference(robot, entries(q0), entries(q1)))

    return robot_trace("difference", robot, ("q0", "q1"), ("qd", (robot.n,), ""), equations, of_tree=False)


def trace_normalised(robot: Robot) -> TracedFunction:
    """``q (nq,)`` with quaternions of length 1."""

    def equations(q: SX) -> SX:
        return column_sum(normalised(robot, entries(q)))

    return robot_trace("normalised", robot, ("q",), ("q", (robot.nq,), ""), equations, of_tree=False)


FRAMED = ("fkine", "jacob0", "jacobe", "pose_error_in_world", "pose_error_in_tool", *JACOBIAN_DERIVATIVES)
"""The functions that take ``frame``, the name of a frame in the place of the tool."""
ASSEMBLED = (
    *("rne", "rne_loaded", "gravload", "accel", "accel_loaded"),
    *("joint_wrenches", "joint_wrenches_loaded"),
    *("hybrid_dynamics", "hybrid_dynamics_loaded"),
)
"""The functions that take ``near``, because they depend on the independent relations of closures."""
TRACES: Mapping[str, Callable[..., TracedFunction]] = {
    "fkine": trace_fkine,
    "link_poses": trace_link_poses,
    "jacob0": trace_jacob0,
    "jacobe": trace_jacobe,
    "pose_error_in_world": trace_pose_error_in_world,
    "pose_error_in_tool": trace_pose_error_in_tool,
    "branches": trace_branches,
    **JACOBIAN_DERIVATIVES,
    "manipulability": trace_manipulability,
    "rne": trace_rne,
    "rne_loaded": trace_rne_loaded,
    "joint_wrenches": trace_joint_wrenches,
    "joint_wrenches_loaded": trace_joint_wrenches_loaded,
    "gravload": trace_gravload,
    "inertia": trace_inertia,
    "coriolis": trace_coriolis,
    "friction": trace_friction,
    "accel": trace_accel,
    "accel_loaded": trace_accel_loaded,
    "hybrid_dynamics": trace_hybrid_dynamics,
    "hybrid_dynamics_loaded": trace_hybrid_dynamics_loaded,
    "kinetic_energy": trace_kinetic_energy,
    "potential_energy": trace_potential_energy,
    "centre_of_mass": trace_centre_of_mass,
    "position_rates": trace_position_rates,
    "integrate": trace_integrate,
    "difference": trace_difference,
    "normalised": trace_normalised,
}
"""The trace functions by name: ``TRACES["rne"](robot)``; those in ``FRAMED`` also take ``frame``, those
in ``ASSEMBLED`` also ``near``."""

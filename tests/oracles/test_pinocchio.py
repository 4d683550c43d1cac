"""Comparison with Pinocchio, an independent implementation; its models are built from the description.

Pinocchio's quaternions are x y z w, its planar joints have the cosine and sine of the angle, and the linear
velocities of its planar and free-flyer joints are in the axes of the moving body.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
import pytest
from numpy.testing import assert_allclose

from armblocks.dynamics.torque_regressor import trace_torque_regressor
from armblocks.robot import (
    Cylindrical,
    Free,
    Joint,
    Planar,
    Prismatic,
    Revolute,
    Robot,
    Screw,
    Spherical,
    Universal,
)
from armblocks.robot.tree import BASE, KinematicTree
from robots_for_tests import LAW_ROBOTS, build_unusual_robot, evaluate, random_states


def pinocchio_joints(joint: Joint) -> list[object]:
    """Return the joints of Pinocchio whose series is a joint."""
    axis = np.array(joint.axis)
    match joint:
        case Revolute():
            return [pin.JointModelRevoluteUnaligned(axis)]
        case Prismatic():
            return [pin.JointModelPrismaticUnaligned(axis)]
        case Screw():
            return [pin.JointModelHelicalUnaligned(axis, joint.pitch / (2 * np.pi))]
        case Cylindrical():
            return [pin.JointModelRevoluteUnaligned(axis), pin.JointModelPrismaticUnaligned(axis)]
        case Universal():
            return [
                pin.JointModelRevoluteUnaligned(axis),
                pin.JointModelRevoluteUnaligned(np.array(joint.second_axis)),
            ]
        case Planar():
            return [pin.JointModelPlanar()]
        case Spherical():
            return [pin.JointModelSpherical()]
        case Free():
            return [pin.JointModelFreeFlyer()]
        case _:
            raise NotImplementedError(type(joint).__name__)


@dataclass(frozen=True, eq=False)
class PinocchioRobot:
    """A robot as a model of Pinocchio; ``first``: the first entries of each joint in its q and v."""

    robot: Robot
    model: pin.Model
    data: pin.Data
    tool: int
    first: list[tuple[int, int]]

    def state(
        self, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return q, v and a of Pinocchio, and the matrix B with ``v = B qd``."""
        theirs, B, rate = (
            np.empty(self.model.nq),
            np.zeros((self.model.nv, self.robot.n)),
            np.zeros(self.model.nv),
        )
        position = speed = 0
        for joint, (iq, iv) in zip(self.robot.joints, self.first):
            own, v = q[position : position + joint.nq], qd[speed : speed + joint.nv]
            values, block = own, np.eye(joint.nv)
            change = np.zeros(joint.nv)
            if isinstance(joint, Spherical | Free):
                w, x, y, z = own[-4:] / np.linalg.norm(own[-4:])
                values = np.array((*own[:-4], x, y, z, w))
            if isinstance(joint, Free):
                R = joint.motion(own.tolist()).R
                block[:3, :3] = R.T
                change[:3] = -np.cross(v[3:], R.T @ v[:3])
            elif isinstance(joint, Planar):
                c, s = np.cos(own[2]), np.sin(own[2])
                values = np.array((own[0], own[1], c, s))
                block[:2, :2] = ((c, s), (-s, c))
                change[:2] = v[2] * (np.array(((-s, c), (-c, -s))) @ v[:2])
            theirs[iq : iq + len(values)] = values
            B[iv : iv + joint.nv, speed : speed + joint.nv] = block
            rate[iv : iv + joint.nv] = change
            position, speed = position + joint.nq, speed + joint.nv
        return theirs, B @ qd, B @ qdd + rate, B


def pinocchio_robot(robot: Robot) -> PinocchioRobot:
    """Return the model of a robot; rotor inertias are the armature, whose axes are those of the speeds."""
    model = pin.Model()
    world = pin.SE3(robot.base.matrix)
    links: dict[str | None, tuple[int, pin.SE3]] = {None: (0, world)}
    first: dict[str, tuple[int, int]] = {}
    # Depth first: Pinocchio assumes that the joints of a branch have consecutive numbers.
    remaining = [link for link in robot.links if link.parent is None]
    while remaining:
        link = remaining.pop()
        remaining += [child for child in robot.links if child.parent == link.name]
        index, carried = links[link.parent]
        # The offset is part of the placement, so that both robots have the same q.
        placement = carried * pin.SE3(link.before.matrix)
        if link.joint.moves:
            placement = placement * pin.SE3(link.joint.motion(link.joint.neutral).matrix)
            for number, kind in enumerate(pinocchio_joints(link.joint)):
                index = model.addJoint(index, kind, placement, f"{link.name} {number}")
                first.setdefault(link.name, (model.joints[index].idx_q, model.joints[index].idx_v))
                placement = pin.SE3.Identity()
        at_link = placement * pin.SE3(link.after.matrix)
        links[link.name] = (index, at_link)
        if index:
            body = pin.Inertia(link.mass, link.r, np.zeros((3, 3)))
            body.inertia = link.I
            model.appendBodyToJoint(index, body, at_link)
    carrier, at_link = links[robot.links[-1].name]
    tool = model.addFrame(
        pin.Frame("tool", carrier, 0, at_link * pin.SE3(robot.tool.matrix), pin.FrameType.OP_FRAME)
    )
    model.gravity.linear = np.array(robot.gravity)
    # The armature of a joint is isotropic, so that it is the same in the axes of both programs.
    armature = np.zeros(model.nv)
    for joint, link in zip(robot.joints, robot.moving_links):
        iv = first[link.name][1]
        armature[iv : iv + joint.nv] = link.motor.reflected_inertia if link.motor else 0.0
    model.armature = armature
    places = [first[link.name] for link in robot.moving_links]
    return PinocchioRobot(robot, model, model.createData(), tool, places)


@pytest.mark.parametrize("seed", range(5))
def test_robots_with_unusual_values_agree_with_pinocchio(seed: int):
    check_agreement(build_unusual_robot(seed))


@pytest.mark.parametrize("robot", LAW_ROBOTS.values(), ids=LAW_ROBOTS.keys())
def test_agrees_with_pinocchio(robot: Robot):
    check_agreement(robot)


def check_agreement(robot: Robot) -> None:
    """Compare kinematics and dynamics with Pinocchio; accelerations if the inertia matrix is regular."""
    other = pinocchio_robot(robot)
    model, data, tool = other.model, other.data, other.tool
    smooth = robot.nofriction()

    def close(actual: np.ndarray, expected: np.ndarray, tolerance: float = 1e-12) -> None:
        size = max(1.0, float(np.abs(expected).max()))
        assert_allclose(actual, expected, rtol=0, atol=tolerance * size)

    for q, qd, qdd in random_states(robot):
        q_pin, v_pin, a_pin, B = other.state(q, qd, qdd)
        _, _, rate, _ = other.state(q, qd, 0 * qdd)
        close(evaluate(smooth, "rne", q, qd, qdd), B.T @ rnea(other, q_pin, v_pin, a_pin, rate))
        M = np.array(pin.crba(model, data, q_pin))
        close(evaluate(robot, "inertia", q), B.T @ M @ B)
        C = np.array(pin.computeCoriolisMatrix(model, data, q_pin, v_pin))
        bias = C @ v_pin + (M - np.diag(model.armature)) @ rate
        close(evaluate(robot, "coriolis", q, qd) @ qd, B.T @ bias)
        close(evaluate(robot, "gravload", q), B.T @ pin.computeGeneralizedGravity(model, data, q_pin))
        condition = np.linalg.cond(M)
        if condition < 1e10:
            torque = np.linalg.solve(B.T, qdd) + model.armature * rate
            accelerations = np.linalg.solve(B, np.array(pin.aba(model, data, q_pin, v_pin, torque)) - rate)
            tolerance = max(1e-12, 10 * condition * np.finfo(float).eps)
            close(evaluate(smooth, "accel", q, qd, qdd), accelerations, tolerance)
        pin.computeJointJacobians(model, data, q_pin)
        pin.framesForwardKinematics(model, data, q_pin)
        close(evaluate(robot, "fkine", q), data.oMf[tool].homogeneous)
        J0 = pin.getFrameJacobian(model, data, tool, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        Je = pin.getFrameJacobian(model, data, tool, pin.ReferenceFrame.LOCAL)
        close(evaluate(robot, "jacob0", q), np.array(J0) @ B)
        close(evaluate(robot, "jacobe", q), np.array(Je) @ B)


def rnea(other: PinocchioRobot, q: np.ndarray, v: np.ndarray, a: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Return the torques of Pinocchio, whose rotors follow its accelerations, with rotors that follow qdd."""
    return np.array(pin.rnea(other.model, other.data, q, v, a)) - other.model.armature * rate


@pytest.mark.parametrize("robot", LAW_ROBOTS.values(), ids=LAW_ROBOTS.keys())
def test_differences_and_integration_agree_with_pinocchio(robot: Robot):
    other = pinocchio_robot(robot)
    balls = [j for j, joint in enumerate(robot.joints) if isinstance(joint, Spherical)]
    starts = np.cumsum([0, *(joint.nq for joint in robot.joints)])
    speeds = np.cumsum([0, *(joint.nv for joint in robot.joints)])
    for q, qd, _ in random_states(robot, 2):
        moved = evaluate(robot, "integrate", q, qd, 0.3).ravel()
        theirs = pin.integrate(other.model, *(other.state(q, 0.3 * qd, qd)[:2]))
        for j in balls:
            iq, iv = other.first[j]
            x, y, z, w = theirs[iq : iq + 4]
            assert_allclose(moved[starts[j] : starts[j] + 4], (w, x, y, z), rtol=0, atol=1e-14)
            two = pin.difference(other.model, other.state(q, qd, qd)[0], other.state(moved, qd, qd)[0])
            expected = two[iv : iv + 3]
            actual = evaluate(robot, "difference", q, moved).ravel()[speeds[j] : speeds[j] + 3]
            assert_allclose(actual, expected, rtol=0, atol=1e-13)


def test_centre_of_mass_and_energies_agree_for_a_robot_without_fixed_base_links(puma560: Robot):
    other = pinocchio_robot(puma560)
    model, data = other.model, other.data
    model.armature = np.zeros(model.nv)
    tree = KinematicTree.of(puma560)
    assert all(frame.body != BASE for frame in tree.links)
    for q, qd, _ in random_states(puma560):
        assert_allclose(evaluate(puma560, "centre_of_mass", q), pin.centerOfMass(model, data, q), rtol=1e-12)
        potential = pin.computePotentialEnergy(model, data, q)
        assert evaluate(puma560, "potential_energy", q) == pytest.approx(potential, rel=1e-12)
        rotors = sum(motor.reflected_inertia * rate**2 / 2 for motor, rate in zip(puma560.motors, qd))
        kinetic = pin.computeKineticEnergy(model, data, q, qd) + rotors
        assert evaluate(puma560, "kinetic_energy", q, qd) == pytest.approx(kinetic, rel=1e-12)


@pytest.mark.parametrize("name", ["KR180", "Puma 560", "random1tree", "random3chain"])
def test_torques_span_the_space_of_the_regressor_of_pinocchio(name: str):
    robot = LAW_ROBOTS[name]
    other = pinocchio_robot(robot)
    links = [link.name for link in robot.links]
    regressor = trace_torque_regressor(robot, links).casadi_function()
    ours: list[np.ndarray] = []
    theirs: list[np.ndarray] = []
    for q, qd, qdd in random_states(robot, 40, seed=3):
        matrix = np.asarray(regressor(q, qd, qdd)).reshape(robot.n, -1)
        ours.append(matrix[:, : 10 * len(links)])
        states = other.state(q, qd, qdd)
        theirs.append(states[3].T @ pin.computeJointTorqueRegressor(other.model, other.data, *states[:3]))
    A, B = (np.concatenate(parts) for parts in (ours, theirs))

    def rank(matrix: np.ndarray) -> int:
        lengths = np.linalg.norm(matrix, axis=0)
        s = np.linalg.svd(matrix[:, lengths > 1e-9] / lengths[lengths > 1e-9], compute_uv=False)
        return int(np.sum(s > 1e-8 * s[0]))

    assert (rank(A), rank(B), rank(np.hstack([A, B]))) == (rank(A),) * 3

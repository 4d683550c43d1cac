"""Comparison with Pinocchio, an independent implementation; its models are built from the description."""

import numpy as np
import pinocchio as pin
import pytest
from numpy.testing import assert_allclose

from armblocks.robot import Revolute, Robot
from armblocks.robot.tree import BASE, KinematicTree
from robots_for_tests import LAW_ROBOTS, evaluate, random_states


def pinocchio_model(robot: Robot) -> tuple[pin.Model, pin.Data, int, np.ndarray]:
    """Return model, data, tool frame, and the index of each joint; rotor inertias are the armature."""
    model = pin.Model()
    world = pin.SE3(robot.base.matrix)
    links: dict[str | None, tuple[int, pin.SE3]] = {None: (0, world)}
    # Depth first: Pinocchio assumes that the joints of a branch have consecutive numbers.
    remaining = [link for link in robot.links if link.parent is None]
    while remaining:
        link = remaining.pop()
        remaining += [child for child in robot.links if child.parent == link.name]
        parent, carried = links[link.parent]
        placement = carried * pin.SE3(link.before.matrix)
        if link.joint.moves:
            axis = np.array(link.joint.axis)
            is_revolute = isinstance(link.joint, Revolute)
            kind = pin.JointModelRevoluteUnaligned if is_revolute else pin.JointModelPrismaticUnaligned
            # The offset is part of the placement, so that both robots have the same q.
            placement = placement * pin.SE3(link.joint.motion(link.joint.offset).matrix)
            index = model.addJoint(parent, kind(axis), placement, link.name)
            at_link = pin.SE3(link.after.matrix)
        else:
            index, at_link = parent, placement * pin.SE3(link.after.matrix)
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
    indices = np.array([model.joints[model.getJointId(name)].idx_v for name in robot.joint_names])
    armature = np.zeros(model.nv)
    armature[indices] = [motor.reflected_inertia if motor else 0.0 for motor in robot.motors]
    model.armature = armature
    return model, model.createData(), tool, indices


@pytest.mark.parametrize("robot", LAW_ROBOTS.values(), ids=LAW_ROBOTS.keys())
def test_agrees_with_pinocchio(robot: Robot):
    model, data, tool, indices = pinocchio_model(robot)
    smooth = robot.nofriction()

    def close(actual: np.ndarray, expected: np.ndarray, tolerance: float = 1e-12) -> None:
        size = max(1.0, float(np.abs(expected).max()))
        assert_allclose(actual, expected, rtol=0, atol=tolerance * size)

    for q, qd, qdd in random_states(robot):
        state = [np.empty(robot.n) for _ in range(3)]
        for argument, other_argument in zip((q, qd, qdd), state):
            other_argument[indices] = argument
        close(evaluate(smooth, "rne", q, qd, qdd), pin.rnea(model, data, *state)[indices])
        M = np.array(pin.crba(model, data, state[0]))
        close(evaluate(robot, "inertia", q), M[np.ix_(indices, indices)])
        C = np.array(pin.computeCoriolisMatrix(model, data, state[0], state[1]))
        close(evaluate(robot, "coriolis", q, qd) @ qd, (C @ state[1])[indices])
        close(evaluate(robot, "gravload", q), pin.computeGeneralizedGravity(model, data, state[0])[indices])
        accelerations = np.array(pin.aba(model, data, *state))[indices]
        condition = np.linalg.cond(M)
        tolerance = max(1e-12, 10 * condition * np.finfo(float).eps)
        close(evaluate(smooth, "accel", q, qd, qdd), accelerations, tolerance)
        pin.computeJointJacobians(model, data, state[0])
        pin.framesForwardKinematics(model, data, state[0])
        close(evaluate(robot, "fkine", q), data.oMf[tool].homogeneous)
        J0 = pin.getFrameJacobian(model, data, tool, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        Je = pin.getFrameJacobian(model, data, tool, pin.ReferenceFrame.LOCAL)
        close(evaluate(robot, "jacob0", q), np.array(J0)[:, indices])
        close(evaluate(robot, "jacobe", q), np.array(Je)[:, indices])


def test_centre_of_mass_and_energies_agree_for_a_robot_without_fixed_base_links(puma560: Robot):
    model, data, _, _ = pinocchio_model(puma560)
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

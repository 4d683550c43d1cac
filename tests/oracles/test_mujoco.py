"""Comparison with MuJoCo for robots that it accepts: it refuses physically impossible inertias."""

import mujoco
import numpy as np
import pytest
from numpy.testing import assert_allclose

from armblocks.robot import Revolute, Robot, inertia_findings
from robots_for_tests import CONSISTENT_ROBOTS, evaluate, random_states


def quaternion(R: np.ndarray) -> np.ndarray:
    result = np.empty(4)
    mujoco.mju_mat2Quat(result, R.ravel())
    return result


def mujoco_model(robot: Robot) -> mujoco.MjModel:
    spec = mujoco.MjSpec()
    spec.option.gravity = robot.gravity
    spec.compiler.balanceinertia = False
    base = spec.worldbody.add_body(name="base", pos=robot.base.p, quat=quaternion(robot.base.R))
    bodies = {None: base}
    remaining = list(robot.links)
    while remaining:
        link = next(link for link in remaining if link.parent in bodies)
        remaining.remove(link)
        # One body at the joint, with its zero at q = 0, and one at the frame of the link.
        T = link.before @ link.joint.motion(link.joint.offset)
        moving = bodies[link.parent].add_body(name=f"{link.name} joint", pos=T.p, quat=quaternion(T.R))
        if link.joint.moves:
            is_revolute = isinstance(link.joint, Revolute)
            kind = mujoco.mjtJoint.mjJNT_HINGE if is_revolute else mujoco.mjtJoint.mjJNT_SLIDE
            armature = link.motor.reflected_inertia if link.motor else 0.0
            moving.add_joint(name=link.name, type=kind, axis=link.joint.axis, armature=armature)
        body = moving.add_body(name=link.name, pos=link.after.p, quat=quaternion(link.after.R))
        body.mass, body.ipos = link.mass, link.r
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = link.inertia
        body.fullinertia = (xx, yy, zz, xy, xz, yz)
        body.explicitinertial = True
        bodies[link.name] = body
    return spec.compile()


@pytest.mark.parametrize("robot", CONSISTENT_ROBOTS.values(), ids=CONSISTENT_ROBOTS.keys())
def test_agrees_with_mujoco(robot: Robot):
    assert not inertia_findings(robot)
    model = mujoco_model(robot)
    data = mujoco.MjData(model)
    indices = np.array([model.joint(name).dofadr[0] for name in robot.joint_names])
    smooth = robot.nofriction()
    for q, qd, qdd in random_states(robot, 2):
        data.qpos[indices], data.qvel[indices], data.qacc[indices] = q, qd, qdd
        mujoco.mj_inverse(model, data)
        tau = evaluate(smooth, "rne", q, qd, qdd)
        # MuJoCo diagonalises inertias and rotates by quaternions.
        assert_allclose(tau, data.qfrc_inverse[indices], rtol=0, atol=1e-11 * np.abs(tau).max())

"""Comparison with MuJoCo for robots that it accepts: it refuses physically impossible inertias."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from numpy.testing import assert_allclose

from armblocks.robot import (
    Cylindrical,
    Free,
    Planar,
    Prismatic,
    Revolute,
    Robot,
    Spherical,
    Universal,
    inertia_findings,
)
from armblocks.robot.joints import AxisMotion
from armblocks.spatial import Transform
from robots_for_tests import CONSISTENT_ROBOTS, build_mixed_tree, evaluate, random_states


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
        T = link.before @ link.joint.motion(link.joint.neutral)
        carrier = spec.worldbody if isinstance(link.joint, Free) else bodies[link.parent]
        moving = carrier.add_body(name=f"{link.name} joint", pos=T.p, quat=quaternion(T.R))
        armature = link.motor.reflected_inertia if link.motor else 0.0
        if isinstance(link.joint, Free):
            moving.add_freejoint(name=f"{link.name} 0")
        else:
            for number, motion in enumerate(link.joint.motions):
                kind = mujoco.mjtJoint.mjJNT_BALL
                axis = (0.0, 0.0, 1.0)
                if isinstance(motion, AxisMotion):
                    is_hinge = motion.angular != 0.0
                    kind = mujoco.mjtJoint.mjJNT_HINGE if is_hinge else mujoco.mjtJoint.mjJNT_SLIDE
                    axis = motion.axis
                moving.add_joint(name=f"{link.name} {number}", type=kind, axis=axis, armature=armature)
        body = moving.add_body(name=link.name, pos=link.after.p, quat=quaternion(link.after.R))
        body.mass, body.ipos = link.mass, link.r
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = link.inertia
        body.fullinertia = (xx, yy, zz, xy, xz, yz)
        body.explicitinertial = True
        bodies[link.name] = body
    return spec.compile()


def mujoco_addresses(robot: Robot, model: mujoco.MjModel) -> tuple[np.ndarray, np.ndarray]:
    """Return the indices in qpos and in qvel of the entries of q and qd."""
    positions, speeds = [], []
    for link in robot.moving_links:
        names = [f"{link.name} {k}" for k in range(len(link.joint.motions))]
        names = names[:1] if isinstance(link.joint, Free) else names
        position, speed = (
            min(getattr(model.joint(name), a)[0] for name in names) for a in ("qposadr", "dofadr")
        )
        positions += range(position, position + link.joint.nq)
        speeds += range(speed, speed + link.joint.nv)
    return np.array(positions), np.array(speeds)


def floating(robot: Robot) -> Robot:
    """Return the robot with a free joint instead of its first joint, on the base, without a motor."""
    root = replace(robot.links[0], joint=Free(), before=Transform(), motor=None)
    return replace(robot, links=(root, *robot.links[1:]), base=Transform())


MUJOCO_TYPES = (Revolute, Cylindrical, Universal, Planar, Spherical, Prismatic)
"""MuJoCo has no screws, and free joints only between the world and a body."""
ROBOTS = (
    *CONSISTENT_ROBOTS.values(),
    build_mixed_tree(7, MUJOCO_TYPES),
    floating(build_mixed_tree(8, MUJOCO_TYPES)),
)


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_agrees_with_mujoco(robot: Robot):
    assert not inertia_findings(robot)
    model = mujoco_model(robot)
    data = mujoco.MjData(model)
    positions, speeds = mujoco_addresses(robot, model)
    smooth = robot.nofriction()
    for q, qd, qdd in random_states(robot, 2):
        data.qpos[positions], data.qvel[speeds], data.qacc[speeds] = q, qd, qdd
        mujoco.mj_inverse(model, data)
        tau = evaluate(smooth, "rne", q, qd, qdd)
        # MuJoCo diagonalises inertias and rotates by quaternions.
        assert_allclose(tau, data.qfrc_inverse[speeds], rtol=0, atol=1e-11 * np.abs(tau).max())

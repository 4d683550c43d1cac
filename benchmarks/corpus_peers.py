"""Comparison of robots with Pinocchio (URDF) and MuJoCo (MJCF) at random states.

Differences are relative to the largest entry of a result, or to 1 if that is smaller.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin

from armblocks.dynamics import TRACES
from armblocks.formats.xml_elements import read_elements
from armblocks.robot import Free, Robot
from armblocks.robot.geometry import link_frames
from armblocks.spatial import Transform

STATES = 2


def pinocchio_model(path: Path) -> pin.Model | None:
    """The model of a URDF file, or ``None`` if Pinocchio refuses it."""
    try:
        return pin.buildModelFromUrdf(str(path))
    except (ValueError, RuntimeError):
        return None


def difference_to_pinocchio(robot: Robot, model: pin.Model, path: Path) -> float:
    """The largest relative difference at random states, of all joints of the tree.

    Pinocchio reads ``<mimic>`` joints as independent joints.
    """
    robot = replace(robot, constraints=())
    random = np.random.default_rng(0)
    root = read_elements(path.read_bytes(), path.name)
    joint_of = {
        joint.first("child").attributes["link"]: joint.attributes["name"]  # pyright: ignore
        for joint in root.all("joint")
    }
    joints: list[Any] = [model.joints[model.getJointId(joint_of[link.name])] for link in robot.moving_links]
    indices = np.array([joint.idx_v for joint in joints])
    armature = np.zeros(model.nv)
    armature[indices] = [motor.reflected_inertia if motor else 0.0 for motor in robot.motors]
    model.armature = armature
    data = model.createData()
    tip = model.getFrameId(robot.links[-1].name)
    smooth = robot.nofriction()
    names = ("fkine", "jacob0", "inertia", "rne")
    functions = {name: TRACES[name](smooth).casadi_function() for name in names}
    worst = 0.0
    for _ in range(STATES):
        q, qd, qdd = random.uniform(-2, 2, (3, robot.n))
        theirs = [pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)]
        for joint, value in zip(joints, q):
            # Pinocchio's continuous joints have the coordinates cos q and sin q.
            theirs[0][joint.idx_q : joint.idx_q + joint.nq] = (
                value if joint.nq == 1 else (np.cos(value), np.sin(value))
            )
        theirs[1][indices], theirs[2][indices] = qd, qdd
        tau = pin.rnea(model, data, *theirs)[indices]
        M = np.triu(pin.crba(model, data, theirs[0]))
        M = M + np.triu(M, 1).T
        pin.computeJointJacobians(model, data, theirs[0])
        pin.framesForwardKinematics(model, data, theirs[0])
        axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        J = np.array(pin.getFrameJacobian(model, data, tip, axes)).reshape(6, model.nv)
        expected = {
            "fkine": data.oMf[tip].homogeneous,
            "jacob0": J[:, indices],
            "inertia": M[np.ix_(indices, indices)],
            "rne": tau,
        }
        for name, value in expected.items():
            arguments = (q, qd, qdd) if name == "rne" else (q,)
            ours = np.asarray(functions[name](*arguments)).reshape(value.shape)
            worst = max(worst, float(np.abs(ours - value).max() / max(1.0, np.abs(value).max())))
    return worst


def mujoco_model(path: Path) -> mujoco.MjModel | None:
    """The model, or ``None`` if MuJoCo refuses it."""
    try:
        return mujoco.MjModel.from_xml_path(str(path))
    except (ValueError, RuntimeError):
        return None


def joints_of(robot: Robot, model: mujoco.MjModel) -> list[int]:
    """For each joint of the robot, the index of that of the model; -1 for joints without a name."""
    joints = {model.joint(j).name: j for j in range(model.njnt)}
    last_joint = {
        model.body(b).name: model.body_jntadr[b] + model.body_jntnum[b] - 1
        for b in range(model.nbody)
        if model.body_jntnum[b]
    }
    return [int(last_joint.get(link.name, joints.get(link.name, -1))) for link in robot.moving_links]


def difference_to_mujoco(robot: Robot, model: mujoco.MjModel, max_joints: int) -> tuple[float, bool]:
    """The largest relative difference at a random state, and whether a mass differs by more than 1e-6.

    It is infinite if the joints cannot be assigned by their names.
    """
    # The coordinates of a free joint of MuJoCo are its pose in the world, here relative to its initial pose.
    links = tuple(
        replace(link, before=Transform()) if isinstance(link.joint, Free) else link for link in robot.links
    )
    # The constraints of MuJoCo are soft forces, and its rne has no springs; the trees are compared.
    robot = replace(robot, links=links, constraints=(), springs=())
    rows: list[int] = []
    columns: list[int] = []
    for joint, j in zip(robot.joints, joints_of(robot, model)):
        rows += range(model.jnt_qposadr[j], model.jnt_qposadr[j] + joint.nq)
        columns += range(model.jnt_dofadr[j], model.jnt_dofadr[j] + joint.nv)
    if sorted(rows) != list(range(model.nq)) or sorted(columns) != list(range(model.nv)):
        return np.inf, False
    random = np.random.default_rng(0)
    q, (qd, qdd) = random.uniform(-1, 1, robot.nq), random.uniform(-1, 1, (2, robot.n))
    data = mujoco.MjData(model)
    data.qpos[rows], data.qvel[columns], data.qacc[columns] = q, qd, qdd
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    poses = dict(zip((link.name for link in robot.links), link_frames(robot, q)[1:]))
    masses = {link.name: link.mass for link in robot.links}
    worst, other_mass = 0.0, False
    for b in range(1, model.nbody):
        name = model.body(b).name
        if name in poses:
            ours = np.vstack([poses[name][:3, 3], poses[name][:3, :3]])
            theirs = np.vstack([data.xpos[b], data.xmat[b].reshape(3, 3)])
            worst = max(worst, float(np.abs(ours - theirs).max() / max(1.0, np.abs(theirs).max())))
            error = float(abs(masses[name] - model.body_mass[b]))
            other_mass = other_mass or error > 1e-6 * float(model.body_mass[b])
    if other_mass or not 0 < robot.n <= max_joints:
        return worst, other_mass
    smooth = robot.nofriction()
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, M)
    tau = np.zeros(model.nv)
    mujoco.mj_rne(model, data, 1, tau)
    tau += model.dof_armature * data.qacc
    for name, arguments, theirs in (
        ("inertia", (q,), M[np.ix_(columns, columns)]),
        ("rne", (q, qd, qdd), tau[columns]),
    ):
        ours = np.asarray(TRACES[name](smooth).casadi_function()(*arguments)).reshape(theirs.shape)
        worst = max(worst, float(np.abs(ours - theirs).max() / max(1.0, np.abs(theirs).max())))
    return worst, other_mass

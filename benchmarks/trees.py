"""Batches of a humanoid and of a free body beside Pinocchio; a palletising arm beside its serial chain.

    python benchmarks/trees.py

The humanoid has a floating base and 30 revolute joints: legs of six joints, arms of seven, waist and neck of
two. Pinocchio reads the URDF that armblocks writes, and computes the batch on one thread by
`rneaInParallel` and `abaInParallel`. The results of both programs are compared before the timing.
"""

# pyright: basic
from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pinocchio as pin
from measure import in_turn

import armblocks as ab
from armblocks.formats.urdf.writer import write_urdf
from armblocks.robot import Free, JointLimits, Link, Revolute, Robot
from armblocks.spatial import transl

N = 100_000
REPEATS = 7
LIMITS = JointLimits(position=(-3.2, 3.2))  # without limits, joints of Pinocchio have two coordinates
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
LIMBS = {
    "waist": ("trunk", "zy", (0, 0, 0.1), (0, 0, 0.15)),
    "neck": ("waist2", "zy", (0, 0, 0.35), (0, 0, 0.1)),
    **{f"leg{k}": ("trunk", "zxyyyx", (0, y, -0.05), (0, 0, -0.14)) for k, y in ((1, 0.1), (2, -0.1))},
    **{f"arm{k}": ("waist2", "yxzyzyx", (0, y, 0.3), (0, 0, -0.1)) for k, y in ((1, 0.2), (2, -0.2))},
}


def solid(name: str, mass: float, **more: object) -> Link:
    moments = (0.02 * mass, 0.018 * mass, 0.007 * mass, 1e-4 * mass, 2e-4 * mass, -1e-4 * mass)
    return Link(name=name, mass=mass, centre_of_mass=(0.01, 0.005, -0.05), inertia=moments, **more)


def humanoid() -> Robot:
    links = [solid("trunk", 12.0, joint=Free())]
    for limb, (parent, axes, first, step) in LIMBS.items():
        for k, axis in enumerate(axes, start=1):
            place = transl(*(first if k == 1 else step))
            joint = Revolute(axis=AXES[axis], limits=LIMITS)
            links.append(solid(f"{limb}{k}", 3.0 / k, parent=parent, before=place, joint=joint))
            parent = f"{limb}{k}"
    return Robot(name="humanoid", links=tuple(links))


class Batch:
    """A robot with a floating base and its random states for both programs."""

    def __init__(self, robot: Robot) -> None:
        self.arm = arm = ab.Arm(robot)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self.model = pin.buildModelFromXML(write_urdf(robot).decode())
        n, random = arm.n, np.random.default_rng(0)
        self.q = random.uniform(-2, 2, (N, arm.nq))
        self.q[:, 3:7] /= np.linalg.norm(self.q[:, 3:7], axis=1)[:, None]
        self.qd, self.qdd = random.uniform(-2, 2, (N, n)), random.uniform(-5, 5, (N, n))
        self.tau = arm.rne(self.q, self.qd, self.qdd)
        names = [f"{name}_joint" for name in robot.joint_names[1:]]
        ids = [self.model.getJointId(name) for name in names]
        nq, nv = self.model.nq, self.model.nv
        own_q = [self.model.idx_qs[i] for i in ids]
        own_v = [self.model.idx_vs[i] for i in ids]
        R = np.array([T[:3, :3] for T in arm.link_poses(self.q)[:, 1]])
        to_body = lambda v: np.einsum("nij,ni->nj", R, v)  # noqa: E731
        theirs_q = np.zeros((nq, N), order="F")
        theirs_q[:3], theirs_q[3:6], theirs_q[6] = self.q[:, :3].T, self.q[:, 4:7].T, self.q[:, 3]
        theirs_q[own_q] = self.q[:, 7:].T
        v, a, f = (np.zeros((nv, N), order="F") for _ in range(3))
        v[:3], v[3:6], v[own_v] = to_body(self.qd[:, :3]).T, self.qd[:, 3:6].T, self.qd[:, 6:].T
        a[:3] = to_body(self.qdd[:, :3]).T - np.cross(v[3:6].T, v[:3].T).T
        a[3:6], a[own_v] = self.qdd[:, 3:6].T, self.qdd[:, 6:].T
        f[:3], f[3:6], f[own_v] = to_body(self.tau[:, :3]).T, self.tau[:, 3:6].T, self.tau[:, 6:].T
        self.theirs = theirs_q, v, a, f

    def rows(self) -> None:
        q, v, a, f = self.theirs
        pool, out = pin.ModelPool(self.model, 2), np.zeros_like(v)
        ours = np.empty_like(self.qd)
        pin.rneaInParallel(1, pool, q, v, a, out)
        print(f"{self.arm.name}: largest difference of rne {np.abs(out - f).max() / np.abs(f).max():.1e}")
        pin.abaInParallel(1, pool, q, v, f, out)
        print(f"{self.arm.name}: largest difference of accel {np.abs(out - a).max() / np.abs(a).max():.1e}")
        for name, theirs, own in (
            (
                "rne",
                lambda: pin.rneaInParallel(1, pool, q, v, a, out),
                lambda: self.arm.rne(self.q, self.qd, self.qdd, out=ours),
            ),
            (
                "accel",
                lambda: pin.abaInParallel(1, pool, q, v, f, out),
                lambda: self.arm.accel(self.q, self.qd, self.tau, out=ours),
            ),
        ):
            peer, mine = in_turn([theirs, own], REPEATS)
            print(
                f"| {self.arm.name} {name} | {1e9 * peer.per(N).median:.0f} | {1e9 * mine.per(N).median:.1f} "
                f"| {mine.times_faster_than(peer):.1f} x |"
            )


def palletiser_ratio(name: str) -> None:
    """The arm with its linkages, and the serial chain of its four axes with the same links.

    The links of the linkage that are not between base and tool are not part of the chain.
    """
    robot = ab.load_robot(name).nofriction("all").robot
    tip, chain = robot.links[-1].name, []
    while tip is not None:
        link = robot.link(tip)
        chain.insert(0, link)
        tip = link.parent
    kept = {link.name for link in chain}
    couplings = tuple(c for c in robot.couplings if kept.issuperset(c.joints))
    serial = replace(robot, links=tuple(chain), constraints=couplings, frames=())
    arms = [ab.Arm(robot), ab.Arm(serial)]
    states = np.random.default_rng(1).uniform(-1, 1, (3, N, robot.n))
    outs = [np.empty((N, arm.n)) for arm in arms]
    whole, alone = in_turn(
        [lambda arm=arm, out=out: arm.rne(*states, out=out) for arm, out in zip(arms, outs)], 3 * REPEATS
    )
    print(
        f"| {name} rne | {1e9 * alone.per(N).median:.2f} | {1e9 * whole.per(N).median:.2f} "
        f"| {1 / whole.times_faster_than(alone):.2f} |"
    )


if __name__ == "__main__":
    for robot in (humanoid(), Robot(name="free body", links=(solid("body", 5.0, joint=Free()),))):
        Batch(robot).rows()
    palletiser_ratio("kr180_2_pa")

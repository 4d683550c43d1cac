"""URDF of a serial armblocks robot, so that other programs use the same parameters."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from armblocks.robot import Link, Prismatic, Revolute, Robot


def _pose(T: np.ndarray) -> str:
    xyz = " ".join(repr(float(v)) for v in T[:3, 3])
    rpy = " ".join(repr(float(v)) for v in Rotation.from_matrix(T[:3, :3]).as_euler("xyz"))
    return f'<origin xyz="{xyz}" rpy="{rpy}"/>'


def _link(name: str, link: Link, after: np.ndarray) -> str:
    """URDF element of a link.

    A URDF link frame is the joint frame. ``after``, the constant transform after the joint, is applied to the
    centre of mass and the inertia.
    """
    R, p = after[:3, :3], after[:3, 3]
    centre = R @ np.asarray(link.centre_of_mass) + p
    inertia = R @ np.asarray(link.inertia) @ R.T
    entries = {"ixx": (0, 0), "iyy": (1, 1), "izz": (2, 2), "ixy": (0, 1), "iyz": (1, 2), "ixz": (0, 2)}
    values = " ".join(f'{key}="{float(inertia[place])!r}"' for key, place in entries.items())
    origin = _pose(np.block([[np.eye(3), centre[:, None]], [np.zeros((1, 3)), np.ones((1, 1))]]))
    return (
        f'<link name="{name}"><inertial>{origin}<mass value="{float(link.mass)!r}"/>'
        f"<inertia {values}/></inertial></link>"
    )


def to_urdf(robot: Robot) -> str:
    """URDF text with links l1…, joints j1… and the tool frame ``tip``, without base pose and gravity."""
    parts = [f'<robot name="{robot.name}">', '<link name="base"/>']
    previous_after, parent = np.eye(4), "base"
    for number, link in enumerate(robot.links, start=1):
        before = previous_after @ link.before.matrix
        kind = {Revolute: "revolute", Prismatic: "prismatic"}[type(link.joint)]
        axis = " ".join(repr(float(v)) for v in link.joint.axis)
        parts.append(_link(f"l{number}", link, link.after.matrix))
        parts.append(
            f'<joint name="j{number}" type="{kind}"><parent link="{parent}"/><child link="l{number}"/>'
            f'{_pose(before)}<axis xyz="{axis}"/>'
            '<limit lower="-10" upper="10" effort="1e6" velocity="100"/></joint>'
        )
        previous_after, parent = link.after.matrix, f"l{number}"
    tip = previous_after @ robot.tool.matrix
    parts.append('<link name="tip"/>')
    parts.append(
        f'<joint name="jtip" type="fixed"><parent link="{parent}"/><child link="tip"/>{_pose(tip)}</joint>'
    )
    return "\n".join([*parts, "</robot>"])

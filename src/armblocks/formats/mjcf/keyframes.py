"""Named configurations as key frames of MJCF: ``<keyframe> <key name qpos>``.

``qpos`` has the coordinates of all joints of the tree in the order of the file, those of equality constraints
included. Angles are in rad for every ``<compiler angle>``. A free joint has the pose of its body in the
world. Source: MuJoCo documentation, *XML reference*, *keyframe*.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from armblocks.errors import shortened_list
from armblocks.formats.file_findings import FileContext
from armblocks.formats.mjcf.equality_writing import quaternion_of
from armblocks.formats.mjcf.poses import of_quaternion
from armblocks.formats.mjcf.rules import KEYFRAME
from armblocks.formats.mjcf.settings import sections
from armblocks.formats.robot_writing import free_name, numbers, quoted
from armblocks.formats.xml_elements import Element, note, shortened
from armblocks.robot import Free, Link, Robot, Spherical
from armblocks.robot.configurations import MAX_CONFIGURATIONS, MAX_NAME
from armblocks.spatial import Matrix3, Transform, matrix3

_ROUNDING = 1e-6
"""Difference of a coupled coordinate from the value of its coupling, rad or m, that is not reported."""


def with_keyframes(robot: Robot, root: Element, context: FileContext) -> Robot:
    """The robot with the key frames of a file; ``robot`` has its links in the order of the file.

    Key frames without ``qpos`` are not configurations. A key frame of another length becomes a finding.
    """
    used: set[str] = set()
    found: dict[str, list[float]] = {}
    for number, key in enumerate((k for k in sections(root, "keyframe") if k.tag == "key"), start=1):
        if "qpos" not in key.attributes:
            continue
        if len(found) == MAX_CONFIGURATIONS:
            note(context, KEYFRAME, key, f"there are more than {MAX_CONFIGURATIONS} key frames")
            break
        count = sum(link.joint.nq for link in robot.tree_links)
        words = len(key.attributes["qpos"].split())
        if words != count:
            what = f"its qpos has {words} numbers, and the joints that are read have {count} coordinates"
            note(context, KEYFRAME, key, what)
            continue
        given = key.attributes.get("name", "").strip()[: MAX_NAME - 20].strip()
        name = free_name(given or f"key {number}", used)
        found[name] = _coordinates(robot, key, key.numbers("qpos", (count,)), context)
    return replace(robot, configurations=found) if found else robot


def _coordinates(robot: Robot, key: Element, qpos: Sequence[float], context: FileContext) -> list[float]:
    """q of a key frame. A joint that couplings determine gets the value of its coupling."""
    independent = {link.name for link in robot.moving_links}
    q: list[float] = []
    given: dict[str, float] = {}
    first = 0
    for link in robot.tree_links:
        part = list(qpos[first : first + link.joint.nq])
        first += link.joint.nq
        if link.name not in independent:
            given[link.name] = part[0]
        elif isinstance(link.joint, Free):
            pose = Transform(rotation=_rotation(key, part[3:]), translation=(part[0], part[1], part[2]))
            relative = link.before.inverse() @ pose @ link.after.inverse()
            q += [*relative.translation, *quaternion_of(relative.rotation)]
        elif isinstance(link.joint, Spherical):
            q += part if any(part) else [1.0, 0.0, 0.0, 0.0]
        else:
            q += part
    wrong = [name for name, value in _dependent(robot, q).items() if abs(value - given[name]) > _ROUNDING]
    if wrong:
        what = "coordinates that do not satisfy the equality constraints of joints are replaced: "
        note(context, KEYFRAME, key, what + shortened(shortened_list(wrong)))
    return q


def _rotation(key: Element, quaternion: list[float]) -> Matrix3:
    if not any(quaternion):  # MuJoCo normalises zeros to no rotation
        return Transform().rotation
    return matrix3(of_quaternion(key, quaternion))


def _dependent(robot: Robot, q: Sequence[float]) -> dict[str, float]:
    """The coordinates of the joints that couplings determine, by name."""
    if not robot.couplings:
        return {}
    mapped = robot.coordinate_map
    tree = (mapped.positions @ np.array(q)).tolist()
    values: dict[str, float] = {}
    first = 0
    for link in robot.tree_links:
        if link.name in mapped.offsets:
            values[link.name] = tree[first] + mapped.offsets[link.name]
        first += link.joint.nq
    return values


def key_lines(robot: Robot, order: Sequence[Link], world_poses: Mapping[str, Transform]) -> list[str]:
    """The elements of the named configurations. ``order``: the links with joints in the order of the file.

    ``world_poses``: for each free joint the pose, in the world, of its proximal frame.
    """
    return [
        f'  <key name={quoted(name, robot)} qpos="{numbers(_qpos(robot, q, order, world_poses))}"/>'
        for name, q in robot.configurations.entries
    ]


def _qpos(
    robot: Robot, q: Sequence[float], order: Sequence[Link], world_poses: Mapping[str, Transform]
) -> list[float]:
    parts: dict[str, Sequence[float]] = {name: [value] for name, value in _dependent(robot, q).items()}
    first = 0
    for link in robot.moving_links:
        parts[link.name] = q[first : first + link.joint.nq]
        first += link.joint.nq
    qpos: list[float] = []
    for link in order:
        part = parts[link.name]
        if isinstance(link.joint, Free):
            pose = world_poses[link.name] @ link.joint.motion(part) @ link.after
            part = [*pose.translation, *quaternion_of(pose.rotation)]
        elif isinstance(link.joint, Spherical):
            turned = link.after.inverse() @ link.joint.motion(part) @ link.after
            part = quaternion_of(turned.rotation)
        qpos += part
    return qpos

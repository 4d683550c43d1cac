"""Constraints of a robot as MJCF text: ``<equality>`` and the sites that it needs."""

from __future__ import annotations

import math
from collections.abc import Mapping

from armblocks.formats.robot_writing import Mimic, free_name, numbers, quoted
from armblocks.formats.spring_writing import line_springs, warn_of_springs
from armblocks.robot import (
    Attachment,
    Closure,
    NamedFrame,
    RevoluteClosure,
    Robot,
    SphericalClosure,
    WeldClosure,
)
from armblocks.spatial import IDENTITY3, Matrix3, Transform, transl

CLOSURES: tuple[type[Closure], ...] = (WeldClosure, SphericalClosure, RevoluteClosure)
"""The closures that MJCF can describe."""
AXIS_LENGTH = 0.1
"""Distance of the two points on the axis of a revolute closure, m."""

Sites = dict[str | None, list[str]]
"""The lines of the sites of each link; None is the world."""


def equality_lines(
    robot: Robot,
    mimics: Mapping[str, Mimic],
    names: Mapping[str | None, str],
    frames: dict[str, NamedFrame],
    sites: Sites,
) -> list[str]:
    """The elements of ``<equality>``; the sites that they refer to are added to ``frames`` and ``sites``.

    ``names``: the names of the links in the file. ``frames``: the frames that are sites, by name.
    """
    lines: list[str] = []
    for follower, mimic in mimics.items():
        joints = f"joint1={quoted(names[follower], robot)} joint2={quoted(names[mimic.leader], robot)}"
        coefficients = numbers((mimic.offset, mimic.multiplier, 0.0, 0.0, 0.0))
        lines.append(f'    <joint {joints} polycoef="{coefficients}"/>')
    for closure in robot.closures:
        name = quoted(closure.name, robot)
        if isinstance(closure, WeldClosure):
            lines.append(f"    <weld name={name} {_weld(robot, closure, names)}/>")
            continue
        shifts = (0.0, AXIS_LENGTH) if isinstance(closure, RevoluteClosure) else (0.0,)
        for number, shift in enumerate(shifts):
            named = quoted(f"{closure.name} {number + 1}", robot) if number else name
            ends = [
                _site(
                    robot,
                    closure.name,
                    Attachment(link=end.link, pose=end.pose @ transl(0, 0, shift)),
                    frames,
                    sites,
                )
                for end in (closure.first, closure.second)
            ]
            at = f"site1={quoted(ends[0], robot)} site2={quoted(ends[1], robot)}"
            lines.append(f"    <connect name={named} {at}/>")
    return lines


def tendon_lines(robot: Robot, frames: dict[str, NamedFrame], sites: Sites) -> list[str]:
    """The springs between two points as the elements of ``<tendon>``, with their sites.

    A tendon has no preload: its rest length is the length without force. Warns of forces that MJCF does not
    have.
    """
    lines: list[str] = []
    others: list[str] = []
    for spring in line_springs(robot):
        rest = spring.length - spring.preload / spring.stiffness if spring.stiffness else -1.0
        if rest < 0.0:
            others.append(spring.name)
            continue
        ends = [_site(robot, spring.name, end, frames, sites) for end in (spring.first, spring.second)]
        points = "".join(f"<site site={quoted(end, robot)}/>" for end in ends)
        values = f'stiffness="{spring.stiffness!r}" springlength="{rest!r}"'
        lines.append(f"    <spatial name={quoted(spring.name, robot)} {values}>{points}</spatial>")
    warn_of_springs(robot, others, "MJCF")
    return lines


def _weld(robot: Robot, closure: Closure, names: Mapping[str | None, str]) -> str:
    """Bodies and relative pose: of the second body in the frame of the first body."""
    poses = [
        robot.base @ end.pose if end.link is None else end.pose for end in (closure.first, closure.second)
    ]
    relative = poses[0] @ poses[1].inverse()
    bodies = ["world" if link is None else names[link] for link in closure.links]
    pose = numbers((*relative.translation, *quaternion_of(relative.rotation)))
    return f'body1={quoted(bodies[0], robot)} body2={quoted(bodies[1], robot)} relpose="{pose}"'


def _site(robot: Robot, name: str, end: Attachment, frames: dict[str, NamedFrame], sites: Sites) -> str:
    """The name of the site at an attachment: the name of a frame of the robot, or of a new site."""
    for frame in frames.values():
        if (frame.link, frame.pose) == (end.link, end.pose):
            return frame.name
    used = {*frames, *robot.frame_names}
    frame = NamedFrame(name=free_name(f"{name}_site", used), link=end.link, pose=end.pose)
    frames[frame.name] = frame
    add_site(robot, sites, frame)
    return frame.name


def add_site(robot: Robot, sites: Sites, frame: NamedFrame) -> None:
    """Add the element of a frame; in the world its pose includes the pose of the base."""
    pose = frame.pose if frame.link is not None else robot.base @ frame.pose
    indent = "    " if frame.link is None else "  "
    line = f"{indent}<site name={quoted(frame.name, robot)} {placed(pose)}/>"
    sites.setdefault(frame.link, []).append(line)


def placed(pose: Transform) -> str:
    """The attributes of a pose."""
    position = f'pos="{numbers(pose.translation)}"'
    if pose.rotation == IDENTITY3:
        return position
    return f'{position} quat="{numbers(quaternion_of(pose.rotation))}"'


def quaternion_of(R: Matrix3) -> tuple[float, float, float, float]:
    """The quaternion w x y z of a rotation, by Shepperd's method, which divides by the largest component."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = R
    fours = (1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz)
    products = (
        (fours[0], zy - yz, xz - zx, yx - xy),
        (zy - yz, fours[1], yx + xy, xz + zx),
        (xz - zx, yx + xy, fours[2], zy + yz),
        (yx - xy, xz + zx, zy + yz, fours[3]),
    )
    row = products[max(range(4), key=lambda k: fours[k])]
    length = math.hypot(*row)
    w, x, y, z = (value / length for value in row)
    return w, x, y, z

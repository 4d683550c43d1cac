"""Plausibility warnings: valid numbers of a robot that probably have a wrong unit or sign."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from armblocks.errors import warn
from armblocks.robot.coupled_limits import common_range
from armblocks.robot.dh_table import coordinate_text
from armblocks.robot.joints import JointLimits
from armblocks.robot.link import Link
from armblocks.robot.robot import Robot

FULL_TURN = 2 * math.pi * (1 + 1e-6)
"""A full turn, rad, with a tolerance for limits that are written with six digits."""
MAX_MOTION_ANGLE = 4 * math.pi
"""Start or end angles of a motion above this value (rad) are probably in degrees."""
MAX_REACH = 20.0
"""Maximum plausible reach, m; the largest industrial arms reach 5 m."""
MAX_GYRATION_RATIO = 3.0
"""Maximum plausible ratio of a link's radius of gyration, which is below its size, to the robot's reach."""


@dataclass(frozen=True, kw_only=True)
class PlausibilityFinding:
    """A plausibility warning at a ``link`` (``""``: the whole robot).

    ``what`` describes the value, and ``question`` suggests a cause.
    """

    robot: str
    link: str = ""
    what: str
    question: str

    def __str__(self) -> str:
        location = f", link '{self.link}'" if self.link else ""
        return f"robot '{self.robot}'{location}: {self.what}. {self.question}"


def plausibility_findings(robot: Robot) -> tuple[PlausibilityFinding, ...]:
    """Values that probably have a wrong unit or sign; they are warnings, not errors.

    Findings are:

    - a limit of a rotation beyond a full turn in either direction, except of screw joints (degrees?),
    - a reach beyond 20 m, or a link whose radius of gyration exceeds three times the reach (millimetres?),
    - gravity with a component along +z,
    - limits of coupled joints that :attr:`Robot.limits` cannot include,
    - named configurations outside the limits.
    """
    return tuple(_findings(robot))


def warn_of_degrees(angles: ArrayLike, where: str) -> None:
    """Issue an ArmblocksWarning if an angle (rad) is so large that it is probably in degrees."""
    values = np.abs(np.asarray(angles, dtype=np.float64)).ravel()
    beyond = values[np.isfinite(values) & (values > MAX_MOTION_ANGLE)]
    if beyond.size:
        warn(
            f"{where}: an angle of {beyond[0]:g} rad is more than two full turns. Is this in degrees? "
            "It is used as given; np.radians converts degrees to rad."
        )


def warn_of_implausible_values(robot: Robot) -> None:
    """Issue an ArmblocksWarning for every finding; called when a robot is loaded."""
    for finding in plausibility_findings(robot):
        warn(str(finding))


def _findings(robot: Robot) -> Iterator[PlausibilityFinding]:
    for link in robot.links:
        for coordinate, limits in zip(link.joint.speeds, link.joint.coordinate_limits):
            low, high = limits.position or (0.0, 0.0)
            is_screw = link.joint.nv == 1 and link.joint.translations == 1
            if coordinate.unit == "rad" and not is_screw and max(abs(low), abs(high)) > FULL_TURN:
                yield PlausibilityFinding(
                    robot=robot.name,
                    link=link.name,
                    what=f"the joint turns from {low:g} to {high:g} rad, more than a full turn",
                    question="Is this in degrees? It is used as given.",
                )
    yield from _limits_left_out(robot)
    yield from _configurations_outside(robot)
    reach = max(_reaches(robot).values())
    if reach > MAX_REACH:
        yield PlausibilityFinding(
            robot=robot.name,
            what=f"the reach is {reach:g} m",
            question="Are its lengths in millimetres? They are used as given.",
        )
    for link in robot.links:
        moment = float(np.abs(np.linalg.eigvalsh(link.I)).max())
        if link.mass > 0 and reach > 0 and moment > link.mass * (MAX_GYRATION_RATIO * reach) ** 2:
            yield PlausibilityFinding(
                robot=robot.name,
                link=link.name,
                what=f"its inertia of {moment:g} kg m2 belongs to {link.mass:g} kg at a distance of "
                f"{math.sqrt(moment / link.mass):g} m, while the robot reaches {reach:g} m",
                question="Is it in kg mm2 or kg cm2? It is used as given.",
            )
    if robot.gravity[2] > 0:
        yield PlausibilityFinding(
            robot=robot.name,
            what=f"gravity is {list(robot.gravity)} m/s2, so that bodies fall upwards",
            question="Does it have the sign of the Robotics Toolbox? Here gravity is the acceleration of a "
            "falling body, [0, 0, -9.81].",
        )


def _limits_left_out(robot: Robot) -> Iterator[PlausibilityFinding]:
    """Limits of coupled joints that depend on several coordinates."""
    names = [entry.name for entry in robot.speeds]
    for joint in robot.coupled_joints:
        if joint.limits == JointLimits(torque=joint.limits.torque):
            continue
        if len(joint.factors) > 1:
            yield PlausibilityFinding(
                robot=robot.name,
                link=joint.link.name,
                what="the limits of the joint are not checked, because it depends on several coordinates: "
                + ", ".join(names[k] for k in joint.factors),
                question="Do their limits keep it in its range?",
            )
        elif joint.factors and joint.limits.position is not None:
            (k,) = joint.factors
            if common_range(robot.limits[k].position, joint) is not None:
                continue
            low, high = joint.limits.position
            yield PlausibilityFinding(
                robot=robot.name,
                link=joint.link.name,
                what=f"its range from {low:g} to {high:g} has no common value with the range of joint "
                f"'{names[k]}', on which it depends",
                question="Is a sign of the coupling or of the range wrong? The range is not checked.",
            )


def _configurations_outside(robot: Robot) -> Iterator[PlausibilityFinding]:
    """Named configurations outside the limits of the joints.

    An angle that is within the limits after one full turn is the same pose, such as 180 degrees for joint 3
    of the Puma 560 in its published configuration ``qn``.
    """
    if not robot.configurations.entries:
        return
    limits = robot.qlim.tolist()
    coordinates = robot.positions
    for name, q in robot.configurations.entries:
        for value, (low, high), coordinate in zip(q, limits, coordinates):
            margin = 1e-9 * max(1.0, abs(value))  # rounding errors of degrees
            turns = (0.0, 2 * math.pi, -2 * math.pi) if coordinate.unit == "rad" else (0.0,)
            if any(low - margin <= value + turn <= high + margin for turn in turns):
                continue
            texts = [coordinate_text(number, coordinate.unit) for number in (value, low, high)]
            yield PlausibilityFinding(
                robot=robot.name,
                what=f"coordinate '{coordinate.name}' of the configuration '{name}' is {texts[0]}, outside "
                f"its limits from {texts[1]} to {texts[2]}",
                question="Is this in degrees, or are the limits too narrow? It is used as given.",
            )


def _reaches(robot: Robot) -> dict[str | None, float]:
    """An upper bound of each link's distance from the base, m: the sum of the lengths up to it."""
    reaches: dict[str | None, float] = {None: 0.0}
    remaining = list(robot.links)
    while remaining:
        later: list[Link] = []
        for link in remaining:
            if link.parent in reaches:
                reaches[link.name] = reaches[link.parent] + _length(link)
            else:
                later.append(link)
        remaining = later
    return reaches


def _length(link: Link) -> float:
    lengths = (math.hypot(*link.before.translation), math.hypot(*link.after.translation))
    return sum(lengths) + max(map(abs, link.joint.travel or (0.0,)))

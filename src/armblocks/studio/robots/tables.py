"""The tables of the robot editor: columns, values, and physically impossible values."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Literal

from armblocks.robot import DhConvention, Link, Robot, inertia_findings, plausibility_findings, serial_chain
from armblocks.studio.protocol.messages import robots as robot_messages
from armblocks.studio.robots.columns import ROBOT, ROBOT_COLUMNS, Column, Owner
from armblocks.studio.robots.link_columns import (
    DYNAMICS,
    INERTIA_INDICES,
    KINEMATICS,
    LINK_COLUMNS,
    variable_of,
)
from armblocks.studio.robots.scene import rest_of


def robot_tables() -> robot_messages.RobotTables:
    """Return all editable columns."""
    return robot_messages.RobotTables(
        kinematics=[_column(column) for column in KINEMATICS],
        dynamics=[_column(column) for column in DYNAMICS],
        robot=[_column(column) for column in ROBOT],
    )


def robot_content(robot: Robot, published: Collection[str] = ()) -> robot_messages.RobotContent:
    """Return the data of a robot that a client displays; its named configurations are the poses.

    ``published`` are the names of the configurations of the shipped robot.
    """
    return robot_messages.RobotContent(
        name=robot.name,
        convention=_convention(robot),
        chain=robot.links == serial_chain(robot.links),
        links=[_row(link) for link in robot.links],
        coordinates=_coordinates(robot),
        speeds=_speeds(robot),
        poses=[robot_messages.Pose(name=name, q=list(q)) for name, q in robot.configurations.entries],
        published_poses=list(published),
        fields={name: column.read(robot) for name, column in ROBOT_COLUMNS.items()},
        findings=[
            *_inertia_findings(robot),
            *_friction_findings(robot),
            *_massless_findings(robot),
            *_plausibility_findings(robot),
        ],
    )


def _coordinates(robot: Robot) -> list[robot_messages.Coordinate]:
    return [
        robot_messages.Coordinate(
            name=entry.name, unit=entry.unit, low=_finite(low), high=_finite(high), rest=value
        )
        for entry, (low, high), value in zip(robot.positions, robot.qlim.tolist(), rest_of(robot))
    ]


def _speeds(robot: Robot) -> list[robot_messages.Speed]:
    return [
        robot_messages.Speed(name=entry.name, unit=entry.unit, limit=_finite(limit))
        for entry, limit in zip(robot.speeds, robot.speed_limits.tolist())
    ]


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _column(column: Column[Owner]) -> robot_messages.CellColumn:
    return robot_messages.CellColumn(
        name=column.name,
        title=column.title,
        doc=column.doc,
        quantity=column.quantity.value,
        unit=column.unit,
        optional=column.optional,
        choices=list(column.choices),
        group=column.group,
    )


def _row(link: Link) -> robot_messages.LinkRow:
    locked = {name: why for name, column in LINK_COLUMNS.items() if (why := column.locked(link))}
    return robot_messages.LinkRow(
        name=link.name,
        parent=link.parent,
        turns=link.joint.rotates,
        moves=link.joint.moves,
        variable=variable_of(link),
        cells={name: column.read(link) for name, column in LINK_COLUMNS.items()},
        locked=locked,
    )


def _convention(robot: Robot) -> Literal["standard", "modified", ""]:
    conventions = {link.dh.convention for link in robot.links if link.dh is not None}
    if conventions == {DhConvention.STANDARD}:
        return "standard"
    return "modified" if conventions == {DhConvention.MODIFIED} else ""


def _inertia_findings(robot: Robot) -> list[robot_messages.RobotFinding]:
    return [
        robot_messages.RobotFinding(
            link=finding.link,
            columns=[*INERTIA_INDICES, *(["mass"] if "no mass" in finding.reason else [])],
            what=f"No rigid body has this inertia: {finding.reason} "
            f"(principal moments {', '.join(f'{moment:.4g}' for moment in finding.moments)} kg m²).",
            fix="It is used as given. Give moments so that none exceeds the sum of the other two.",
        )
        for finding in inertia_findings(robot)
    ]


def _plausibility_findings(robot: Robot) -> list[robot_messages.RobotFinding]:
    return [
        robot_messages.RobotFinding(
            link=finding.link or robot.name, columns=[], what=f"{finding.what}.", fix=finding.question
        )
        for finding in plausibility_findings(robot)
    ]


def _friction_findings(robot: Robot) -> list[robot_messages.RobotFinding]:
    findings: list[robot_messages.RobotFinding] = []
    for link in robot.links:
        if link.motor is None:
            continue
        plus, minus = link.motor.coulomb_friction
        is_invalid = {"B": link.motor.viscous_friction < 0, "Tc+": plus < 0, "Tc-": minus > 0}
        if any(is_invalid.values()):
            findings.append(
                robot_messages.RobotFinding(
                    link=link.name,
                    columns=[name for name, invalid in is_invalid.items() if invalid],
                    what="Friction accelerates the joint instead of braking it.",
                    fix="Give B and Tc+ that are not below zero, and Tc- that is not above it.",
                )
            )
    return findings


def _massless_findings(robot: Robot) -> list[robot_messages.RobotFinding]:
    """Find joints without inertia, for which forward dynamics has no solution."""
    last = robot.links[-1]
    is_massless = last.mass == 0 and not any(any(row) for row in last.inertia)
    if (
        not is_massless
        or (last.motor is not None and last.motor.reflected_inertia > 0)
        or not last.joint.moves
    ):
        return []
    return [
        robot_messages.RobotFinding(
            link=last.name,
            columns=["mass"],
            what="The last joint has no inertia: no mass, no inertia tensor and no rotor.",
            fix="Give it a mass or an inertia, or Jm of its motor; poses and joint torques do not need it.",
        )
    ]

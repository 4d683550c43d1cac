"""Robots: what front ends show of them, and what they ask about their motion."""

from __future__ import annotations

from typing import Annotated, Generic, Literal

from pydantic import Field

from armblocks.studio.protocol.message import Message, ReplyT, Request
from armblocks.studio.protocol.messages.documents import Content, ContentChange
from armblocks.studio.protocol.robot_scene import RobotScene

Number = Annotated[float, Field(allow_inf_nan=False)]
Joints = Annotated[list[Number], Field(max_length=1000)]
"""One number a joint: rad or m, and per second."""

# -- what is shown of robots ---------------------------------------------------------------------------------


class CellColumn(Message):
    """A column of a table, or a field of the robot."""

    name: str
    title: str
    doc: str
    quantity: Literal["number", "angle", "coordinate", "rate", "text", "choice"]
    unit: str
    optional: bool
    choices: list[str]
    group: str


class RobotTables(Message):
    """Every column of the tables of robots."""

    kinematics: list[CellColumn]
    dynamics: list[CellColumn]
    robot: list[CellColumn]


class LinkRow(Message):
    """A link as the tables show it: values by column in SI units, ``None`` where there is none."""

    name: str
    parent: str | None
    turns: bool
    """Whether its joint coordinate is an angle."""
    moves: bool
    variable: str
    """The column in whose place the joint coordinate stands."""
    cells: dict[str, float | str | None]
    locked: dict[str, str]
    """Columns in which nothing can be typed, with the reason."""


class RobotFinding(Message):
    """What no real arm could have, at the columns of a link that say it."""

    link: str
    columns: list[str]
    what: str
    fix: str


class RobotContent(Content):
    """A robot as the tables of its editor show it."""

    kind: Literal["robot"] = "robot"
    name: str
    convention: Literal["standard", "modified", ""]
    """Of the D-H rows; ``""`` where there are none, or both kinds."""
    chain: bool
    links: list[LinkRow]
    fields: dict[str, float | str | None]
    findings: list[RobotFinding]


class RobotChange(ContentChange):
    """A robot after a change: all of it, since one cell may change many."""

    kind: Literal["robot"] = "robot"
    content: RobotContent


class Readings(Message):
    """What an arm does in one configuration; m, rad, N m, world axes."""

    pose: list[list[float]]
    position: list[float]
    rpy: list[float]
    """Roll, pitch, yaw of R = Rz(yaw) Ry(pitch) Rx(roll)."""
    jacobian: list[list[float]]
    manipulability: float
    gravload: list[float]
    torque: list[float]
    singular: str
    limits: list[str]


# -- requests ------------------------------------------------------------------------------------------------


class RobotOfBlock(Request[str]):
    """Open the robot that a block uses: its file, or a copy of it."""

    kind: Literal["robot_of_block"] = "robot_of_block"
    document: str
    inside: list[str] = Field(default_factory=list[str])
    block: str


class AskRobotTables(Request[RobotTables]):
    """Ask which tables robots have and what stands in their columns."""

    kind: Literal["robot_tables"] = "robot_tables"


class OfRobot(Request[ReplyT], Generic[ReplyT]):
    """A question about the robot of a document or, of a diagram, about that of a ``block``."""

    document: str
    inside: list[str] = Field(default_factory=list[str])
    block: str = ""


class AskScene(OfRobot[RobotScene]):
    """Ask for the bodies of a robot."""

    kind: Literal["scene"] = "scene"


class AskPose(OfRobot[list[list[list[float]]]]):
    """Ask where the base, the links and the tool of a robot are at ``q``: poses (L+2, 4, 4)."""

    kind: Literal["pose"] = "pose"
    q: Joints


class AskPicture(OfRobot[str]):
    """Ask for a drawing of a robot at ``q``, as SVG."""

    kind: Literal["picture"] = "picture"
    q: Joints
    theme: Literal["light", "dark"]


class AskReadings(Request[Readings]):
    """Ask what the robot of a document does at ``q, qd, qdd``."""

    kind: Literal["readings"] = "readings"
    document: str
    q: Joints
    qd: Joints
    qdd: Joints

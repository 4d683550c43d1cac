"""Robots: the data of their editor and views, and requests about their motion."""

from __future__ import annotations

from typing import Annotated, Generic, Literal

from pydantic import Field

from armblocks.studio.protocol.message import Message, ReplyT, Request
from armblocks.studio.protocol.messages.documents import Content, ContentChange
from armblocks.studio.protocol.robot_scene import RobotScene

Number = Annotated[float, Field(allow_inf_nan=False)]
Joints = Annotated[list[Number], Field(max_length=1000)]
"""One number for each joint: rad or m; for speeds rad/s or m/s, for accelerations rad/s² or m/s²."""

# -- data of robots ------------------------------------------------------------------------------------------


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
    """All columns of the tables of robots."""

    kinematics: list[CellColumn]
    dynamics: list[CellColumn]
    robot: list[CellColumn]


class LinkRow(Message):
    """A link as a row of the tables: values by column in SI units, ``None`` for an empty cell."""

    name: str
    parent: str | None
    turns: bool
    """Whether its joint coordinate is an angle."""
    moves: bool
    """Whether the joint is not fixed."""
    variable: str
    """The D-H column that shows the joint coordinate instead of a number."""
    cells: dict[str, float | str | None]
    locked: dict[str, str]
    """Columns that cannot be edited, with the reason."""


class RobotFinding(Message):
    """A physically impossible value, and the columns of the link that contain it."""

    link: str
    columns: list[str]
    what: str
    fix: str


class Coordinate(Message):
    """An entry of q: its name, its unit (rad, m or 1), and its limits if it has them.

    ``rest`` is its value in the pose that is shown without motion.
    """

    name: str
    unit: str
    low: float | None
    high: float | None
    rest: float


class Speed(Message):
    """An entry of qd: its name, the unit of its coordinate (rad or m), and its limit if it has one."""

    name: str
    unit: str
    limit: float | None


class Pose(Message):
    """A recorded pose: its name and coordinates."""

    name: str
    q: list[float]


class RobotContent(Content):
    """A robot as the tables of its editor show it."""

    kind: Literal["robot"] = "robot"
    name: str
    convention: Literal["standard", "modified", ""]
    """Convention of the D-H rows; ``""`` if there are none or both conventions occur."""
    chain: bool
    links: list[LinkRow]
    coordinates: list[Coordinate]
    speeds: list[Speed]
    poses: list[Pose]
    published_poses: list[str]
    """Names of the configurations of the shipped robot, if this is a copy that has no file yet."""
    fields: dict[str, float | str | None]
    findings: list[RobotFinding]


class RobotChange(ContentChange):
    """A robot after a change: the complete content, because one cell may affect many others."""

    kind: Literal["robot"] = "robot"
    content: RobotContent


class Readings(Message):
    """Read-outs of an arm in one configuration, in m, rad and N m along world axes."""

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
    """Open the robot of a block: its file, or a copy of a shipped robot."""

    kind: Literal["robot_of_block"] = "robot_of_block"
    document: str
    inside: list[str] = Field(default_factory=list[str])
    block: str


class AskRobotTables(Request[RobotTables]):
    """Return the columns of the robot tables."""

    kind: Literal["robot_tables"] = "robot_tables"


class RobotRequest(Request[ReplyT], Generic[ReplyT]):
    """A request about the robot of a document; ``block`` selects the robot of a block in a diagram."""

    document: str
    inside: list[str] = Field(default_factory=list[str])
    block: str = ""


class AskScene(RobotRequest[RobotScene]):
    """Return the bodies of a robot."""

    kind: Literal["scene"] = "scene"


class AskPose(RobotRequest[list[list[list[float]]]]):
    """Return the poses of base, links and tool of a robot at ``q``: (L+2, 4, 4)."""

    kind: Literal["pose"] = "pose"
    q: Joints


class AskPicture(RobotRequest[str]):
    """Return a drawing of a robot at ``q``, as SVG."""

    kind: Literal["picture"] = "picture"
    q: Joints
    theme: Literal["light", "dark"]


class AskReadings(Request[Readings]):
    """Compute the read-outs of the robot of a document at ``q, qd, qdd``."""

    kind: Literal["readings"] = "readings"
    document: str
    q: Joints
    qd: Joints
    qdd: Joints

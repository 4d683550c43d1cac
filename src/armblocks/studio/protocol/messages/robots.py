"""What page and server say to each other about robots: the editor, the arm on the screen, dropped files."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from armblocks.studio.protocol.alteration import Alteration
from armblocks.studio.protocol.message import AnyOf, Event, Message, Request
from armblocks.studio.protocol.messages.robot_edits import RobotEdit
from armblocks.studio.protocol.robot_scene import RobotScene

Number = Annotated[float, Field(allow_inf_nan=False)]
Joints = Annotated[list[Number], Field(max_length=1000)]
"""One number a joint: rad or m, and per second."""

MOST_DROPPED = 5 * 2**20
"""Bytes of a file that is dropped on the page."""

# -- what is shown of robots --------------------------------------------------------------------------------


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
    """The answer to ``robot_form``."""

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


class RobotSpot(Message):
    """Names of a robot that was opened."""

    robot: str
    name: str


class Opening(Message):
    """The answer to what opens: the robots or the diagram of a file, and what was said about it."""

    robots: list[RobotSpot]
    document: str
    notes: list[str]


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


class RobotOpen(Request[Opening]):
    """Open a robot: a file of the project, a shipped one, or a new one where both are empty."""

    kind: Literal["robot_open"] = "robot_open"
    path: str = ""
    shipped: str = ""


class RobotOfBlock(Request[Opening]):
    """Open the robot that a block uses: its file, or a copy of it."""

    kind: Literal["robot_of_block"] = "robot_of_block"
    document: str
    inside: list[str] = Field(default_factory=list[str])
    block: str


class RobotAttach(Request[Opening]):
    """Show a robot that is open already: after a reload, after the line was down, or in a second page.

    Where the server was started anew and does not know it, it comes from its journal, or else from the file
    or the shipped robot of these names, under the same key: edits that wait to be sent again find it.
    """

    kind: Literal["robot_attach"] = "robot_attach"
    robot: str = Field(pattern=r"^[0-9a-f]{16}$")
    path: str | None = None
    shipped: str = ""


class RobotAlteration(Alteration):
    """What changes a robot."""

    robot: str


class RobotChange(RobotAlteration):
    """Carry out an edit.

    Changes in a row of one ``gesture`` (the letters typed into one cell) are one step of undo.
    """

    kind: Literal["robot_change"] = "robot_change"
    gesture: str = ""
    edit: Annotated[RobotEdit, AnyOf()]


class RobotUndo(RobotAlteration):
    """Take the last edit back."""

    does = "undo"
    kind: Literal["robot_undo"] = "robot_undo"


class RobotRedo(RobotAlteration):
    """Do again what was undone."""

    does = "redo"
    kind: Literal["robot_redo"] = "robot_redo"


class RobotReload(RobotAlteration):
    """Take what the file holds now, as one step that can be undone."""

    kind: Literal["robot_reload"] = "robot_reload"


class RobotKeepMine(Request[None]):
    """Leave the file that has changed on the disk until the next save, which overwrites it."""

    kind: Literal["robot_keep_mine"] = "robot_keep_mine"
    robot: str


class RobotSave(Request[str]):
    """Write the robot's file; ``path`` gives it another. ``overwrite``: also where the disk has changed."""

    kind: Literal["robot_save"] = "robot_save"
    robot: str
    path: str = ""
    overwrite: bool = False


class RobotForm(Request[RobotTables]):
    """Ask which tables a robot has and what stands in their columns."""

    kind: Literal["robot_form"] = "robot_form"


class RobotBodies(Request[RobotScene]):
    """Ask for the bodies of an open robot."""

    kind: Literal["robot_bodies"] = "robot_bodies"
    robot: str


class RobotPose(Request[list[list[list[float]]]]):
    """Ask where the links of an open robot are at ``q``."""

    kind: Literal["robot_pose"] = "robot_pose"
    robot: str
    q: Joints


class RobotRead(Request[Readings]):
    """Ask what an open robot does at ``q, qd, qdd``."""

    kind: Literal["robot_read"] = "robot_read"
    robot: str
    q: Joints
    qd: Joints
    qdd: Joints


class RobotPicture(Request[str]):
    """Ask for a drawing, as SVG, of an open robot at ``q``, or of that of a block where ``block`` is said."""

    kind: Literal["robot_picture"] = "robot_picture"
    robot: str = ""
    document: str = ""
    inside: list[str] = Field(default_factory=list[str])
    block: str = ""
    q: Joints
    theme: Literal["light", "dark"]


class Scene(Request[RobotScene]):
    """Ask for the bodies of the robot that a block shows."""

    kind: Literal["scene"] = "scene"
    document: str
    inside: list[str] = Field(default_factory=list[str])
    block: str


class Pose(Request[list[list[list[float]]]]):
    """Ask where the links of a block's robot are at joint coordinates ``q`` (rad, m)."""

    kind: Literal["pose"] = "pose"
    document: str
    inside: list[str] = Field(default_factory=list[str])
    block: str
    q: list[float]


class Drop(Request[Opening]):
    """Open a file that was dropped on the page: a script, a robot or a diagram. Nothing of it is run."""

    kind: Literal["drop"] = "drop"
    name: str = Field(max_length=255)
    content: str = Field(max_length=4 * MOST_DROPPED // 3 + 4)
    """The bytes of the file as base64."""


# -- events --------------------------------------------------------------------------------------------------


class RobotShown(Event):
    """An open robot as it is now: sent to every page that shows it, after every change."""

    kind: Literal["robot"] = "robot"
    robot: str
    version: int
    path: str | None
    shipped: str
    """The shipped robot that it is a copy of."""
    dirty: bool
    disk: Literal["same", "changed", "gone"]
    """How its file is now, compared with what was opened or saved."""
    journaled: bool
    """False where the journal cannot be written: then only a save keeps what is edited."""
    undo: str
    redo: str
    name: str
    convention: Literal["standard", "modified", ""]
    """Of the D-H rows; ``""`` where there are none, or both kinds."""
    chain: bool
    links: list[LinkRow]
    fields: dict[str, float | str | None]
    findings: list[RobotFinding]
    notes: list[str]
    """What was said when the file was read."""


class RobotOpened(Event):
    """A page has opened robots: they come to its screen. It was told of each before."""

    kind: Literal["robot_opened"] = "robot_opened"
    opening: Opening

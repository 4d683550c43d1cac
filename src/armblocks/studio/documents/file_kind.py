"""The two kinds of files that the studio edits, diagrams and robots: each read and written in its own way.

All else is the same for both: journal, recovery, saving, what is noticed of the disk.
"""

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar, Generic, Literal, TypeVar

from pydantic import TypeAdapter

from armblocks import formats
from armblocks.blocks import BLOCKS
from armblocks.diagram import Diagram
from armblocks.errors import ArmblocksWarning, UnknownNameError
from armblocks.robot import Robot, standard_dh
from armblocks.studio.documents.edited import Edited
from armblocks.studio.documents.history import Value
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.protocol import messages as say
from armblocks.studio.protocol import robot_messages as say_robot
from armblocks.studio.protocol.alteration import Alteration
from armblocks.studio.robots.document import RobotDocument
from armblocks.studio.sheet.document import Document
from armblocks.studio.sheet.parameter_values import ResolveRobot
from armblocks.studio.sheet.placing import placed

Performed = say.Change | say.Undo | say.Redo | say.ArrangeBlocks
RobotPerformed = say_robot.RobotChange | say_robot.RobotUndo | say_robot.RobotRedo
_PERFORMED: TypeAdapter[Performed] = TypeAdapter(Performed)
_ROBOT_PERFORMED: TypeAdapter[RobotPerformed] = TypeAdapter(RobotPerformed)
EditedT = TypeVar("EditedT", bound=Edited[Any])


class FileKind(ABC, Generic[Value, EditedT]):
    """How one kind of file is begun, read and written. What reads raises ``ArmblocksError``."""

    name: ClassVar[Literal["diagram", "robot"]]
    """Also the suffix of its journals."""

    @abstractmethod
    def new(self) -> Value:
        """What a new one begins as."""

    @abstractmethod
    def shipped(self, name: str) -> Value:
        """The shipped one of this name."""

    @abstractmethod
    def edited(self, value: Value, version: int = 0) -> EditedT:
        """One that can be edited."""

    @abstractmethod
    def from_file(self, data: bytes, place: Path) -> Value:
        """What the file at ``place`` holds."""

    @abstractmethod
    def to_file(self, value: Value, place: Path) -> bytes:
        """What the file at ``place`` is to hold."""

    @abstractmethod
    def renamed(self, value: Value, place: Path) -> Value:
        """With the name that it gets from the file under which it is saved."""

    @abstractmethod
    def from_text(self, text: str, where: str) -> Value:
        """What :meth:`to_text` has written."""

    @abstractmethod
    def to_text(self, value: Value) -> str:
        """All of it, for the journal; this is what takes long, and may be done in another thread."""

    @abstractmethod
    def request(self, said: Mapping[str, Any]) -> Alteration:
        """A request of a page as the journal has it; raises ``ValidationError``."""

    @abstractmethod
    def parts(self, value: Value) -> int:
        """How many blocks or links it has."""


class DiagramKind(FileKind[Diagram, Document]):
    """Diagrams, complete or not."""

    name = "diagram"

    def __init__(self, folder: ProjectFolder, resolve_robot: ResolveRobot) -> None:
        self._folder = folder
        self._resolve_robot = resolve_robot

    def new(self) -> Diagram:
        """An empty sheet."""
        return Diagram(name="untitled", blocks={})

    def shipped(self, name: str) -> Diagram:
        """A shipped example."""
        known = formats.list_examples()
        if name not in known:
            raise UnknownNameError("example", name, known)
        return placed(formats.load_diagram(name, BLOCKS))

    def edited(self, value: Diagram, version: int = 0) -> Document:
        """A drawing."""
        return Document(value, self._resolve_robot, version=version, read_diagram=self.from_text)

    def from_file(self, data: bytes, place: Path) -> Diagram:
        """The diagram, every block with a place; it may link to libraries of the project."""
        read = formats.diagram_from_bytes(
            data,
            place.name,
            BLOCKS,
            self._resolve_robot,
            folder=place.parent,
            draft=True,
            read_library=self._folder.read_library,
        )
        return placed(read)

    def to_file(self, value: Diagram, place: Path) -> bytes:
        """Its canonical document; robots of the project are named from there."""
        return formats.diagram_to_bytes(value, self._resolve_robot, folder=place.parent)

    def renamed(self, value: Diagram, place: Path) -> Diagram:
        """A diagram is called as its file."""
        return replace(value, name=place.stem)

    def from_text(self, text: str, where: str) -> Diagram:
        """A drawing of the journal, or what was copied of one.

        The sheets of library blocks do not stand in the text: they are placed as where the file was opened.
        """
        read = formats.diagram_from_bytes(
            text.encode(),
            where,
            BLOCKS,
            self._resolve_robot,
            folder=self._folder.root,
            draft=True,
            read_library=self._folder.read_library,
        )
        return placed(read)

    def to_text(self, value: Diagram) -> str:
        """The canonical document."""
        return formats.diagram_to_bytes(value, self._resolve_robot, folder=self._folder.root).decode()

    def request(self, said: Mapping[str, Any]) -> Performed:
        """What a page asked of the drawing."""
        return _PERFORMED.validate_python({**said, "document": ""})

    def parts(self, value: Diagram) -> int:
        """Blocks of the top sheet."""
        return len(value.blocks)


class RobotKind(FileKind[Robot, RobotDocument]):
    """Robots as the editor's tables show them."""

    name = "robot"

    def __init__(self, folder: ProjectFolder) -> None:
        self._folder = folder

    def new(self) -> Robot:
        """Two links of half a metre."""
        first = standard_dh("link1", a=0.5, mass=1.0, centre_of_mass=(-0.25, 0.0, 0.0))
        second = standard_dh("link2", parent="link1", a=0.5, mass=1.0, centre_of_mass=(-0.25, 0.0, 0.0))
        return Robot(name="new robot", links=(first, second))

    def shipped(self, name: str) -> Robot:
        """A shipped robot, or a robot file of the project."""
        return formats.load_robot(self._folder.robot_path(name, formats.list_robots()))

    def edited(self, value: Robot, version: int = 0) -> RobotDocument:
        """A robot in the editor."""
        return RobotDocument(value, version=version)

    def from_file(self, data: bytes, place: Path) -> Robot:
        """The robot of a file of ours, which knows its file."""
        (robot,) = formats.read_robots(data, place.name).values()
        return replace(robot, source=str(place))

    def to_file(self, value: Robot, place: Path) -> bytes:
        """Its canonical document."""
        return formats.write_robot(value)

    def renamed(self, value: Robot, place: Path) -> Robot:
        """A robot keeps its own name, whatever its file is called."""
        return value

    def from_text(self, text: str, where: str) -> Robot:
        """A robot of the journal."""
        with warnings.catch_warnings():  # what it warns of stands among the findings
            warnings.simplefilter("ignore", ArmblocksWarning)
            (robot,) = formats.read_robots(text.encode(), "journal.json").values()
        return robot

    def to_text(self, value: Robot) -> str:
        """The canonical document."""
        return formats.write_robot(value).decode()

    def request(self, said: Mapping[str, Any]) -> RobotPerformed:
        """What a page asked of the robot."""
        return _ROBOT_PERFORMED.validate_python({**said, "robot": ""})

    def parts(self, value: Robot) -> int:
        """Links."""
        return len(value.links)

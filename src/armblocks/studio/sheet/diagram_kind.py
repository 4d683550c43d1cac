"""Creation, reading and writing of diagram files in the studio."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from armblocks import formats
from armblocks.blocks import BLOCKS
from armblocks.diagram import Diagram
from armblocks.errors import UnknownNameError
from armblocks.formats.data_files import DataFiles
from armblocks.studio.documents.file_kind import FileKind
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.sheet.document import Document
from armblocks.studio.sheet.parameter_values import ResolveRobot
from armblocks.studio.sheet.placing import placed


class DiagramKind(FileKind[Diagram, Document]):
    """Diagrams, complete or incomplete."""

    name = "diagram"

    def __init__(self, folder: ProjectFolder, resolve_robot: ResolveRobot, data: DataFiles) -> None:
        self._folder = folder
        self._resolve_robot = resolve_robot
        self._data = data

    def new(self) -> Diagram:
        """An empty diagram."""
        return Diagram(name="untitled", blocks={})

    def shipped(self, name: str) -> Diagram:
        """A shipped example."""
        example_names = formats.list_examples()
        if name not in example_names:
            raise UnknownNameError("example", name, example_names)
        return placed(formats.load_diagram(name, BLOCKS))

    def document(self, value: Diagram, version: int = 0) -> Document:
        """An open diagram."""
        return Document(
            value, self._resolve_robot, version=version, read_diagram=self.from_text, data=self._data
        )

    def from_file(self, data: bytes, place: Path) -> Diagram:
        """Read a diagram and place every block; it may be linked to libraries of the project."""
        diagram = formats.diagram_from_bytes(
            data,
            place.name,
            BLOCKS,
            self._resolve_robot,
            folder=place.parent,
            draft=True,
            read_library=self._folder.read_library,
            read_data=self._data,
        )
        return placed(diagram)

    def to_file(self, value: Diagram, place: Path) -> bytes:
        """The canonical document of the diagram; paths of project robots are relative to its folder."""
        root = self._folder.root
        return formats.diagram_to_bytes(value, self._resolve_robot, folder=place.parent, project=root)

    def renamed(self, value: Diagram, place: Path) -> Diagram:
        """Return the diagram with the name of its file."""
        return replace(value, name=place.stem)

    def from_text(self, text: str, where: str) -> Diagram:
        """Read a diagram from its journal or from the clipboard.

        The text does not contain the sheets of library blocks; their layout is taken from the opened file.
        """
        diagram = formats.diagram_from_bytes(
            text.encode(),
            where,
            BLOCKS,
            self._resolve_robot,
            folder=self._folder.root,
            draft=True,
            read_library=self._folder.read_library,
            read_data=self._data,
        )
        return placed(diagram)

    def to_text(self, value: Diagram) -> str:
        """The canonical document of the diagram."""
        root = self._folder.root
        return formats.diagram_to_bytes(value, self._resolve_robot, folder=root, project=root).decode()

    def parts(self, value: Diagram) -> int:
        """Number of blocks of the top sheet."""
        return len(value.blocks)

"""The kind of a name or file: robot, diagram, or library of subsystems."""

from __future__ import annotations

from enum import Enum

from armblocks.errors import UnknownNameError
from armblocks.files import read_bounded
from armblocks.formats.diagram_json import MAX_BYTES, MAX_DEPTH
from armblocks.formats.json_document import read_document
from armblocks.formats.robot_files import is_path
from armblocks.formats.shipped import list_examples, list_libraries, list_robots


class DocumentKind(Enum):
    """The kind of a file's content."""

    ROBOT = "robot"
    DIAGRAM = "diagram"
    LIBRARY = "library"


def kind_of_document(name_or_path: str) -> DocumentKind:
    """The kind of a shipped item or of a file; files other than JSON are robots.

    Raises ``UnknownNameError`` for a name that is not shipped, ``FormatError`` for a file that cannot be
    read.
    """
    if not is_path(name_or_path):
        shipped = {
            **dict.fromkeys(list_libraries(), DocumentKind.LIBRARY),
            **dict.fromkeys(list_examples(), DocumentKind.DIAGRAM),
            **dict.fromkeys(list_robots(), DocumentKind.ROBOT),
        }
        if name_or_path not in shipped:
            raise UnknownNameError("shipped robot, diagram or library", name_or_path, shipped)
        return shipped[name_or_path]
    return kind_of_data(read_bounded(name_or_path, MAX_BYTES), name_or_path)


def kind_of_data(data: bytes, name: str) -> DocumentKind:
    """The kind of a file's bytes, from the members of the document; other errors in it are ignored.

    Raises ``FormatError`` if a file with the suffix of JSON is not JSON.
    """
    if not name.lower().endswith(".json"):
        return DocumentKind.ROBOT
    members = read_document(data, name, MAX_BYTES, MAX_DEPTH).members()
    if "library" in members:
        return DocumentKind.LIBRARY
    return DocumentKind.DIAGRAM if "blocks" in members or "links" not in members else DocumentKind.ROBOT

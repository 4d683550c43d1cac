"""The kind of a name or file: robot, diagram, or library of subsystems."""

from __future__ import annotations

from enum import Enum

from armblocks.errors import UnknownNameError
from armblocks.files import read_bounded
from armblocks.formats.diagram_json import DEEPEST, MOST_BYTES
from armblocks.formats.json_document import read_document
from armblocks.formats.robot_files import is_path
from armblocks.formats.shipped import list_examples, list_libraries, list_robots


class DocumentKind(Enum):
    """What a file describes."""

    ROBOT = "robot"
    DIAGRAM = "diagram"
    LIBRARY = "library"


def kind_of_document(name_or_path: str) -> DocumentKind:
    """What something shipped, or a file, holds; files that are no JSON are robots.

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
    return kind_of_data(read_bounded(name_or_path, MOST_BYTES), name_or_path)


def kind_of_data(data: bytes, name: str) -> DocumentKind:
    """What the bytes of a file hold, by the members of a document, whatever is wrong elsewhere in it.

    Raises ``FormatError`` where a file that is named as JSON is none.
    """
    if not name.lower().endswith(".json"):
        return DocumentKind.ROBOT
    members = read_document(data, name, MOST_BYTES, DEEPEST).members()
    if "library" in members:
        return DocumentKind.LIBRARY
    return DocumentKind.DIAGRAM if "blocks" in members or "links" not in members else DocumentKind.ROBOT

"""Diagrams by name or path, and their files on the disk."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from os import PathLike, fspath
from pathlib import Path
from types import MappingProxyType

from armblocks.diagram import BlockLibrary, Diagram, check_block_name
from armblocks.errors import UnknownNameError, check_type
from armblocks.files import read_bounded, write_atomically
from armblocks.formats.diagram_json import (
    MAX_BYTES,
    MAX_DEPTH,
    diagram_from_bytes,
    diagram_to_bytes,
    library_to_bytes,
    read_library,
)
from armblocks.formats.json_document import read_document
from armblocks.formats.robot_files import load_robot
from armblocks.formats.robot_references import ResolveRobot
from armblocks.formats.shipped import SUFFIX, list_examples, shipped_folder
from armblocks.formats.subsystem_libraries import library_path


@cache
def example_descriptions() -> Mapping[str, str]:
    """The descriptions of the shipped diagrams by name, read from their files without building a diagram."""
    folder = shipped_folder("examples")
    return MappingProxyType({name: _description(folder / f"{name}{SUFFIX}") for name in list_examples()})


def _description(path: Path) -> str:
    document = read_document(read_bounded(path, MAX_BYTES), str(path), MAX_BYTES, MAX_DEPTH)
    members = document.members()
    return members["description"].text() if "description" in members else ""


def load_diagram(
    name_or_path: str | PathLike[str],
    library: BlockLibrary,
    resolve_robot: ResolveRobot = load_robot,
    *,
    trust: bool = False,
    draft: bool = False,
) -> Diagram:
    """A shipped diagram by its name, ``"kr180model"``, or a diagram file by its path.

    A text with a path separator or the suffix ``.json`` is a path, any other text a name. Raises
    ``UnknownNameError`` for a name that is not shipped, and the errors of :func:`read_diagram`. With
    ``trust`` the files of the diagram's Python functions are run; without it, Python functions are an error.
    With ``draft`` the diagram is not checked or traced, which is sufficient for drawing.
    """
    check_type(
        name_or_path,
        (str, PathLike),
        "a Diagram, the name of a shipped diagram, or the path of a file",
        where="a diagram",
    )
    text = fspath(name_or_path)
    if not isinstance(name_or_path, str) or "/" in text or "\\" in text or text.lower().endswith(SUFFIX):
        return read_diagram(text, library, resolve_robot, trust=trust, draft=draft)
    example_names = list_examples()
    if text not in example_names:
        raise UnknownNameError("shipped diagram", text, example_names)
    path = shipped_folder("examples") / f"{text}{SUFFIX}"
    return read_diagram(path, library, resolve_robot, trust=trust, draft=draft)


def read_diagram(
    path: str | PathLike[str],
    library: BlockLibrary,
    resolve_robot: ResolveRobot = load_robot,
    *,
    trust: bool = False,
    draft: bool = False,
) -> Diagram:
    """The diagram of a file, checked unless ``draft``; ``library`` holds the block types that it may use.

    ``resolve_robot`` returns the robot of a shipped name or a path. Paths in the file are relative to the
    file's folder. Raises ``FormatError`` for a missing or unreadable file and for violations of the format,
    ``UnknownNameError`` for unknown types, parameters, blocks, ports and robots, ``DiagramError`` for a
    diagram that cannot be built. All name the file, and the line if known.
    """
    data = read_bounded(fspath(path), MAX_BYTES)
    return diagram_from_bytes(
        data, fspath(path), library, resolve_robot, folder=Path(path).parent, trust=trust, draft=draft
    )


def write_diagram(
    path: str | PathLike[str], diagram: Diagram, resolve_robot: ResolveRobot = load_robot
) -> Path:
    """Write the canonical file of a diagram atomically, and return its path.

    Reading the file gives an equal diagram. Robots are written as references; a robot that is neither shipped
    nor from a file is written completely. Raises ``FormatError`` if the folder cannot be written or JSON
    cannot represent a value.
    """
    target = Path(fspath(path))
    write_atomically(target, diagram_to_bytes(diagram, resolve_robot, folder=target.parent))
    return target


def load_library(
    name_or_path: str | PathLike[str],
    library: BlockLibrary,
    resolve_robot: ResolveRobot = load_robot,
    *,
    trust: bool = False,
) -> Mapping[str, Diagram]:
    """The diagrams of a library by name, each linked to it: a shipped library's name, or a path.

    Raises the errors of :func:`read_diagram`.
    """
    path = Path(name_or_path) if isinstance(name_or_path, PathLike) else library_path(name_or_path, None)
    return read_library(path.resolve(), library, resolve_robot, trust=trust)


def write_library(
    path: str | PathLike[str], entries: Mapping[str, Diagram], resolve_robot: ResolveRobot = load_robot
) -> Path:
    """Write a library of diagrams by name atomically, and return its path."""
    target = Path(fspath(path))
    for name in entries:
        check_block_name(name, str(target))
    write_atomically(target, library_to_bytes(entries, resolve_robot, folder=target.parent))
    return target

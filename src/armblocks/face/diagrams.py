"""Loading and saving of diagrams and libraries, and lists of names."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from os import PathLike
from pathlib import Path

from armblocks import formats
from armblocks.blocks import BLOCKS
from armblocks.diagram import Block, Diagram, DiagramBlock, Subsystem
from armblocks.errors import check_type


def load_diagram(
    name_or_path: str | PathLike[str], *, trust: bool = False, blocks: Iterable[type[Block]] = ()
) -> Diagram:
    """A shipped example by name (``"kr180model"``), or a diagram from a ``.json`` file.

    ``blocks``: additional block classes that the file may contain.

    A diagram may refer to functions in Python files. With ``trust`` these files are run; without it, a
    diagram with such functions is an error.
    """
    return formats.load_diagram(name_or_path, BLOCKS.with_kinds("own", blocks), trust=trust)


def stored_diagram(diagram: Diagram | str | PathLike[str], where: str) -> Diagram:
    """The diagram of an argument of the function ``where``: a diagram, the name of a shipped diagram, or the
    path of a file."""
    if isinstance(diagram, str | PathLike):
        return load_diagram(diagram)
    check_type(diagram, Diagram, "a Diagram, or the name or path of a diagram", where=where)
    return diagram


def save_diagram(diagram: Diagram | str | PathLike[str], path: str | PathLike[str]) -> Path:
    """Write a diagram as canonical JSON, atomically; returns the path."""
    return formats.write_diagram(path, stored_diagram(diagram, "save_diagram"))


def to_python(diagram: Diagram | str | PathLike[str]) -> str:
    """The Python program that builds a diagram, as ``diagram``, and runs it, as ``result``.

    Layout, notes and description are omitted. Raises ``FormatError`` if a block has a Python function, or a
    robot that is neither shipped nor from a file.
    """
    return formats.diagram_to_python(stored_diagram(diagram, "to_python"))


def load_library(name_or_path: str | PathLike[str], *, trust: bool = False) -> Mapping[str, Subsystem]:
    """The blocks of a library of subsystems by name, linked to it: a shipped name, or a file's path.

    ``load_library("joint_servos")["JointServo"].with_parameters(kp=40.0)`` is a block for a builder.
    ``trust`` is as in :func:`load_diagram`.
    """
    entries = formats.load_library(name_or_path, BLOCKS, trust=trust)
    return {name: Subsystem(diagram=diagram) for name, diagram in entries.items()}


def save_library(blocks: Mapping[str, DiagramBlock | Diagram], path: str | PathLike[str]) -> Path:
    """Write diagrams, or the diagrams inside subsystem blocks, as a library, atomically; returns the path."""
    return formats.write_library(
        path, {name: b.diagram if isinstance(b, DiagramBlock) else b for name, b in blocks.items()}
    )


def list_libraries() -> tuple[str, ...]:
    """Names of the shipped libraries of subsystems."""
    return formats.list_libraries()


def list_examples() -> tuple[str, ...]:
    """Names of the shipped diagrams."""
    return formats.list_examples()


def list_blocks() -> tuple[str, ...]:
    """Type names of all blocks."""
    return tuple(BLOCKS)

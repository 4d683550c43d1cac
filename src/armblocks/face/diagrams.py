"""Diagrams by name or path, and the blocks that they are made of."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from armblocks import formats
from armblocks.blocks import BLOCKS
from armblocks.diagram import Diagram


def load_diagram(name_or_path: str | PathLike[str], *, trust: bool = False) -> Diagram:
    """A shipped example by name (``"kr180model"``), or a diagram from a ``.json`` file.

    A diagram may name functions in Python files beside it. With ``trust`` those files are run; without it,
    such a diagram is refused.
    """
    return formats.load_diagram(name_or_path, BLOCKS, trust=trust)


def save_diagram(diagram: Diagram, path: str | PathLike[str]) -> Path:
    """Write a diagram as canonical JSON, all or nothing; returns the path."""
    return formats.write_diagram(path, diagram)


def list_examples() -> tuple[str, ...]:
    """Names of the shipped diagrams."""
    return formats.list_examples()


def list_blocks() -> tuple[str, ...]:
    """Type names of all blocks."""
    return tuple(BLOCKS)

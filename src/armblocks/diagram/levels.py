"""Levels of a hierarchy: the diagrams of its subsystems, each under the path of its subsystem."""

from __future__ import annotations

from armblocks.diagram.diagram import Diagram
from armblocks.diagram.structure import DiagramBlock
from armblocks.errors import DiagramError

MAX_LEVELS = 100
"""Maximum nesting depth of subsystems."""


def joined(level: str, name: str) -> str:
    """The path of a block of a level."""
    return f"{level}/{name}" if level else name


def level_of(path: str) -> str:
    """The path of the subsystem that contains a block; ``""`` at the top level."""
    return path.rpartition("/")[0]


def name_of(path: str) -> str:
    """The name of a block within its level."""
    return path.rpartition("/")[2]


def levels_of(diagram: Diagram) -> dict[str, Diagram]:
    """All diagrams of a hierarchy by path, outer diagrams first.

    Raises ``DiagramError`` for too deeply nested subsystems.
    """
    levels: dict[str, Diagram] = {}
    pending = [("", diagram, 0)]
    while pending:
        path, level, depth = pending.pop()
        if depth > MAX_LEVELS:
            raise DiagramError(
                f"subsystems are nested more than {MAX_LEVELS} levels deep",
                where=f"block '{'/'.join(path.split('/')[:3])}/…'",
                allowed=f"at most {MAX_LEVELS}",
                fix="reduce the nesting",
            )
        levels[path] = level
        for name, block in level.blocks.items():
            if isinstance(block, DiagramBlock):
                pending.append((joined(path, name), block.diagram, depth + 1))
    return levels

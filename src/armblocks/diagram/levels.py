"""Levels of a hierarchy: the diagrams of its subsystems, each under the path of its subsystem."""

from __future__ import annotations

from collections.abc import Mapping

from armblocks.diagram.diagram import Diagram
from armblocks.diagram.port import PortRef
from armblocks.diagram.structure import DiagramBlock
from armblocks.errors import DiagramError

DEEPEST = 100
"""Maximum nesting depth of subsystems."""
MOST_LISTED = 20
"""Maximum number of inputs that one message lists."""


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
    """All diagrams of a hierarchy by path, outer ones first.

    Raises ``DiagramError`` for too deeply nested subsystems.
    """
    levels: dict[str, Diagram] = {}
    pending = [("", diagram, 0)]
    while pending:
        path, level, depth = pending.pop()
        if depth > DEEPEST:
            raise DiagramError(
                f"subsystems are nested more than {DEEPEST} levels deep",
                where=f"block '{'/'.join(path.split('/')[:3])}/…'",
                allowed=f"at most {DEEPEST}",
                fix="reduce the nesting",
            )
        levels[path] = level
        for name, block in level.blocks.items():
            if isinstance(block, DiagramBlock):
                pending.append((joined(path, name), block.diagram, depth + 1))
    return levels


def check_connected(levels: Mapping[str, Diagram]) -> None:
    """Raise ``DiagramError`` that lists the inputs that nothing drives, of all diagrams of a hierarchy."""
    open_inputs = [
        f"{joined(level, name)}/{port.name}"
        for level, diagram in levels.items()
        for name, block in diagram.blocks.items()
        for port in block.input_ports()
        if PortRef(name, port.name) not in diagram.drivers
    ]
    if open_inputs:
        shown = ", ".join(open_inputs[:MOST_LISTED])
        rest = len(open_inputs) - MOST_LISTED
        raise DiagramError(
            f"{len(open_inputs)} unconnected input{'s' * (len(open_inputs) > 1)}: {shown}"
            + (f" and {rest} more" if rest > 0 else ""),
            where=f"diagram '{next(iter(levels.values())).name}'",
            allowed="each input has a driver",
            fix="connect an output or a Constant to each",
        )

"""Commented blocks: a commented block is excluded from the model, or replaced by connections.

A block that is commented *out* has no states, events, views or logged signals. Its outputs are zeros, with
the shapes that they have in the model without comments, and its inputs are unused. A block that is commented
*through* is replaced by connections: each output equals the input of the same index. A commented subsystem
hides all blocks inside. The replacement is the pass :mod:`armblocks.diagram.passes.comments`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Literal

from armblocks.diagram.block import Block
from armblocks.diagram.connection_port import ConnectionPort
from armblocks.diagram.diagram import Diagram
from armblocks.diagram.levels import joined, level_of
from armblocks.diagram.port import Port, PortRef
from armblocks.diagram.structure import DiagramBlock, Inport, Outport
from armblocks.errors import DiagramError, counted

Comment = Literal["out", "through"]
MAX_LISTED = 20
"""Maximum number of inputs that one message lists."""


def check_comment(name: str, block: Block, comment: str) -> Comment:
    """The checked comment of a block. Raises ``DiagramError`` for an invalid comment."""
    where = f"block '{name}' ({block.title})"
    if comment != "out" and comment != "through":
        raise DiagramError(
            f"the comment is '{comment}'", where=where, allowed="out, through", fix="choose one of them"
        )
    if isinstance(block, Inport | Outport | ConnectionPort):
        raise DiagramError(
            "a port of a subsystem is commented",
            where=where,
            allowed="all blocks except In, Out and Connection Port",
            fix="comment the subsystem, or the block at the other end of the wire",
        )
    if comment == "out":
        return comment
    if block.frame_ports():
        raise DiagramError(
            "a block with frame ports is commented through",
            where=where,
            allowed="blocks with signal ports only: frames have no direction in which they pass",
            fix="comment it out, and draw a frame line past it",
        )
    into, out = len(data_inputs(block)), len(block.output_ports())
    if not 0 < out <= into:
        raise DiagramError(
            f"a block with {counted(into, 'input')} and {counted(out, 'output')} is commented through",
            where=where,
            allowed="blocks with at least one output, and an input for each output",
            fix="comment it out",
        )
    return comment


def data_inputs(block: Block) -> tuple[Port, ...]:
    """The inputs of a block without the control inputs of a conditional subsystem."""
    ports = block.input_ports()
    return ports[: len(ports) - len(block.control_ports())] if isinstance(block, DiagramBlock) else ports


def passed_ports(block: Block) -> tuple[tuple[str, str], ...]:
    """The pairs (input, output) of a block that is commented through; each becomes a direct connection."""
    return tuple((into.name, out.name) for into, out in zip(data_inputs(block), block.output_ports()))


def commented_paths(levels: Mapping[str, Diagram]) -> dict[str, Comment]:
    """The outermost commented blocks of a hierarchy by path; ``levels`` has outer levels first.

    Raises ``DiagramError`` for a block that cannot be commented.
    """
    comments: dict[str, Comment] = {}
    for level, diagram in levels.items():
        for name, comment in diagram.commented.items():
            if not is_inside(level, comments):
                comments[joined(level, name)] = check_comment(name, diagram.blocks[name], comment)
    return comments


def is_inside(path: str, commented: Collection[str]) -> bool:
    """Whether a block or a level is commented, or inside a commented subsystem."""
    while path:
        if path in commented:
            return True
        path = level_of(path)
    return False


def active_levels(levels: Mapping[str, Diagram]) -> dict[str, Diagram]:
    """The levels that are not inside a commented subsystem."""
    commented = commented_paths(levels)
    return {path: level for path, level in levels.items() if not is_inside(path, commented)}


def open_inputs(levels: Mapping[str, Diagram]) -> Iterator[PortRef]:
    """The unconnected inputs of a hierarchy, by path.

    Inputs of blocks that are commented out, and inputs inside commented subsystems, need no driver.
    """
    for level, diagram in active_levels(levels).items():
        drivers = diagram.drivers
        for name, block in diagram.blocks.items():
            comment = diagram.commented.get(name)
            required = [port.name for port in block.input_ports()] if comment is None else []
            if comment == "through":
                required = [into for into, _ in passed_ports(block)]
            yield from (
                PortRef(joined(level, name), port) for port in required if PortRef(name, port) not in drivers
            )


def check_connected(levels: Mapping[str, Diagram]) -> None:
    """Raise ``DiagramError`` with a list of the unconnected inputs of all diagrams of a hierarchy."""
    unconnected = [str(ref) for ref in open_inputs(levels)]
    if unconnected:
        listed_ports = ", ".join(unconnected[:MAX_LISTED])
        rest = len(unconnected) - MAX_LISTED
        raise DiagramError(
            f"{counted(len(unconnected), 'unconnected input')}: {listed_ports}"
            + (f" and {rest} more" if rest > 0 else ""),
            where=f"diagram '{next(iter(levels.values())).name}'",
            allowed="each input has a driver",
            fix="connect an output or a Constant to each",
        )

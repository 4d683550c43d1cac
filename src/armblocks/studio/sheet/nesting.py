"""Inner diagrams: access by path, replacement after an edit, and grouping of blocks."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path

from armblocks.diagram import (
    Block,
    Connection,
    Diagram,
    DiagramBlock,
    FrameLine,
    Inport,
    Outport,
    Placement,
    PortRef,
    Subsystem,
    frames_of,
    lines_without,
)
from armblocks.diagram.connection_port import FRAME, ConnectionPort
from armblocks.diagram.names import FreeNames, check_block_name, folded
from armblocks.errors import ArmblocksError, DiagramError, UnknownNameError
from armblocks.robot import Robot

_MARGIN = 120.0
"""Distance between the blocks of a new subsystem and its In and Out blocks, px."""


def inside(diagram: Diagram, path: Sequence[str]) -> Diagram:
    """Return the diagram inside the subsystem at this path; the empty path gives the diagram itself.

    Raises ``UnknownNameError`` if the path contains a block that is not a subsystem.
    """
    for name in path:
        block = diagram.blocks.get(name)
        if not isinstance(block, DiagramBlock):
            subsystem_names = [
                key for key, other in diagram.blocks.items() if isinstance(other, DiagramBlock)
            ]
            raise UnknownNameError("subsystem", name, subsystem_names, where=f"diagram '{diagram.name}'")
        diagram = block.diagram
    return diagram


def linked_part(diagram: Diagram, path: Sequence[str]) -> tuple[str, ...]:
    """Return the path of the library block that contains the sheet; empty for a sheet in no library block."""
    depths = range(1, len(path) + 1)
    return next((tuple(path[:depth]) for depth in depths if inside(diagram, path[:depth]).link), ())


def check_editable(diagram: Diagram, path: Sequence[str]) -> None:
    """Raise ``DiagramError`` for a sheet inside a library block, which cannot be edited."""
    linked = linked_part(diagram, path)
    if linked:
        raise DiagramError(
            f"the sheet belongs to the library block '{inside(diagram, linked).link}'",
            where=f"block '{'/'.join(linked)}'",
            allowed="changing the parameters of the library block",
            fix="break the link first",
        )


def unlinked(diagram: Diagram, name: str) -> Diagram:
    """Return the diagram with a library block replaced by an unlinked copy.

    Raises ``DiagramError`` for a block without a link.
    """
    block = diagram.block(name)
    if not isinstance(block, DiagramBlock) or not block.diagram.link:
        raise DiagramError(
            "the block is not linked to a library",
            where=f"block '{name}' ({block.title})",
            allowed="blocks with a link",
            fix="choose another block",
        )
    own = dataclasses.replace(block.diagram, link="")
    return with_block(diagram, name, dataclasses.replace(block, diagram=own))


def with_inside(diagram: Diagram, path: Sequence[str], inner: Diagram) -> Diagram:
    """Return the diagram with another diagram inside the subsystem at this path."""
    if not path:
        return inner
    block = diagram.blocks[path[0]]
    assert isinstance(block, DiagramBlock)
    changed = dataclasses.replace(block, diagram=with_inside(block.diagram, path[1:], inner))
    return with_block(diagram, path[0], changed)


def with_block(diagram: Diagram, name: str, block: Block) -> Diagram:
    """Return the diagram with one block replaced; wires to ports that no longer exist are removed."""
    into = {port.name for port in block.input_ports()}
    out = {port.name for port in block.output_ports()}
    frames = {port.name for port in block.frame_ports()}
    return dataclasses.replace(
        diagram,
        blocks={**diagram.blocks, name: block},
        connections=tuple(
            wire
            for wire in diagram.connections
            if (wire.source.block != name or wire.source.port in out)
            and (wire.target.block != name or wire.target.port in into)
        ),
        frame_lines=lines_without(
            diagram.frame_lines, lambda end: end.block == name and end.port not in frames
        ),
        logged=tuple(ref for ref in diagram.logged if ref.block != name or ref.port in out),
        signal_names={
            ref: signal
            for ref, signal in diagram.signal_names.items()
            if ref.block != name or ref.port in out
        },
    )


def with_robot(diagram: Diagram, robot: Robot) -> Diagram:
    """Return the diagram with ``robot`` in every block whose robot comes from the same file, on all levels.

    Returns the same object if no block uses the robot. A block whose parameters do not fit the new robot (for
    example another number of joints) keeps its robot.
    """
    changed: dict[str, Block] = {}
    for name, block in diagram.blocks.items():
        if isinstance(block, DiagramBlock):
            inner = with_robot(block.diagram, robot)
            if inner is not block.diagram:
                changed[name] = dataclasses.replace(block, diagram=inner)
            continue
        present_robot = getattr(block, "robot", None)
        if isinstance(present_robot, Robot) and _same_file(present_robot, robot) and present_robot != robot:
            with contextlib.suppress(ArmblocksError):
                changed[name] = dataclasses.replace(block, robot=robot)  # pyright: ignore[reportCallIssue]
    for name, block in changed.items():
        diagram = with_block(diagram, name, block)
    return diagram


def _same_file(one: Robot, other: Robot) -> bool:
    return bool(one.source) and Path(one.source).resolve() == Path(other.source).resolve()


def check_free(name: str, used_names: Mapping[str, str], where: str) -> None:
    """Raise ``DiagramError`` for an invalid or used block name; ``used_names``: by case-folded name."""
    check_block_name(name, where)
    other = used_names.get(folded(name))
    if other is not None:
        raise DiagramError(
            f"a block is already named '{other}'",
            where=where,
            allowed="unique names, regardless of capitalisation",
            fix="choose another name",
        )


def grouped(names: Sequence[str], name: str, diagram: Diagram) -> Diagram:
    """Return the diagram with some of its blocks inside a new subsystem; all signals are unchanged.

    Each outside source that feeds the group becomes an In block, and each port of the group that feeds an
    outside input becomes an Out block; they are named after that source or port. Names of signals remain,
    inside and at the new outputs.
    """
    where = f"diagram '{diagram.name}'"
    group = {entry: diagram.block(entry) for entry in names}
    if not group:
        raise DiagramError("no blocks were chosen", where=where, allowed="one or more", fix="select some")
    check_free(name, {folded(other): other for other in diagram.blocks if other not in group}, where)
    inputs = sorted(
        {w.source for w in diagram.connections if w.target.block in group and w.source.block not in group}
    )
    outputs = sorted(
        {w.source for w in diagram.connections if w.source.block in group and w.target.block not in group}
    )
    free = FreeNames((*group, *diagram.signal_names.values()))
    ins = {source: free.take(_port_title(source)) for source in inputs}
    outs = {source: free.take(_port_title(source)) for source in outputs}
    inner_wires = [
        wire if wire.source.block in group else Connection(PortRef(ins[wire.source], "y"), wire.target)
        for wire in diagram.connections
        if wire.target.block in group
    ]
    frames = _FramesOfGroup(diagram, group, name, free)
    inner = Diagram(
        name=name,
        blocks={
            **group,
            **frames.ports,
            **{key: Inport(port=number) for number, key in enumerate(ins.values(), start=1)},
            **{key: Outport(port=number) for number, key in enumerate(outs.values(), start=1)},
        },
        connections=(*inner_wires, *(Connection(port, PortRef(key, "u")) for port, key in outs.items())),
        frame_lines=frames.inside,
        layout=_inner_layout(diagram, list(group), [*ins.values(), *frames.ports], list(outs.values())),
        bends=diagram.bends,
        logged=tuple(ref for ref in diagram.logged if ref.block in group),
        commented={entry: comment for entry, comment in diagram.commented.items() if entry in group},
        signal_names={ref: signal for ref, signal in diagram.signal_names.items() if ref.block in group},
    )
    outer_wires = [
        wire if wire.source.block not in group else Connection(PortRef(name, outs[wire.source]), wire.target)
        for wire in diagram.connections
        if wire.target.block not in group
    ]
    outer_wires += [Connection(source, PortRef(name, key)) for source, key in ins.items()]
    places = [diagram.layout[entry] for entry in group]
    middle = Placement(
        x=round(sum(place.x for place in places) / len(places)),
        y=round(sum(place.y for place in places) / len(places)),
    )
    return dataclasses.replace(
        diagram,
        blocks={k: b for k, b in diagram.blocks.items() if k not in group} | {name: Subsystem(diagram=inner)},
        connections=tuple(outer_wires),
        frame_lines=frames.outside,
        layout={k: p for k, p in diagram.layout.items() if k not in group} | {name: middle},
        logged=tuple(ref for ref in diagram.logged if ref.block not in group),
        signal_names={
            PortRef(name, outs[ref]) if ref in outs else ref: signal
            for ref, signal in diagram.signal_names.items()
            if ref in outs or ref.block not in group
        },
        commented={entry: comment for entry, comment in diagram.commented.items() if entry not in group},
    )


class _FramesOfGroup:
    """The frame lines inside and outside of a new subsystem, and its Connection Ports.

    Each frame with ports on both sides of the border gets one Connection Port.
    """

    def __init__(self, diagram: Diagram, group: Mapping[str, Block], name: str, free: FreeNames) -> None:
        self.ports: dict[str, Block] = {}
        inside: list[FrameLine] = []
        outside: list[FrameLine] = []
        for members in frames_of(diagram.frame_lines):
            own = [ref for ref in members if ref.block in group]
            others = [ref for ref in members if ref.block not in group]
            lines = [line for line in diagram.frame_lines if line.first in members]
            if not own or not others:
                (inside if own else outside).extend(lines)
                continue
            port = free.take(own[0].port if len(own[0].port) > 1 else f"{own[0].block} {own[0].port}")
            self.ports[port] = ConnectionPort()
            inside += [FrameLine(ref, PortRef(port, FRAME)) for ref in own]
            outside += [FrameLine(ref, PortRef(name, port)) for ref in others]
        self.inside, self.outside = tuple(inside), tuple(outside)


def _inner_layout(
    diagram: Diagram, group: Sequence[str], ins: Sequence[str], outs: Sequence[str]
) -> dict[str, Placement]:
    """The positions of the blocks, which are unchanged, and of columns of In and Out blocks beside them."""
    places = {name: diagram.layout[name] for name in group}
    left = min(place.x for place in places.values()) - _MARGIN
    right = max(place.x for place in places.values()) + _MARGIN + 60.0
    top = min(place.y for place in places.values())
    for x, column in ((left, ins), (right, outs)):
        for row, name in enumerate(column):
            places[name] = Placement(x=x, y=top + 60.0 * row)
    return places


def _port_title(source: PortRef) -> str:
    """The name of an In or Out block for a signal, if it is free."""
    return source.block if source.port == "y" else source.port

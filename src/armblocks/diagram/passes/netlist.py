"""The netlist: all blocks of a hierarchy and the connections of their ports, the form that passes transform.

A netlist begins as a copy of the hierarchy: the blocks of all levels by path, including virtual blocks, and
the connections of all levels. A pass resolves one kind of virtual block. It adds a *replacement* for each
output port of these blocks: a rule for the contents of the port. The last pass removes all replaced blocks.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from armblocks.diagram.block import Block
from armblocks.diagram.bus import PortContent
from armblocks.diagram.diagram import Diagram, Gate
from armblocks.diagram.frames import FrameLine
from armblocks.diagram.levels import joined
from armblocks.diagram.port import PortRef, View
from armblocks.equations import Shape
from armblocks.errors import DiagramError


def _first(contents: Sequence[PortContent]) -> PortContent:
    return contents[0]


@dataclass(frozen=True)
class Replacement:
    """The contents of an output port of a virtual block.

    ``sources`` are output ports; ``content`` computes a signal or bus from their contents. By default,
    this is the content of the first source.
    """

    sources: tuple[PortRef, ...]
    content: Callable[[Sequence[PortContent]], PortContent] = _first


Replacements = Mapping[str, Replacement]
"""The replacements of the output ports of a virtual block."""


@dataclass(frozen=True, kw_only=True)
class KnownSignals:
    """Known contents and shapes of the signals in the model without comments."""

    contents: Mapping[PortRef, PortContent] = field(default_factory=dict[PortRef, PortContent])
    shapes: Mapping[PortRef, Shape] = field(default_factory=dict[PortRef, Shape])

    def at(self, ref: PortRef) -> PortContent:
        """The signal or bus at an output port of the hierarchy."""
        return self.contents.get(ref, ref)

    def shape(self, ref: PortRef) -> Shape | None:
        """The shape at an output port of the hierarchy; ``None`` for a bus and an unknown shape."""
        content = self.at(ref)
        return self.shapes.get(content) if isinstance(content, PortRef) else None


@dataclass(frozen=True, kw_only=True)
class Netlist:
    """Blocks by path and their connections, before, between or after the passes.

    Paths refer to the user's hierarchy. A block that a pass adds is named after a block of the
    hierarchy, its origin; ``origins`` has the path of the origin.
    """

    top: Diagram
    levels: Mapping[str, Diagram]
    """The diagram of every subsystem by its path, with ``""`` for the top."""
    blocks: Mapping[str, Block]
    """Every block by path, level by level, and then the blocks that passes have added."""
    drivers: Mapping[PortRef, PortRef]
    """The output port that is connected to each input port."""
    frame_lines: tuple[FrameLine, ...] = ()
    """The lines between frame ports, of all levels; empty after the pass ``physical_networks``."""
    commented: Mapping[str, str] = field(default_factory=dict[str, str])
    """The outermost commented blocks by path, see :mod:`armblocks.diagram.comments`; empty after their
    pass."""
    without_comments: KnownSignals = field(default_factory=KnownSignals)
    """The signals of the same model without comments."""
    replaced: Mapping[str, Replacements] = field(default_factory=dict[str, Replacements])
    """The blocks that the last pass removes, by path, with the contents of their output ports."""
    gates: Mapping[str, Gate] = field(default_factory=dict[str, Gate])
    """Hidden inputs of blocks in conditional subsystems: see ``Diagram.gates``."""
    shares: Mapping[str, str] = field(default_factory=dict[str, str])
    """Blocks that share the parameters of another block: see ``Diagram.shares``."""
    origins: Mapping[str, str] = field(default_factory=dict[str, str])
    """For every block that a pass has added, the path of its origin in the hierarchy."""
    contents: Mapping[PortRef, PortContent] = field(default_factory=dict[PortRef, PortContent])
    """The signal or bus at every output port; empty before the pass ``signals``."""
    views: tuple[tuple[str, View], ...] = ()
    """The views, each with its block; empty before the pass ``displays``."""
    aliases: Mapping[str, PortRef] = field(default_factory=dict[str, PortRef])
    """Other names of signals; empty before the pass ``names``."""
    declared_shapes: Mapping[PortRef, tuple[PortRef, Shape]] = field(
        default_factory=dict[PortRef, tuple[PortRef, Shape]]
    )
    """Signals at ports with a declared shape; empty before the pass ``names``."""

    @property
    def where(self) -> str:
        """The text that identifies the diagram in messages."""
        return f"diagram '{self.top.name}'"

    def remaining(self) -> dict[str, Block]:
        """The blocks that are not replaced."""
        return {path: block for path, block in self.blocks.items() if path not in self.replaced}

    def outputs(self) -> list[PortRef]:
        """The output ports of all blocks."""
        return [
            PortRef(path, port.name) for path, block in self.blocks.items() for port in block.output_ports()
        ]

    def label(self, path: str) -> str:
        """The text that identifies a block in messages."""
        return f"block '{path}' ({self.blocks[path].title})"

    def with_replaced(self, replaced: Mapping[str, Replacements]) -> Netlist:
        """A copy of the netlist with replacements for further blocks."""
        return dataclasses.replace(self, replaced={**self.replaced, **replaced})

    def at(self, path: str, port: str) -> PortContent:
        """The signal or bus at an input port, after the pass ``signals``."""
        return self.contents[self.drivers[PortRef(path, port)]]

    def one_signal(self, path: str, port: str) -> PortRef:
        """The signal at an input port, after the pass ``signals``. Raises ``DiagramError`` for a bus."""
        content = self.at(path, port)
        if isinstance(content, PortRef):
            return content
        raise DiagramError(
            f"input '{port}' receives a bus with the elements {', '.join(content.elements)}",
            where=self.label(path),
            allowed="a single signal",
            fix="put a Bus Selector in between",
        )


def netlist(
    levels: Mapping[str, Diagram],
    commented: Mapping[str, str] | None = None,
    without_comments: KnownSignals | None = None,
) -> Netlist:
    """The netlist of a hierarchy before all passes; the first of ``levels`` is the top."""
    blocks: dict[str, Block] = {}
    drivers: dict[PortRef, PortRef] = {}
    lines: list[FrameLine] = []
    for level, diagram in levels.items():
        for name, block in diagram.blocks.items():
            blocks[joined(level, name)] = block
        for wire in diagram.connections:
            source = PortRef(joined(level, wire.source.block), wire.source.port)
            drivers[PortRef(joined(level, wire.target.block), wire.target.port)] = source
        for line in diagram.frame_lines:
            first, second = (PortRef(joined(level, end.block), end.port) for end in line.ends)
            lines.append(FrameLine(first, second))
    return Netlist(
        top=levels[""],
        levels=levels,
        blocks=blocks,
        drivers=drivers,
        frame_lines=tuple(lines),
        commented=commented or {},
        without_comments=without_comments or KnownSignals(),
    )

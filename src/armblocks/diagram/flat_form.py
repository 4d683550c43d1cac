"""The flat form of a diagram: the result of the passes, and its relation to the hierarchy."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field

from armblocks.diagram.block import Block
from armblocks.diagram.bus import PortContent
from armblocks.diagram.diagram import Connection, Diagram
from armblocks.diagram.passes.netlist import Netlist
from armblocks.diagram.passes.order import resolved
from armblocks.diagram.port import PortRef, View
from armblocks.equations import Shape


@dataclass(frozen=True, kw_only=True)
class FlatForm:
    """A flat diagram, and its relation to the hierarchy. Names are paths from the top level.

    - ``levels``: the diagram of every subsystem by its path, with ``""`` for the top.
    - ``contents``: the signal or bus at output ports that pass on signals of other ports.
    - ``views``: the views, by block.
    - ``aliases``: other names of signals, such as a subsystem's ports.
    - ``declared_shapes``: ports with a declared shape.
    - ``origins``: for blocks that the passes add, such as the control of a conditional subsystem, the block
      of the hierarchy from which each is derived.

    All except ``levels`` are empty for a diagram that is already flat.
    """

    diagram: Diagram
    levels: Mapping[str, Diagram]
    contents: Mapping[PortRef, PortContent] = field(default_factory=dict[PortRef, PortContent])
    views: tuple[tuple[str, View], ...] = ()
    aliases: Mapping[str, PortRef] = field(default_factory=dict[str, PortRef])
    declared_shapes: Mapping[PortRef, tuple[PortRef, Shape]] = field(
        default_factory=dict[PortRef, tuple[PortRef, Shape]]
    )
    origins: Mapping[str, str] = field(default_factory=dict[str, str])

    def original_port(self, ref: PortRef) -> PortRef:
        """The port of the hierarchy for an input port of a flat block.

        The control ``enabled/enable`` represents a port of the subsystem ``enabled``: ``enabled/enable/u``
        becomes ``enabled/enable``.
        """
        origin = self.origins.get(ref.block, ref.block)
        if ref.block.startswith(f"{origin}/"):
            return PortRef(origin, ref.block.removeprefix(f"{origin}/"))
        return PortRef(origin, ref.port)


def flat_form(net: Netlist) -> FlatForm:
    """Apply all passes to a netlist and return the flat form. Raises ``DiagramError``."""
    levels, net = net.levels, resolved(net)
    return FlatForm(
        diagram=_as_diagram(net),
        levels=levels,
        contents=net.contents,
        views=net.views,
        aliases=net.aliases,
        declared_shapes=net.declared_shapes,
        origins=net.origins,
    )


def _as_diagram(net: Netlist) -> Diagram:
    """The diagram of a netlist without virtual blocks."""
    return dataclasses.replace(
        net.top,
        # The flat diagram has no masks: blocks keep the computed values without their formulas.
        blocks={path: _without_formulas(block) for path, block in net.blocks.items()},
        connections=tuple(Connection(source, target) for target, source in net.drivers.items()),
        layout={},
        bends={},
        notes={},
        bookmarks={},
        scope_trigger=None,
        extras={},
        gates=net.gates,
        mask=(),
        mask_values={},
        commented={},
        signal_names={},
        shares=net.shares,
        frame_lines=(),
    )


def _without_formulas(block: Block) -> Block:
    return dataclasses.replace(block, formulas=()) if block.formulas else block

"""Flattening of diagrams with subsystems, tags and buses: blocks named by paths, direct connections only.

Flattening changes no signal. A block ``pid`` inside the subsystem ``controller`` becomes the block
``controller/pid``; each input is traced back through virtual blocks to the output of a real block. A diagram
without virtual blocks is its own flat form. The steps are the passes of :mod:`armblocks.diagram.passes`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from armblocks.diagram.block import Block
from armblocks.diagram.bus import Carried
from armblocks.diagram.diagram import Connection, Diagram
from armblocks.diagram.levels import check_connected, joined, levels_of
from armblocks.diagram.passes.netlist import Netlist
from armblocks.diagram.passes.order import flat_netlist
from armblocks.diagram.port import PortRef, View, ViewKind
from armblocks.diagram.structure import Subsystem
from armblocks.equations import Shape


@dataclass(frozen=True, kw_only=True)
class FlatForm:
    """A flat diagram, and its relation to the hierarchy. Names are paths from the top level.

    ``levels``: the diagram of every subsystem by its path, with ``""`` for the top. ``carried``: the signal
    or bus at output ports of the hierarchy, where it is not their own signal. ``aliases``: other names of
    signals, such as a subsystem's ports. ``views``: the views, by block. ``stated``: ports with a declared
    shape. ``origins``: for blocks that are not blocks of the hierarchy, such as the control of a conditional
    subsystem, the block of the hierarchy that they come from. All except ``levels`` are empty for a diagram
    that is already flat.
    """

    diagram: Diagram
    levels: Mapping[str, Diagram]
    carried: Mapping[PortRef, Carried] = field(default_factory=dict[PortRef, Carried])
    views: tuple[tuple[str, View], ...] = ()
    aliases: Mapping[str, PortRef] = field(default_factory=dict[str, PortRef])
    stated: Mapping[PortRef, tuple[PortRef, Shape]] = field(
        default_factory=dict[PortRef, tuple[PortRef, Shape]]
    )
    origins: Mapping[str, str] = field(default_factory=dict[str, str])

    def original_port(self, ref: PortRef) -> PortRef:
        """The port of the hierarchy for an input port of a flat block.

        The control ``enabled/enable`` of a subsystem stands for its port: ``enabled/enable/u`` becomes
        ``enabled/enable``.
        """
        origin = self.origins.get(ref.block, ref.block)
        if ref.block.startswith(f"{origin}/"):
            return PortRef(origin, ref.block.removeprefix(f"{origin}/"))
        return PortRef(origin, ref.port)


def flatten_hierarchy(diagram: Diagram) -> FlatForm:
    """The flat form of a diagram, cached for each diagram object.

    Raises ``DiagramError`` for unconnected inputs, unmatched tags and bus elements, connections in a cycle
    without a block, and too deeply nested subsystems; ``where`` names the path.
    """
    return diagram.keep("flat form", lambda: _flat_form(diagram))


def flat_diagram(diagram: Diagram) -> Diagram:
    """The flat diagram alone; a diagram without virtual blocks itself."""
    return flatten_hierarchy(diagram).diagram


def diagram_views(diagram: Diagram) -> tuple[tuple[str, View], ...]:
    """All views of a diagram and its subsystems, with the path of the block that defines each.

    Logged outputs come last: each is a view with traces, named after the output.
    """
    form = flatten_hierarchy(diagram)
    views = form.views
    if form.diagram is diagram:
        views = tuple((name, view) for name, block in diagram.blocks.items() for view in block.views())
    return (*views, *_logged_views(diagram))


def _logged_views(diagram: Diagram, path: str = "") -> Iterator[tuple[str, View]]:
    for ref in diagram.logged:
        place = joined(path, ref.block)
        yield place, View(kind=ViewKind.TRACES, signals=(ref.port,), title=f"{place}/{ref.port}")
    for name, block in diagram.blocks.items():
        if isinstance(block, Subsystem):
            yield from _logged_views(block.diagram, joined(path, name))


def _flat_form(diagram: Diagram) -> FlatForm:
    if not any(block.virtual for block in diagram.blocks.values()):
        check_connected({"": diagram})
        return FlatForm(diagram=diagram, levels={"": diagram})
    levels = levels_of(diagram)
    check_connected(levels)
    net = flat_netlist(levels)
    return FlatForm(
        diagram=_as_diagram(net),
        levels=levels,
        carried=net.carried,
        views=net.views,
        aliases=net.aliases,
        stated=net.stated,
        origins=net.origins,
    )


def _as_diagram(net: Netlist) -> Diagram:
    """The diagram of a netlist without virtual blocks."""
    return dataclasses.replace(
        net.top,
        # Values without the masks from which they were computed.
        blocks={path: _plain(block) for path, block in net.blocks.items()},
        connections=tuple(Connection(source, target) for target, source in net.drivers.items()),
        layout={},
        bends={},
        notes={},
        extras={},
        gates=net.gates,
        mask=(),
        mask_values={},
        shares=net.shares,
    )


def _plain(block: Block) -> Block:
    return dataclasses.replace(block, formulas=()) if block.formulas else block

"""The passes that make a hierarchy flat, in their order.

A pass is a function from a :class:`~armblocks.diagram.passes.netlist.Netlist` to a netlist, in a separate
file, whose docstring names the input and the result of the pass. A new pass needs a file and an entry in
``PASSES``. One pass resolves each kind of virtual block and adds replacements for its output ports.
A pass that reads signals comes after ``resolve_signals``.
"""

from __future__ import annotations

from collections.abc import Callable

from armblocks.diagram.passes.bus_copies import copy_for_buses
from armblocks.diagram.passes.buses import resolve_buses
from armblocks.diagram.passes.comments import resolve_comments
from armblocks.diagram.passes.conditional_subsystems import resolve_conditional_subsystems
from armblocks.diagram.passes.displays import resolve_displays
from armblocks.diagram.passes.merges import resolve_merges
from armblocks.diagram.passes.names import resolve_names
from armblocks.diagram.passes.netlist import Netlist
from armblocks.diagram.passes.physical_networks import resolve_physical_networks
from armblocks.diagram.passes.signals import resolve_signals
from armblocks.diagram.passes.subsystems import resolve_subsystems
from armblocks.diagram.passes.tags import resolve_tags
from armblocks.diagram.passes.virtual_blocks import remove_virtual_blocks

PASSES: tuple[Callable[[Netlist], Netlist], ...] = (
    resolve_comments,
    resolve_conditional_subsystems,
    resolve_subsystems,
    resolve_physical_networks,
    resolve_tags,
    resolve_buses,
    copy_for_buses,
    resolve_signals,
    resolve_merges,
    resolve_displays,
    resolve_names,
    remove_virtual_blocks,
)


def resolved(net: Netlist) -> Netlist:
    """A netlist after all passes. Raises ``DiagramError``."""
    for resolve in PASSES:
        net = resolve(net)
    return net

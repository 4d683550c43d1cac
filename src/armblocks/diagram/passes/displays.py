"""Pass: the views of all blocks; displays of buses show all signals of the bus.

Input: the contents of all ports.

Result: the views (``Netlist.views``), by path. Displays with a bus at an input become virtual: their views
read the signals of the bus directly.
"""

from __future__ import annotations

import dataclasses

from armblocks.diagram.block import Block
from armblocks.diagram.bus import Bus
from armblocks.diagram.passes.netlist import Netlist, Replacements
from armblocks.diagram.port import View


def resolve_displays(net: Netlist) -> Netlist:
    """The netlist with all views, and without displays of buses."""
    blocks_with_views = {path: block for path, block in net.remaining().items() if block.views()}
    with_bus = {path for path, block in blocks_with_views.items() if _shows_bus(net, path, block)}
    views = tuple(
        (path, _expanded(net, path, view) if path in with_bus else view)
        for path, block in sorted(blocks_with_views.items())
        for view in block.views()
    )
    removed: dict[str, Replacements] = {path: {} for path in blocks_with_views if path in with_bus}
    return dataclasses.replace(net.with_replaced(removed), views=views)


def _shows_bus(net: Netlist, path: str, block: Block) -> bool:
    """Whether a block is a display only, with a bus at an input."""
    if block.output_ports() or block.record_ports():
        return False
    return any(isinstance(net.at(path, port.name), Bus) for port in block.input_ports())


def _expanded(net: Netlist, path: str, view: View) -> View:
    """A view with a bus replaced by its signals."""
    signals: list[str] = []
    labels: list[str] = []
    view_labels = view.labels or ("",) * len(view.signals)
    for signal, label in zip(view.signals, view_labels):
        content = net.at(path, signal)
        if isinstance(content, Bus):
            signals += [f"{signal}.{element}" for element, _ in content.leaves()]
            labels += [f"{label}.{element}" if label else element for element, _ in content.leaves()]
        else:
            signals.append(signal)
            labels.append(label)
    return dataclasses.replace(view, signals=tuple(signals), labels=tuple(labels))

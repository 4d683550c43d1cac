"""Pass: networks of physical blocks are replaced by blocks with equations.

Input: physical blocks, which name their pass (``Block.gathers``), and the frame lines between them, of all
levels.

Result: no physical blocks and no frame lines. Each family of physical blocks brings its own pass, because the
equations of a family, such as the mechanics of bodies, are above the diagram layer.
"""

from __future__ import annotations

import dataclasses

from armblocks.diagram.passes.netlist import Netlist


def resolve_physical_networks(net: Netlist) -> Netlist:
    """The netlist after the passes of all families of physical blocks that it contains.

    Raises ``DiagramError``.
    """
    for gather in {type(block).gathers: None for block in net.blocks.values()}:
        if gather is not None:
            net = gather(net)
    return dataclasses.replace(net, frame_lines=())

"""Pass: Merge blocks become blocks that select the outputs of active conditional subsystems.

Input: Merge blocks whose inputs are held outputs of conditional subsystems.

Result: ``MergedOutput`` blocks without a gate (hidden inputs of a conditional subsystem). Their inputs
``running1``, ``running2`` and so on are 1 while the subsystem of the input is active.
"""

from __future__ import annotations

import dataclasses

from armblocks.diagram.block import Block
from armblocks.diagram.conditional import Merge
from armblocks.diagram.conditional_equations import RESTART
from armblocks.diagram.controls import HeldOutput, MergedOutput
from armblocks.diagram.diagram import Gate
from armblocks.diagram.grounded import Grounded
from armblocks.diagram.passes.netlist import Netlist
from armblocks.diagram.port import PortRef
from armblocks.errors import DiagramError


def resolve_merges(net: Netlist) -> Netlist:
    """The netlist without Merge blocks. Raises ``DiagramError`` for an input that is not a held output."""
    merges = {path: block for path, block in net.remaining().items() if isinstance(block, Merge)}
    if not merges:
        return net
    blocks: dict[str, Block] = dict(net.blocks)
    drivers, gates, origins = dict(net.drivers), dict(net.gates), dict(net.origins)
    contents = dict(net.contents)
    for path, block in merges.items():
        outer: Gate = gates.pop(path, {})
        resettable = RESTART in outer
        blocks[path] = MergedOutput(resettable=resettable, inputs=block.inputs, initial=block.initial)
        if resettable:
            drivers[PortRef(path, "outer_restart")] = outer[RESTART]
        for number in range(1, block.inputs + 1):
            active = _active_signal(net, path, f"u{number}")
            if active is None:  # a subsystem that is commented out
                inactive = f"{path}.running{number}"
                blocks[inactive], origins[inactive] = Grounded.of({"y": ()}), path
                active = contents[PortRef(inactive, "y")] = PortRef(inactive, "y")
            drivers[PortRef(path, f"running{number}")] = active
    return dataclasses.replace(
        net, blocks=blocks, drivers=drivers, gates=gates, origins=origins, contents=contents
    )


def _active_signal(net: Netlist, path: str, port: str) -> PortRef | None:
    """The signal that is 1 while the subsystem of an input is active.

    ``None`` if the subsystem is commented out.
    """
    content = net.at(path, port)
    if isinstance(content, PortRef) and isinstance(net.blocks[content.block], Grounded):
        return None
    if isinstance(content, PortRef) and isinstance(net.blocks[content.block], HeldOutput):
        return net.drivers[PortRef(content.block, "running")]
    source = f"'{content}'" if isinstance(content, PortRef) else "a bus"
    raise DiagramError(
        f"input '{port}' is {source}, which is not an output of a conditional subsystem",
        where=f"block '{path}' (Merge)",
        allowed="outputs of enabled, triggered and action subsystems",
        fix="use a Switch, or put the signal's block into a conditional subsystem",
    )

"""The mechanisms of a diagram as robots, for views of a diagram that is still incomplete."""

from __future__ import annotations

from collections.abc import Mapping
from typing import cast

from armblocks.diagram import Diagram
from armblocks.diagram.comments import commented_paths
from armblocks.diagram.levels import levels_of
from armblocks.diagram.passes.netlist import KnownSignals, Netlist, netlist
from armblocks.multibody.assembly import drawn_mechanism, world_block
from armblocks.multibody.frames import frames_of_parts, networks
from armblocks.multibody.gathering import gather_mechanisms
from armblocks.multibody.parts import Part, WorldPart
from armblocks.multibody.start import start_of
from armblocks.robot import Robot


def drawn_robots(diagram: Diagram) -> Mapping[str, tuple[Robot, tuple[float, ...]]]:
    """The robot of each mechanism that can move, and its assembled coordinates q (nq,), by its World Frame.

    Unconnected inputs, and networks without a World Frame, are permitted. Raises ``DiagramError`` for a
    mechanism with a World Frame that cannot be assembled.
    """
    return diagram.cached("drawn robots", lambda: _drawn_robots(diagram))


def _drawn_robots(diagram: Diagram) -> Mapping[str, tuple[Robot, tuple[float, ...]]]:
    levels = levels_of(diagram)
    net: Netlist = netlist(levels, {}, KnownSignals())
    omitted = tuple(commented_paths(levels))
    parts = {
        path: cast("Part", block.part())
        for path, block in net.blocks.items()
        if type(block).gathers is gather_mechanisms
        and not any(path == other or path.startswith(f"{other}/") for other in omitted)
    }
    frames = frames_of_parts(net, parts)
    robots: dict[str, tuple[Robot, tuple[float, ...]]] = {}
    for network in networks(net, parts, frames):
        if not any(isinstance(parts[path], WorldPart) for path in network):
            continue
        drawn = drawn_mechanism(net, parts, frames, network)
        if drawn is not None:
            robots[world_block(parts, network)] = drawn.robot, tuple(start_of(net, drawn).q.tolist())
    return robots

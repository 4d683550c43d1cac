"""Routes the wires of a sheet: orthogonal lines around blocks with an unambiguous meaning.

The lines and dots determine the connections uniquely. No line passes under a block or near a port of another
net. Lines of two nets never overlap, and cross at right angles away from corners, dots and ports. A wire
without a legal route has labels at its ends in place of a line.

The routes are a function of the blocks and nets alone. :class:`Routing` stores the previous routes and the
area on which each depends. It reroutes only nets with a change in this area. Routing the whole sheet again
gives the same result.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from armblocks.drawing.free_space import RESERVED, Extent, FreeSpace, areas_overlap, extents, sorted_ends
from armblocks.drawing.wire_net import NetRoute, NetRouter
from armblocks.drawing.wire_search import Floats
from armblocks.drawing.wires import Net, Obstacle, RoutedNet, WireEnd

MAX_LEVEL_OFFSET = 1.5
"""Maximum distance between the end of a line and the centre of its port, px; it makes lines straight."""


def route(obstacles: Sequence[Obstacle], nets: Sequence[Net]) -> list[RoutedNet]:
    """The routes of all nets, in their order."""
    blocks = {str(k): obstacle for k, obstacle in enumerate(obstacles)}
    routed = Routing().update(blocks, {f"{k:06}": net for k, net in enumerate(nets)})
    return [routed[f"{k:06}"] for k in range(len(nets))]


@dataclass(frozen=True)
class _RankedNet:
    """A net with its reserved segments at the ports and its rank in the routing order."""

    net: Net
    number: int
    ends: Floats
    rank: tuple[bool, float, str]


class Routing:
    """The routes of one sheet, updated when its blocks or nets change."""

    def __init__(self) -> None:
        self._obstacles: Mapping[str, Obstacle] = {}
        self._space = FreeSpace([])
        self._ranked: dict[str, _RankedNet] = {}
        self._routes: dict[str, NetRoute] = {}
        self._aligned_by_key: dict[str, tuple[Net, Net]] = {}
        self._net_count = 0

    def update(self, obstacles: Mapping[str, Obstacle], nets: Mapping[str, Net]) -> dict[str, RoutedNet]:
        """The routes of all nets by key. Nets with user-drawn routes are routed first, then others by
        length."""
        nets = {key: self._aligned(key, net) for key, net in nets.items()}
        changed = [*self._changed_obstacles(obstacles), *self._changed_nets(nets)]
        if not changed and nets.keys() == self._routes.keys():
            return {key: self._routes[key].routed for key in nets}
        space = self._space if obstacles == self._obstacles else FreeSpace(_sides(obstacles.values()))
        space.reserve([(entry.ends, entry.number) for entry in self._ranked.values()])
        stale = self._stale(changed)
        routes: dict[str, NetRoute] = {}
        changed_areas: list[Extent] = []
        for key in sorted(nets, key=lambda key: self._ranked[key].rank):
            net, old = nets[key], self._routes.get(key)
            if (
                old is None
                or key in stale
                or old.net != net
                or (changed_areas and any(areas_overlap(old.examined, extent) for extent in changed_areas))
            ):
                rerouted = NetRouter(space, net, self._ranked[key].number).route()
                if old is None or rerouted.routed != old.routed:
                    changed_areas += extents(rerouted.segments)
                    changed_areas += extents(old.segments) if old is not None else ()
                old = rerouted
            routes[key] = old
            space.add_net(old.segments, self._ranked[key].number)
        self._obstacles, self._space, self._routes = dict(obstacles), space, routes
        self._aligned_by_key = {key: self._aligned_by_key[key] for key in nets}
        return {key: routes[key].routed for key in nets}

    def _aligned(self, key: str, net: Net) -> Net:
        """The net; targets within ``MAX_LEVEL_OFFSET`` of the source's line are moved onto this line."""
        old = self._aligned_by_key.get(key)
        if old is None or (old[0] is not net and old[0] != net):
            targets = tuple(_aligned_target(target, net.source) for target in net.targets)
            old = self._aligned_by_key[key] = (
                net,
                net if targets == net.targets else replace(net, targets=targets),
            )
        return old[1]

    def _stale(self, changed: Sequence[Extent]) -> set[str]:
        """The nets whose routes depend on one of these changed areas."""
        if not changed or not self._routes:
            return set()
        examined = np.array([entry.examined for entry in self._routes.values()])[:, None]
        areas = np.array(changed)[None]
        overlaps = (examined[..., :2] <= areas[..., 2:]) & (areas[..., :2] <= examined[..., 2:])
        is_stale = np.any(np.all(overlaps, axis=2), axis=1)
        return {key for key, stale in zip(self._routes, is_stale.tolist()) if stale}

    def _changed_obstacles(self, obstacles: Mapping[str, Obstacle]) -> Iterable[Extent]:
        for name in {*obstacles, *self._obstacles}:
            old, new = self._obstacles.get(name), obstacles.get(name)
            if old is not new and old != new:
                yield from (FreeSpace(_sides([one])).extent(0) for one in (old, new) if one is not None)

    def _changed_nets(self, nets: Mapping[str, Net]) -> list[Extent]:
        changed: list[Extent] = []
        ranked: dict[str, _RankedNet] = {}
        for key, net in nets.items():
            old = self._ranked.get(key)
            if old is None or (old.net is not net and old.net != net):
                self._net_count += 1
                rank = not any(net.bends), _length(net), key
                ranked[key] = _RankedNet(net, self._net_count, _ends(net), rank)
                changed += extents(ranked[key].ends, at_ports=True)
            else:
                ranked[key] = old
        for key, old in self._ranked.items():
            if ranked.get(key) is not old:
                changed += extents(old.ends, at_ports=True)
                changed += extents(self._routes[key].segments)
        self._ranked = ranked
        return changed


def _aligned_target(target: WireEnd, source: WireEnd) -> WireEnd:
    if (target.dx, target.dy) != (source.dx, source.dy):
        return target
    if target.dx and abs(target.y - source.y) <= MAX_LEVEL_OFFSET:
        return replace(target, y=source.y)
    if target.dy and abs(target.x - source.x) <= MAX_LEVEL_OFFSET:
        return replace(target, x=source.x)
    return target


def _sides(obstacles: Iterable[Obstacle]) -> list[tuple[float, ...]]:
    """Left, top, right and bottom of each block and of its name."""
    return [block + label for block, label in (obstacle.areas for obstacle in obstacles)]


def _ends(net: Net) -> Floats:
    """The segments directly before the ports of a net, which are reserved for it."""
    source = net.source
    rows = [(source.x, source.y, source.x + RESERVED * source.dx, source.y + RESERVED * source.dy)]
    rows += [(t.x - RESERVED * t.dx, t.y - RESERVED * t.dy, t.x, t.y) for t in net.targets]
    return sorted_ends(np.array(rows))


def _length(net: Net) -> float:
    return sum(abs(net.source.x - t.x) + abs(net.source.y - t.y) for t in net.targets)

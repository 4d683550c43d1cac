"""The columns of the blocks, and the lines between neighbouring columns.

A line over several columns gets a dummy node in each column that it passes, which reserves space for the
line. A backward line reverses its direction at a dummy node in the column of its source, and again at one in
the column of its target.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from armblocks.drawing.arrangement.feedback import Flow, forward_order
from armblocks.drawing.arrangement.links import Link, Network

_PASSES = 4
_MAX_PATHS = 40
_SINK_BONUS = 1000.0
"""Value of a path that ends at a sink, in blocks."""
_FURTHER_TERM_PENALTY = 1.4
"""Reduction of the value of a path that does not enter a sum by its first port, in blocks."""
_UPPER_PORT, _LOWER_PORT = -0.3, 0.3
"""Heights of the ports of a round sum relative to its middle, as a fraction of its height."""


@dataclass(frozen=True)
class End:
    """An end of a line: the node, whether it is on the node's right side, and the height of the port.

    ``relative_height``: height below the node's middle as a fraction of its height, between -1/2 and 1/2.
    """

    node: int
    right: bool
    relative_height: float
    port: float
    """Height of the port below the upper edge, px."""
    can_be_straight: bool = True
    """Whether the line may reach the port without a bend."""


@dataclass(frozen=True, eq=False)
class Segment:
    """A line between two neighbouring columns, or between two nodes of one column.

    ``gap``: number of the column to the left of the gap in which it runs.
    """

    net: int
    gap: int
    a: End
    b: End

    @property
    def is_reversal(self) -> bool:
        """Whether the line reverses its direction: both ends are in one column."""
        return self.a.right == self.b.right


@dataclass(frozen=True)
class Columns:
    """Nodes in columns: first the blocks, then the dummy nodes of long lines."""

    column: list[int]
    segments: list[Segment]
    blocks: int
    paths: tuple[tuple[int, ...], ...]
    """The blocks of the main path, from its source to its sink, and then of further paths."""
    path: dict[int, int] = field(default_factory=dict[int, int])
    """The number of the path of each node that is on a path."""
    nets: list[int] = field(default_factory=list[int])
    """The net of each dummy node."""
    two_input_sums: frozenset[int] = frozenset()
    """Round sums with two inputs."""
    mirrored: frozenset[int] = frozenset()
    """Mirrored blocks."""


def assign_columns(network: Network, flow: Flow, exchanged: frozenset[int] = frozenset()) -> Columns:
    """The columns of a connected network.

    ``exchanged``: round sums whose upper and lower lines are exchanged.
    """
    column = _column_numbers(network, flow)
    return _LineSplitter(network, flow, column, _paths(network, flow), exchanged).columns()


def _constraints(network: Network, flow: Flow) -> list[tuple[int, int, int]]:
    """Pairs of blocks, and the minimum number of columns from the first to the second, to the right."""
    distances: dict[tuple[int, int], int] = {}
    local = _local_feedback(network, flow)
    for k, link in enumerate(network.links):
        source, target = link.source, link.target
        if source in local or target in local:
            continue
        if target in flow.mirrored:
            pair, min_columns = (target, source), int(source in flow.mirrored)
        elif source in flow.mirrored:
            pair, min_columns = (target, source), 1
        elif k in flow.cut:
            continue
        else:
            pair, min_columns = (source, target), 1
        distances[pair] = max(distances.get(pair, 0), min_columns)
    return [(a, b, min_columns) for (a, b), min_columns in distances.items()]


def _local_feedback(network: Network, flow: Flow) -> dict[int, int]:
    """The mirrored blocks whose only source is also their only target, with the number of that block."""
    sources: dict[int, set[int]] = {}
    targets: dict[int, set[int]] = {}
    for link in network.links:
        sources.setdefault(link.target, set()).add(link.source)
        targets.setdefault(link.source, set()).add(link.target)
    return {
        k: min(sources[k])
        for k in flow.mirrored
        if len(sources.get(k, ())) == 1 and sources[k] == targets.get(k, set())
    }


def _column_numbers(network: Network, flow: Flow) -> list[int]:
    """The column of each block: by the longest path from a source, then moved close to its neighbours."""
    count = len(network.names)
    rules = _constraints(network, flow)
    left: list[list[tuple[int, int]]] = [[] for _ in range(count)]
    right: list[list[tuple[int, int]]] = [[] for _ in range(count)]
    for a, b, min_columns in rules:
        right[a].append((b, min_columns))
        left[b].append((a, min_columns))
    order = forward_order(count, [Link(a, 0, b, 0, 0.0) for a, b, _ in rules])
    column = [0] * count
    for node in order:
        column[node] = max((column[a] + min_columns for a, min_columns in left[node]), default=0)
    for _ in range(_PASSES):
        for node in reversed(order):
            if right[node] and len(right[node]) >= len(left[node]):
                column[node] = min(column[b] - min_columns for b, min_columns in right[node])
        for node in order:
            if len(left[node]) > len(right[node]):
                column[node] = max(column[a] + min_columns for a, min_columns in left[node])
    for node, partner in _local_feedback(network, flow).items():
        column[node] = column[partner]
    first = min(column, default=0)
    return [k - first for k in column]


def _paths(network: Network, flow: Flow) -> tuple[tuple[int, ...], ...]:
    """The main path, then repeatedly the best path through the remaining blocks."""
    links = [
        link
        for k, link in enumerate(network.links)
        if k not in flow.cut and not {link.source, link.target} & flow.mirrored
    ]
    remaining = set(range(len(network.names))) - flow.mirrored
    paths: list[tuple[int, ...]] = []
    while len(paths) < _MAX_PATHS:
        links = [link for link in links if link.source in remaining and link.target in remaining]
        path = _best_path(network, links, remaining, sink_bonus=0.0 if paths else _SINK_BONUS)
        if len(path) < 2 and paths:
            break
        paths.append(path)
        remaining -= set(path)
    return tuple(paths)


def _best_path(
    network: Network, links: Sequence[Link], blocks: set[int], *, sink_bonus: float
) -> tuple[int, ...]:
    """The longest path through ``blocks`` along the flow. Of several branches, first ports are preferred.

    ``sink_bonus``: value of a path that ends at a sink, in blocks.
    """
    count = len(network.names)
    leaving: list[list[Link]] = [[] for _ in range(count)]
    for link in links:
        leaving[link.source].append(link)
    feeding = {link.source for link in network.links}
    best: list[tuple[float, Link | None]] = [(0.0, None)] * count
    for node in reversed(forward_order(count, links)):
        if node not in feeding:
            best[node] = (sink_bonus, None)
        for link in leaving[node]:
            bonus = 0.4 * (link.input == 0) + 0.2 * (link.output == 0)
            if link.input and network.is_sum(link.target):
                bonus -= _FURTHER_TERM_PENALTY
            value = best[link.target][0] + 1.0 + bonus
            if best[node][1] is None or value > best[node][0] + 1e-9:
                best[node] = (value, link)
    path: list[int] = []
    entered = {link.target for link in links}
    starts = [k for k in sorted(blocks) if k not in entered]
    node = max(starts, key=lambda k: (best[k][0], -k), default=None)
    while node is not None:
        path.append(node)
        link = best[node][1]
        node = link.target if link is not None else None
    return tuple(path)


class _LineSplitter:
    """Divides the lines into segments between neighbouring columns, with dummy nodes in the columns."""

    def __init__(
        self,
        network: Network,
        flow: Flow,
        column: list[int],
        paths: tuple[tuple[int, ...], ...],
        exchanged: frozenset[int],
    ) -> None:
        self._network, self._flow, self._paths = network, flow, paths
        self._column = list(column)
        self._path = {node: k for k, path in enumerate(paths) for node in path}
        self._steps = {step: k for k, path in enumerate(paths) for step in pairwise(path)}
        self._segments: list[Segment] = []
        self._nets: list[int] = []
        self._sides = _sum_ports(network, flow, paths, column)
        for node in exchanged:
            self._sides[node] = {
                port: -relative_height for port, relative_height in self._sides[node].items()
            }

    def columns(self) -> Columns:
        """All nodes and segments."""
        nets: dict[tuple[int, int], list[Link]] = {}
        for link in self._network.links:
            nets.setdefault((link.source, link.output), []).append(link)
        for number, ((source, output), links) in enumerate(sorted(nets.items())):
            self._split_net(number, source, output, sorted(links, key=lambda a: (a.target, a.input)))
        two_input_sums = [
            k
            for k, box in enumerate(self._network.boxes)
            if self._network.is_round(k) and len(box.inputs) == 2
        ]
        return Columns(
            self._column,
            self._segments,
            len(self._network.names),
            self._paths,
            self._path,
            self._nets,
            frozenset(two_input_sums),
            self._flow.mirrored,
        )

    def _split_net(self, net: int, source: int, output: int, links: Sequence[Link]) -> None:
        column, mirrored = self._column, self._flow.mirrored
        source_column = column[source]
        start = self._end(source, source not in mirrored, output, inputs=False)
        backward: dict[int, End] = {}
        """The dummy nodes of the line to the left, by column."""

        def dummy(at: int) -> End:
            column.append(at)
            self._nets.append(net)
            return End(len(column) - 1, True, 0.0, 0.0)

        def forward_end(gap: int, target: int) -> End:
            """The left end of the segment in a gap. Lines to several targets have separate dummy nodes."""
            end = start
            for at in range(source_column + 1, gap + 1):
                before, end = end, dummy(at)
                if (source, target) in self._steps:
                    self._path[end.node] = self._steps[source, target]
                self._join(net, at - 1, before, _with_side(end, right=False))
            return end

        def backward_end(at: int) -> End:
            """The dummy node of the line to the left in a column."""
            if at not in backward:
                if source in mirrored and at == source_column:
                    backward[at] = start
                    return start
                if at == source_column:
                    backward[at] = dummy(at)
                    self._join(net, at, start, backward[at])
                else:
                    after = backward_end(at + 1)
                    backward[at] = dummy(at)
                    self._join(net, at, backward[at], _with_side(after, right=False))
            return backward[at]

        for link in links:
            target, target_column = link.target, column[link.target]
            if target in mirrored:
                end = self._end(target, True, link.input)
                if target_column == source_column and source not in mirrored:
                    self._join(net, source_column, start, end)
                else:
                    self._join(
                        net, target_column, end, _with_side(backward_end(target_column + 1), right=False)
                    )
            elif source not in mirrored and target_column > source_column:
                self._join(
                    net,
                    target_column - 1,
                    forward_end(target_column - 1, target),
                    self._end(target, False, link.input),
                )
            else:
                self._join(
                    net,
                    target_column - 1,
                    _with_side(backward_end(target_column), right=False),
                    self._end(target, False, link.input),
                )

    def _join(self, net: int, gap: int, a: End, b: End) -> None:
        """Add a segment of a line; a segment between two columns begins at its left end."""
        self._segments.append(Segment(net, gap, a, b))

    def _end(self, block: int, right: bool, number: int, *, inputs: bool = True) -> End:
        box = self._network.boxes[block]
        port = (box.inputs if inputs else box.outputs)[number]
        if inputs and block in self._sides:
            relative_height = self._sides[block][number]
            return End(block, right, relative_height, box.height / 2, can_be_straight=relative_height == 0.0)
        if port.dy:
            return End(block, right, -0.48, 0.0, can_be_straight=False)
        height = port.y - box.y
        return End(block, right, 0.9 * (height / box.height - 0.5), height)


def _with_side(end: End, *, right: bool) -> End:
    return End(end.node, right, end.relative_height, end.port, end.can_be_straight)


def _sum_ports(
    network: Network, flow: Flow, paths: Sequence[Sequence[int]], column: Sequence[int]
) -> dict[int, dict[int, float]]:
    """Heights of the inputs of round sums: one at the rear side, feedback below, all other inputs above.

    Of two feedback lines to one sum, the line over more columns comes from above.
    """
    entering: dict[int, list[tuple[int, Link]]] = {}
    for k, link in enumerate(network.links):
        if network.is_round(link.target):
            entering.setdefault(link.target, []).append((k, link))
    before = {after: node for path in paths for node, after in pairwise(path)}
    main = set(paths[0])
    port_heights: dict[int, dict[int, float]] = {}
    for node, links in entering.items():
        is_backward = node in flow.mirrored

        def is_feedback(k: int, link: Link, is_backward: bool = is_backward) -> bool:
            return not is_backward and (k in flow.cut or link.source in flow.mirrored)

        links.sort(
            key=lambda entry: (
                is_feedback(*entry),
                before.get(entry[1].target) != entry[1].source,
                is_backward and entry[1].source not in flow.mirrored,
                abs(column[entry[1].source] - column[node]) if not is_backward else -column[entry[1].source],
                entry[1].source in main,
                network.is_minus(entry[1].target, entry[1].input),
                entry[1].input,
            )
        )
        heights = {links[0][1].input: 0.0}
        rest = sorted(links[1:], key=lambda entry: _length(network, entry[1], column))
        used_heights: set[float] = set()
        for k, link in rest:
            below = is_feedback(k, link)
            relative_height = _LOWER_PORT if below else _UPPER_PORT
            if relative_height in used_heights:
                relative_height = -relative_height
            used_heights.add(relative_height)
            heights[link.input] = relative_height
        port_heights[node] = heights
    return port_heights


def _length(network: Network, link: Link, column: Sequence[int]) -> tuple[int, int]:
    """The sort key of a feedback line: the number of columns that it spans, and its input port."""
    farthest = column[link.source]
    for other in network.links:
        if other.target == link.source:
            farthest = max(farthest, column[other.source])
    return abs(farthest - column[link.target]), link.input

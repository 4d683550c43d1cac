"""The connections of a diagram as links between numbered blocks, with the weight of cutting each of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from armblocks import blocks as kinds
from armblocks.diagram import Block, Diagram, DiagramBlock, Inport, frames_of
from armblocks.diagram.signs import Outline
from armblocks.drawing.block_boxes import SIDES, Box, BoxPort

_MEMORY_WEIGHT = 30.0
"""Weight of a cut before an integrator, a filter or a plant."""
_FUNCTION_WEIGHT = 5.0
_FRAME_WEIGHT = 5.0
"""Weights of a cut before a block without memory, and of a cut of a frame line."""
_FURTHER_PORT_WEIGHT = 2.0
_SUM_WEIGHT = 3.0
_PLUS_TERM_WEIGHT = 1.5
_MINUS_TERM_WEIGHT = 1.0
"""Weights of a cut before a further input of a sum, with a plus and with a minus."""
_STATE_OUTPUT_FACTOR = 0.5
"""Factor of the weight of a link that leaves a block with a state, because states are usually fed back."""


@dataclass(frozen=True)
class Link:
    """A connection: numbers of the blocks and of their ports."""

    source: int
    output: int
    target: int
    input: int
    weight: float
    """Weight of cutting this link, relative to other links of the same loop."""


@dataclass(frozen=True, eq=False)
class Network:
    """The blocks of a sheet in the order of their names, with their boxes, and the links between them."""

    names: tuple[str, ...]
    boxes: tuple[Box, ...]
    links: tuple[Link, ...]

    @classmethod
    def of(cls, diagram: Diagram, unplaced: Mapping[str, Box]) -> Network:
        """The network of a sheet; ``unplaced``: the boxes of its blocks, at any position."""
        names = tuple(sorted(diagram.blocks))
        number = {name: k for k, name in enumerate(names)}
        inputs = {name: {p.name: k for k, p in enumerate(unplaced[name].inputs)} for name in names}
        outputs = {name: {p.name: k for k, p in enumerate(unplaced[name].outputs)} for name in names}
        memory = {name: has_memory(diagram.blocks[name]) for name in names}
        state = {name: memory[name] and not _is_filter(diagram.blocks[name]) for name in names}
        links: list[Link] = []
        for wire in diagram.connections:
            source, target = wire.source, wire.target
            if source.port not in outputs.get(source.block, {}) or target.port not in inputs.get(
                target.block, {}
            ):
                continue  # an incomplete diagram
            input_number = inputs[target.block][target.port]
            weight = _weight(unplaced[target.block], input_number, memory[target.block])
            weight *= _STATE_OUTPUT_FACTOR if state[source.block] else 1.0
            links.append(
                Link(
                    number[source.block],
                    outputs[source.block][source.port],
                    number[target.block],
                    input_number,
                    weight,
                )
            )
        links += _frame_links(diagram, unplaced, number)
        return cls(names, tuple(with_frames(unplaced[name]) for name in names), tuple(links))

    def subnetwork(self, members: Sequence[int]) -> Network:
        """Some of the blocks, and the links between them."""
        number = {member: k for k, member in enumerate(members)}
        return Network(
            tuple(self.names[k] for k in members),
            tuple(self.boxes[k] for k in members),
            tuple(
                Link(number[a.source], a.output, number[a.target], a.input, a.weight)
                for a in self.links
                if a.source in number
            ),
        )

    def components(self) -> list[list[int]]:
        """The connected parts, the largest first."""
        leader = list(range(len(self.names)))

        def find(k: int) -> int:
            while leader[k] != k:
                leader[k] = k = leader[leader[k]]
            return k

        for link in self.links:
            a, b = sorted((find(link.source), find(link.target)))
            leader[b] = a
        components: dict[int, list[int]] = {}
        for k in range(len(leader)):
            components.setdefault(find(k), []).append(k)
        return sorted(components.values(), key=lambda members: (-len(members), members))

    def is_round(self, k: int) -> bool:
        """Whether a block is a round sum, whose inputs are on the sides from which their lines come."""
        box = self.boxes[k]
        return len(box.inputs) in (2, 3) and is_circle(box)

    def may_be_mirrored(self, k: int) -> bool:
        """Whether a source may be placed to the right of the block that it feeds."""
        return not isinstance(self.boxes[k].block, Inport)

    def is_state(self, k: int) -> bool:
        """Whether a block has memory and is not a filter or controller."""
        block = self.boxes[k].block
        return has_memory(block) and not _is_filter(block)

    def is_constant(self, k: int) -> bool:
        """Whether a block is a constant, which does not start a signal path."""
        return isinstance(self.boxes[k].block, kinds.Constant)

    def is_sum(self, k: int) -> bool:
        """Whether a block adds its inputs."""
        return isinstance(self.boxes[k].block, kinds.Sum)

    def is_minus(self, k: int, port: int) -> bool:
        """Whether an input of a sum is subtracted."""
        block = self.boxes[k].block
        return isinstance(block, kinds.Sum) and block.signs[port] == "-"

    def memory(self) -> list[bool]:
        """For each block, whether it has states or delays."""
        return [has_memory(box.block) for box in self.boxes]


def with_frames(box: Box) -> Box:
    """The box with its left frame ports after its inputs, and the right ones after its outputs."""
    if not box.frames:
        return box
    left, right = _sides(box)
    return replace(
        box,
        inputs=(*box.inputs, *(replace(port, dx=-port.dx) for port in left)),
        outputs=(*box.outputs, *right),
    )


def without_frames(box: Box) -> Box:
    """The box with its own inputs and outputs, the inverse of :func:`with_frames`."""
    if not box.frames:
        return box
    left, right = _sides(box)
    return replace(
        box,
        inputs=box.inputs[: len(box.inputs) - len(left)],
        outputs=box.outputs[: len(box.outputs) - len(right)],
    )


def _sides(box: Box) -> tuple[list[BoxPort], list[BoxPort]]:
    """The frame ports of the left and of the right side of the block before it is flipped."""
    sides = {port.name: port.side for port in box.block.frame_ports()}
    left, right = ([port for port in box.frames if sides[port.name] == side] for side in SIDES)
    return left, right


def _frame_links(diagram: Diagram, unplaced: Mapping[str, Box], number: Mapping[str, int]) -> list[Link]:
    """The links of frames: from one port that leads to the right to all ports that lead to the left.

    Blocks are thus arranged from the base to the follower, as signals are from outputs to inputs.
    """
    links: list[Link] = []
    for members in frames_of(diagram.frame_lines):
        outputs: list[tuple[int, int]] = []
        inputs: list[tuple[int, int]] = []
        for ref in members:
            if ref.block not in unplaced:
                continue
            box = unplaced[ref.block]
            left, right = _sides(box)
            inputs += [
                (number[ref.block], len(box.inputs) + k) for k, p in enumerate(left) if p.name == ref.port
            ]
            outputs += [
                (number[ref.block], len(box.outputs) + k) for k, p in enumerate(right) if p.name == ref.port
            ]
        for source, output in outputs[:1]:
            links += [Link(source, output, block, port, _FRAME_WEIGHT) for block, port in inputs]
    return links


def is_circle(box: Box) -> bool:
    """Whether a block is drawn as a circle."""
    return box.block.face_outline() is Outline.CIRCLE


def has_memory(block: Block) -> bool:
    """Whether a block, or a block inside it, has states or delays."""
    if isinstance(block, DiagramBlock):
        return any(has_memory(inner) for inner in block.diagram.blocks.values())
    kind = type(block)
    return any(
        getattr(kind, name) is not getattr(Block, name)
        for name in ("states", "discrete_states", "delay_lines")
    )


def _is_filter(block: Block) -> bool:
    """Whether a block with states may be a controller as well as a plant."""
    return isinstance(
        block,
        kinds.TransferFunction | kinds.ZeroPole | kinds.FirstOrderLag | kinds.SecondOrderLag | kinds.LeadLag
        | kinds.AnalogFilter | kinds.PID | kinds.PID2DOF | kinds.DiscretePID | kinds.DiscretePID2DOF
        | kinds.DiscreteTransferFunction | kinds.DiscreteFilter | kinds.DiscreteZeroPole,
    )  # fmt: skip


def _weight(target: Box, port: int, memory: bool) -> float:
    if isinstance(target.block, kinds.Sum):
        if port == 0:
            return _SUM_WEIGHT
        return _MINUS_TERM_WEIGHT if target.block.signs[port] == "-" else _PLUS_TERM_WEIGHT
    if memory:
        return _MEMORY_WEIGHT if port == 0 else _MEMORY_WEIGHT / 3
    return _FUNCTION_WEIGHT if port == 0 else _FURTHER_PORT_WEIGHT

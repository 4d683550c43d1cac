"""Sample times: those that blocks declare, and those that are inherited through connections."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from armblocks.diagram.block import Block
from armblocks.diagram.block_equations import BlockEquations
from armblocks.diagram.components import strongly_connected
from armblocks.diagram.diagram import Diagram
from armblocks.diagram.features import SlotKind
from armblocks.diagram.parameter import ParameterKind, parameter
from armblocks.diagram.port import PortRef
from armblocks.equations import SampleClock
from armblocks.equations.clock_ratios import exact_clocks
from armblocks.errors import DiagramError, InputError

INHERITED = -1.0
"""The sample time of a block that inherits the sample time of its inputs, as in Simulink."""

Source = SampleClock | None
"""When a signal changes: at the ticks of a clock, or (``None``) continuously."""


def sample_time_parameter(default: float = INHERITED) -> Any:
    """Declare the parameter ``sample_time`` of a sampled block: ``-1``, ``T`` or ``(T, offset)``."""
    return parameter(
        default,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        tunable=False,
        unit="s",
        doc="the period, or (period, offset); -1 inherits that of the inputs",
    )


def own_clock(block: Block) -> SampleClock | None:
    """The clock that a sampled block declares; ``None`` if it inherits that of its inputs.

    Raises ``InputError`` for an invalid sample time.
    """
    sample_time = np.atleast_1d(np.asarray(block.parameter_value("sample_time"), dtype=np.float64))
    if sample_time.tolist() == [INHERITED]:
        return None
    period, offset = (float(sample_time[0]), float(sample_time[1]) if sample_time.size > 1 else 0.0)
    if sample_time.size > 2 or period <= 0.0 or not 0.0 <= offset < period:
        raise InputError(
            f"the sample time is {sample_time.tolist()}",
            where=f"{block.type_name()}.sample_time",
            allowed="-1 (that of the inputs), a period > 0, or (period, offset) with 0 <= offset < period",
            fix="give the period in seconds",
        )
    return SampleClock(period, offset)


@dataclass(frozen=True)
class Sampling:
    """The clocks of a diagram, fastest first, and the number of the clock of each sampled block."""

    clocks: tuple[SampleClock, ...]
    clock_of: Mapping[str, int]


def resolve_sampling(diagram: Diagram, equations: Mapping[str, BlockEquations]) -> Sampling:
    """Find the clock of every sampled block; ``equations`` are those of all other blocks.

    A block with sample time -1 inherits the clock of the sampled blocks upstream, through blocks without
    states; the fastest one, if the periods of the others are multiples of it. If only constants are upstream,
    it inherits from the sampled blocks downstream.

    Raises ``DiagramError`` for a block without a clock upstream or downstream, and for clocks that are not
    multiples.
    """
    sampled = [name for name in diagram.blocks if diagram.clocked(name)]
    if not sampled:
        return Sampling((), {})
    stated: dict[str, SampleClock | None] = {}
    for name in sampled:
        try:
            stated[name] = own_clock(diagram.blocks[name])
        except InputError as error:
            raise DiagramError(
                error.what, where=f"block '{name}', {error.where}", allowed=error.allowed, fix=error.fix
            ) from None
    begins: dict[str, Source] = {name: clock for name, clock in stated.items() if clock is not None}
    begins.update({name: None for name, clocks_by_block in equations.items() if _flows(clocks_by_block)})
    forward = {name: list[str]() for name in diagram.blocks}
    backward = {name: list[str]() for name in diagram.blocks}
    for wire in diagram.connections:
        forward[wire.source.block].append(wire.target.block)
        backward[wire.target.block].append(wire.source.block)
    upstream = _reach(begins, forward)
    downstream: Mapping[str, Collection[tuple[str, Source]]] | None = None
    clocks_by_block: dict[str, SampleClock] = {}
    for name, clock in stated.items():
        if clock is not None:
            clocks_by_block[name] = clock
            continue
        reaching = {source for entry in backward[name] for source in upstream[entry]}
        if not reaching:
            if downstream is None:
                clocked = {entry: own for entry, own in stated.items() if own is not None}
                downstream = _reach(dict(clocked), backward)
            reaching = {source for entry in forward[name] for source in downstream[entry]}
        clocks_by_block[name] = _fastest(name, diagram.blocks[name], reaching)
    clocks = tuple(sorted(set(clocks_by_block.values()), key=lambda clock: (clock.period, clock.offset)))
    return Sampling(clocks, {name: clocks.index(clock) for name, clock in clocks_by_block.items()})


def moving_blocks(diagram: Diagram, equations: Mapping[str, BlockEquations]) -> frozenset[str]:
    """The blocks with outputs that may change between instants: they depend on time, a state, or such
    outputs.

    Outputs that depend only on sampled blocks, constants and modes change at instants. Blocks on a loop
    always belong to the result, so that a loop through comparisons is solved for each of their values.
    ``equations`` are those of all blocks that are not sampled.
    """
    wires = {name: list[tuple[str, PortRef]]() for name in equations}
    for wire in diagram.connections:
        if wire.source.block in wires and wire.target.block in wires:
            wires[wire.source.block].append((wire.source.port, wire.target))
    on_loops = _on_loops({name: [target.block for _, target in entries] for name, entries in wires.items()})
    inputs: dict[str, set[str]] = {name: set() for name in equations}
    queue = deque(equations)
    while queue:
        name = queue.popleft()
        outputs = _moving_outputs(diagram.blocks[name], equations[name], inputs[name])
        for port, target in wires[name]:
            if (port in outputs or name in on_loops) and target.port not in inputs[target.block]:
                inputs[target.block].add(target.port)
                queue.append(target.block)
    flowing = {name for name, own in equations.items() if _flows(own)}
    return frozenset(flowing | on_loops | {name for name, ports in inputs.items() if ports})


def check_triggered(diagram: Diagram, equations: Mapping[str, BlockEquations]) -> None:
    """Raise ``DiagramError`` for a block in a triggered subsystem with a continuous state or with a declared
    sample time.
    """
    for name, own in equations.items():
        block = diagram.blocks[name]
        if diagram.clocked(name) or "?fire" not in diagram.gates.get(name, {}):
            continue
        timed = block.sampled and own_clock(block) is not None
        if own.states or timed:
            kind = "ticks by itself" if timed else f"has the continuous state '{own.states[0].name}'"
            raise DiagramError(
                f"a block in a triggered subsystem {kind}",
                where=f"block '{name}' ({block.title})",
                allowed="blocks without states, and sampled blocks with the sample time -1",
                fix="set its sample_time to -1" if timed else "use a sampled block, or an enabled subsystem",
            )


def _flows(block: BlockEquations) -> bool:
    """Whether outputs of a block depend on time or a continuous state."""
    return bool(block.states or block.delays) or any(group.timed for group in block.groups)


def _moving_outputs(block: Block, equations: BlockEquations, moving: Collection[str]) -> set[str]:
    """The outputs of a block that may change between instants, where these inputs do."""
    delayed = {line.name for line in equations.delays}
    outputs: set[str] = set()
    for port in block.output_ports():
        index = equations.group_of.get((SlotKind.OUTPUT, port.name))
        if index is None or port.name in block.implicit_outputs:
            outputs.add(port.name)
            continue
        group = equations.groups[index]
        inputs = {name.removesuffix("'") for name in group.inputs}
        if group.timed or group.states or delayed & set(group.discrete) or inputs & set(moving):
            outputs.add(port.name)
    return outputs


def _on_loops(following: Mapping[str, Iterable[str]]) -> set[str]:
    """The blocks on feedback loops."""
    indices = {name: index for index, name in enumerate(following)}
    names = list(following)
    needs = [[indices[entry] for entry in entries] for entries in following.values()]
    components = (component for component in strongly_connected(needs) if len(component) > 1)
    on_loops = {names[index] for component in components for index in component}
    return on_loops | {name for name, entries in following.items() if name in entries}


def _reach(
    begins: Mapping[str, Source], following: Mapping[str, Iterable[str]]
) -> Mapping[str, set[tuple[str, Source]]]:
    """For each block the nearest sources of its sample time, without those upstream of another source."""
    reach: dict[str, set[tuple[str, Source]]] = {name: set() for name in following}
    queue: deque[str] = deque()
    for name, source in begins.items():
        reach[name].add((name, source))
        queue.append(name)
    while queue:
        name = queue.popleft()
        for entry in following[name]:
            if entry in begins:
                continue
            before = len(reach[entry])
            # One block per clock is enough for the message and limits the size of the sets.
            known = {source for _, source in reach[entry]}
            reach[entry].update(pair for pair in reach[name] if pair[1] not in known)
            if len(reach[entry]) > before:
                queue.append(entry)
    return reach


def _fastest(name: str, block: Block, reaching: Collection[tuple[str, Source]]) -> SampleClock:
    where = f"block '{name}' ({block.title})"
    fix = "set the sample_time of the block"
    moving = sorted(entry for entry, source in reaching if source is None)
    if moving:
        raise DiagramError(
            f"the sample time -1 is that of the inputs, but '{moving[0]}' changes continuously",
            where=where,
            allowed="-1 downstream of sampled blocks only",
            fix=fix + "; to delay a continuous signal, use a Transport Delay",
        )
    clocks = sorted(((clock, entry) for entry, clock in reaching if clock), key=lambda pair: pair[0].period)
    if not clocks:
        raise DiagramError(
            "the sample time -1 is that of the inputs, but none of them is sampled",
            where=where,
            allowed="-1 upstream or downstream of a block with a sample time",
            fix=fix,
        )
    fastest, by = clocks[0]
    for clock, other in clocks[1:]:
        (step, start), (period, offset) = exact_clocks((fastest, clock))
        if (period / step).denominator != 1 or ((offset - start) / step).denominator != 1:
            raise DiagramError(
                f"'{by}' ticks every {fastest.period:g} s (offset {fastest.offset:g} s) and '{other}' every "
                f"{clock.period:g} s (offset {clock.offset:g} s)",
                where=where,
                allowed="inputs whose ticks are all ticks of the fastest one",
                fix=fix + ", or put a Rate Transition before one of the inputs",
            )
    return fastest

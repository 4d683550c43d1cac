"""Sample times, declared by blocks or inherited through connections."""

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
"""The sample time of a block that inherits the clock of other blocks, see :func:`resolve_sampling`."""

Source = SampleClock | None
"""The times at which a signal changes: the ticks of a clock, or (``None``) all times."""


def sample_time_parameter(default: float = INHERITED) -> Any:
    """Declare the parameter ``sample_time`` of a sampled block: ``-1``, ``T`` or ``(T, offset)``."""
    return parameter(
        default,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        tunable=False,
        unit="s",
        doc="the period, or (period, offset); -1: the sample time of sampled blocks upstream or downstream",
    )


def own_clock(block: Block) -> SampleClock | None:
    """The clock that a sampled block declares; ``None`` if the block inherits its clock.

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
            allowed="-1 (inherited), a period > 0, or (period, offset) with 0 <= offset < period",
            fix="give the period in seconds",
        )
    return SampleClock(period, offset)


@dataclass(frozen=True)
class Sampling:
    """The clocks of a diagram, fastest first, and the index of the clock of each sampled block."""

    clocks: tuple[SampleClock, ...]
    clock_of: Mapping[str, int]


def resolve_sampling(diagram: Diagram, equations: Mapping[str, BlockEquations]) -> Sampling:
    """Find the clock of every sampled block; ``equations``: the equations of all other blocks.

    A block with sample time -1 inherits the clock of the sampled blocks upstream, through blocks without
    states. Of several clocks it inherits the fastest, if all other periods are multiples of it. If only
    constants are upstream, the block inherits the clock of the sampled blocks downstream.

    Raises ``DiagramError`` for a block without a clock upstream or downstream, and for clocks whose periods
    are not multiples of the fastest period.
    """
    sampled = [name for name in diagram.blocks if diagram.clocked(name)]
    if not sampled:
        return Sampling((), {})
    declared: dict[str, SampleClock | None] = {}
    for name in sampled:
        try:
            declared[name] = own_clock(diagram.blocks[name])
        except InputError as error:
            raise DiagramError(
                error.what, where=f"block '{name}', {error.where}", allowed=error.allowed, fix=error.fix
            ) from None
    sources: dict[str, Source] = {name: clock for name, clock in declared.items() if clock is not None}
    sources.update({name: None for name, own in equations.items() if _is_continuous(own)})
    forward = {name: list[str]() for name in diagram.blocks}
    backward = {name: list[str]() for name in diagram.blocks}
    for wire in diagram.connections:
        forward[wire.source.block].append(wire.target.block)
        backward[wire.target.block].append(wire.source.block)
    upstream = _nearest_sources(sources, forward)
    downstream: Mapping[str, Collection[tuple[str, Source]]] | None = None
    clocks_by_block: dict[str, SampleClock] = {}
    for name, clock in declared.items():
        if clock is not None:
            clocks_by_block[name] = clock
            continue
        reaching_sources = {source for entry in backward[name] for source in upstream[entry]}
        if not reaching_sources:
            if downstream is None:
                clocked = {entry: own for entry, own in declared.items() if own is not None}
                downstream = _nearest_sources(dict(clocked), backward)
            reaching_sources = {source for entry in forward[name] for source in downstream[entry]}
        clocks_by_block[name] = _fastest_clock(name, diagram.blocks[name], reaching_sources)
    clocks = tuple(sorted(set(clocks_by_block.values()), key=lambda clock: (clock.period, clock.offset)))
    return Sampling(clocks, {name: clocks.index(clock) for name, clock in clocks_by_block.items()})


def moving_blocks(diagram: Diagram, equations: Mapping[str, BlockEquations]) -> frozenset[str]:
    """The blocks with moving outputs: outputs that may change between instants.

    A moving output depends on time, a state, or another moving output. Outputs that depend only on sampled
    blocks, constants and modes change at instants. The result contains all blocks on loops, so that a loop
    through comparisons is solved for each value of the comparisons. ``equations``: the equations of all
    blocks that are not sampled.
    """
    wires = {name: list[tuple[str, PortRef]]() for name in equations}
    for wire in diagram.connections:
        if wire.source.block in wires and wire.target.block in wires:
            wires[wire.source.block].append((wire.source.port, wire.target))
    on_loops = _on_loops({name: [target.block for _, target in entries] for name, entries in wires.items()})
    inputs: dict[str, set[str]] = {name: set() for name in equations}
    wires_of: dict[PortRef, list[PortRef]] = {}
    for name, entries in wires.items():
        for port, target in entries:
            wires_of.setdefault(PortRef(name, port), []).append(target)
    always, readers = dict[str, set[str]](), dict[str, dict[str, list[str]]]()
    for name, own in equations.items():
        always[name], readers[name] = _moving_outputs(diagram.blocks[name], own)
    queue = deque(
        PortRef(name, port)
        for name, entries in wires.items()
        for port in dict.fromkeys(port for port, _ in entries)
        if port in always[name] or name in on_loops
    )
    moving = set(queue)
    while queue:
        for target in wires_of[queue.popleft()]:
            if target.port in inputs[target.block]:
                continue
            inputs[target.block].add(target.port)
            for port in readers[target.block].get(target.port, ()):
                output = PortRef(target.block, port)
                if output in wires_of and output not in moving:
                    moving.add(output)
                    queue.append(output)
    continuous = {name for name, own in equations.items() if _is_continuous(own)}
    return frozenset(continuous | on_loops | {name for name, ports in inputs.items() if ports})


def check_triggered(diagram: Diagram, equations: Mapping[str, BlockEquations]) -> None:
    """Raise ``DiagramError`` for a continuous state or a declared sample time in a triggered subsystem."""
    for name, own in equations.items():
        block = diagram.blocks[name]
        if diagram.clocked(name) or "?fire" not in diagram.gates.get(name, {}):
            continue
        timed = block.sampled and own_clock(block) is not None
        if own.states or timed:
            kind = "has its own sample time" if timed else f"has the continuous state '{own.states[0].name}'"
            raise DiagramError(
                f"a block in a triggered subsystem {kind}",
                where=f"block '{name}' ({block.title})",
                allowed="blocks without states, and sampled blocks with the sample time -1",
                fix="set its sample_time to -1" if timed else "use a sampled block, or an enabled subsystem",
            )


def _is_continuous(block: BlockEquations) -> bool:
    """Whether outputs of a block depend on time or a continuous state."""
    return bool(block.states or block.delays) or any(group.timed for group in block.groups)


def _moving_outputs(block: Block, equations: BlockEquations) -> tuple[set[str], dict[str, list[str]]]:
    """The outputs of a block that may change between instants, and the outputs that depend on each input."""
    delayed = {line.name for line in equations.delays}
    outputs: set[str] = set()
    readers: dict[str, list[str]] = {}
    for port in block.output_ports():
        index = equations.group_of.get((SlotKind.OUTPUT, port.name))
        if index is None or port.name in block.implicit_outputs:
            outputs.add(port.name)
            continue
        group = equations.groups[index]
        if group.timed or group.states or delayed & set(group.discrete):
            outputs.add(port.name)
            continue
        for name in dict.fromkeys(entry.rstrip("'") for entry in group.inputs):
            readers.setdefault(name, []).append(port.name)
    return outputs, readers


def _on_loops(successors: Mapping[str, Iterable[str]]) -> set[str]:
    """The blocks on feedback loops."""
    indices = {name: index for index, name in enumerate(successors)}
    names = list(successors)
    needs = [[indices[entry] for entry in entries] for entries in successors.values()]
    components = (component for component in strongly_connected(needs) if len(component) > 1)
    on_loops = {names[index] for component in components for index in component}
    return on_loops | {name for name, entries in successors.items() if name in entries}


def _nearest_sources(
    sources: Mapping[str, Source], successors: Mapping[str, Iterable[str]]
) -> Mapping[str, set[tuple[str, Source]]]:
    """The nearest sources of the sample time of each block; the search ends at each source."""
    reach: dict[str, set[tuple[str, Source]]] = {name: set() for name in successors}
    queue: deque[str] = deque()
    for name, source in sources.items():
        reach[name].add((name, source))
        queue.append(name)
    while queue:
        name = queue.popleft()
        for entry in successors[name]:
            if entry in sources:
                continue
            before = len(reach[entry])
            # One block per clock is enough for the message and limits the size of the sets.
            known_sources = {source for _, source in reach[entry]}
            reach[entry].update(pair for pair in reach[name] if pair[1] not in known_sources)
            if len(reach[entry]) > before:
                queue.append(entry)
    return reach


def _fastest_clock(name: str, block: Block, reaching_sources: Collection[tuple[str, Source]]) -> SampleClock:
    where = f"block '{name}' ({block.title})"
    fix = "set the sample_time of the block"
    moving = sorted(entry for entry, source in reaching_sources if source is None)
    if moving:
        raise DiagramError(
            f"the sample time is -1 (inherited), but '{moving[0]}' changes continuously",
            where=where,
            allowed="-1 downstream of sampled blocks only",
            fix=fix + "; to delay a continuous signal, use a Transport Delay",
        )
    clocks = sorted(
        ((clock, entry) for entry, clock in reaching_sources if clock), key=lambda pair: pair[0].period
    )
    if not clocks:
        raise DiagramError(
            "the sample time is -1 (inherited), but no connected block is sampled",
            where=where,
            allowed="-1 upstream or downstream of a block with a sample time",
            fix=fix,
        )
    fastest, fastest_block = clocks[0]
    for clock, other in clocks[1:]:
        (step, start), (period, offset) = exact_clocks((fastest, clock))
        if (period / step).denominator != 1 or ((offset - start) / step).denominator != 1:
            raise DiagramError(
                f"'{fastest_block}' ticks every {fastest.period:g} s (offset {fastest.offset:g} s) and "
                f"'{other}' every {clock.period:g} s (offset {clock.offset:g} s)",
                where=where,
                allowed="inputs whose ticks are all ticks of the fastest input",
                fix=fix + ", or put a Rate Transition before one of the inputs",
            )
    return fastest

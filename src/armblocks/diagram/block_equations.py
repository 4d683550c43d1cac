"""The equations of one block, traced once for all blocks that differ in tunable numbers only.

The values that a block works out, its *slots* (outputs, derivatives of states, records), are put together
into *groups* that depend on the same inputs and states. A group is the unit of ordering: the position
output of a robot block is there before the torque that moves it.

Dependence is read off the sparsity of the traced equations, with every tunable parameter symbolic, so that
a gain of zero hides nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property, lru_cache

from casadi import SX, Function, densify, jtimes, vertcat

from armblocks.diagram.block import Block, Shapes, Signals
from armblocks.diagram.parameter import shape_of
from armblocks.diagram.port import State
from armblocks.equations import Shape, Slot, flatten, unflatten
from armblocks.errors import DiagramError


class SlotKind(Enum):
    """What a value of a block is for."""

    OUTPUT = "output"
    DERIVATIVE = "derivative"
    RECORD = "record"


@dataclass(frozen=True)
class BlockSlot:
    """One value that a block works out; a derivative has the name of its state."""

    kind: SlotKind
    name: str
    shape: Shape

    @property
    def size(self) -> int:
        """Count of scalars."""
        return Slot(self.name, self.shape).size


@dataclass(frozen=True, eq=False)
class Group:
    """Slots of one block that depend on the same ``inputs`` and ``states`` (by name), and their equations.

    ``expression`` is the flat column of all slots over ``t``, the flat column ``p`` of the block's tunable
    parameters, and ``z``: the flat states, then the flat inputs, that the group depends on.
    """

    slots: tuple[BlockSlot, ...]
    inputs: tuple[str, ...]
    states: tuple[str, ...]
    expression: SX
    t: SX
    p: SX
    z: SX
    _rates: list[tuple[SX, tuple[SX, ...]]] = field(default_factory=list[tuple[SX, tuple[SX, ...]]])
    _functions: dict[int, Function] = field(default_factory=dict[int, Function])

    def rate(self, order: int) -> Function:
        """The ``order``-th time derivative as a function of ``t, p, z, z', …`` up to that order of z.

        f' = df/dt + df/dz z' + df/dz' z'' + …: exact, by CasADi's forward differentiation. It is cached
        here, because it is a pure function of the group.
        """
        if not self._rates:
            self._rates.append((self.expression, (self.z,)))
        while len(self._rates) <= order:
            expression, orders = self._rates[-1]
            following = SX.sym(f"z{len(orders)}", self.z.numel())
            along = vertcat(self.t, *orders)
            seeds = vertcat(1.0, *orders[1:], following)
            self._rates.append((densify(jtimes(expression, along, seeds)), (*orders, following)))
        if order not in self._functions:
            expression, orders = self._rates[order]
            self._functions[order] = Function("f", [self.t, self.p, *orders], [expression])
        return self._functions[order]


@dataclass(frozen=True, eq=False)
class BlockEquations:
    """All equations of one block: its states and the groups of what it works out."""

    states: tuple[State, ...]
    groups: tuple[Group, ...]

    @cached_property
    def group_of(self) -> dict[tuple[SlotKind, str], int]:
        """In which group a slot is."""
        return {
            (slot.kind, slot.name): index for index, group in enumerate(self.groups) for slot in group.slots
        }


@dataclass(frozen=True)
class _Structure:
    """Everything of a block that its equations depend on but the tunable numbers."""

    kind: type[Block]
    fixed: tuple[object, ...]
    tunable_shapes: tuple[Shape, ...]
    input_shapes: tuple[tuple[str, Shape], ...]
    block: Block = field(compare=False)


def block_equations(block: Block, input_shapes: Shapes) -> BlockEquations:
    """Trace a block whose inputs have these shapes; equal structures are traced once."""
    rules = block.parameters()
    return _trace(
        _Structure(
            kind=type(block),
            fixed=tuple(block.parameter_value(rule.name) for rule in rules if not rule.tunable),
            tunable_shapes=tuple(
                shape_of(block.parameter_value(rule.name)) for rule in rules if rule.tunable
            ),
            input_shapes=tuple(input_shapes.items()),
            block=block,
        )
    )


def tunable_slots(block: Block) -> tuple[Slot, ...]:
    """The tunable parameters of a block, in order."""
    return tuple(
        Slot(rule.name, shape_of(block.parameter_value(rule.name)), rule.unit)
        for rule in block.parameters()
        if rule.tunable
    )


def natural(slots: Sequence[Slot], flat: SX) -> Signals:
    """Cut a flat column into named values in their natural shapes."""
    values: dict[str, SX] = {}
    start = 0
    for slot in slots:
        values[slot.name] = unflatten(flat[start : start + slot.size], slot.shape)
        start += slot.size
    return values


def spread(value: SX, shape: Shape) -> SX:
    """The flat column of a value; a scalar is spread over the shape."""
    slot = Slot("", shape)
    if value.numel() == 1:
        return densify(SX.ones(slot.size) * value)
    return flatten(value, shape)


@lru_cache(maxsize=1024)
def _trace(structure: _Structure) -> BlockEquations:
    block = structure.block
    shapes = dict(structure.input_shapes)
    states = block.states(shapes)
    ends = {
        "x": [Slot(state.name, state.shape) for state in states],
        "u": [Slot(name, shape) for name, shape in shapes.items()],
        "p": list(tunable_slots(block)),
    }
    t = SX.sym("t")
    x, u, p = (SX.sym(letter, sum(slot.size for slot in slots)) for letter, slots in ends.items())
    arguments = (t, natural(ends["x"], x), natural(ends["u"], u), natural(ends["p"], p))

    output_shapes = {port.name: port.shape for port in block.output_ports() if port.shape is not None}
    output_shapes.update(block.output_shapes(shapes))
    sought = [
        BlockSlot(SlotKind.OUTPUT, port.name, output_shapes[port.name])
        for port in block.output_ports()
        if port.name not in block.time_derivatives
    ]
    sought += [BlockSlot(SlotKind.DERIVATIVE, state.name, state.shape) for state in states]
    sought += [BlockSlot(SlotKind.RECORD, port.name, port.shape or ()) for port in block.record_ports()]
    found = {
        SlotKind.OUTPUT: block.outputs(*arguments),
        SlotKind.DERIVATIVE: block.derivatives(*arguments),
        SlotKind.RECORD: block.records(*arguments),
    }
    for kind, values in found.items():
        _check_complete(block, kind, [slot.name for slot in sought if slot.kind is kind], values)
    flat = [spread(SX(found[slot.kind][slot.name]), slot.shape) for slot in sought]
    groups = _grouped(sought, flat, (t, x, u, p), ends["x"], ends["u"])
    return BlockEquations(states=states, groups=groups)


def _grouped(
    slots: list[BlockSlot],
    flat: list[SX],
    symbols: tuple[SX, SX, SX, SX],
    states: list[Slot],
    inputs: list[Slot],
) -> tuple[Group, ...]:
    t, x, u, p = symbols
    parts = _parts(x, states) + _parts(u, inputs)
    names = [slot.name for slot in (*states, *inputs)]
    dependence = Function("f", [t, p, *parts], flat) if slots else None
    members: dict[tuple[bool, ...], list[int]] = {}
    for index in range(len(slots)):
        pattern = tuple(
            dependence is not None and dependence.jac_sparsity(index, 2 + place).nnz() > 0
            for place in range(len(parts))
        )
        members.setdefault(pattern, []).append(index)
    groups: list[Group] = []
    for pattern, indices in members.items():
        on_states = [place for place in range(len(states)) if pattern[place]]
        on_inputs = [place for place in range(len(states), len(parts)) if pattern[place]]
        groups.append(
            Group(
                slots=tuple(slots[index] for index in indices),
                inputs=tuple(names[place] for place in on_inputs),
                states=tuple(names[place] for place in on_states),
                expression=vertcat(*[flat[index] for index in indices]),
                t=t,
                p=p,
                z=vertcat(*[parts[place] for place in (*on_states, *on_inputs)], SX(0, 1)),
            )
        )
    return tuple(groups)


def _parts(column: SX, slots: list[Slot]) -> list[SX]:
    parts: list[SX] = []
    start = 0
    for slot in slots:
        parts.append(column[start : start + slot.size])
        start += slot.size
    return parts


def _check_complete(block: Block, kind: SlotKind, sought: list[str], values: Signals) -> None:
    if set(sought) != set(values):
        raise DiagramError(
            f"the equations give {sorted(values)} as {kind.value}s",
            where=f"block type {block.type_name()}",
            allowed=f"exactly {sorted(sought)}",
            fix="correct the block's class",
        )

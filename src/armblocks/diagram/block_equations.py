"""The equations of one block, traced once for all blocks that differ in tunable numbers only.

The values that a block computes, its *slots* (outputs, derivatives of states, records), are collected in
*groups* that depend on the same inputs and states. Groups are the unit of the evaluation order: the position
output of a robot block is available before its torque input.

Dependence is read from the sparsity of the traced equations. Tunable parameters are symbolic, so that a gain
of zero does not remove a dependence.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property, lru_cache

from casadi import SX, Function, densify, if_else, jtimes, substitute, vertcat

from armblocks.diagram.block import Block, Shapes, Signals
from armblocks.diagram.conditional_equations import FIRE, ConditionalBlock
from armblocks.diagram.parameter import shape_of
from armblocks.diagram.port import Condition, DelayLine, Guard, State
from armblocks.equations import Shape, Slot, call_with_constants, flatten, has_elementary, unflatten
from armblocks.errors import DiagramError


class SlotKind(Enum):
    """The role of a value of a block."""

    OUTPUT = "output"
    DERIVATIVE = "derivative"
    RECORD = "record"
    UPDATE = "update"
    GUARD = "guard value"
    MODE = "mode value"
    CONTRADICTION = "inconsistency of a mode"
    RESET = "reset"
    DELAYED = "delayed signal"
    DELAYED_RATE = "derivative of a delayed signal"
    DELAY = "delay"
    CAPTURE = "capture"


@dataclass(frozen=True)
class BlockSlot:
    """One value that a block computes; a derivative has the name of its state."""

    kind: SlotKind
    name: str
    shape: Shape

    @property
    def size(self) -> int:
        """Number of scalars."""
        return Slot(self.name, self.shape).size


@dataclass(frozen=True, eq=False)
class Group:
    """Slots of one block that depend on the same states, inputs and events (by name), and their equations.

    ``expression`` is the flat column of all slots over ``t``, the flat column ``p`` of the block's tunable
    parameters, and ``z``: the flat continuous states, discrete states and modes, inputs, and events, that the
    group depends on. An input ``u'`` is the time derivative of the input ``u``. ``timed``: whether it depends
    on time explicitly.
    """

    slots: tuple[BlockSlot, ...]
    states: tuple[str, ...]
    discrete: tuple[str, ...]
    inputs: tuple[str, ...]
    events: tuple[str, ...]
    timed: bool
    expression: SX
    t: SX
    p: SX
    z: SX
    _rates: list[tuple[SX, tuple[SX, ...]]] = field(default_factory=list[tuple[SX, tuple[SX, ...]]])
    _functions: dict[int, Function] = field(default_factory=dict[int, Function])
    _elementary: dict[int, bool] = field(default_factory=dict[int, bool])

    def value(self, order: int, arguments: Sequence[SX]) -> SX:
        """The result of :meth:`rate` for these arguments: symbols, expressions, constants."""
        function = self.rate(order)
        if order not in self._elementary:
            self._elementary[order] = has_elementary(function)
        if self._elementary[order]:
            (flat,) = call_with_constants(function, arguments)
        else:
            (flat,) = function.call(list(arguments), True, False)
        return flat

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
    """All equations of one block: its states and its groups of slots."""

    states: tuple[State, ...]
    discrete: tuple[State, ...]
    """Discrete states, then delayed values, then their derivatives (``name'``), then modes."""
    modes: tuple[State, ...]
    guards: tuple[Guard, ...]
    groups: tuple[Group, ...]
    delays: tuple[DelayLine, ...] = ()
    fixed_delays: frozenset[str] = frozenset()
    """Delays that depend on parameters alone."""

    @cached_property
    def group_of(self) -> dict[tuple[SlotKind, str], int]:
        """The index of the group of each slot."""
        return {
            (slot.kind, slot.name): index for index, group in enumerate(self.groups) for slot in group.slots
        }


@dataclass(frozen=True)
class _Structure:
    """Everything that a block's equations depend on, except the values of tunable parameters."""

    kind: type[Block]
    fixed: tuple[object, ...]
    tunable_shapes: tuple[Shape, ...]
    input_shapes: tuple[tuple[str, Shape], ...]
    period: float
    settled: bool
    hidden: tuple[str, ...]
    clocked: bool
    block: Block = field(compare=False)


def block_equations(
    block: Block,
    input_shapes: Shapes,
    *,
    period: float = 1.0,
    settled: bool = False,
    hidden: Collection[str] = (),
) -> BlockEquations:
    """Trace a block whose inputs have these shapes; equal structures are traced once.

    ``period`` s: of a sampled block's clock. ``settled``: with modes computed from the present values instead
    of by events. ``hidden``: the hidden inputs of a block in a conditional subsystem.
    """
    clocked = block.sampled and FIRE not in hidden
    inputs = block.inputs_of_the_run()
    return _trace(
        _Structure(
            kind=type(block),
            fixed=tuple(block.parameter_value(rule.name) for rule in block.structure_of_the_run()),
            tunable_shapes=tuple(shape_of(block.parameter_value(rule.name)) for rule in inputs),
            input_shapes=tuple(input_shapes.items()),
            period=period if clocked else 0.0,
            settled=settled and bool(block.modes(input_shapes) or block.conditions(input_shapes) or hidden),
            hidden=tuple(sorted(hidden)),
            clocked=clocked,
            block=block,
        )
    )


def tunable_slots(block: Block) -> tuple[Slot, ...]:
    """The tunable parameters of a block, in order."""
    return tuple(
        Slot(rule.name, shape_of(block.parameter_value(rule.name)), rule.unit)
        for rule in block.inputs_of_the_run()
    )


def natural(slots: Sequence[Slot], flat: SX) -> Signals:
    """Split a flat column into named values of natural shape."""
    values: dict[str, SX] = {}
    start = 0
    for slot in slots:
        values[slot.name] = unflatten(flat[start : start + slot.size], slot.shape)
        start += slot.size
    return values


def spread(value: SX, shape: Shape) -> SX:
    """The flat column of a value; a scalar is broadcast to the shape."""
    slot = Slot("", shape)
    if value.numel() == 1:
        return densify(SX.ones(slot.size) * value)
    return flatten(value, shape)


def _gated(structure: _Structure) -> tuple[Block, dict[str, Shape]]:
    """The block with its hidden inputs, if it is in a conditional subsystem, and the shapes of all inputs."""
    shapes = dict(structure.input_shapes)
    if not structure.hidden:
        return structure.block, shapes
    block = ConditionalBlock(
        block=structure.block,
        hidden=structure.hidden,
        clocked=structure.clocked,
        ticking=structure.settled or structure.clocked,
    )
    return block, shapes | dict.fromkeys(structure.hidden, ())


@lru_cache(maxsize=1024)
def _trace(structure: _Structure) -> BlockEquations:
    block, shapes = _gated(structure)
    states, discrete, lines = block.states(shapes), block.discrete_states(shapes), block.delay_lines(shapes)
    past = tuple(State(f"{line.name}{mark}", line.shape, line.doc) for mark in ("", "'") for line in lines)
    conditions = block.conditions(shapes)
    # Conditions whose change is an event are modes; the others are evaluated directly.
    located = () if structure.settled else tuple(entry for entry in conditions if entry.located)
    asked = tuple(entry for entry in conditions if entry not in located)
    modes, guards = _modes_and_guards(block, shapes, located)
    discrete += tuple(dataclasses.replace(mode, name=mode.before) for mode in modes if mode.remembers)
    ends = {
        "x": [Slot(state.name, state.shape) for state in states],
        "z": [Slot(state.name, state.shape) for state in (*discrete, *past, *modes)],
        "u": [Slot(name, shape) for name, shape in shapes.items()]
        + [Slot(f"{name}'", shapes[name]) for name in structure.block.rated_inputs],
        "e": [Slot(guard.name, guard.shape) for guard in guards],
        "p": list(tunable_slots(structure.block)),
    }
    symbols = {letter: SX.sym(letter, sum(slot.size for slot in slots)) for letter, slots in ends.items()}
    t = SX.sym("t")
    x, z, u, e, p = (dict(natural(slots, symbols[letter])) for letter, slots in ends.items())
    if structure.clocked:
        p["T"] = SX(structure.period)
    x.update(z)
    x.update(_answers(block, asked, t, x, u, p))
    # Such a mode follows from its value before the event time, not from values during mode iteration.
    earlier = x | {mode.name: x[mode.before] for mode in modes if mode.remembers}
    if structure.settled:
        x.update(block.mode_values(t, x, u, p))
    quantities: Signals = block.condition_values(t, x, u, p) if located else {}
    sides = {entry.name: _sided(quantities[entry.name], entry.closed) for entry in located}
    answers = {entry.name: _positive(quantities[entry.name], entry.closed) for entry in located}
    wrong = {name: SX(answer) != x[name] for name, answer in answers.items()}

    state_shapes = {state.name: state.shape for state in (*states, *discrete, *modes)}
    resets = {**block.resets(t, x, u, p, e), **_sides_after(located, x, e)}
    captures = block.captures(t, x, u, p)
    sought: dict[SlotKind, dict[str, Shape]] = {
        SlotKind.OUTPUT: _output_shapes(structure.block, dict(structure.input_shapes)),
        SlotKind.DERIVATIVE: {state.name: state.shape for state in states},
        SlotKind.RECORD: {port.name: port.shape or () for port in block.record_ports()},
        SlotKind.UPDATE: {state.name: state.shape for state in discrete if structure.clocked},
        SlotKind.GUARD: {guard.name: guard.shape for guard in guards},
        SlotKind.MODE: {mode.name: mode.shape for mode in modes},
        SlotKind.CONTRADICTION: {mode.name: mode.shape for mode in modes},
        SlotKind.RESET: {name: state_shapes[name] for name in resets if name in state_shapes},
        SlotKind.DELAYED: {line.name: line.shape for line in lines},
        SlotKind.DELAYED_RATE: {line.name: line.shape for line in lines},
        SlotKind.DELAY: {line.name: () for line in lines},
        SlotKind.CAPTURE: {name: state_shapes[name] for name in captures if name in state_shapes},
    }
    found = {
        SlotKind.OUTPUT: block.outputs(t, x, u, p),
        SlotKind.DERIVATIVE: block.derivatives(t, x, u, p),
        SlotKind.RECORD: block.records(t, x, u, p),
        SlotKind.UPDATE: block.updates(t, x, u, p),
        SlotKind.GUARD: {**block.guard_values(t, x, u, p), **sides},
        SlotKind.MODE: {**block.mode_values(t, earlier, u, p), **answers},
        SlotKind.CONTRADICTION: {**block.contradictions(t, x, u, p), **wrong},
        SlotKind.RESET: resets,
        SlotKind.DELAYED: {line.name: u[line.input] for line in lines},
        SlotKind.DELAYED_RATE: {line.name: u[f"{line.input}'"] for line in lines},
        SlotKind.DELAY: block.delay_times(t, x, u, p),
        SlotKind.CAPTURE: captures,
    }
    for kind, values in found.items():
        _check_complete(block, kind, list(sought[kind]), values)
    slots = [BlockSlot(kind, name, shape) for kind, named in sought.items() for name, shape in named.items()]
    flat = [spread(SX(found[slot.kind][slot.name]), slot.shape) for slot in slots]
    groups = _grouped(slots, flat, t, symbols, ends)
    return BlockEquations(
        states=states,
        discrete=(*discrete, *past, *modes),
        modes=modes,
        guards=guards,
        groups=groups,
        delays=lines,
        fixed_delays=frozenset(line.name for line in lines) - _moving_delays(groups),
    )


def _modes_and_guards(
    block: Block, shapes: Shapes, located: Sequence[Condition]
) -> tuple[tuple[State, ...], tuple[Guard, ...]]:
    """The modes and guards of a block, plus one of each for every located condition."""
    modes = (State(entry.name, entry.shape, entry.doc, follows=True) for entry in located)
    guards = (Guard(entry.name, entry.shape, entry.doc, locates=True) for entry in located)
    return (*block.all_modes(shapes), *modes), (*block.all_guards(shapes), *guards)


def _output_shapes(block: Block, inputs: Shapes) -> dict[str, Shape]:
    """Shapes of the outputs that have equations."""
    stated = {port.name: port.shape for port in block.output_ports() if port.shape is not None}
    found = {**stated, **block.output_shapes(inputs)}
    names = [port.name for port in block.output_ports() if port.name not in block.time_derivatives]
    return {name: found[name] for name in names}


def _moving_delays(groups: Sequence[Group]) -> frozenset[str]:
    """The values that depend on more than parameters."""
    return frozenset(
        slot.name
        for group in groups
        for slot in group.slots
        if slot.kind is SlotKind.DELAY and (group.timed or group.states or group.discrete or group.inputs)
    )


def _positive(quantity: SX, closed: bool) -> SX:
    return quantity >= 0.0 if closed else quantity > 0.0


def _sides_after(located: Sequence[Condition], x: Signals, e: Signals) -> Signals:
    """The new modes of conditions at events."""
    return {
        entry.name: if_else(e[entry.name] == 0.0, x[entry.name], e[entry.name] > 0.0) for entry in located
    }


def _sided(quantity: SX, closed: bool) -> SX:
    """The quantity with an offset below any signal resolution, which assigns zero to one side."""
    return quantity + 1e-300 if closed else quantity - 1e-300


def _answers(block: Block, asked: Sequence[Condition], t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
    """Conditions from the present values, each substituted into those after it."""
    unknown = {
        entry.name: unflatten(SX.sym(entry.name, Slot(entry.name, entry.shape).size), entry.shape)
        for entry in asked
    }
    quantities: Signals = block.condition_values(t, {**x, **unknown}, u, p) if asked else {}
    found: dict[str, SX] = {}
    for entry in asked:
        quantity = SX(quantities[entry.name])
        for name, value in found.items():
            quantity = substitute(quantity, unknown[name], value)
        answer = densify(SX(_positive(quantity, entry.closed)))
        found[entry.name] = unflatten(spread(answer, entry.shape), entry.shape)
    return found


def _grouped(
    slots: list[BlockSlot], flat: list[SX], t: SX, symbols: dict[str, SX], ends: dict[str, list[Slot]]
) -> tuple[Group, ...]:
    letters = [(letter, slot.name) for letter in "xzue" for slot in ends[letter]]
    parts = [part for letter in "xzue" for part in _parts(symbols[letter], ends[letter])]
    dependence = Function("f", [t, symbols["p"], *parts], flat) if slots else None
    members: dict[tuple[bool, ...], list[int]] = {}
    timed: set[int] = set()
    for index in range(len(slots)):
        assert dependence is not None
        if dependence.jac_sparsity(index, 0).nnz() > 0:
            timed.add(index)
        pattern = tuple(dependence.jac_sparsity(index, 2 + place).nnz() > 0 for place in range(len(parts)))
        members.setdefault(pattern, []).append(index)
    groups: list[Group] = []
    for pattern, indices in members.items():
        on = [place for place in range(len(parts)) if pattern[place]]
        names = {letter: tuple(letters[k][1] for k in on if letters[k][0] == letter) for letter in "xzue"}
        groups.append(
            Group(
                slots=tuple(slots[index] for index in indices),
                states=names["x"],
                discrete=names["z"],
                inputs=names["u"],
                events=names["e"],
                timed=any(index in timed for index in indices),
                expression=vertcat(*[flat[index] for index in indices]),
                t=t,
                p=symbols["p"],
                z=vertcat(*[parts[place] for place in on], SX(0, 1)),
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

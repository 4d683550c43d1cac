"""The equations of one block, traced once for all blocks that differ in tunable numbers only.

The values that a block computes, its *slots* (outputs, derivatives of states, records), are collected in
*groups* that depend on the same inputs and states. Groups are the unit of the evaluation order: the position
output of a robot block is available before its torque input.

Dependence is read from the sparsity of the traced equations. Tunable parameters are symbolic, so that a gain
of zero does not remove a dependence.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

from casadi import SX, Function, densify, vertcat

from armblocks.diagram.block import Block, Shapes, Signals
from armblocks.diagram.conditional_equations import FIRE, conditional
from armblocks.diagram.features import Arguments, Features, SlotKind, features_of
from armblocks.diagram.flat_values import broadcast_column, named_values, tunable_slots
from armblocks.diagram.generated_modes import (
    evaluated_conditions,
    with_modes_of_conditions,
    with_previous_modes,
)
from armblocks.diagram.parameter import shape_of
from armblocks.diagram.port import DelayLine, Guard, State
from armblocks.equations import Shape, Slot, call_with_constants, directional_derivative, has_elementary
from armblocks.errors import DiagramError


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
    group depends on. An input ``u'`` is the time derivative of the input ``u``. ``timed``: whether the
    group depends on time explicitly.
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

        f' = df/dt + df/dz z' + df/dz' z'' + …: exact. The result is cached in the group.
        """
        if not self._rates:
            self._rates.append((self.expression, (self.z,)))
        while len(self._rates) <= order:
            expression, orders = self._rates[-1]
            next_order = SX.sym(f"z{len(orders)}", self.z.numel())
            variables = vertcat(self.t, *orders)
            seeds = vertcat(1.0, *orders[1:], next_order)
            rate = directional_derivative(expression, variables, seeds)
            self._rates.append((densify(rate), (*orders, next_order)))
        if order not in self._functions:
            expression, orders = self._rates[order]
            self._functions[order] = Function("f", [self.t, self.p, *orders], [expression])
        return self._functions[order]


@dataclass(frozen=True, eq=False)
class BlockEquations:
    """All equations of one block: its states and its groups of slots."""

    features: Features
    """The features of the block, gated by the conditional subsystem that contains it."""
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
    consistent_modes: bool
    hidden: tuple[str, ...]
    clocked: bool
    block: Block = field(compare=False)


def block_equations(
    block: Block,
    input_shapes: Shapes,
    *,
    period: float = 1.0,
    consistent_modes: bool = False,
    hidden: Collection[str] = (),
) -> BlockEquations:
    """Trace a block whose inputs have these shapes; equal structures are traced once.

    ``period``: period of a sampled block's clock, s. ``consistent_modes``: whether modes are computed from
    the present values instead of at events. ``hidden``: the hidden inputs of a block in a conditional
    subsystem.
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
            consistent_modes=consistent_modes
            and bool(block.modes(input_shapes) or block.conditions(input_shapes) or hidden),
            hidden=tuple(sorted(hidden)),
            clocked=clocked,
            block=block,
        )
    )


def known_equations(
    block: Block, input_shapes: Shapes, dependences: Mapping[str, Collection[str]]
) -> BlockEquations:
    """The groups of a block by :meth:`Block.known_dependences`, without expressions: not for evaluation."""
    features, empty = features_of(block, input_shapes), SX(0, 1)
    members: dict[tuple[str, ...], list[BlockSlot]] = {}
    for kind, named in ((SlotKind.OUTPUT, features.outputs), (SlotKind.RECORD, features.records)):
        for name, shape in named.items():
            members.setdefault(tuple(dependences[name]), []).append(BlockSlot(kind, name, shape))
    groups = tuple(
        Group(tuple(slots), (), (), inputs, (), False, empty, SX(0.0), empty, empty)
        for inputs, slots in members.items()
    )
    return BlockEquations(features=features, states=(), discrete=(), modes=(), guards=(), groups=groups)


@lru_cache(maxsize=1024)
def _trace(structure: _Structure) -> BlockEquations:
    own = features_of(structure.block, dict(structure.input_shapes))
    if structure.hidden:
        own = conditional(
            own, structure.hidden, clocked=structure.clocked, ticking=structure.consistent_modes
        )
    # Conditions whose change is an event become modes; all others are evaluated directly.
    located = () if structure.consistent_modes else tuple(entry for entry in own.conditions if entry.located)
    requested = tuple(entry for entry in own.conditions if entry not in located)
    features = with_modes_of_conditions(with_previous_modes(own, clocked=structure.clocked), located)
    delayed = tuple(
        State(f"{line.name}{mark}", line.shape, line.doc) for mark in ("", "'") for line in features.delays
    )
    layout = {
        "x": [Slot(state.name, state.shape) for state in features.states],
        "z": [Slot(state.name, state.shape) for state in (*features.discrete, *delayed, *features.modes)],
        "u": [Slot(name, shape) for name, shape in features.inputs.items()]
        + [Slot(f"{name}'", features.inputs[name.rstrip("'")]) for name in features.differentiated_inputs],
        "e": [Slot(guard.name, guard.shape) for guard in features.guards],
        "p": list(tunable_slots(structure.block)),
    }
    symbols = {letter: SX.sym(letter, sum(slot.size for slot in slots)) for letter, slots in layout.items()}
    t = SX.sym("t")
    x, z, u, e, p = (dict(named_values(slots, symbols[letter])) for letter, slots in layout.items())
    if structure.clocked:
        p["T"] = SX(structure.period)
        if own.reads_next_period:
            p["T_next"] = p["T"]
    at = Arguments(t, {**x, **z}, u, p, e)
    at = at.with_states(evaluated_conditions(own, requested, at))
    at_consistent_modes = (  # from the previous modes: events before the ticks may have changed the modes
        at.with_states(features.equations[SlotKind.MODE](at)) if structure.consistent_modes else at
    )
    results = {
        kind: features.equations[kind](at if kind is SlotKind.MODE else at_consistent_modes)
        for kind in SlotKind
        if kind is not SlotKind.CONDITION
    }
    required = _required_shapes(features, structure.clocked, results)
    for kind, values in results.items():
        _check_complete(structure.block, kind, list(required[kind]), values)
    slots = [
        BlockSlot(kind, name, shape) for kind, named in required.items() for name, shape in named.items()
    ]
    flat = [broadcast_column(SX(results[slot.kind][slot.name]), slot.shape) for slot in slots]
    groups = _grouped(slots, flat, t, symbols, layout)
    return BlockEquations(
        features=own,
        states=features.states,
        discrete=(*features.discrete, *delayed, *features.modes),
        modes=features.modes,
        guards=features.guards,
        groups=groups,
        delays=features.delays,
        fixed_delays=frozenset(line.name for line in features.delays) - _variable_delays(groups),
    )


def _required_shapes(
    features: Features, clocked: bool, results: Mapping[SlotKind, Signals]
) -> dict[SlotKind, dict[str, Shape]]:
    """The shapes of the values that the equations of each role return."""
    stored_slots = (*features.states, *features.discrete, *features.modes)
    states = {state.name: state.shape for state in stored_slots}
    modes = {mode.name: mode.shape for mode in features.modes}
    delayed = {line.name: line.shape for line in features.delays}
    resets, captures = results[SlotKind.RESET], results[SlotKind.CAPTURE]
    return {
        SlotKind.OUTPUT: dict(features.outputs),
        SlotKind.DERIVATIVE: {state.name: state.shape for state in features.states},
        SlotKind.RECORD: dict(features.records),
        SlotKind.UPDATE: {state.name: state.shape for state in features.discrete if clocked},
        SlotKind.GUARD: {guard.name: guard.shape for guard in features.guards},
        SlotKind.MODE: modes,
        SlotKind.CONTRADICTION: modes,
        SlotKind.RESET: {name: states[name] for name in resets if name in states},
        SlotKind.DELAYED: delayed,
        SlotKind.DELAYED_RATE: delayed,
        SlotKind.DELAY: dict.fromkeys(delayed, ()),
        SlotKind.CAPTURE: {name: states[name] for name in captures if name in states},
    }


def _variable_delays(groups: Sequence[Group]) -> frozenset[str]:
    """The names of delays that depend on time, states or inputs."""
    return frozenset(
        slot.name
        for group in groups
        for slot in group.slots
        if slot.kind is SlotKind.DELAY and (group.timed or group.states or group.discrete or group.inputs)
    )


def _grouped(
    slots: list[BlockSlot], flat: list[SX], t: SX, symbols: dict[str, SX], layout: dict[str, list[Slot]]
) -> tuple[Group, ...]:
    letters = [(letter, slot.name) for letter in "xzue" for slot in layout[letter]]
    parts = [part for letter in "xzue" for part in _parts(symbols[letter], layout[letter])]
    dependence = Function("f", [t, symbols["p"], *parts], flat) if slots else None
    members: dict[tuple[bool, ...], list[int]] = {}
    timed: set[int] = set()
    for index in range(len(slots)):
        assert dependence is not None
        if dependence.jac_sparsity(index, 0).nnz() > 0:
            timed.add(index)
        pattern = tuple(dependence.jac_sparsity(index, 2 + part).nnz() > 0 for part in range(len(parts)))
        members.setdefault(pattern, []).append(index)
    groups: list[Group] = []
    for pattern, indices in members.items():
        dependencies = [part for part in range(len(parts)) if pattern[part]]
        names = {
            letter: tuple(letters[k][1] for k in dependencies if letters[k][0] == letter) for letter in "xzue"
        }
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
                z=vertcat(*[parts[part] for part in dependencies], SX(0, 1)),
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


def _check_complete(block: Block, kind: SlotKind, required: list[str], values: Signals) -> None:
    if set(required) != set(values):
        raise DiagramError(
            f"the equations give {sorted(values)} as {kind.value}s",
            where=f"block type {block.type_name()}",
            allowed=f"exactly {sorted(required)}",
            fix="correct the block's class",
        )

"""The symbols of a diagram, the values computed from them group by group, and the unknowns of its loops."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import casadi
import numpy as np
from casadi import (
    SX,
    if_else,
    logic_and,
    repmat,
    substitute,
    vertcat,
    vertsplit,
)
from numpy.typing import NDArray

from armblocks import interrupts
from armblocks.diagram.block import Signals
from armblocks.diagram.conditional_equations import ON
from armblocks.diagram.features import AT_TICKS, SlotKind
from armblocks.diagram.flat_values import named_values, tunable_slots
from armblocks.diagram.implicit import check_solvable, solve_affine
from armblocks.diagram.model import Model
from armblocks.diagram.ordering import HELD, Network, Node, Value
from armblocks.equations import Signature, Slot, flatten, substituted
from armblocks.errors import DiagramError


class Symbols:
    """The symbols of a diagram: time, states, discrete variables, parameters, ticks and events."""

    def __init__(self, model: Model) -> None:
        equations, blocks = model.flow.equations, model.flow.diagram.blocks
        self.tunables = {name: tunable_slots(block) for name, block in blocks.items()}
        owner = model.flow.diagram.owner
        owned = {owner(name): slots for name, slots in self.tunables.items()}
        self.parameter_slots = [
            Slot(f"{name}.{slot.name}", slot.shape, slot.unit)
            for name, slots in owned.items()
            for slot in slots
        ]
        self.state_slots = [
            Slot(f"{name}/{state.name}", state.shape, state.unit)
            for name, own in equations.items()
            for state in own.states
        ]
        self.discrete_slots: list[Slot] = []
        for name in blocks:
            for state in equations[name].discrete:
                self.discrete_slots.append(Slot(f"{name}/{state.name}", state.shape, state.unit))
            if name in model.sampling.clock_of:
                shapes = model.shapes.outputs[name]
                self.discrete_slots += [Slot(f"{name}/{port}", shape) for port, shape in shapes.items()]
        guard_slots = [
            Slot(f"{name}/{guard.name}", guard.shape)
            for name, own in equations.items()
            for guard in own.guards
        ]
        self.t = SX.sym("t")
        self.x, self.states = _named_symbols("x", self.state_slots)
        self.z, self.discrete = _named_symbols("z", self.discrete_slots)
        self.e, self.events = _named_symbols("e", guard_slots)
        self.m = SX.sym("m", len(model.sampling.clocks))
        sizes = [sum(slot.size for slot in slots) for slots in owned.values()]
        self.p, parts = _symbols("p", sizes)
        of_owner = dict(zip(owned, parts))
        self.parameters = {name: of_owner[owner(name)] for name in blocks}

    def parameters_of(self, block: str) -> Signals:
        """The symbols of a block's tunable parameters, in their natural shapes."""
        return named_values(self.tunables[block], self.parameters[block])


class Tracing:
    """The values of one network computed so far; used during tracing only."""

    def __init__(
        self,
        network: Network,
        symbols: Symbols,
        sums: Collection[Node],
        tick_marks: Mapping[tuple[str, SlotKind], SX] | None = None,
    ) -> None:
        self.network = network
        self._sums = sums
        self.symbols = symbols
        self._tick_marks = tick_marks or {}
        self._values: dict[Node, dict[tuple[SlotKind, str], SX]] = {}
        self._residuals: dict[Value, SX] = {}
        self.products: list[SX] = []
        """The signals that are products of two numbers."""
        self.unknowns: dict[Value, SX] = {}
        """Symbols of the unknowns: loop cuts (values that are read before they are computed) and implicit
        outputs."""

    def evaluate(self, node: Node) -> None:
        """Evaluate the equations of one node with the values of the nodes on which it depends."""
        if node.group == HELD:
            return
        interrupts.check()
        group = self.network.equations[node.block].groups[node.group]
        symbols = self.symbols
        columns: list[SX] = []
        for order in range(node.order + 1):
            states = [
                self.value(self.network.state_rate(node.block, state, order))
                if order
                else symbols.states[f"{node.block}/{state}"]
                for state in group.states
            ]
            # Discrete variables and events are constant between events.
            constants = [symbols.discrete[f"{node.block}/{name}"] for name in group.discrete]
            events = [symbols.events[f"{node.block}/{name}"] for name in group.events]
            if order:
                constants, events = (
                    [SX.zeros(part.numel()) for part in parts] for parts in (constants, events)
                )
                for index, name in enumerate(group.discrete):
                    if name in {line.name for line in self.network.equations[node.block].delays}:
                        constants[index] = self._delayed_rate(node.block, name, order)
            inputs = [self.value(self.network.input(node.block, port, order)) for port in group.inputs]
            columns.append(vertcat(*states, *constants, *inputs, *events, SX(0, 1)))
        arguments = [symbols.t, symbols.parameters[node.block], *columns]
        flat = group.value(node.order, arguments)
        parts = _split(flat, [slot.size for slot in group.slots])
        for slot, part in zip(group.slots, parts):
            if slot.kind is SlotKind.OUTPUT:
                self.products += _products(part)
        self._values[node] = {(slot.kind, slot.name): part for slot, part in zip(group.slots, parts)}
        for name in self.network.diagram.blocks[node.block].implicit_outputs:
            if (SlotKind.OUTPUT, name) in self._values[node]:
                unknown = Value(node, SlotKind.OUTPUT, name)
                self._residuals[unknown] = self._values[node].pop((SlotKind.OUTPUT, name))
                self.value(unknown)  # creates the unknown even if no block reads it
        if node in self._sums:
            for slot in group.slots:
                if slot.kind is SlotKind.OUTPUT:
                    unknown = Value(node, slot.kind, slot.name)
                    self._residuals[unknown] = self._values[node].pop((slot.kind, slot.name)) - self.value(
                        unknown
                    )
        if (node.block, SlotKind.OUTPUT) in self._tick_marks:
            is_on: SX | None = None
            if ON in self.network.diagram.gates.get(node.block, {}):
                is_on = self.value(self.network.input(node.block, ON))
            for slot in group.slots:
                if slot.kind in AT_TICKS:
                    ticks = self._tick_marks[node.block, slot.kind]
                    ticks = ticks if is_on is None else logic_and(ticks, is_on)
                    computed = self._values[node][slot.kind, slot.name]
                    held = symbols.discrete[f"{node.block}/{slot.name}"]
                    self._values[node][slot.kind, slot.name] = if_else(ticks, computed, held)

    def _delayed_rate(self, block: str, name: str, order: int) -> SX:
        """The time derivative of a delayed value. Raises ``DiagramError`` where it is not available."""
        if order > 1 or name not in self.network.equations[block].fixed_delays:
            derivative = "the second derivative" if order > 1 else "the derivative"
            raise DiagramError(
                f"{derivative} of a delayed signal is not available"
                + ("" if order > 1 else ", whose delay changes"),
                where=f"block '{block}' ({self.network.diagram.blocks[block].title})",
                allowed="the first derivative after a constant delay",
                fix="differentiate before the delay, or filter instead of differentiating",
            )
        return self.symbols.discrete[f"{block}/{name}'"]

    def value(self, value: Value) -> SX:
        """The flat column of a value: computed, held, or an unknown of a loop."""
        if value.node.group == HELD:
            held = self.symbols.discrete[f"{value.node.block}/{value.name}"]
            return SX.zeros(held.numel()) if value.node.order else held
        if value in self.unknowns:
            return self.unknowns[value]
        known = self._values.get(value.node, {}).get((value.kind, value.name))
        if known is not None:
            return known
        if value not in self.unknowns:
            slots = self.network.equations[value.node.block].groups[value.node.group].slots
            size = next(slot.size for slot in slots if (slot.kind, slot.name) == (value.kind, value.name))
            self.unknowns[value] = SX.sym("w", size)
        return self.unknowns[value]

    def residuals(self) -> SX:
        """The residual of each unknown."""
        return vertcat(
            *[
                self._residuals[value]
                if value in self._residuals
                else self._values[value.node][value.kind, value.name] - unknown
                for value, unknown in self.unknowns.items()
            ]
        )


class Implicit:
    """The unknowns of the loops of a traced network: solved, or left as ``w`` with their residual."""

    def __init__(self, model: Model, symbols: Symbols, tracing: Tracing, values: NDArray[np.float64]) -> None:
        self.slots = Signature()
        self.w = SX.sym("w", 0)
        self.residual = SX(0, 1)
        self.guesses = SX(0, 1)
        self.linear: list[tuple[tuple[str, ...], SX]] = []
        """The names of the unknowns of each solved loop, and the matrix of its equations."""
        self._cuts, self._solution = SX(0, 1), SX(0, 1)
        if not tracing.unknowns:
            return
        network, loops = model.flow, model.flow_order.loops
        where = f"diagram '{network.diagram.name}'"
        cuts = vertcat(*tracing.unknowns.values())
        residual = tracing.residuals()
        own = {value: (f"{value.node.block}/{value.name}",) for value in tracing.unknowns}
        loop_signals = [
            loops.get(value.node, own[value])
            for value, cut in tracing.unknowns.items()
            for _ in range(cut.numel())
        ]
        check_solvable(cuts, residual, symbols.p, values, loop_signals, where)
        solution, remaining, solved_loops = solve_affine(cuts, residual)
        names = [
            _unknown_name(value) + (f"[{k}]" if cut.numel() > 1 else "")
            for value, cut in tracing.unknowns.items()
            for k in range(cut.numel())
        ]
        self.linear = [(tuple(names[k] for k in loop), matrix) for loop, matrix in solved_loops]
        self.slots = Signature(tuple(Slot(names[k]) for k in remaining))
        self.w = SX.sym("w", len(remaining))
        if remaining:
            guesses = [_guess(network, symbols, *entry) for entry in tracing.unknowns.items()]
            self.guesses = vertcat(*guesses)[remaining]
            self.residual = substitute(
                substituted(residual[remaining], cuts, solution), cuts[remaining], self.w
            )
            solution = substitute(solution, cuts[remaining], self.w)
        self._cuts, self._solution = cuts, solution

    def solved(self, parts: Sequence[SX]) -> SX:
        """One column with the solutions substituted for the unknowns."""
        column = vertcat(*parts, SX(0, 1))
        return substituted(column, self._cuts, self._solution) if self._cuts.numel() else column


def _guess(network: Network, symbols: Symbols, value: Value, unknown: SX) -> SX:
    """The start value of an unknown: given by its block, else 0."""
    block, features = network.diagram.blocks[value.node.block], network.equations[value.node.block].features
    if value.node.order or value.kind is not SlotKind.OUTPUT or value.name not in block.implicit_outputs:
        return SX.zeros(unknown.numel())
    guess = features.initial_guesses(symbols.parameters_of(value.node.block))[value.name]
    return repmat(guess, unknown.numel(), 1) if guess.numel() == 1 else flatten(guess, guess.shape)


def _unknown_name(value: Value) -> str:
    primes = value.node.order + (value.kind is SlotKind.DERIVATIVE)
    return f"{value.node.block}/{value.name}" + "'" * primes


def _symbols(letter: str, sizes: Sequence[int]) -> tuple[SX, list[SX]]:
    """One flat symbol and its consecutive parts."""
    whole = SX.sym(letter, sum(sizes))
    return whole, _split(whole, sizes)


def _split(column: SX, sizes: Sequence[int]) -> list[SX]:
    if len(sizes) == 1:
        return [column]
    return vertsplit(column, [0, *np.cumsum(sizes).tolist()]) if sizes else []


def _products(column: SX) -> list[SX]:
    """The elements that are products, or negated products."""
    entries = [entry for entry in column.nonzeros() if not entry.is_leaf()]
    plain = [entry.dep(0) if entry.op() == casadi.OP_NEG else entry for entry in entries]
    return [entry for entry in plain if not entry.is_leaf() and entry.op() in (casadi.OP_MUL, casadi.OP_SQ)]


def _named_symbols(letter: str, slots: Sequence[Slot]) -> tuple[SX, dict[str, SX]]:
    whole, parts = _symbols(letter, [slot.size for slot in slots])
    return whole, {slot.name: part for slot, part in zip(slots, parts)}

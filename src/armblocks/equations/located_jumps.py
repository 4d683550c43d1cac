"""Jumps in formulas as events.

A comparison, a sign or a rounding in the equations jumps at a time that depends on the signals. A run needs
no event there. The derivative of a run with respect to a parameter needs one, because a change of the
parameter shifts the time of the jump. :func:`with_located_jumps` replaces each such operation by a following
mode. The guards of the mode locate its changes. With consistent modes all signals keep their values.

Some comparisons are not replaced: comparisons of the time with constants and unchanged parameters, whose
times do not shift; of the time with a breakpoint, which is an instant already; of the time with a stored
instant, which are true at single times only; comparisons that search an index of a table; and conditions
under which a value is NaN, because they end a run.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi
from casadi import (
    SX,
    Function,
    densify,
    depends_on,
    dot,
    if_else,
    is_equal,
    logic_or,
    symvar,
    vertcat,
    vertsplit,
)

from armblocks.equations.constant_folding import called_entries, operation_value
from armblocks.equations.hybrid_system import HybridSystem
from armblocks.equations.jump_modes import COMPARISONS, JUMPS, LOGIC, STEPS, JumpModes
from armblocks.equations.signatures import Signature, Slot, signature
from armblocks.equations.traced_function import TracedFunction

UNREACHABLE = 1e300
"""A comparison with a constant of this size never changes."""
SAME_INSTANT = 2.0**-50
"""Blocks compare the time with a stored instant within this relative tolerance."""
SAME_EXPRESSION = 20
"""Depth to which expressions are compared."""
_TIME, _STATES, _DISCRETE, _UNKNOWNS, _PARAMETERS, _TICKS, _EVENTS = range(7)
"""The inputs of the functions."""


@dataclass(frozen=True)
class _Node:
    """An operation of the equations, with the operations of its operands."""

    operation: int
    operands: tuple[_Node, ...] = ()
    constant: float = 0.0
    varies: bool = False
    """Whether the value changes continuously between instants."""
    shifts: bool = False
    """Whether the value depends on a signal or on a chosen parameter, not only on the time."""
    momentary: bool = False
    """Whether the value depends on a comparison of the time with a stored instant."""


def with_located_jumps(system: HybridSystem, parameters: Sequence[int]) -> HybridSystem:
    """The system with a mode for every jump whose time can depend on parameters with these indices in p."""
    located = _Located(system, frozenset(parameters))
    columns = located.columns()
    return located.system(columns) if located.jumps.modes else system


class _Located:
    """All functions of a system in common symbols, with modes in place of jumps."""

    def __init__(self, system: HybridSystem, chosen: frozenset[int]) -> None:
        self.old, self.chosen = system, chosen
        self.symbols = [*system.reset.arguments[:5], system.update.arguments[5], system.reset.arguments[5]]
        self.functions, self.searched = _functions(system)
        results = [self._in_symbols(traced, vertcat(*traced.results, SX(0, 1))) for traced in self.functions]
        # The products that are separate values contain the same jumps.
        products = [self._in_symbols(traced, traced.rounded) for traced in self.functions]
        self.function = Function("f", self.symbols, [*results, *products], {"cse": True})
        self.jumps = JumpModes()
        (p,) = system.breakpoints.arguments
        breakpoints = Function("f", [p], [vertcat(*system.breakpoints.results, SX(0, 1))])
        (times,) = breakpoints.call([self.symbols[_PARAMETERS]], True, False)
        self.breakpoints = [times[k] for k in range(times.numel())]

    def _in_symbols(self, traced: TracedFunction, column: SX) -> SX:
        letters = dict(zip("txzwpme", self.symbols))
        function = Function("f", list(traced.arguments), [column])
        (column,) = function.call([letters[name] for name in traced.inputs.names], True, False)
        return densify(column)

    # The operations that jump.

    def _nodes(self) -> list[tuple[_Node, bool]]:
        """The operation of every instruction, and whether a searched function depends on it."""
        function = self.function
        delays = self.old.delays
        delayed = frozenset(() if delays is None else (*delays.values, *delays.derivatives))
        nodes: list[_Node] = []
        sources: list[tuple[int, ...]] = []
        writers = [-1] * function.sz_w()
        reached = [False] * function.n_instructions()
        for k in range(function.n_instructions()):
            operation, read = function.instruction_id(k), function.instruction_input(k)
            written = function.instruction_output(k)
            if operation == casadi.OP_OUTPUT:
                reached[writers[read[0]]] |= written[0] < self.searched
            inside = operation not in (casadi.OP_INPUT, casadi.OP_OUTPUT, casadi.OP_CONST)
            sources.append(tuple(writers[slot] for slot in read) if inside else ())
            if operation == casadi.OP_INPUT:
                nodes.append(self._input(read[0], read[1], delayed))
            elif operation == casadi.OP_CONST:
                nodes.append(_Node(operation, constant=function.instruction_constant(k)))
            else:
                nodes.append(_combined(operation, [nodes[source] for source in sources[-1]]))
            if operation != casadi.OP_OUTPUT:
                for slot in written:
                    if slot >= 0:
                        writers[slot] = k
        for k in range(len(nodes) - 1, -1, -1):
            searched = sources[k][1:] if _is_refusal(nodes[k]) else sources[k]
            for source in searched if reached[k] else ():
                reached[source] = True
        return list(zip(nodes, reached))

    def _input(self, letter: int, index: int, delayed: frozenset[int]) -> _Node:
        varies = letter in (_TIME, _STATES, _UNKNOWNS) or (letter == _DISCRETE and index in delayed)
        chosen = letter == _PARAMETERS and index in self.chosen
        # A delayed signal jumps at a time that depends on the delay as well.
        shifts = chosen or letter in (_STATES, _DISCRETE, _UNKNOWNS) or self.old.delays is not None
        return _Node(casadi.OP_INPUT, varies=varies, shifts=shifts)

    def columns(self) -> list[SX]:
        """The results of all functions, with modes in place of jumps."""
        function = self.function
        results = [SX.zeros(function.numel_out(k)) for k in range(function.n_out())]
        rows = [function.sparsity_out(k).row() for k in range(function.n_out())]
        work: list[Any] = [SX(0.0)] * function.sz_w()
        nodes = self._nodes()
        has_calls = any(node.operation == casadi.OP_CALL for node, _ in nodes)
        called = function.instructions_sx() if has_calls else SX()
        for k, (node, reached) in enumerate(nodes):
            sources, target = function.instruction_input(k), function.instruction_output(k)
            if node.operation == casadi.OP_OUTPUT:
                results[target[0]][rows[target[0]][target[1]]] = work[sources[0]]
            elif node.operation == casadi.OP_CONST:
                work[target[0]] = SX(node.constant)
            elif node.operation == casadi.OP_INPUT:
                work[target[0]] = self.symbols[sources[0]][sources[1]]
            elif node.operation == casadi.OP_CALL:
                values = called_entries(called[k].which_function(), [work[source] for source in sources])
                for slot, value in zip(target, values):
                    if slot >= 0:
                        work[slot] = value
            else:
                operands = [work[source] for source in sources]
                work[target[0]] = self._value(node, operands) if reached else _plain(node, operands)
        return results

    def _value(self, node: _Node, operands: list[SX]) -> SX:
        """The value of an operation on which a searched function depends."""
        if _is_refusal(node):
            return _plain(node, operands)
        conditions = {casadi.OP_IF_ELSE_ZERO: 1}.get(node.operation, 2 if node.operation in LOGIC else 0)
        for k, operand in enumerate(node.operands[:conditions]):
            condition = _Node(casadi.OP_NE, (operand, _Node(casadi.OP_CONST)), varies=operand.varies)
            if operand.varies and operand.shifts and _changes(condition):
                operands[k] = self.jumps.replaced(casadi.OP_NE, operands[k], SX(0.0))
        if node.operation not in JUMPS or not node.shifts or not _changes(node):
            return _plain(node, operands)
        a, b = operands[0], operands[-1]
        if node.operation in COMPARISONS and self._is_breakpoint(a, b):
            return _plain(node, operands)
        return self.jumps.replaced(node.operation, a, b)

    def _is_breakpoint(self, a: SX, b: SX) -> bool:
        """Whether a comparison is one of the time with a breakpoint."""
        t = self.symbols[_TIME]
        pairs = ((a, b), (b, a))
        return any(
            is_equal(left, t, 0) and is_equal(right, time, SAME_EXPRESSION)
            for left, right in pairs
            for time in self.breakpoints
        )

    # The system.

    def system(self, columns: Sequence[SX]) -> HybridSystem:
        """The system with the modes behind its discrete variables, and the guards behind its guards."""
        old, (t, x, z, w, p, m, e) = self.old, self.symbols
        modes, consistent = vertcat(*self.jumps.modes), vertcat(*self.jumps.consistent)
        new_z = SX.sym("z", z.numel() + modes.numel())
        new_e = SX.sym("e", e.numel() + len(self.jumps.guards))
        wrong = consistent != modes
        changed = if_else(logic_or(dot(new_e, new_e) == 0.0, wrong), consistent, modes)
        for number, (mode, (up, down)) in enumerate(zip(self.jumps.mode_of_guard, self.jumps.after)):
            fired = new_e[e.numel() + number]
            changed[mode] = if_else(fired == 0.0, changed[mode], if_else(fired > 0.0, up, down))
        names = [traced.name for traced in self.functions]
        by_name = dict(zip(names, columns))
        reset = by_name["reset"]
        by_name |= {
            "update": vertcat(by_name["update"], modes),
            "guards": vertcat(by_name["guards"], *self.jumps.guards),
            "contradictions": vertcat(by_name.get("contradictions", SX(0, 1)), wrong),
            "reset": vertcat(reset, changed),
        }
        products = dict(zip(names, columns[len(names) :]))
        inside = Function("f", [t, x, z, modes, w, p, m, e, new_e], [*by_name.values(), *products.values()])
        given = [t, x, new_z[: z.numel()], new_z[z.numel() :], w, p, m, new_e[: e.numel()], new_e]
        all_values = inside.call(given, True, False)
        values, products = (
            dict(zip(keys, part))
            for keys, part in ((by_name, all_values), (products, all_values[len(by_name) :]))
        )
        arguments = {"t": t, "x": x, "z": new_z, "w": w, "p": p, "m": m, "e": new_e}
        known = {traced.name: traced for traced in (old.guards, *self.functions)}
        known.setdefault("contradictions", dataclasses.replace(old.guards, name="contradictions"))
        new = {
            name: _rebuilt(known[name], arguments, value, products.get(name, products["guards"]))
            for name, value in values.items()
        }
        return self._replaced(new, self._blocks(values, new_z[z.numel() :]))

    def _blocks(self, values: Mapping[str, SX], modes: SX) -> list[str]:
        """For each mode the block of the first unknown, signal or state that depends on it."""
        layouts = (self.old.algebraic, self.old.signals_layout, self.old.states)
        names = [slot.name for layout in layouts for slot in layout.slots for _ in range(slot.size)]
        column = vertcat(values["residual"], values["signals"], values["derivative"])
        others = [symbol for symbol in symvar(column) if not depends_on(modes, symbol)]
        pattern = Function("f", [modes, vertcat(*others)], [column]).jac_sparsity(0, 0)
        first: dict[int, int] = {}
        for row, mode in zip(pattern.row(), pattern.get_col()):
            first[mode] = min(row, first.get(mode, row))
        return [
            names[first[mode]].rpartition("/")[0] if mode in first else self.old.name
            for mode in range(modes.numel())
        ]

    def _replaced(self, new: Mapping[str, TracedFunction], blocks: Sequence[str]) -> HybridSystem:
        old, jumps, start = self.old, self.jumps, self.old.discrete.size
        slots = [Slot(f"{block}/jump {k + 1}") for k, block in enumerate(blocks)]
        initial = old.initial_discrete
        column = vertcat(*initial.results, SX.zeros(len(slots)))
        delays, loops, first_guard = old.delays, old.loops, len(old.guard_directions)
        ranks = old.ranks
        if ranks is not None:
            ranks = dataclasses.replace(ranks, guards=(*ranks.guards, *[0] * len(jumps.guards)))
        return dataclasses.replace(
            old,
            **{
                name: new[name]
                for name in new
                if name not in ("delay_inputs", "delay_times", "loop_matrices")
            },
            discrete=Signature((*old.discrete.slots, *slots)),
            initial_discrete=dataclasses.replace(
                initial, outputs=signature(("z0", (column.numel(),))), results=(column,)
            ),
            guard_directions=(*old.guard_directions, *jumps.directions),
            guard_names=(*old.guard_names, *(blocks[mode] for mode in jumps.mode_of_guard)),
            guard_actions=(*old.guard_actions, *[""] * len(jumps.guards)),
            locating_guards=(*old.locating_guards, *range(first_guard, first_guard + len(jumps.guards))),
            ranks=ranks,
            modes=(*old.modes, *range(start, start + len(slots))),
            followers=(*old.followers, *[True] * len(slots)),
            delays=None
            if delays is None
            else dataclasses.replace(delays, inputs=new["delay_inputs"], times=new["delay_times"]),
            loops=None if loops is None else dataclasses.replace(loops, matrices=new["loop_matrices"]),
        )


def _functions(system: HybridSystem) -> tuple[list[TracedFunction], int]:
    """The functions of the variables, and the number of functions, from the first on, whose jumps are
    located."""
    searched = [system.derivative, system.signals, system.residual]
    if system.delays is not None:
        searched += [system.delays.inputs, system.delays.times]
    others = [system.residual_jacobian, system.update, system.guards, system.reset, system.contradictions]
    loops = None if system.loops is None else system.loops.matrices
    return [*searched, *(traced for traced in (*others, loops) if traced is not None)], len(searched)


def _combined(operation: int, operands: Sequence[_Node]) -> _Node:
    return _Node(
        operation,
        tuple(operands),
        varies=operation not in STEPS and any(operand.varies for operand in operands),
        shifts=any(operand.shifts for operand in operands),
        momentary=any(operand.momentary for operand in operands) or _compares_instants(operation, operands),
    )


def _is_refusal(node: _Node) -> bool:
    """Whether an operation is NaN if its first operand, a condition, is true, and otherwise 0."""
    return node.operation == casadi.OP_IF_ELSE_ZERO and math.isnan(node.operands[1].constant)


def _changes(node: _Node) -> bool:
    """Whether a jumping operation has an operand that varies, and can change its value for longer than an
    instant."""
    if node.momentary or not any(operand.varies for operand in node.operands):
        return False
    return node.operation not in COMPARISONS or not any(map(_is_exempt, node.operands))


def _is_exempt(operand: _Node) -> bool:
    """Whether a comparison with this operand needs no event: with a huge constant, in the search of an
    index."""
    huge = operand.operation == casadi.OP_CONST and abs(operand.constant) >= UNREACHABLE
    return huge or operand.operation == casadi.OP_PRINTME


def _compares_instants(operation: int, operands: Sequence[_Node]) -> bool:
    """Whether an operation is a comparison of the time with a stored instant, within rounding errors."""
    return operation == casadi.OP_LE and any(
        factor.constant == SAME_INSTANT for operand in operands for factor in operand.operands
    )


def _plain(node: _Node, operands: Sequence[SX]) -> SX:
    return operation_value(node.operation, operands)


def _rebuilt(traced: TracedFunction, arguments: Mapping[str, SX], column: SX, rounded: SX) -> TracedFunction:
    """A function of a system with other arguments, results and products that are separate values."""
    symbols = tuple(arguments[name] for name in traced.inputs.names)
    inputs = [Slot(name, () if name == "t" else (arguments[name].numel(),)) for name in traced.inputs.names]
    sizes = [slot.size for slot in traced.outputs]
    sizes[-1] = column.numel() - sum(sizes[:-1])
    outputs = [
        Slot(slot.name, slot.shape if slot.size == size else (size,))
        for slot, size in zip(traced.outputs, sizes)
    ]
    results = vertsplit(column, [0, *itertools.accumulate(sizes)])
    return TracedFunction(
        traced.name,
        Signature(tuple(inputs)),
        Signature(tuple(outputs)),
        symbols,
        tuple(map(densify, results)),
        rounded,
    )

"""Limits of signals that are constant between instants: a sampled signal in a comparison, for example.

If such a signal is exactly at a limit, it stays there until the next instant. A change of a parameter moves
it to one side of the limit, and the results have no derivative.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import casadi
from casadi import SX, Function, densify, fabs, if_else, vertcat

from armblocks.equations.constant_folding import called_entries, operation_value
from armblocks.equations.hybrid_system import HybridSystem
from armblocks.equations.jump_modes import COMPARISONS, STEPS
from armblocks.equations.remainders import nearest

_BETWEEN_OPERANDS = COMPARISONS | {casadi.OP_FMIN, casadi.OP_FMAX}
"""Operations with a limit where their operands are equal."""
_EQUALITIES = frozenset({casadi.OP_EQ, casadi.OP_NE})
"""Comparisons that can also protect a division by 0, where the result is smooth."""
_TIME, _STATES, _DISCRETE, _UNKNOWNS = range(4)
"""The inputs of the functions that change during a run."""


class _Node(NamedTuple):
    """The value of an operation."""

    value: SX
    varies: bool
    """Whether it changes continuously between instants."""
    stored: bool
    """Whether it can change during a run."""


def held_limits(system: HybridSystem) -> dict[str, Function]:
    """For each block the distances between held signals and their limits: functions of ``t, x, z, w, p`` with
    two results, the distances (n,) from limits and those (m,) in comparisons by == and ~=.

    The block is the one of the first signal, state or unknown that depends on the operation with the limit.
    """
    if not system.breakpoints.outputs.size and system.discrete.size == len(system.modes):
        return {}
    symbols = list(system.signals.arguments)
    function = _all_values(system, symbols)
    delayed = frozenset(() if system.delays is None else (*system.delays.values, *system.delays.derivatives))
    first = _first_results(function)
    layouts = (system.signals_layout, system.states, system.algebraic)
    names = [element for layout in layouts for slot in layout for element in slot.elements]
    found: dict[str, tuple[list[SX], list[SX]]] = {}
    for number, distance in _limits(function, symbols, delayed).items():
        if first[number] < len(names):
            of_block = found.setdefault(names[first[number]].rpartition("/")[0], ([], []))
            of_block[function.instruction_id(number) in _EQUALITIES].append(distance)
    return {
        block: Function("f", symbols, [vertcat(*distances, SX(0, 1)) for distances in both])
        for block, both in found.items()
    }


def _all_values(system: HybridSystem, symbols: Sequence[SX]) -> Function:
    """The signals, the derivatives of states and the residual in one column."""
    columns: list[SX] = []
    for traced in (system.signals, system.derivative, system.residual):
        function = Function("f", list(traced.arguments), [vertcat(*traced.results, SX(0, 1))])
        columns += function.call(list(symbols), True, False)
    return Function("f", list(symbols), [densify(vertcat(*columns))], {"cse": True})


def _first_results(function: Function) -> list[int]:
    """For each instruction the first row of the result that depends on it."""
    readers = [function.numel_out(0)] * function.sz_w()
    first: list[int] = [0] * function.n_instructions()
    for k in reversed(range(function.n_instructions())):
        sources, targets = function.instruction_input(k), function.instruction_output(k)
        if function.instruction_id(k) == casadi.OP_OUTPUT:
            readers[sources[0]] = min(readers[sources[0]], targets[1])
            continue
        first[k] = min(readers[target] for target in targets if target >= 0)
        for target in targets:
            readers[target] = function.numel_out(0)
        if function.instruction_id(k) not in (casadi.OP_INPUT, casadi.OP_CONST):
            for source in sources:
                readers[source] = min(readers[source], first[k])
    return first


def _limits(function: Function, symbols: Sequence[SX], delayed: frozenset[int]) -> dict[int, SX]:
    """For each instruction with a limit of a held signal the distance from this limit."""
    work = [_Node(SX(0.0), False, False)] * function.sz_w()
    found: dict[int, SX] = {}
    calls = any(function.instruction_id(k) == casadi.OP_CALL for k in range(function.n_instructions()))
    called = function.instructions_sx() if calls else SX()
    for k in range(function.n_instructions()):
        operation, sources = function.instruction_id(k), function.instruction_input(k)
        targets = function.instruction_output(k)
        if operation == casadi.OP_OUTPUT:
            continue
        if operation == casadi.OP_CONST:
            work[targets[0]] = _Node(SX(function.instruction_constant(k)), False, False)
            continue
        if operation == casadi.OP_INPUT:
            letter, index = sources
            continuous = letter in (_TIME, _STATES, _UNKNOWNS) or (letter == _DISCRETE and index in delayed)
            work[targets[0]] = _Node(symbols[letter][index], continuous, letter <= _UNKNOWNS)
            continue
        operands = [work[source] for source in sources]
        values = [operand.value for operand in operands]
        varies = any(operand.varies for operand in operands)
        stored = any(operand.stored for operand in operands)
        if operation == casadi.OP_CALL:
            results = called_entries(called[k].which_function(), values)
        else:
            results = [operation_value(operation, values)]
            if stored and not varies:
                distance = _distance(operation, values[0], values[-1])
                if distance is not None:
                    found[k] = distance
        for target, value in zip(targets, results):
            if target >= 0:
                work[target] = _Node(value, varies and operation not in STEPS, stored)
    return found


def _distance(operation: int, a: SX, b: SX) -> SX | None:
    """The distance of the operands of an operation from its limit, where it jumps or has a kink; None for
    other operations."""
    if operation in _BETWEEN_OPERANDS:
        return a - b
    if operation in (casadi.OP_SIGN, casadi.OP_FABS):
        return a
    if operation in (casadi.OP_FLOOR, casadi.OP_CEIL):
        return a - nearest(a)
    if operation == casadi.OP_FMOD:
        return if_else(b == 0.0, b, a / b - nearest(a / b))
    if operation == casadi.OP_ATAN2:
        return if_else(b < 0.0, a, fabs(b) + 1.0)
    return None

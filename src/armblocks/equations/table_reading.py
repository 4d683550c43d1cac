"""Indexed reads of table entries at run time.

CasADi's scalar expressions have no indexed read, so a table of n entries would cost n operations. An indexed
read is represented by CasADi's operation ``printme(x, y)``, whose value is x and which has no other use here,
as ``printme(printme(first, -n), index)``: ``first`` is the symbol of the table's first entry. The compiler
translates it to one load, and nothing is printed. A table must be an input of the function (a parameter of
the system), so that its entries are contiguous.

CasADi's derivative with respect to the index is 0, which is correct for an integer. CasADi reports a
dependence on the first entry only, so sensitivities to entries of such tables are not available.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import casadi
import numpy as np
from casadi import DM, SX, Function, fmax, fmin, if_else
from numpy.typing import NDArray


def read_entry(table: SX, index: SX) -> SX:
    """Entry ``index`` (an integer from 0, limited to the table) of a vector of symbols."""
    count = table.numel()
    first = SX.binary(casadi.OP_PRINTME, table[0], SX(-float(count)))
    return SX.binary(casadi.OP_PRINTME, first, fmin(fmax(index, 0.0), count - 1.0))


def last_at_or_below(table: SX, value: SX, count: int | None = None, stride: int = 1) -> SX:
    """The index of the last of ascending entries that is at most ``value``; -1 if there is none.

    A binary search without branches: log2(n) reads. ``count`` and ``stride``: only every ``stride``-th entry
    counts, such as the first column of a row-major table.
    """
    count = count or table.numel()
    step = 1 << (count.bit_length() - 1)
    index = SX(-1.0)
    while step:
        candidate = index + float(step)
        entry = read_entry(table, float(stride) * candidate)
        fits = casadi.logic_and(candidate < float(count), entry <= value)
        index = if_else(fits, candidate, index)
        step >>= 1
    return index


def reads_tables(function: Function) -> bool:
    """Whether the function has such reads, which CasADi's interpreter evaluates incorrectly."""
    return any(function.instruction_id(k) == casadi.OP_PRINTME for k in range(function.n_instructions()))


def tables_read(function: Function) -> set[tuple[int, int, int]]:
    """The tables that a function reads: the input of each, its first index there, its length."""
    tables: set[tuple[int, int, int]] = set()
    if not reads_tables(function):
        return tables
    inputs: dict[int, tuple[int, int]] = {}  # which input a work slot holds now
    constants: dict[int, float] = {}
    for k in range(function.n_instructions()):
        number, sources = function.instruction_id(k), function.instruction_input(k)
        targets = function.instruction_output(k)
        if number == casadi.OP_OUTPUT:
            continue
        target = targets[0]
        if number == casadi.OP_PRINTME and sources[0] in inputs and constants.get(sources[1], 0.0) < 0.0:
            slot, offset = inputs[sources[0]]
            tables.add((slot, offset, int(-constants[sources[1]])))
        for written in targets:
            inputs.pop(written, None)
            constants.pop(written, None)
        if number == casadi.OP_INPUT:
            inputs[target] = (sources[0], sources[1])
        elif number == casadi.OP_CONST:
            constants[target] = function.instruction_constant(k)
    return tables


def evaluated(
    function: Function, arguments: Sequence[NDArray[np.float64]], *, reads: bool
) -> list[NDArray[np.float64]]:
    """The values of a function, each a flat array. ``reads``: whether the function reads tables."""
    values = evaluate_with_reads(function, arguments) if reads else function.call(list(arguments))
    return [np.array(value, dtype=np.float64).ravel() for value in values]


def evaluate_with_reads(function: Function, arguments: Sequence[NDArray[np.float64]]) -> list[Any]:
    """The values of a function that reads tables: operations by CasADi, reads here. Slow."""
    outputs = [np.zeros(function.numel_out(k)) for k in range(function.n_out())]
    rows = [function.sparsity_out(k).row() for k in range(function.n_out())]
    work = [0.0] * function.sz_w()
    origins: dict[int, tuple[int, int]] = {}  # which input a work slot holds now
    for k in range(function.n_instructions()):
        number, sources = function.instruction_id(k), function.instruction_input(k)
        target = function.instruction_output(k)
        if number == casadi.OP_OUTPUT:
            outputs[target[0]][rows[target[0]][target[1]]] = work[sources[0]]
            continue
        if number == casadi.OP_CALL:
            called = function.instructions_sx()[k].which_function()
            for position, value in zip(target, _called(called, [work[source] for source in sources])):
                if position >= 0:
                    work[position] = value
                    origins.pop(position, None)
            continue
        origin = None
        if number == casadi.OP_CONST:
            value = function.instruction_constant(k)
        elif number == casadi.OP_INPUT:
            origin, value = (sources[0], sources[1]), float(arguments[sources[0]][sources[1]])
        elif number == casadi.OP_PRINTME:
            slot, position = origins[sources[0]]
            if work[sources[1]] < 0.0:
                origin, value = (slot, position), work[sources[0]]
            else:
                value = float(arguments[slot][position + int(work[sources[1]])])
        elif len(sources) == 1:
            value = float(SX.unary(number, SX(work[sources[0]])))
        else:
            value = float(SX.binary(number, SX(work[sources[0]]), SX(work[sources[1]])))
        work[target[0]] = value
        origins.pop(target[0], None)
        if origin is not None:
            origins[target[0]] = origin
    return outputs


def _called(function: Function, values: Sequence[float]) -> list[float]:
    """All structural entries of the results of a called function, from the entries of its arguments."""
    starts = itertools.accumulate((function.nnz_in(k) for k in range(function.n_in())), initial=0)
    spans = itertools.pairwise(starts)
    arguments = [DM(function.sparsity_in(k), list(values[start:end])) for k, (start, end) in enumerate(spans)]
    return [float(value) for result in function.call(arguments) for value in result.nonzeros()]

"""Indexed reads: agreement of the interpreter, native code in every layout, and CasADi."""

from __future__ import annotations

import numpy as np
import pytest
from casadi import SX

from armblocks.compiler import compile_function
from armblocks.compiler.interpret import interpret
from armblocks.equations import Signature, Slot, TracedFunction
from armblocks.equations.table_reading import last_at_or_below, read_entry
from armblocks.errors import CompileError

RANDOM = np.random.default_rng(5)


def traced(count: int) -> TracedFunction:
    """``(u, table) -> (entry at u, index of the last entry that is not above u)``."""

    def equations(u: SX, table: SX) -> list[SX]:
        return [read_entry(table, u), last_at_or_below(table, u)]

    return TracedFunction.trace(
        "reading",
        Signature((Slot("u", ()), Slot("table", (count,)))),
        Signature((Slot("entry", ()), Slot("index", ()))),
        equations,
    )


@pytest.mark.parametrize("count", [1, 2, 3, 7, 8, 1000])
def test_reads_of_all_implementations_agree_with_numpy(count: int) -> None:
    function = traced(count)
    table = np.sort(RANDOM.uniform(0.0, count, count))
    u = np.concatenate(
        [RANDOM.uniform(-2.0, count + 2.0, 37), table[:5], np.arange(min(count, 5)), [-1e300, 1e300]]
    )
    entries = table[np.clip(np.trunc(u), 0, count - 1).astype(int)]
    indices = np.searchsorted(table, u, side="right") - 1.0
    kernel = compile_function(function)
    for actual in (
        kernel(u, table),
        kernel(u, np.tile(table, (len(u), 1))),
        kernel.columns(u, np.tile(table, (len(u), 1))),
        [value[:, 0] for value in interpret(kernel.tape, [u[:, None], table])],
        np.transpose([function(value, table) for value in u]),
        np.transpose([kernel(value, table) for value in u]),
    ):
        np.testing.assert_array_equal(np.ravel(actual[0]), entries)
        np.testing.assert_array_equal(np.ravel(actual[1]), indices)


def test_each_sample_may_have_its_own_table() -> None:
    tables = RANDOM.uniform(size=(19, 5))
    u = RANDOM.uniform(0.0, 5.0, 19)
    kernel = compile_function(traced(5))
    np.testing.assert_array_equal(kernel(u, tables)[0], tables[np.arange(19), u.astype(int)])


def test_a_nan_index_reads_an_entry_of_the_table() -> None:
    kernel = compile_function(traced(3))
    entries = kernel(np.full(11, np.nan), [1.0, 2.0, 3.0])[0]
    assert set(entries) <= {1.0, 2.0, 3.0}


def test_the_tape_of_a_large_table_is_short() -> None:
    assert len(compile_function(traced(100_000)).tape.operations) < 200


def test_a_computed_table_is_refused() -> None:
    def equations(u: SX, table: SX) -> SX:
        return read_entry(2.0 * table, u)

    function = TracedFunction.trace(
        "doubled",
        Signature((Slot("u", ()), Slot("table", (3,)))),
        Signature((Slot("entry", ()),)),
        equations,
    )
    with pytest.raises(CompileError, match=r"a table that is not a parameter.*pass the table as a parameter"):
        compile_function(function)

"""Selection and logic blocks compared with indexing and comparisons in NumPy."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from block_evaluation import evaluate

from armblocks.blocks import (
    Assignment,
    CombinatorialLogic,
    CompareToConstant,
    CompareToZero,
    IndexVector,
    IntervalTest,
    IntervalTestDynamic,
    LogicalOperator,
    ManualSwitch,
    MultiportSwitch,
    RelationalOperator,
    Selector,
    SubMatrix,
)
from armblocks.errors import DiagramError, InputError

U = np.array([10.0, 20.0, 30.0, 40.0])
COMPARISONS = {
    "==": np.equal,
    "~=": np.not_equal,
    "<": np.less,
    "<=": np.less_equal,
    ">": np.greater,
    ">=": np.greater_equal,
}


def test_elements_are_selected_in_order() -> None:
    assert evaluate(Selector(indices=[3, 1]), U)["y"].tolist() == [30, 10]
    assert evaluate(Selector(indices=[0, 3, 3], counting="zero-based"), U)["y"].tolist() == [10, 40, 40]
    assert evaluate(Selector(indices=2), U)["y"].shape == ()


def test_sub_matrices_are_selected() -> None:
    A = np.arange(12.0).reshape(3, 4)
    part = SubMatrix(first_row=2, first_column=2, last_column=3)
    assert np.array_equal(evaluate(part, A)["y"], A[1:, 1:3])
    assert np.array_equal(evaluate(SubMatrix(), A)["y"], A)


def test_assignment_replaces_elements() -> None:
    assert evaluate(Assignment(indices=[2, 4]), U, [1.0, 2.0])["y"].tolist() == [10, 1, 30, 2]
    assert evaluate(Assignment(indices=[0, 1], counting="zero-based"), U, 7.0)["y"].tolist() == [7, 7, 30, 40]


@pytest.mark.parametrize(("index", "element"), [(-5, 0), (0, 0), (0.99, 0), (1, 1), (3, 3), (9, 3)])
def test_a_signal_selects_an_element_by_its_index(index: float, element: int) -> None:
    assert evaluate(IndexVector(), index, U)["y"] == U[element]
    assert evaluate(IndexVector(counting="one-based"), index + 1, U)["y"] == U[element]
    switch = MultiportSwitch(inputs=4, counting="zero-based")
    assert evaluate(switch, index, *U)["y"] == U[element]


def test_scalar_inputs_of_switches_are_broadcast() -> None:
    assert evaluate(MultiportSwitch(inputs=2), 1.0, 5.0, [1.0, 2.0])["y"].tolist() == [5, 5]
    assert evaluate(MultiportSwitch(inputs=2), 2.0, 5.0, [1.0, 2.0])["y"].tolist() == [1, 2]
    assert evaluate(ManualSwitch(), 5.0, [1.0, 2.0])["y"].tolist() == [5, 5]
    assert evaluate(ManualSwitch(position=2.0), 5.0, [1.0, 2.0])["y"].tolist() == [1, 2]


@pytest.mark.parametrize(("relation", "function"), COMPARISONS.items())
def test_relational_operators_agree_with_numpy(relation: str, function: np.ufunc) -> None:
    left, right = np.array([1.0, 2.0, 3.0]), np.array([2.0, 2.0, 2.0])
    expected = function(left, right).tolist()
    assert evaluate(RelationalOperator(relation=relation), left, right)["y"].tolist() == expected
    assert evaluate(CompareToConstant(relation=relation, constant=2.0), left)["y"].tolist() == expected
    assert evaluate(CompareToZero(relation=relation), left - 2)["y"].tolist() == expected


GATES = {
    "AND": lambda u: all(u),
    "OR": lambda u: any(u),
    "NAND": lambda u: not all(u),
    "NOR": lambda u: not any(u),
    "XOR": lambda u: sum(map(bool, u)) % 2 == 1,
    "NXOR": lambda u: sum(map(bool, u)) % 2 == 0,
}


@pytest.mark.parametrize("operator", GATES)
def test_logical_operators_agree_with_their_truth_tables(operator: str) -> None:
    for u in itertools.product([0.0, -2.5], repeat=3):
        result = evaluate(LogicalOperator(operator=operator, inputs=3), *u)["y"]
        assert result == float(GATES[operator](u))
    assert evaluate(LogicalOperator(operator=operator, inputs=1), 3.0)["y"] == float(GATES[operator]([3.0]))


def test_not() -> None:
    assert evaluate(LogicalOperator(operator="NOT"), [0.0, 2.0])["y"].tolist() == [1, 0]


def test_an_interval_test_includes_only_its_closed_ends() -> None:
    u = [0.0, 1.0, 1.5, 2.0, 3.0]
    closed, half = IntervalTest(lower=1.0, upper=2.0), IntervalTest(lower=1.0, upper=2.0, upper_closed=False)
    assert evaluate(closed, u)["y"].tolist() == [0, 1, 1, 1, 0]
    assert evaluate(half, u)["y"].tolist() == [0, 1, 1, 0, 0]
    assert evaluate(IntervalTest(lower=1.0, upper=np.inf, lower_closed=False), u)["y"].tolist() == [
        0,
        0,
        1,
        1,
        1,
    ]
    assert evaluate(IntervalTestDynamic(), 2.0, u, 1.0)["y"].tolist() == [0, 1, 1, 1, 0]
    assert evaluate(IntervalTestDynamic(lower_closed=False), 2.0, u, 1.0)["y"].tolist() == [0, 0, 1, 1, 0]


def test_combinatorial_logic_outputs_the_row_of_its_truth_table() -> None:
    adder = CombinatorialLogic(
        table=[[a ^ b ^ c, a + b + c > 1] for a, b, c in itertools.product([0, 1], repeat=3)]
    )
    for u in itertools.product([0, 1], repeat=3):
        assert evaluate(adder, u)["y"].tolist() == [u[0] ^ u[1] ^ u[2], float(sum(u) > 1)]
    assert [float(evaluate(CombinatorialLogic(), u)["y"]) for u in ([0, 1], [1, 1])] == [0, 1]


def test_invalid_indices_shapes_and_tables_are_refused() -> None:
    with pytest.raises(InputError, match=r"Selector: the indices are \[1.5\].*integers, at least 1"):
        Selector(indices=[1.5])
    with pytest.raises(InputError, match=r"Assignment: the indices are \[0.0\]"):
        Assignment(indices=[0])
    with pytest.raises(DiagramError, match=r"the index 5 exceeds the size of the signal.*Allowed: 1 to 4"):
        evaluate(Selector(indices=5), U)
    with pytest.raises(DiagramError, match=r"'u' has shape \(2, 2\).*use SubMatrix for matrices"):
        evaluate(Selector(), np.eye(2))
    with pytest.raises(DiagramError, match=r"3 new elements for 2 indices"):
        evaluate(Assignment(indices=[1, 2]), U, [1, 2, 3])
    with pytest.raises(DiagramError, match=r"rows 2 to 5 and columns 1 to 2 are outside the matrix"):
        evaluate(SubMatrix(first_row=2, last_row=5), np.eye(2))
    with pytest.raises(InputError, match=r"CombinatorialLogic: the table has 3 rows"):
        CombinatorialLogic(table=[[0], [1], [1]])

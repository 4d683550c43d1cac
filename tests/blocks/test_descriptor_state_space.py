"""Descriptor state-space systems compared with closed forms and SciPy's generalised eigenvalues."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.linalg

import armblocks as ab
from armblocks.blocks import DescriptorStateSpace, Gain, SineWave, StateSpace, Step, Sum
from armblocks.diagram import Block, Diagram, DiagramBuilder
from armblocks.errors import InputError
from unordered import matched

SOLVERS = pytest.mark.parametrize("solver", [{"solver": "rk45"}, {"solver": "rk4", "step": 0.01}], ids=str)
TOLERANCES: dict[str, Any] = {"rtol": 1e-10, "atol": 1e-12, "stop_time": 3.0, "sample_time": 0.05}


def diagram(block: Block, source: Block) -> Diagram:
    builder = DiagramBuilder("d")
    builder.add("block", block, builder.add("source", source))
    return builder.build()


@SOLVERS
def test_a_circuit_with_an_algebraic_current_agrees_with_its_closed_form(solver: dict[str, Any]) -> None:
    """RC = 0.5 s: C v' = i, 0 = u - v - R i; v = 1 - exp(-2 t) after a step, and i = (1 - v) / R."""
    R, C = 0.25, 2.0
    block = DescriptorStateSpace(
        E=((C, 0.0), (0.0, 0.0)),
        A=((0.0, 1.0), (-1.0, -R)),
        B=((0.0,), (1.0,)),
        C=np.eye(2),
        D=np.zeros((2, 1)),
    )
    result = ab.simulate(diagram(block, Step(time=0.0)), **TOLERANCES, **solver)
    v = -np.expm1(-2.0 * result.time)
    # RK4 with h = 0.01 s: relative error (2 h)^4 / 120 = 1e-9 of the exponential
    assert result["block/y"] == pytest.approx(np.column_stack([v, (1.0 - v) / R]), abs=4e-9)


@SOLVERS
def test_a_system_with_regular_E_agrees_with_the_state_space_block(solver: dict[str, Any]) -> None:
    random = np.random.default_rng(3)
    E, A = random.normal(size=(3, 3)) + 3 * np.eye(3), random.normal(size=(3, 3)) - 3 * np.eye(3)
    B, C, D = random.normal(size=(3, 2)), random.normal(size=(2, 3)), random.normal(size=(2, 2))
    start, source = random.normal(size=3), SineWave(amplitude=[1.0, 2.0], frequency=[1.0, 3.0])
    result = ab.simulate(
        diagram(DescriptorStateSpace(E=E, A=A, B=B, C=C, D=D, initial=start), source), **TOLERANCES, **solver
    )
    plain = StateSpace(A=np.linalg.solve(E, A), B=np.linalg.solve(E, B), C=C, D=D, initial=start)
    expected = ab.simulate(diagram(plain, source), **TOLERANCES, **solver)
    assert result["block/y"] == pytest.approx(expected["block/y"], abs=1e-12)


def test_the_poles_are_the_finite_generalised_eigenvalues() -> None:
    """A random pencil with E of rank 3 of 5; its static gain is C (-A)^-1 B + D."""
    random = np.random.default_rng(5)
    E = random.normal(size=(5, 3)) @ random.normal(size=(3, 5))
    A, B, C, D = (random.normal(size=size) for size in ((5, 5), (5, 1), (1, 5), (1, 1)))
    block = DescriptorStateSpace(E=E, A=A, B=B, C=C, D=D)
    linear = ab.linearize(diagram(block, Step()), inputs="source.final", outputs="block/y", at=2.0)
    values = scipy.linalg.eigvals(A, E)
    finite = values[np.abs(values) < 1e8]
    assert len(finite) == 3
    assert matched(linear.poles(), finite)
    assert linear.dcgain() == pytest.approx(C @ np.linalg.solve(-A, B) + D, rel=1e-9)


def test_initial_algebraic_variables_follow_from_the_differential_ones() -> None:
    """x1' = -x1, 0 = x2 - 2 x1: of the initial values (3, 100) only the value of x1 is used."""
    block = DescriptorStateSpace(
        E=((1.0, 0.0), (0.0, 0.0)),
        A=((-1.0, 0.0), (-2.0, 1.0)),
        B=np.zeros((2, 1)),
        C=np.eye(2),
        D=np.zeros((2, 1)),
        initial=(3.0, 100.0),
    )
    result = ab.simulate(diagram(block, Step()), **TOLERANCES)
    expected_x = 3.0 * np.exp(-result.time)
    assert result["block/y"] == pytest.approx(np.column_stack([expected_x, 2.0 * expected_x]), abs=1e-9)


def test_a_system_with_E_equal_to_zero_is_a_gain() -> None:
    """E = 0: 0 = A x + B u."""
    block = DescriptorStateSpace(
        E=np.zeros((2, 2)), A=((2.0, 0.0), (0.0, 4.0)), B=((1.0,), (1.0,)), C=np.eye(2), D=np.zeros((2, 1))
    )
    result = ab.simulate(diagram(block, SineWave()), stop_time=1.0, sample_time=0.1)
    assert result["block/y"] == pytest.approx(np.outer(np.sin(result.time), [-0.5, -0.25]), abs=1e-15)


def test_a_system_without_feedthrough_may_be_part_of_a_loop() -> None:
    """E is singular, but y = x1 only: y' = -y + (u - y) with the solution (1 - exp(-2 t)) / 2."""
    builder = DiagramBuilder("d")
    block = DescriptorStateSpace(
        E=((0.0, 2.0), (0.0, 0.0)),
        A=((0.0, -2.0), (1.0, 0.0)),
        B=((2.0,), (1.0,)),
        C=((0.0, 1.0),),
        D=((0.0,),),
    )
    plant = builder.add("plant", block)
    error = builder.add("error", Sum(signs="+-"))
    builder.connect(builder.add("u", Step(time=0.0)), error["u1"])
    builder.connect(builder.add("unity", Gain(gain=[1.0]), plant), error["u2"])
    builder.connect(error, plant["u"])
    result = ab.simulate(builder.build(), **TOLERANCES)
    assert np.ravel(result["plant/y"]) == pytest.approx(-np.expm1(-2.0 * result.time) / 2.0, abs=1e-9)


def test_a_system_of_index_2_and_inconsistent_shapes_are_refused() -> None:
    """Index 2: x1' = x2, 0 = x1 - u."""
    shapes = {"B": ((0.0,), (-1.0,)), "C": ((1.0, 0.0),), "D": ((0.0,),)}
    E = ((1.0, 0.0), (0.0, 0.0))
    with pytest.raises(InputError, match=r"E has rank 1 of 2; 1 algebraic equation does not determine"):
        DescriptorStateSpace(E=E, A=((0.0, 1.0), (1.0, 0.0)), **shapes)
    with pytest.raises(InputError, match=r"E is \(2, 2\), A is \(2, 2\), B is \(1, 1\).*correct the shapes"):
        DescriptorStateSpace(E=E, A=np.eye(2), B=((1.0,),), C=((1.0, 0.0),), D=((0.0,),))
    with pytest.raises(InputError, match=r"DescriptorStateSpace.initial: initial has shape \(3,\)"):
        DescriptorStateSpace(E=E, A=np.eye(2), **shapes, initial=(1.0, 2.0, 3.0))

"""Algebraic constraints compared with closed forms; decision tables compared with Python."""

import itertools
from typing import Any

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import (
    AlgebraicConstraint,
    Clock,
    Constant,
    Derivative,
    Expression,
    Gain,
    Integrator,
    MatrixGain,
    Mux,
    SecondOrderIntegrator,
    SineWave,
    Sum,
    TruthTable,
    ZeroOrderHold,
)
from armblocks.errors import AlgebraicLoopError, InputError

SOLVER_SETTINGS: list[dict[str, Any]] = [
    {"solver": "rk4", "step": 0.01},
    {"solver": "rk45", "rtol": 1e-9, "atol": 1e-12},
    {"solver": "rodas5p", "rtol": 1e-9, "atol": 1e-12},
]


def constrained_diagram(formula: str, initial: float = 0.0) -> ab.DiagramBuilder:
    """A diagram with z from formula(z, t) = 0, its derivative, its integral and a sample-and-hold of z."""
    builder = ab.DiagramBuilder("constrained", settings=ab.SimulationOptions(stop_time=2.0, sample_time=0.1))
    z = builder.add("z", AlgebraicConstraint(initial=initial))
    time = builder.add("time", Clock())
    f = builder.add("f", Expression(formula=formula, inputs=2), z, time)
    builder.connect(f, z["u"])
    builder.add("rate", Derivative(), z)
    builder.add("integral", Integrator(), z)
    builder.add("held", ZeroOrderHold(sample_time=0.5), z)
    return builder


@pytest.mark.parametrize("settings", SOLVER_SETTINGS)
def test_the_root_nearest_to_the_start_value_is_found_and_tracked(settings: dict[str, Any]) -> None:
    for sign in (1.0, -1.0):
        result = ab.simulate(constrained_diagram("u1 ^ 2 - 1 - u2", initial=3.0 * sign).build(), **settings)
        expected = sign * np.sqrt(1.0 + result.time)
        np.testing.assert_allclose(result["z"], expected, rtol=1e-9)
        np.testing.assert_allclose(result["rate"], 0.5 / expected, rtol=1e-8)
        exact = sign * 2.0 / 3.0 * ((1.0 + result.time) ** 1.5 - 1.0)
        np.testing.assert_allclose(result["integral"], exact, rtol=1e-6, atol=1e-9)
        held = expected[np.floor(result.time / 0.5 + 1e-9).astype(int) * 5]
        np.testing.assert_allclose(result["held"], held, rtol=1e-9)


def test_a_linear_equation_is_eliminated_symbolically() -> None:
    diagram = constrained_diagram("4 * u1 - u2").build()
    assert ab.compile_diagram(diagram).system.algebraic.size == 0
    result = ab.simulate(diagram)
    assert np.array_equal(result["z"], result.time / 4.0)
    np.testing.assert_allclose(result["rate"], 0.25, rtol=1e-15)


def test_a_vector_is_solved_as_a_whole() -> None:
    matrix = ((2.0, 1.0), (-1.0, 3.0))
    builder = ab.DiagramBuilder("vector", settings=ab.SimulationOptions(stop_time=1.0))
    z = builder.add("z", AlgebraicConstraint(initial=(0.0, 0.0)))
    right = builder.add("right", SineWave(phase=(0.0, 1.0)))
    builder.connect(
        builder.add("f", Sum(signs="+-"), builder.add("A", MatrixGain(gain=matrix), z), right), z["u"]
    )
    result = ab.simulate(builder.build())
    np.testing.assert_allclose(result["z"] @ np.transpose(matrix), result["right"], rtol=1e-14, atol=1e-15)


def test_two_coupled_constraints_are_solved() -> None:
    """a + b = 3 and a b = 2 with a > b have the solution a = 2, b = 1."""
    builder = ab.DiagramBuilder("pair", settings=ab.SimulationOptions(stop_time=1.0))
    a = builder.add("a", AlgebraicConstraint(initial=3.0))
    b = builder.add("b", AlgebraicConstraint(initial=0.5))
    builder.connect(builder.add("sum", Expression(formula="u1 + u2 - 3", inputs=2), a, b), a["u"])
    builder.connect(builder.add("product", Expression(formula="u1 * u2 - 2", inputs=2), a, b), b["u"])
    result = ab.simulate(builder.build())
    np.testing.assert_allclose(result["a"], 2.0, rtol=1e-12)
    np.testing.assert_allclose(result["b"], 1.0, rtol=1e-12)


def test_a_constraint_whose_input_does_not_depend_on_its_output_is_refused() -> None:
    builder = ab.DiagramBuilder("alone")
    z = builder.add("z", AlgebraicConstraint(), builder.add("one", Constant()))
    builder.add("double", Gain(gain=2.0), z)
    with pytest.raises(AlgebraicLoopError, match="z/z"):
        ab.simulate(builder.build())


def test_linearisation_differentiates_the_implicit_function() -> None:
    """x' = z with z^3 + z = u + x: at z = 1 the derivative of z is 1 / 4."""
    builder = ab.DiagramBuilder("flow")
    z = builder.add("z", AlgebraicConstraint(initial=0.9))
    x = builder.add("x", Integrator(initial=1.5), z)
    drive = builder.add("drive", Constant(value=0.5))
    builder.connect(
        builder.add("f", Expression(formula="u1^3 + u1 - u2 - u3", inputs=3), z, x, drive), z["u"]
    )
    linear = ab.linearize(builder.build(), inputs="drive.value", outputs="z")
    np.testing.assert_allclose([linear.A, linear.B, linear.C, linear.D], 0.25, rtol=1e-9)


DECISIONS = ((1.0, -1.0, 0.0), (0.0, 1.0, -1.0), (-1.0, 0.0, 1.0), (-1.0, -1.0, -1.0))
ACTIONS = ((1.0, 10.0), (2.0, 20.0), (3.0, 30.0), (4.0, 40.0))


def table_outputs(conditions: tuple[int, ...]) -> tuple[float, ...]:
    for row, action in zip(DECISIONS, ACTIONS):
        if all(required in (-1.0, float(condition)) for required, condition in zip(row, conditions)):
            return action
    raise AssertionError("the last row decides")


@pytest.mark.parametrize("conditions", list(itertools.product((0, 1), repeat=3)))
@pytest.mark.parametrize("settings", SOLVER_SETTINGS[:2])
def test_the_first_matching_row_of_a_decision_table_is_taken(
    conditions: tuple[int, ...], settings: dict[str, Any]
) -> None:
    builder = ab.DiagramBuilder("table", settings=ab.SimulationOptions(stop_time=1.0))
    inputs = [builder.add(f"c{k}", Constant(value=5.0 * value)) for k, value in enumerate(conditions)]
    table = TruthTable(decisions=DECISIONS, actions=ACTIONS)
    builder.add("table", table, builder.add("mux", Mux(inputs=3), *inputs))
    result = ab.simulate(builder.build(), **settings)
    assert tuple(result["table"][-1]) == table_outputs(conditions)


def test_invalid_decision_tables_are_refused() -> None:
    with pytest.raises(InputError, match=r"the conditions \[0, 1\] are not decided"):
        TruthTable(decisions=((1.0, -1.0), (-1.0, 0.0)), actions=((1.0,), (0.0,)))
    with pytest.raises(InputError, match=r"there are 2 decisions and 1 actions"):
        TruthTable(actions=((1.0,),))
    with pytest.raises(InputError, match=r"there are 13 conditions"):
        TruthTable(decisions=((-1.0,) * 13,), actions=((1.0,),))


def test_an_unsolvable_constraint_with_an_unused_output_is_refused() -> None:
    builder = ab.DiagramBuilder("unread")
    z = builder.add("z", AlgebraicConstraint())
    builder.connect(builder.add("c", Constant()), z["u"])
    with pytest.raises(AlgebraicLoopError, match="with no solution: z/z"):
        ab.simulate(builder.build(), stop_time=1.0)


def pendulum(constraint: str) -> ab.Diagram:
    """A point mass on a rod of length 1 that starts horizontal: x'' = -L x, y'' = -L y - g."""
    builder = ab.DiagramBuilder("rod")
    force = builder.add("L", AlgebraicConstraint())
    x = builder.add("x", SecondOrderIntegrator(initial=1.0))
    y = builder.add("y", SecondOrderIntegrator())
    builder.connect(builder.add("ax", Expression(formula="-u1 * u2", inputs=2), force, x["x"]), x["u"])
    builder.connect(builder.add("ay", Expression(formula="-u1 * u2 - 9.81", inputs=2), force, y["x"]), y["u"])
    signals = (x["x"], y["x"], x["dx"], y["dx"], force)
    rule = builder.add("rule", Expression(formula=constraint, inputs=5), *signals)
    builder.connect(rule, force["u"])
    return builder.build()


def test_a_rod_is_refused_at_index_3_and_2_and_simulated_at_index_1() -> None:
    """Constraints on the length have index 3, on the speed along the rod index 2, on the acceleration 1."""
    for constraint in ("u1^2 + u2^2 - 1", "u1*u3 + u2*u4"):
        with pytest.raises(
            AlgebraicLoopError,
            match=r"does not contain its unknown .*that contain their unknown.*twice for the force in a rod",
        ) as caught:
            ab.simulate(pendulum(constraint), stop_time=1.0)
        assert caught.value.loop == ("L/z",)
        assert len(str(caught.value)) < 400
    period = 2.3678419475762374493  # 4 K(1/2) / sqrt(9.81)
    rod = pendulum("u3^2 + u4^2 - u5 * (u1^2 + u2^2) - 9.81 * u2")
    result = ab.simulate(rod, stop_time=period, rtol=1e-11, atol=1e-12)
    # only the second derivative of the length is constrained: its error is the tolerance times the time
    # squared
    assert result["x/x"][-1] == pytest.approx(1.0, abs=1e-9)
    assert result["y/x"][-1] == pytest.approx(0.0, abs=1e-9)

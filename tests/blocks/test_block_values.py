"""Outputs of blocks compared with NumPy and with values computed by hand."""

from __future__ import annotations

import numpy as np
import pytest
from block_evaluation import evaluate

import armblocks as ab
from armblocks.blocks import (
    Atan2,
    Clock,
    Demux,
    Derivative,
    Gain,
    MathFunction,
    MatrixGain,
    MatrixProduct,
    MinMax,
    Mux,
    Power,
    Product,
    Ramp,
    Saturation,
    SineWave,
    StateSpace,
    Step,
    Sum,
    T2xyz,
    Trigonometry,
    Xyz2T,
)
from armblocks.errors import InputError


def test_sources_have_their_closed_forms() -> None:
    assert evaluate(Clock(), t=3.5)["y"] == 3.5
    assert evaluate(Step(time=1.0, initial=2.0, final=5.0), t=0.99)["y"] == 2.0
    assert evaluate(Step(time=1.0, initial=2.0, final=5.0), t=1.0)["y"] == 5.0
    assert evaluate(Ramp(slope=[2.0, -1.0], start=1.0, initial=0.5), t=3.0)["y"].tolist() == [4.5, -1.5]
    assert evaluate(Ramp(start=1.0, initial=0.5), t=0.3)["y"] == 0.5
    # At the start the rate is that after it.
    builder = ab.DiagramBuilder("rate")
    builder.add("rate", Derivative(), builder.add("ramp", Ramp(slope=2.0, start=0.5)))
    rates = ab.simulate(builder.build(), stop_time=1.0, sample_time=0.25)["rate"].ravel()
    assert rates.tolist() == [0.0, 0.0, 2.0, 2.0, 2.0]
    sine = SineWave(amplitude=2.0, frequency=3.0, phase=0.4, bias=-1.0)
    assert evaluate(sine, t=0.7)["y"] == pytest.approx(2 * np.sin(3 * 0.7 + 0.4) - 1, rel=1e-15)


def test_scalar_and_vector_gains_are_broadcast() -> None:
    assert evaluate(Gain(gain=2.0), [1, 2, 3])["y"].tolist() == [2, 4, 6]
    assert evaluate(Gain(gain=[1, 2, 3]), 2.0)["y"].tolist() == [2, 4, 6]
    assert evaluate(Gain(gain=[[1, 2], [3, 4]]), [[1, 0], [0, 1]])["y"].tolist() == [[1, 0], [0, 4]]
    assert evaluate(MatrixGain(gain=[[1, 2, 3], [4, 5, 6]]), [1, 0, -1])["y"].tolist() == [-2, -2]


def test_sums_and_products_use_the_given_signs_and_operators() -> None:
    assert evaluate(Sum(signs="+-+"), 1.0, [2.0, 3.0], 4.0)["y"].tolist() == [3.0, 2.0]
    assert evaluate(Sum(signs="-"), 1.0)["y"] == -1.0
    assert evaluate(Product(operators="*/*"), 6.0, [2.0, 3.0], 5.0)["y"].tolist() == [15.0, 10.0]
    assert evaluate(Product(operators="/"), 4.0)["y"] == 0.25
    A, B = np.arange(6.0).reshape(2, 3), np.arange(12.0).reshape(3, 4)
    assert np.array_equal(evaluate(MatrixProduct(), A, B)["y"], A @ B)
    assert np.array_equal(evaluate(MatrixProduct(), A, B[:, 0])["y"], A @ B[:, 0])


@pytest.mark.parametrize(
    ("name", "function"),
    [
        ("abs", np.abs),
        ("ceil", np.ceil),
        ("exp", np.exp),
        ("floor", np.floor),
        ("log", np.log),
        ("log10", np.log10),
        ("negate", np.negative),
        ("reciprocal", np.reciprocal),
        ("sign", np.sign),
        ("sqrt", np.sqrt),
        ("square", np.square),
    ],
)
def test_math_functions_agree_with_numpy(name: str, function: np.ufunc) -> None:
    u = np.array([0.3, 1.0, 2.5])
    assert evaluate(MathFunction(function=name), u)["y"] == pytest.approx(function(u), rel=1e-15)


@pytest.mark.parametrize("name", ["sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh"])
def test_trigonometric_functions_agree_with_numpy(name: str) -> None:
    u = np.array([-0.7, 0.0, 0.4])
    numpy_name = {"asin": "arcsin", "acos": "arccos", "atan": "arctan"}.get(name, name)
    expected = getattr(np, numpy_name)(u)
    assert evaluate(Trigonometry(function=name), u)["y"] == pytest.approx(expected, rel=1e-15)


def test_functions_of_several_inputs_agree_with_numpy() -> None:
    y, x = np.array([1.0, 1.0, -1.0, -1.0]), np.array([1.0, -1.0, -1.0, 1.0])
    assert evaluate(Atan2(), y, x)["angle"] == pytest.approx(np.arctan2(y, x), rel=1e-15)
    assert evaluate(Power(), [2.0, 3.0], 3.0)["y"] == pytest.approx([8.0, 27.0], rel=1e-15)
    assert evaluate(MinMax(inputs=3), [1, 5], [4, 2], 3)["y"].tolist() == [1, 2]
    assert evaluate(MinMax(function="max", inputs=3), [1, 5], [4, 2], 3)["y"].tolist() == [4, 5]


def test_saturation_limits_each_element() -> None:
    limits = Saturation(lower=-1.0, upper=[2.0, 3.0, 4.0])
    assert evaluate(limits, [-5.0, 2.5, 9.0])["y"].tolist() == [-1.0, 2.5, 4.0]
    assert evaluate(Saturation(lower=0.0, upper=np.inf), 1e300)["y"] == 1e300


def test_demux_is_the_inverse_of_mux() -> None:
    assert evaluate(Mux(inputs=3), 1.0, [2.0, 3.0], 4.0)["y"].tolist() == [1, 2, 3, 4]
    parts = evaluate(Demux(parts=2), [1.0, 2.0, 3.0, 4.0])
    assert parts["y1"].tolist() == [1, 2]
    assert parts["y2"].tolist() == [3, 4]
    assert evaluate(Demux(parts=2), [1.0, 2.0])["y2"].shape == ()
    assert evaluate(Demux(parts=1), [1.0, 2.0])["y"].tolist() == [1, 2]


def test_poses_and_positions_are_inverse() -> None:
    T = evaluate(Xyz2T(), 1.0, 2.0, 3.0)["T"]
    assert T.tolist() == [[1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]
    assert {axis: float(value) for axis, value in evaluate(T2xyz(), T).items()} == {"x": 1, "y": 2, "z": 3}


def test_the_output_of_a_state_space_system() -> None:
    system = StateSpace(
        A=[[0, 1], [-2, -3]], B=[[0], [1]], C=[[1, 0], [1, 1]], D=[[0], [2]], initial=[1.0, 0.0]
    )
    assert evaluate(system, [5.0], x=[0.5, 0.25])["y"].tolist() == [0.5, 10.75]


@pytest.mark.parametrize("signs", ["", "+*", "+ "])
def test_signs_other_than_plus_and_minus_are_refused(signs: str) -> None:
    with pytest.raises(InputError, match=r"Sum\.signs: the value is .*Allowed: \+ and -, at least one"):
        Sum(signs=signs)


@pytest.mark.parametrize("operators", ["", "*+"])
def test_operators_other_than_times_and_divide_are_refused(operators: str) -> None:
    with pytest.raises(InputError, match=r"Product\.operators: the value is .*: \* and /, at least one"):
        Product(operators=operators)


def test_state_space_matrices_of_inconsistent_shapes_are_refused() -> None:
    with pytest.raises(InputError, match=r"A is \(1, 1\), B is \(2, 1\).*A \(n, n\), B \(n, m\)"):
        StateSpace(B=[[1.0], [2.0]])
    with pytest.raises(
        InputError,
        match=r"StateSpace.initial: initial has shape \(2,\). Allowed: \(\) or \(1,\). Fix: give one",
    ):
        StateSpace(initial=[1.0, 2.0])


def test_source_parameters_of_inconsistent_shapes_are_refused() -> None:
    with pytest.raises(InputError, match=r"'initial' has shape \(2,\) and 'final' has shape \(3,\)"):
        Step(initial=[1, 2], final=[1, 2, 3])
    with pytest.raises(InputError, match=r"'slope' has shape \(2,\) and 'initial' has shape \(3,\)"):
        Ramp(slope=[1, 2], initial=[1, 2, 3])
    with pytest.raises(InputError, match=r"'amplitude' has shape \(2,\) and 'bias' has shape \(3,\)"):
        SineWave(amplitude=[1, 2], bias=[1, 2, 3])


@pytest.mark.parametrize(
    ("numerator", "denominator"), [((1.0,), (0.0, 1.0)), ((1.0,), (2.0,)), ((1.0, 2.0, 3.0), (1.0, 1.0))]
)
def test_an_improper_transfer_function_is_refused(
    numerator: tuple[float, ...], denominator: tuple[float, ...]
) -> None:
    from armblocks.blocks import TransferFunction

    with pytest.raises(InputError, match=r"TransferFunction: the denominator is .*at most as many in b"):
        TransferFunction(numerator=numerator, denominator=denominator)

"""Elementwise arithmetic and reductions compared with NumPy, on random numbers and special cases."""

from __future__ import annotations

import numpy as np
import pytest
from block_evaluation import evaluate

from armblocks.blocks import (
    Abs,
    AngleDifference,
    Bias,
    CartesianToPolar,
    Constant,
    CumulativeSum,
    DegreesToRadians,
    Divide,
    DotProduct,
    Extremum,
    Hypot,
    MathFunction,
    Modulo,
    Norm,
    PolarToCartesian,
    Polynomial,
    ProductOfElements,
    RadiansToDegrees,
    Rounding,
    Sign,
    Sqrt,
    SumOfElements,
    Trigonometry,
    UnaryMinus,
)
from armblocks.diagram import DiagramBuilder
from armblocks.errors import DiagramError

RANDOM = np.random.default_rng(20)
U = RANDOM.normal(size=(3, 4))
V = RANDOM.normal(size=(3, 4))


def test_elementwise_operations_agree_with_numpy() -> None:
    assert np.array_equal(evaluate(Abs(), U)["y"], np.abs(U))
    assert np.array_equal(evaluate(Bias(bias=2.5), U)["y"], U + 2.5)
    assert np.array_equal(evaluate(UnaryMinus(), U)["y"], -U)
    assert evaluate(Sign(), [-2.0, 0.0, 3.0])["y"].tolist() == [-1, 0, 1]
    assert np.array_equal(evaluate(Divide(), U, V)["y"], U / V)
    assert evaluate(Hypot(), U, V)["y"] == pytest.approx(np.hypot(U, V), rel=1e-15)
    assert evaluate(Hypot(), 3e200, 4e200)["y"] == pytest.approx(5e200, rel=1e-15)
    assert np.array_equal(evaluate(DegreesToRadians(), U)["y"], np.deg2rad(U))
    assert evaluate(RadiansToDegrees(), U)["y"] == pytest.approx(np.rad2deg(U), rel=1e-15)


def test_square_roots_agree_with_numpy() -> None:
    assert np.array_equal(evaluate(Sqrt(), np.abs(U))["y"], np.sqrt(np.abs(U)))
    assert np.array_equal(evaluate(Sqrt(function="signedSqrt"), U)["y"], np.sign(U) * np.sqrt(np.abs(U)))
    assert evaluate(Sqrt(function="rSqrt"), 4.0)["y"] == 0.5


@pytest.mark.parametrize(("name", "function"), [("floor", np.floor), ("ceil", np.ceil), ("fix", np.trunc)])
def test_rounding_agrees_with_numpy(name: str, function: np.ufunc) -> None:
    u = np.concatenate([RANDOM.normal(0, 5, 20), [-2.0, -0.5, 0.0, 0.5, 3.0, 1e300]])
    assert np.array_equal(evaluate(Rounding(function=name), u)["y"], function(u))


def test_exact_halves_are_rounded_away_from_zero() -> None:
    u = [0.5, 1.5, 2.5, -0.5, -2.5, 0.49999999999999994, 2.4, -2.6, 4503599627370497.0]
    expected = [1, 2, 3, -1, -3, 0, 2, -3, 4503599627370497.0]
    assert evaluate(Rounding(function="round"), u)["y"].tolist() == expected


def test_remainders_agree_with_numpy_and_matlab_for_a_divisor_of_zero() -> None:
    u, v = RANDOM.normal(0, 5, 50), RANDOM.normal(0, 2, 50)
    assert np.array_equal(evaluate(Modulo(), u, v)["y"], np.mod(u, v))
    assert np.array_equal(evaluate(Modulo(function="rem"), u, v)["y"], np.fmod(u, v))
    assert evaluate(Modulo(), [5.0, -5.0, 6.0], [0.0, 3.0, -3.0])["y"].tolist() == [5.0, 1.0, 0.0]
    assert np.isnan(evaluate(Modulo(function="rem"), 5.0, 0.0)["y"])


def test_a_polynomial_agrees_with_numpy() -> None:
    c = RANDOM.normal(size=6)
    assert evaluate(Polynomial(coefficients=c), U)["y"] == pytest.approx(np.polyval(c, U), rel=1e-15)
    assert evaluate(Polynomial(coefficients=[3.0]), U)["y"].tolist() == np.full((3, 4), 3.0).tolist()


def test_polar_and_cartesian_are_inverse() -> None:
    polar = evaluate(CartesianToPolar(), U, V)
    assert polar["angle"] == pytest.approx(np.arctan2(V, U), rel=1e-15)
    back = evaluate(PolarToCartesian(), polar["r"], polar["angle"])
    assert back["x"] == pytest.approx(U, rel=1e-14)
    assert back["y"] == pytest.approx(V, rel=1e-14)


def test_an_angle_difference_lies_between_minus_pi_and_pi() -> None:
    result = evaluate(AngleDifference(), [3.0, -3.0, np.pi, 0.2], [-3.0, 3.0, 0.0, 0.1])["y"]
    assert result == pytest.approx([6 - 2 * np.pi, 2 * np.pi - 6, -np.pi, 0.1], rel=1e-13)


@pytest.mark.parametrize(
    ("name", "function"),
    [
        ("10^u", lambda u: 10.0**u),
        ("expm1", np.expm1),
        ("log1p", np.log1p),
        ("log2", np.log2),
        ("cbrt", np.cbrt),
        ("cube", lambda u: u**3),
    ],
)
def test_exponentials_and_logarithms_agree_with_numpy(name: str, function: np.ufunc) -> None:
    u = RANDOM.uniform(0.1, 3, 20)
    assert evaluate(MathFunction(function=name), u)["y"] == pytest.approx(function(u), rel=4e-15)


def test_inverse_hyperbolic_functions_agree_with_numpy() -> None:
    u = RANDOM.uniform(0.1, 0.9, 20)
    assert evaluate(Trigonometry(function="asinh"), u)["y"] == pytest.approx(np.arcsinh(u), rel=1e-14)
    assert evaluate(Trigonometry(function="acosh"), u + 1)["y"] == pytest.approx(np.arccosh(u + 1), rel=1e-14)
    assert evaluate(Trigonometry(function="atanh"), u)["y"] == pytest.approx(np.arctanh(u), rel=1e-14)


def test_sums_and_products_of_elements_agree_with_numpy() -> None:
    assert evaluate(SumOfElements(), U)["y"] == pytest.approx(U.sum(), rel=1e-14)
    assert evaluate(ProductOfElements(), U)["y"] == pytest.approx(U.prod(), rel=1e-14)
    assert evaluate(DotProduct(), U[0], V[0])["y"] == pytest.approx(U[0] @ V[0], rel=1e-14)
    assert evaluate(CumulativeSum(), U)["y"] == pytest.approx(np.cumsum(U, axis=0), rel=1e-14)
    assert evaluate(CumulativeSum(), U[0])["y"] == pytest.approx(np.cumsum(U[0]), rel=1e-14)


def test_extrema_give_the_index_of_the_first_of_equal_elements() -> None:
    result = evaluate(Extremum(), [3.0, 1.0, 2.0, 1.0])
    assert (float(result["y"]), float(result["index"])) == (1.0, 2.0)
    result = evaluate(Extremum(function="max"), U)
    assert result["y"] == U.max()
    assert result["index"] == np.argmax(U.ravel(order="F")) + 1


def test_norms_agree_with_numpy() -> None:
    u = U.ravel()
    for name, order in (("2", 2), ("1", 1), ("inf", np.inf)):
        assert evaluate(Norm(norm=name), u)["y"] == pytest.approx(np.linalg.norm(u, order), rel=1e-14)
    for name, order in (("fro", "fro"), ("1", 1), ("inf", np.inf)):
        assert evaluate(Norm(norm=name), U)["y"] == pytest.approx(np.linalg.norm(U, order), rel=1e-14)


def test_operands_of_unsuitable_shape_are_refused() -> None:
    builder = DiagramBuilder("d")
    a, b = builder.add("a", Constant(value=[1, 2])), builder.add("b", Constant(value=[1, 2, 3]))
    builder.add("dot", DotProduct(), a, b)
    with pytest.raises(DiagramError, match=r"'dot'.*the factors have shapes \(2,\) and \(3,\)"):
        builder.build()
    builder = DiagramBuilder("d")
    builder.add("norm", Norm(), builder.add("a", Constant(value=U)))
    with pytest.raises(DiagramError, match=r"the 2-norm of a matrix of shape \(3, 4\) is not supported"):
        builder.build()

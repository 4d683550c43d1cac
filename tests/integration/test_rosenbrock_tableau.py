"""Tableaux of Rosenbrock methods: rejected tableaux, stability, order, and the textbook form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armblocks.errors import InputError
from armblocks.integration.rosenbrock_tableau import RosenbrockTableau, from_textbook
from armblocks.simulation.methods.rosenbrock import IMPLICIT_EULER, RODAS5P, ROS23
from armblocks.simulation.tableaux import TABLEAUX

ROSENBROCK_TABLEAUX = [tableau for tableau in TABLEAUX if isinstance(tableau, RosenbrockTableau)]

every_method = pytest.mark.parametrize(
    "tableau", ROSENBROCK_TABLEAUX, ids=[t.name for t in ROSENBROCK_TABLEAUX]
)


def test_rows_of_the_wrong_length_are_refused() -> None:
    with pytest.raises(InputError, match="'weights' does not fit the 8 stages"):
        replace(RODAS5P, weights=RODAS5P.weights[:7])
    with pytest.raises(InputError, match="'couplings' does not fit the 3 stages"):
        replace(ROS23, couplings=((), (), ()))


def test_a_wrong_coefficient_is_detected_by_the_row_sums() -> None:
    weights = list(RODAS5P.weights)
    weights[3] += 1e-6
    with pytest.raises(InputError, match=r"weights adds up to 1\.0000"):
        replace(RODAS5P, weights=tuple(weights))
    with pytest.raises(InputError, match="row 0 of Gamma adds up to"):
        replace(IMPLICIT_EULER, time_weights=(0.5,))


def stability(tableau: RosenbrockTableau, z: complex) -> complex:
    """``x_new / x`` for ``x' = lambda x`` and ``h = 1``."""
    k: list[complex] = []
    for i in range(tableau.stages):
        state = 1.0 + sum(a * kj for a, kj in zip(tableau.matrix[i], k))
        right = z * state + sum(c * kj for c, kj in zip(tableau.couplings[i], k))
        k.append(right / (1.0 / tableau.gamma - z))
    return 1.0 + sum(b * kj for b, kj in zip(tableau.weights, k))


@every_method
def test_methods_are_l_stable(tableau: RosenbrockTableau) -> None:
    """``|R| <= 1`` on the imaginary axis, thus in the left half-plane (maximum principle); R tends to zero.

    The rounding of the published digits limits the accuracy of both checks.
    """
    for omega in np.concatenate([np.linspace(0.01, 20.0, 500), np.logspace(1.5, 6, 60)]):
        assert abs(stability(tableau, 1j * omega)) <= 1.0 + 1e-9
    assert abs(stability(tableau, -1e8)) < 1e-6


@every_method
def test_stability_function_has_the_order_of_the_exponential(tableau: RosenbrockTableau) -> None:
    """Without the native loop: the error of one step of a linear decay is proportional to h^(order+1)."""
    errors = [abs(stability(tableau, -h) - np.exp(-h)) for h in (0.2, 0.1)]
    assert np.log2(errors[0] / errors[1]) > tableau.order + 0.7


def test_the_textbook_form_of_implicit_euler_gives_its_tableau() -> None:
    tableau = RosenbrockTableau(
        name="euler",
        title="",
        source="",
        order=1,
        dense_order=1,
        **from_textbook(alpha=((),), gamma=((1.0,),), b=(1.0,), dense=((1.0,),)),  # pyright: ignore
    )
    assert tableau.content == IMPLICIT_EULER.content

"""Electric drives compared with matrix exponentials, for fixed and adaptive steps."""

from __future__ import annotations

import numpy as np
import pytest
from running import run
from scipy.linalg import expm

from armblocks.blocks import Constant, DcMotor, MotorWinding
from armblocks.diagram import DiagramBuilder


@pytest.fixture(params=["rk45", "rk4"])
def solver(request: pytest.FixtureRequest) -> str:
    return request.param


def affine(A: np.ndarray, b: np.ndarray, x0: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Solve x' = A x + b from x0 at the times t."""
    n = len(x0)
    both = np.zeros((n + 1, n + 1))
    both[:n, :n], both[:n, n] = A, b
    return np.array([(expm(both * instant) @ [*x0, 1.0])[:n] for instant in t])


def test_a_motor_with_voltage_and_load_agrees_with_the_matrix_exponential(solver: str) -> None:
    motor = DcMotor(
        R=2.0, L=0.1, k=0.3, J=0.02, b=0.01, initial_current=0.5, initial_speed=-2.0, initial_angle=1.0
    )
    builder = DiagramBuilder("d")
    v, load = builder.add("v", Constant(value=12.0)), builder.add("load", Constant(value=0.2))
    builder.add("motor", motor, v, load)
    result = run(builder.build(), 2.0, solver=solver)
    A = np.array([[-20.0, -3.0, 0.0], [15.0, -0.5, 0.0], [0.0, 1.0, 0.0]])
    exact = affine(A, np.array([120.0, -10.0, 0.0]), np.array([0.5, -2.0, 1.0]), result.time)
    # fixed steps equal the sample time, 20 ms; the time constant is 60 ms
    tolerance = 1e-7 if solver == "rk45" else 2e-3
    for column, port in enumerate(("i", "w", "angle")):
        np.testing.assert_allclose(result[f"motor/{port}"], exact[:, column], rtol=0, atol=tolerance)
    np.testing.assert_array_equal(result["motor/torque"], 0.3 * result["motor/i"])


def test_the_electric_power_of_windings_equals_losses_and_mechanical_power(solver: str) -> None:
    """v i = R i^2 + (L i^2 / 2)' + tau w: in steady state the middle term is zero."""
    R, L, k, G = np.array([1.0, 2.0]), np.array([0.1, 0.05]), np.array([0.2, 0.1]), np.array([-60.0, 100.0])
    builder = DiagramBuilder("d")
    v, w = builder.add("v", Constant(value=(24.0, 10.0))), builder.add("w", Constant(value=(-0.5, 0.7)))
    builder.add("motors", MotorWinding(R=R, L=L, k=k, gear_ratio=G, initial_current=1.0), v, w)
    result = run(builder.build(), 2.0, solver=solver)
    rest = (np.array([24.0, 10.0]) - k * G * np.array([-0.5, 0.7])) / R
    exact = rest + (1.0 - rest) * np.exp(-np.outer(result.time, R / L))
    tolerance = 1e-8 if solver == "rk45" else 2e-3
    np.testing.assert_allclose(result["motors/i"], exact, rtol=0, atol=tolerance)
    np.testing.assert_allclose(result["motors/tau"], G * k * result["motors/i"], rtol=1e-14)
    i, tau = result["motors/i"][-1], result["motors/tau"][-1]
    np.testing.assert_allclose(np.array([24.0, 10.0]) * i, R * i**2 + tau * [-0.5, 0.7], rtol=1e-8)

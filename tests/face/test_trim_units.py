"""Operating points do not depend on the units of states, inputs and time."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import armblocks as ab
from armblocks.blocks import Constant, Gain, Integrator, Product, StateSpace, Sum

Array = NDArray[np.float64]

POWERS = 10.0 ** np.arange(-9, 10)


def resonant_circuit(R: float, L: float, C: float) -> ab.Diagram:
    """A voltage of 1 V at a resistor, an inductor and a capacitor in series, with current and charge."""
    builder = ab.DiagramBuilder("circuit")
    voltage = builder.add("voltage", Constant(value=1.0))
    current = builder.add("current", Integrator())
    charge = builder.add("charge", Integrator(), current)
    resistor = builder.add("R", Gain(gain=R), current)
    capacitor = builder.add("C", Gain(gain=1.0 / C), charge)
    inductor = builder.add("sum", Sum(signs="+--"), voltage, resistor, capacitor)
    builder.connect(builder.add("L", Gain(gain=1.0 / L), inductor), current["u"])
    return builder.build()


@pytest.mark.parametrize("L, C", [(1e-3, 1e-6), (1e-6, 1e-10), (1e-6, 1e-12), (1e-9, 1e-15)])
def test_a_charged_capacitor_is_the_operating_point_of_a_circuit(L: float, C: float) -> None:
    result = ab.trim(resonant_circuit(50.0, L, C))
    assert result.point.states["charge/x"] == pytest.approx(C, rel=1e-14)
    assert abs(float(result.point.states["current/x"])) <= 1e-30
    assert result.iterations <= 10


@pytest.mark.parametrize("seed", range(12))
def test_a_linear_system_has_the_same_operating_point_in_all_units(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 5))
    A = rng.integers(-4, 5, size=(n, n)) * (rng.random((n, n)) < 0.7) - 5.0 * np.eye(n)
    B, x0 = rng.integers(-3, 4, size=(n, 1)) * 1.0, rng.integers(-2, 3, size=n) * 1.0
    units, rate, unit_of_input = rng.choice(POWERS, size=n), rng.choice(POWERS), rng.choice(POWERS)
    builder = ab.DiagramBuilder("system")
    u = builder.add("u", Constant(value=float(unit_of_input)))
    block = StateSpace(
        A=rate * A * units[:, None] / units,
        B=rate * B * units[:, None] / unit_of_input,
        C=np.eye(n),
        D=np.zeros((n, 1)),
        initial=x0 * units,
    )
    builder.add("system", block, u)
    found = ab.trim(builder.build()).point.states["system/x"] / units
    assert found == pytest.approx(np.linalg.solve(A, -B[:, 0]), rel=1e-12, abs=1e-13)


@pytest.mark.parametrize("length", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("time", [1e-9, 1.0, 1e9])
def test_a_hardening_spring_has_the_same_deflection_in_all_units(length: float, time: float) -> None:
    # 2 x'' = 3 - x - x^3 with x = length X and t = time T: at rest x + x^3 = 3.
    builder = ab.DiagramBuilder("spring")
    force = builder.add("force", Constant(value=3.0))
    speed = builder.add("speed", Integrator())
    position = builder.add("position", Integrator(), speed)
    linear = builder.add("linear", Gain(gain=length), position)
    cubic = builder.add("cubic", Product(operators="***"), linear, linear, linear)
    total = builder.add("sum", Sum(signs="+--"), force, linear, cubic)
    builder.connect(builder.add("mass", Gain(gain=time**2 / length / 2.0), total), speed["u"])
    states = ab.trim(builder.build()).point.states
    x = float(states["position/x"]) * length
    assert x + x**3 == pytest.approx(3.0, rel=1e-13)
    assert abs(float(states["speed/x"])) * length <= 1e-20

"""Events are found even if no state limits the length of the steps."""

from __future__ import annotations

import math

import numpy as np
import pytest

import armblocks as ab
from armblocks import blocks as bl


def time_above(frequency: float, level: float, stop: float) -> float:
    """Return how long the sine is above a level between 0 and ``stop``."""
    start, end = math.asin(level) / frequency, (math.pi - math.asin(level)) / frequency
    period = 2 * math.pi / frequency
    whole = math.floor(stop / period)
    rest = stop - whole * period
    return whole * (end - start) + float(np.clip(rest - start, 0.0, end - start))


@pytest.mark.parametrize("solver", ["rk45", "dop853", "rodas5p"])
@pytest.mark.parametrize(("frequency", "stop"), [(1.0, 100.0), (7.3, 100.0), (333.3, 20.0)])
def test_crossings_of_a_level_by_a_sine_are_found(solver: str, frequency: float, stop: float) -> None:
    """The only state is the integral of the comparison, with a constant derivative: steps are not limited."""
    builder = ab.DiagramBuilder("level")
    wave = builder.add("wave", bl.SineWave(frequency=frequency))
    above = builder.add("above", bl.CompareToConstant(relation=">", constant=0.5), wave)
    builder.add("total", bl.Integrator(), above)
    result = ab.simulate(builder.build(), stop_time=stop, solver=solver)
    # each of about 2000 crossings has an error of some units in the last place of the time
    assert result["total"][-1] == pytest.approx(time_above(frequency, 0.5, stop), abs=1e-9)


def parabolas() -> list[tuple[float, ...]]:
    """Divisors, heights, centres and curvatures of parabolas; the first six are regression cases."""
    random = np.random.default_rng(5)
    cases = [
        (-0.7973742649797251, 0.030320733805284217, 1.5323485590083694, 6.480506838230336),
        (-0.09921919980310555, 0.10288181247854467, 1.1894898207919582, 0.19703604271943814),
        (-0.0036077546362273116, -0.7575617145201816, 0.4001330068250857, 3.4999027934506985),
        (0.005758089407675042, 0.19581724934058342, 0.6688284592757979, 0.9122797088431766),
        (0.0441797832474304, 0.7069000028077768, 0.9099853672028844, 0.4871255173681361),
        (-0.030104779158902036, 0.5747949613374372, 0.9369983603286496, 24.838425930615983),
    ]
    for _ in range(60):
        divisor = random.choice([-1.0, 1.0]) * 10.0 ** random.uniform(-2.0, 0.0)
        height, centre = random.uniform(-1.0, 1.0), random.uniform(0.2, 1.8)
        cases.append((divisor, height, centre, 10.0 ** random.uniform(-1.0, 1.0)))
    return cases


def test_jumps_just_before_the_event_of_a_step_are_found() -> None:
    """The remainder of a parabola: one step may contain three of its jumps near the vertex."""
    builder = ab.DiagramBuilder("parabola")
    formula = bl.Expression(formula="h - c*(u - b)^2", names="h, b, c", values=[0.0, 1.0, 1.0])
    parabola = builder.add("parabola", formula, builder.add("t", bl.Clock()))
    divisor = builder.add("divisor", bl.Constant(value=1.0))
    builder.add("rest", bl.Modulo(), parabola, divisor)
    builder.add("total", bl.Integrator(), divisor)
    diagram = builder.build()
    for divisor_value, *values in parabolas():
        tuned = {"parabola.values": values, "divisor.value": divisor_value}
        result = ab.simulate(diagram, stop_time=2.0, sample_time=5e-4, parameters=tuned)
        expected = np.mod(result["parabola"], divisor_value)
        differs = np.abs(result["rest"] - expected) > 1e-8
        # In a row at the time of an event rounding decides between 0 and the divisor.
        assert not (differs[1:] & differs[:-1]).any(), (divisor_value, values)


def integrating(initial: float) -> ab.Diagram:
    """A subsystem with an integrator."""
    inner = ab.DiagramBuilder("integrating")
    inner.output("x", inner.add("integral", bl.Integrator(initial=initial), inner.input("rate")))
    return inner.build()


def test_alternating_action_subsystems_and_their_merge_agree_with_closed_forms() -> None:
    """While sin(pi t) > 1/2 one integrates 1 and keeps its state; otherwise one integrates -2 from 0.5."""
    builder = ab.DiagramBuilder("actions")
    wave = builder.add("wave", bl.SineWave(frequency=math.pi))
    choice = builder.add("choice", bl.If(expressions="u > 0.5"), wave)
    up, down = builder.add("up", bl.Constant(value=1.0)), builder.add("down", bl.Constant(value=-2.0))
    first = builder.add("first", bl.ActionSubsystem(diagram=integrating(0.5)), up, action=choice["if1"])
    second = builder.add(
        "second",
        bl.ActionSubsystem(diagram=integrating(0.5), states_when_resuming="reset"),
        down,
        action=choice["else"],
    )
    builder.add("y", bl.Merge(inputs=2), first, second)
    result = ab.simulate(builder.build(), stop_time=4.0, sample_time=0.05, rtol=1e-9)
    t = result.time
    within = ((t > 1 / 6) & (t < 5 / 6)) | ((t > 13 / 6) & (t < 17 / 6))
    first_output = 0.5 + np.clip(t - 1 / 6, 0.0, 2 / 3) + np.clip(t - 13 / 6, 0.0, 2 / 3)
    begun = np.where(t > 17 / 6, 17 / 6, np.where(t > 5 / 6, 5 / 6, 0.0))
    np.testing.assert_allclose(result["y"], np.where(within, first_output, 0.5 - 2 * (t - begun)), atol=1e-9)

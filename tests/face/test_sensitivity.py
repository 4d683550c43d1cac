"""Derivatives of runs by parameters, against closed forms and differences of runs."""

from __future__ import annotations

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import (
    Constant,
    Expression,
    FromFile,
    Gain,
    Integrator,
    ResettableIntegrator,
    Saturation,
    SineWave,
    Step,
    Sum,
    ZeroOrderHold,
)
from armblocks.errors import InputError, UnknownNameError

TIGHT = {"rtol": 1e-10, "atol": 1e-12, "stop_time": 3.0, "sample_time": 0.1}


def decay() -> ab.Diagram:
    """x' = -k x, x(0) = a."""
    builder = ab.DiagramBuilder("decay")
    state = builder.add("x", Integrator(initial=2.0))
    builder.connect(builder.add("k", Gain(gain=-0.7), state), state["u"])
    return builder.build()


def test_a_decay_follows_its_rate_and_its_start_as_the_closed_form() -> None:
    for solver in ({}, {"solver": "rk4", "step": 0.001}):
        result = ab.sensitivity(decay(), ["k.gain", "x.initial"], "x", **{**TIGHT, **solver})
        t = result.time
        assert np.allclose(result["x", "k.gain"], 2.0 * t * np.exp(-0.7 * t), atol=1e-9)
        assert np.allclose(result["x", "x.initial"], np.exp(-0.7 * t), atol=1e-9)


def differences(diagram: ab.Diagram, parameter: str, output: str, step: float = 1e-5) -> np.ndarray:
    """Central differences of two runs."""
    block, _, name = parameter.rpartition(".")
    middle = float(diagram.blocks[block].parameter_value(name))  # type: ignore[arg-type]
    runs = [
        ab.simulate(diagram, parameters={parameter: middle + sign * step}, **TIGHT)[output]
        for sign in (1, -1)
    ]
    return (runs[0] - runs[1]) / (2.0 * step)


def sampled() -> ab.Diagram:
    builder = ab.DiagramBuilder("sampled")
    wanted = builder.add("wanted", Constant(value=1.0))
    error = builder.add("error", Sum(signs="+-"), wanted)
    held = builder.add("hold", ZeroOrderHold(sample_time=0.25), builder.add("gain", Gain(gain=2.0), error))
    rate = builder.add("rate", Sum(signs="+-"), held)
    state = builder.add("x", Integrator(), rate)
    builder.connect(state, rate["u2"])
    builder.connect(state, error["u2"])
    return builder.build()


def implicit() -> ab.Diagram:
    builder = ab.DiagramBuilder("implicit")
    state = builder.add("x", Integrator(initial=0.7))
    total = builder.add("sum", Sum(signs="+-"), state)
    builder.connect(
        builder.add("cube", Expression(formula="k*u^3", names="k", values=1.5), total), total["u2"]
    )
    builder.connect(builder.add("gain", Gain(gain=-1.0), total), state["u"])
    return builder.build()


def limited() -> ab.Diagram:
    """A gain behind a sine that is cut, into an integrator."""
    builder = ab.DiagramBuilder("limited")
    wave = builder.add("wave", SineWave(frequency=3.0, amplitude=2.0))
    gain = builder.add("gain", Gain(gain=1.3), wave)
    builder.add("x", Integrator(), builder.add("limit", Saturation(lower=-1.0, upper=1.5), gain))
    return builder.build()


@pytest.mark.parametrize(
    ("make", "parameter"),
    [(sampled, "gain.gain"), (implicit, "cube.values"), (limited, "gain.gain"), (limited, "limit.upper")],
)
def test_sensitivities_are_the_differences_of_runs(make: object, parameter: str) -> None:
    diagram = make()  # type: ignore[operator]
    result = ab.sensitivity(diagram, parameter, "x", **TIGHT)
    # h^2 of the differences, and the tolerance of the runs over h.
    assert np.allclose(result["x", parameter], differences(diagram, parameter, "x"), atol=2e-5)
    assert np.abs(result["x", parameter]).max() > 1e-2


def test_a_reset_comes_earlier_where_its_trigger_rises_faster() -> None:
    """x' = 2, set to 0 when y = a t reaches 1, at 1 / a: then x = 2 (t - 1 / a), dx/da = 2 / a^2."""
    builder = ab.DiagramBuilder("reset")
    rate = builder.add("a", Constant(value=0.8))
    ramp = builder.add("y", Integrator(), rate)
    trigger = builder.add("trigger", Sum(signs="+-"), ramp, builder.add("one", Constant(value=1.0)))
    two = builder.add("two", Constant(value=2.0))
    builder.add("x", ResettableIntegrator(external_reset="rising"), two, trigger)
    result = ab.sensitivity(builder.build(), "a.value", "x", **TIGHT)
    after = result.time > 1.25 + 1e-9
    assert np.allclose(result.run["x"][after], 2.0 * (result.time[after] - 1.25), atol=1e-9)
    assert np.allclose(result["x", "a.value"][after], 2.0 / 0.8**2, atol=1e-8)
    assert np.allclose(result["x", "a.value"][~after & (result.time < 1.2)], 0.0, atol=1e-12)


def test_a_jump_at_a_known_time_moves_no_event() -> None:
    """A step makes a limiter switch: the instant is the step's, whatever the gain is."""
    builder = ab.DiagramBuilder("known")
    gain = builder.add("gain", Gain(gain=3.0), builder.add("step", Step(time=1.0)))
    builder.add("x", Integrator(), builder.add("limit", Saturation(lower=-1.0, upper=1.5), gain))
    result = ab.sensitivity(builder.build(), ["gain.gain", "limit.upper"], "x", **TIGHT)
    assert np.allclose(result["x", "gain.gain"], 0.0, atol=1e-12)
    assert np.allclose(result["x", "limit.upper"], np.maximum(result.time - 1.0, 0.0), atol=1e-9)


def test_events_and_implicit_equations_together_are_refused() -> None:
    builder = ab.DiagramBuilder("both")
    state = builder.add("x", Integrator(initial=0.7))
    total = builder.add("sum", Sum(signs="+-"), state)
    builder.connect(builder.add("cube", Expression(formula="u^3"), total), total["u2"])
    limit = builder.add("limit", Saturation(), builder.add("gain", Gain(gain=-1.0), total))
    builder.connect(limit, state["u"])
    with pytest.raises(InputError, match="sensitivities of diagrams with one or the other"):
        ab.sensitivity(builder.build(), "gain.gain", "x")


def test_what_cannot_be_differentiated_is_refused() -> None:
    with pytest.raises(UnknownNameError, match=r"there is no tunable parameter named 'k.gian'"):
        ab.sensitivity(decay(), "k.gian", "x")
    with pytest.raises(UnknownNameError, match="there is no signal named 'y'"):
        ab.sensitivity(decay(), "k.gain", "y")
    with pytest.raises(InputError, match="0 parameters and 1 outputs are given"):
        ab.sensitivity(decay(), [], "x")
    builder = ab.DiagramBuilder("step")
    builder.add("x", Integrator(), builder.add("step", Step(time=1.0)))
    with pytest.raises(InputError, match=r"the parameter 'step.time' says when a signal jumps"):
        ab.sensitivity(builder.build(), "step.time", "x")
    result = ab.sensitivity(decay(), "k.gain", "x", **TIGHT)
    with pytest.raises(UnknownNameError, match="there is no parameter named 'k'"):
        _ = result["x", "k"]


def test_a_table_that_is_read_by_index_is_refused_and_all_else_beside_it_is_right() -> None:
    builder = ab.DiagramBuilder("table", settings=ab.SimulationOptions(stop_time=2.0, sample_time=0.5))
    table = builder.add("table", FromFile(data=((0.0, 1.0), (1.0, 3.0), (2.0, -1.0))))
    builder.add("sum", Integrator(), builder.add("gain", Gain(gain=2.0), table))
    diagram = builder.build()
    with pytest.raises(InputError, match=r"'table\.data' is a table that is read by index"):
        ab.sensitivity(diagram, "table.data", "sum")
    found = ab.sensitivity(diagram, ["gain.gain"], ["sum"])
    # d/dk of k times the integral of the table is that integral: 0, 0.75, 2, 3, 3 at the half seconds
    assert found["sum", "gain.gain"] == pytest.approx([0.0, 0.75, 2.0, 3.0, 3.0], rel=1e-5, abs=1e-6)

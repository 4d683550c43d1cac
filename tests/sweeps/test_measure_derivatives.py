"""Derivatives of measures: against differences of runs, also at jumps whose times depend on parameters."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

import armblocks as ab
from armblocks.blocks import CompareToConstant, Gain, Integrator, Step, StopSimulation, Sum, TransportDelay
from armblocks.errors import InputError, SimulationError
from armblocks.face.measured_run import Chain, MeasuredRun
from armblocks.face.model import CompiledDiagram
from armblocks.sweeps.measure_derivatives import (
    EXTREMES,
    SMOOTH,
    Dual,
    largest_of_parts,
    measure_with_derivatives,
)
from armblocks.sweeps.measure_routines import ROUTINES
from armblocks.sweeps.quantities import RunMeasure

EXACT = {"rtol": 1e-10, "atol": 1e-12}


def moving_step() -> ab.Diagram:
    """``x' = k² u - x`` with a step whose time is a parameter, and the mask parameter ``k``."""
    builder = ab.DiagramBuilder("moving step")
    builder.parameter("k", 1.5)
    u = builder.add("u", Step(time=0.503, final=2.0))
    e = builder.add("e", Sum(signs="+-"), builder.add("g", Gain(gain=ab.formula("k^2")), u))
    x = builder.add("x", Integrator(initial=0.3), e)
    builder.connect(x, e["u2"])
    return builder.build()


def delayed() -> ab.Diagram:
    """``x' = u(t - delay) - x``."""
    builder = ab.DiagramBuilder("delayed")
    u = builder.add("u", Step(time=0.503, final=2.0))
    e = builder.add("e", Sum(signs="+-"), builder.add("d", TransportDelay(delay=0.31), u))
    x = builder.add("x", Integrator(initial=0.3), e)
    builder.connect(x, e["u2"])
    return builder.build()


def compare(
    diagram: ab.Diagram, parameters: dict[str, float], texts: list[str], rtol: float, **settings: float
) -> None:
    """Compare values with a sweep, and derivatives with central differences of a sweep."""
    model = CompiledDiagram(diagram)
    measures = [ab.Measure.parse(text) for text in texts]
    chain = Chain(model, list(parameters), "test")
    options = ab.SimulationOptions(**EXACT, **settings)  # pyright: ignore[reportArgumentType]
    run = MeasuredRun(model, chain.entries, measures, options)
    series = run.series(run.run(model.compiled.parameter_values), chain.derivatives(diagram, "test"))
    step = 1e-5
    rows = [
        {other: value + sign * step * (other == name) for other, value in parameters.items()}
        for name in parameters
        for sign in (1.0, -1.0, 0.0)
    ]
    table = ab.sweep(model, rows, measures=dict(zip(texts, texts)), **EXACT, **settings)  # pyright: ignore[reportArgumentType]
    for measure, text, (t, y) in zip(measures, texts, series):
        found = measure_with_derivatives(measure.kind, measure.values, t, y)
        column = table[text].reshape(-1, 3)
        differences = (column[:, 0] - column[:, 1]) / (2.0 * step)
        assert_allclose(float(found.v), column[0, 2], rtol=1e-6, err_msg=text)
        assert_allclose(found.d, differences, rtol=rtol, atol=rtol * (1.0 + abs(column[0, 2])), err_msg=text)


def test_smooth_measures_have_the_derivatives_of_the_sampled_measures() -> None:
    signal = "x1/y"
    texts = ["itae({reference/y} - {x1/y})", "integral({x1/y}*t)", "settling_time(x1/y, final=0.1, band=3)"]
    texts += ["crossing_time(x1/y, level=0.5)", "time_outside(x1/y, low=-0.5, high=0.5)"]
    texts += [f"overshoot({signal}, final=1)", f"undershoot({signal}, final=1)", "iae(x1/y, reference=0.2)"]
    texts += [f"{kind}({signal})" for kind in ("peak", "maximum", "minimum", "mean", "final", "ise", "rms")]
    start = {"PID.P": 2.0, "PID.D": 0.0, "x1.initial": 1.0}
    diagram = ab.load_diagram("van_der_pol_pid")
    compare(diagram, start, texts, 1e-5, stop_time=8.0, sample_time=0.02)


def test_jumps_at_moving_times_have_exact_derivatives() -> None:
    texts = ["integral(e/y)", "iae(e/y, reference=1)", "itae(e/y)", "rms(e/y)", "peak(e/y)", "final(x)"]
    texts += ["time_outside(e/y, low=-0.5, high=2)", "crossing_time(e/y, level=2)", "integral({e/y}^2 + t)"]
    start = {"u.time": 0.503, "k": 1.5, "u.final": 2.0}
    compare(moving_step(), start, texts, 1e-6, stop_time=2.0, sample_time=0.01)
    texts = ["integral(ball/x)", "iae(ball/dx)", "rms(ball/dx)", "peak(ball/dx)", "minimum(ball/dx)"]
    texts += ["integral({ball/dx}^2*{ball/x})", "time_outside(ball/dx, low=-3, high=3)"]
    ball = {"ball.initial": 1.0, "bounce.gain": -0.8, "gravity.value": -9.81}
    diagram = ab.load_diagram("bouncing_ball")
    ball = {name: float(CompiledDiagram(diagram).simulate().parameters[name]) for name in ball}
    compare(diagram, ball, texts, 1e-5, stop_time=2.5, sample_time=0.01)


def test_delays_have_derivatives_up_to_the_interpolation() -> None:
    texts = ["integral(e/y)", "ise(e/y)", "final(x)", "rms(x)", "integral({e/y}*{x/y})"]
    compare(delayed(), {"d.delay": 0.31, "u.time": 0.503}, texts, 2e-3, stop_time=2.0, sample_time=0.002)


def test_derivatives_of_rows_agree_with_differences_of_the_native_measures() -> None:
    """All kinds on random rows with a jump: values are equal, derivatives those of differences."""
    generator = np.random.default_rng(3)
    options = {"overshoot": (0.4,), "undershoot": (0.4,), "rise_time": (1.0,), "settling_time": (0.3, 6.0)}
    options |= {"crossing_time": (0.25, 1.0), "time_outside": (-0.2, 0.6)}
    options |= dict.fromkeys(("iae", "ise", "itae"), (0.2,))
    assert {*EXTREMES, *SMOOTH} == set(ROUTINES)
    for kind in ROUTINES:
        t = np.sort(generator.uniform(0.0, 4.0, 40))
        t[20] = t[19]
        y = np.sin(3.0 * t) + 0.05 * generator.normal(size=40)
        dt, dy = generator.normal(size=(2, 40, 3))
        dt[20] = dt[19]
        chosen = options.get(kind, ())
        measure = RunMeasure(kind=kind, options=chosen)
        found = measure_with_derivatives(kind, chosen, Dual(t, dt), Dual(y, dy))
        assert_allclose(float(found.v), measure.of(t, y), rtol=1e-12, err_msg=kind)
        h = 1e-7
        for k in range(3):
            ends = [measure.of(t + s * h * dt[:, k], y + s * h * dy[:, k]) for s in (1.0, -1.0)]
            assert_allclose(found.d[k], (ends[0] - ends[1]) / (2.0 * h), rtol=1e-5, atol=1e-6, err_msg=kind)
        if kind in EXTREMES:
            parts = largest_of_parts(kind, chosen, Dual(t, dt), Dual(y, dy), np.linspace(t[0], t[-1], 8))
            assert parts is not None and parts[0].v.shape == (7,) and parts[0].d.shape == (7, 3)
            sign = -1.0 if kind == "minimum" else 1.0
            assert_allclose(sign * max(parts[0].v.max(), parts[1]), found.v, rtol=1e-12)


def test_measures_and_parameters_without_derivatives_are_refused() -> None:
    model = CompiledDiagram(moving_step())
    with pytest.raises(InputError, match="is an integer, which has no derivative"):
        MeasuredRun(model, ["u.time"], [ab.Measure("events")], ab.SimulationOptions())
    with pytest.raises(InputError, match="is a constant of the equations"):
        Chain(CompiledDiagram(ab.load_diagram("dc_motor_sampled_pid")), ["controller.sample_time"], "test")
    builder = ab.DiagramBuilder("stops")
    x = builder.add("x", Integrator(initial=0.0), builder.add("u", Step(time=0.0)))
    builder.add("stop", StopSimulation(), builder.add("c", CompareToConstant(constant=0.5, relation=">="), x))
    model = CompiledDiagram(builder.build())
    run = MeasuredRun(model, ["u.final"], [ab.Measure("final", "x")], ab.SimulationOptions(stop_time=1.0))
    with pytest.raises(SimulationError, match="the run ended at"):
        run.run(model.compiled.parameter_values)

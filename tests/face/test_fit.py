"""``ab.fit``: parameters of diagrams from measured signals, against closed forms and finite differences."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

import armblocks as ab
from armblocks.blocks import (
    Constant,
    Expression,
    FromFile,
    Gain,
    Inport,
    Integrator,
    Outport,
    Saturation,
    SineWave,
    Step,
    Subsystem,
    Sum,
    TransportDelay,
)
from armblocks.errors import InputError, UnknownNameError

TRUE = {"k": 3.0, "rate.gain": 2.0, "x.initial": 0.5}


def first_order(source: Any = None) -> ab.Diagram:
    """Return ``x' = rate (k u - x)`` with the unit step as input."""
    builder = ab.DiagramBuilder("first order")
    builder.parameter("k", 1.0, minimum=0.0)
    u = builder.add("source", source or Step(time=0.0))
    difference = builder.add("difference", Sum(signs="+-"), builder.add("g", Gain(gain=ab.formula("k")), u))
    x = builder.add("x", Integrator(initial=0.0), builder.add("rate", Gain(gain=1.0), difference))
    builder.connect(x, difference["u2"])
    return builder.build()


def response(t: np.ndarray, k: float = 3.0, rate: float = 2.0, x0: float = 0.5) -> np.ndarray:
    return k + (x0 - k) * np.exp(-rate * t)


def measurement(noise: float = 0.02, seed: int = 1, count: int = 200) -> dict[str, np.ndarray]:
    random = np.random.default_rng(seed)
    t = np.sort(random.uniform(0.0, 3.0, count))  # not equally spaced
    return {"t": t, "x": response(t) + noise * random.normal(size=count)}


def closed_form_covariance(t: np.ndarray, noise: float) -> np.ndarray:
    e = np.exp(-2.0 * t)
    J = np.column_stack([1.0 - e, -t * (0.5 - 3.0) * e, e])
    return noise**2 * np.linalg.inv(J.T @ J)


def test_mask_parameters_in_one_formula_are_fitted_together() -> None:
    """Exact data of ``a b``, ``a + b^2`` and, in a subsystem with ``x = 2 a``, ``x y``, for 2, 3 and 4."""
    inner = ab.DiagramBuilder("servo")
    inner.parameter("x", 1.0)
    inner.parameter("y", 1.0)
    product = inner.add("product", Gain(gain=ab.formula("x*y")), inner.add("in", Inport()))
    inner.add("out", Outport(), product)
    builder = ab.DiagramBuilder("products")
    builder.parameter("a", 1.0)
    builder.parameter("b", 1.0)
    one = builder.add("one", Constant(value=1.0))
    for name, text in (("g", "a*b"), ("h", "a + b^2")):
        builder.add(name, Gain(gain=ab.formula(text)), one)
    builder.add("servo", Subsystem(diagram=inner.build()).with_parameters(x=ab.formula("2*a")), one)
    t = np.linspace(0.0, 1.0, 5)
    data = {"t": t} | {"g/y": np.full(5, 6.0), "h/y": np.full(5, 11.0), "servo/out": np.full(5, 16.0)}
    result = ab.fit(builder.build(), ["a", "b", "servo.y"], data)
    assert_allclose(result.values, [2.0, 3.0, 4.0], rtol=1e-6)
    run = ab.simulate(result.diagram, stop_time=1.0)
    for name in ("g/y", "h/y", "servo/out"):
        assert_allclose(run[name][-1], data[name][-1], rtol=1e-6)


def test_a_step_response_gives_gain_rate_and_start_with_their_covariance() -> None:
    data = measurement()
    result = ab.fit(first_order(), list(TRUE), data)
    errors = result.standard_errors
    assert (np.abs(result.values - list(TRUE.values())) < 3.0 * errors).all()
    assert_allclose(result.covariance, closed_form_covariance(data["t"], 0.02), rtol=0.3)
    known = ab.fit(first_order(), list(TRUE), data, noise={"x": 0.02})
    assert_allclose(known.covariance, closed_form_covariance(data["t"], 0.02), rtol=0.1, atol=1e-7)
    assert_allclose(known.values, result.values, rtol=1e-5)
    assert result["k"] == result.values[0] and result.degrees_of_freedom == 197
    assert_allclose(result.signals[0].noise, 0.02, rtol=0.2)  # standard error 5 %
    assert result.signals[0].explained > 90.0
    assert not result.findings and not result.stopped and "converged" in result.message
    run = ab.simulate(result.diagram, stop_time=1.0)
    assert_allclose(run["x"][-1], response(np.array([1.0]), *result.values)[0], rtol=1e-4)
    text = str(result)
    assert "rate.gain" in text and "upper 95 %" in text and "condition number" in text
    assert_allclose(np.diag(result.correlation), 1.0)


def test_as_many_values_as_parameters_have_standard_errors_only_with_known_noise() -> None:
    t = np.array([0.3, 0.9, 2.0])
    data = {"t": t, "x": response(t) + np.array([0.02, -0.01, 0.01])}
    unknown = ab.fit(first_order(), list(TRUE), data)
    assert np.isinf(unknown.standard_errors).all() and np.isinf(unknown.confidence_intervals()).all()
    assert "the standard errors are unknown" in str(unknown) and not unknown.not_identified
    known = ab.fit(first_order(), list(TRUE), data, noise={"x": 0.02})
    assert_allclose(known.covariance, closed_form_covariance(t, 0.02), rtol=0.3)


def test_the_derivatives_are_those_of_finite_differences_of_the_closed_form() -> None:
    exact = {"t": np.linspace(0.0, 3.0, 50), "x": response(np.linspace(0.0, 3.0, 50))}
    result = ab.fit(first_order(), list(TRUE), exact, rtol=1e-9, atol=1e-11)
    assert_allclose(result.values, list(TRUE.values()), rtol=1e-7)
    assert np.abs(result.signals[0].residuals).max() < 1e-7


def test_intervals_of_95_percent_contain_the_parameters() -> None:
    inside = []
    diagram = first_order()
    for seed in range(30):
        low, high = ab.fit(diagram, list(TRUE), measurement(0.05, seed, 40)).confidence_intervals().T
        inside.append((low < list(TRUE.values())) & (list(TRUE.values()) < high))
    assert np.mean(inside) > 0.87  # 90 numbers, correlated


def test_several_experiments_with_their_own_inputs_and_start_values() -> None:
    t = np.linspace(0.0, 2.0, 60)
    diagram = first_order(FromFile(data=[[0.0, 0.0], [3.0, 0.0]]))
    experiments = []
    for size, x0 in ((1.0, 0.5), (2.0, -1.0)):
        table = np.array([[0.0, size], [3.0, size]])
        data = {"time": t, "x": response(t, 3.0 * size, 2.0, x0)}
        experiments.append(ab.Experiment(data=data, parameters={"source.data": table, "x.initial": x0}))
    result = ab.fit(diagram, ["k", "rate.gain"], experiments)
    assert_allclose(result.values, [3.0, 2.0], rtol=1e-4)
    assert [signal.experiment for signal in result.signals] == [1, 2] and "x/y (2)" in str(result)
    assert result.picture().height > 100
    with pytest.raises(InputError, match="experiment 1 has the fitted parameter"):
        ab.fit(diagram, "x.initial", experiments)


def test_pictures_show_signals_that_were_not_measured_in_all_experiments() -> None:
    builder = ab.DiagramBuilder("two")
    u = builder.add("g", Gain(gain=1.0), builder.add("u", Step(time=0.0)))
    builder.add("x", Integrator(), u)
    builder.add("z", Integrator(initial=1.0), u)
    t = np.linspace(0.0, 1.0, 20)
    experiments = [{"t": t, "x": 2.0 * t}, {"t": 2.0 * t, "z": 1.0 + 4.0 * t}]
    result = ab.fit(builder.build(), "g.gain", experiments)
    one = ab.fit(builder.build(), "g.gain", experiments[:1])
    assert [signal.name for signal in result.signals] == ["x/y", "z/y"]
    assert result.picture().height > 1.5 * one.picture().height
    values = result._series("z/y", "fitted")
    assert len(values) == 40 and np.isnan(values[:20]).all()
    assert_allclose(values[20:], 1.0 + 4.0 * t, atol=1e-6)


def test_missing_values_entries_and_units() -> None:
    builder = ab.DiagramBuilder("two")
    both = builder.add("both", Gain(gain=[1.0, 1.0]), builder.add("wave", SineWave(frequency=2.0)))
    builder.add("x", Integrator(initial=[0.0, 0.0]), both)
    t = np.linspace(0.0, 3.0, 80)
    exact = np.column_stack([a * (1.0 - np.cos(2.0 * t)) / 2.0 for a in (1.5, -4.0)])
    random = np.random.default_rng(2)
    noisy = exact + random.normal(size=exact.shape) * (0.01, 0.3)
    noisy[10:30, 0] = np.nan
    elements = {"x[0]": 0.01, "x[1]": 0.3}
    known = ab.fit(builder.build(), "both.gain", {"t": t, "x": noisy}, noise=elements)
    assert [signal.noise for signal in known.signals] == [0.01, 0.3]
    result = ab.fit(builder.build(), "both.gain", {"t": t, "x": noisy})
    assert result.parameters == ("both.gain[0]", "both.gain[1]")
    assert (np.abs(result.values - (1.5, -4.0)) < 3.5 * result.standard_errors).all()
    assert_allclose([signal.noise for signal in result.signals], [0.01, 0.3], rtol=0.3)
    assert result.degrees_of_freedom == 2 * 80 - 20 - 2
    one = ab.fit(builder.build(), "both.gain[1]", {"t": t, "x[1]": noisy[:, 1]})
    assert one.parameters == ("both.gain[1]",) and one.diagram.blocks["both"].gain[0] == 1.0
    assert_allclose(one.values, result.values[1:], rtol=1e-3)


def test_both_sides_of_a_jump_of_a_measured_signal() -> None:
    diagram = first_order(Step(time=1.0))
    builder = ab.DiagramBuilder("jump")
    builder.add("g", Gain(gain=1.0), builder.add("step", Step(time=1.0)))
    t = np.array([0.0, 0.5, 1.0, 1.0, 1.5])
    result = ab.fit(builder.build(), "g.gain", {"t": t, "g": [0.0, 0.0, 0.0, 4.0, 4.0]})
    assert_allclose(result.values, 4.0, rtol=1e-9)
    assert_allclose(result.signals[0].fitted, [0.0, 0.0, 0.0, 4.0, 4.0], atol=1e-9)
    # The minimum of the mask parameter is a bound.
    limited = ab.fit(diagram, "k", {"t": t, "x": np.zeros(5)})
    assert limited.bounds.tolist() == [[0.0, np.inf]] and 0.0 <= limited["k"] < 1e-2


def test_parameters_that_have_no_effect_or_only_together_are_named() -> None:
    data = measurement()
    builder = ab.DiagramBuilder("product")
    first = builder.add("a", Gain(gain=1.0), builder.add("step", Step(time=0.0)))
    builder.add("y", Gain(gain=1.0), first)
    builder.add("idle", Gain(gain=1.0), first)
    result = ab.fit(
        builder.build(), ["a.gain", "y.gain", "idle.gain"], {"t": data["t"], "y": 6.0 + 0 * data["t"]}
    )
    assert set(result.not_identified) == {"a.gain", "y.gain", "idle.gain"}
    assert_allclose(result["a.gain"] * result["y.gain"], 6.0, rtol=1e-6)
    assert result["idle.gain"] == 1.0
    assert "not identified, because the signals do not depend on them" in str(result)
    assert np.isnan(result.standard_errors).all()


def test_parameters_without_exact_derivatives_use_differences_of_runs() -> None:
    builder = ab.DiagramBuilder("limited")
    wave = builder.add("wave", SineWave(frequency=2.0))
    table = builder.add("source", FromFile(data=np.column_stack([np.linspace(0, 3, 40)] * 2)))
    total = builder.add("sum", Sum(), builder.add("limit", Saturation(upper=0.4, lower=-2.0), wave), table)
    builder.add("x", Integrator(), total)
    diagram = builder.build()
    true = ab.simulate(diagram, parameters={"limit.upper": 0.6}, stop_time=3.0, sample_time=0.05)
    data = {"t": true.time, "x": true["x"]}
    exact = ab.fit(diagram, "limit.upper", data)
    assert_allclose(exact.values, 0.6, rtol=1e-4)
    assert not exact.differences
    # Delays together with an implicit equation have no exact derivatives.
    builder = ab.DiagramBuilder("implicit")
    delayed = builder.add("delay", TransportDelay(delay=0.3), builder.add("wave", SineWave(frequency=2.0)))
    total = builder.add("sum", Sum(signs="++"), delayed)
    builder.connect(builder.add("law", Expression(formula="0.5*sin(u) + 0.1*u"), total), total["u2"])
    builder.add("x", Integrator(), builder.add("k", Gain(gain=1.0), total))
    implicit = builder.build()
    true = ab.simulate(implicit, parameters={"k.gain": 3.0}, stop_time=3.0, sample_time=0.1)
    result = ab.fit(implicit, ["k.gain", "x.initial"], {"t": true.time, "x": true["x"]})
    assert_allclose(result.values, [3.0, 0.0], atol=1e-5)
    assert set(result.differences) == {"k.gain", "x.initial"}
    assert "k.gain by differences of runs: the delayed signals and the implicit equation" in str(result)


def test_files_frames_settings_and_pickles(tmp_path: Path) -> None:
    data = measurement()
    path = tmp_path / "log.csv"
    table = np.column_stack([data["t"], data["x"], data["t"]])
    np.savetxt(path, table, delimiter=",", header="time [s],x,temperature", comments="", fmt="%.17g")
    expected = ab.fit(first_order(), list(TRUE), data)
    result = ab.fit(first_order(), list(TRUE), path)
    assert_allclose(result.values, expected.values, rtol=1e-6)
    assert "columns that are not signals: temperature" in str(result)
    pandas = pytest.importorskip("pandas")
    frame = ab.fit(first_order(), list(TRUE), pandas.DataFrame(data))
    assert_allclose(frame.values, expected.values, rtol=1e-9)
    copy = pickle.loads(pickle.dumps(result))
    assert str(copy) == str(result) and copy.diagram == result.diagram
    result.plot(save=tmp_path / "fit.svg")
    assert "measured" in (tmp_path / "fit.svg").read_text()
    fixed = ab.fit(first_order(), ["k"], data, values={"rate.gain": 2.0, "x.initial": 0.5}, start={"k": 2.0})
    assert_allclose(fixed.values, 3.0, atol=0.02)
    assert fixed.start[0] == 2.0
    bounded = ab.fit(first_order(), ["k", "rate.gain", "x.initial"], data, bounds={"k": (0.0, 2.5)})
    assert bounded.at_bounds == ("k",) and "at a bound: k" in str(bounded)


def test_the_search_can_be_watched_limited_and_stopped() -> None:
    data = measurement()
    seen: list[float] = []
    ab.fit(first_order(), list(TRUE), data, progress=lambda count, squares: seen.append(squares))
    assert len(seen) > 3 and min(seen) == pytest.approx(seen[-1], rel=0.5)
    short = ab.fit(first_order(), list(TRUE), data, evaluations=2)
    assert short.stopped and "the number of evaluations is reached" in str(short)

    def interrupt(count: int, squares: float) -> None:
        if count == 3:
            raise KeyboardInterrupt

    stopped = ab.fit(first_order(), list(TRUE), data, progress=interrupt)
    assert stopped.stopped and "stopped by Ctrl-C" in str(stopped)
    assert stopped.signals[0].explained > short.signals[0].explained - 50.0


def test_unsuitable_arguments_are_refused() -> None:
    data = measurement()
    t = data["t"]
    cases: list[tuple[type[Exception], str, tuple[Any, Any], dict[str, Any]]] = [
        (UnknownNameError, "no parameter named 'rate.gian'", ("rate.gian", data), {}),
        (UnknownNameError, "no entry named", ("rate.gain[3]", data), {}),
        (InputError, "the parameter 'k' is named twice", (["k", "k"], data), {}),
        (InputError, "no parameter is named", ((), data), {}),
        (InputError, "an integer number of evaluations", ("k", data), {"evaluations": 2.5}),
        (InputError, "there is no experiment", ("k", []), {}),
        (UnknownNameError, "no signal named 'z'", ("k", {"t": t, "z": t}), {}),
        (
            InputError,
            "the columns 'x' and 'x/y' are the same signal",
            ("k", {"t": t, "x": t, "x/y": 2 * t}),
            {},
        ),
        (InputError, "no column is a measured signal", ("k", {"t": t}), {}),
        (InputError, "every measured value is NaN", ("k", {"t": t, "x": np.nan * t}), {}),
        (InputError, "has infinite values", ("k", {"t": t, "x": np.where(t > 1.0, np.inf, t)}), {}),
        (InputError, "are not finite, negative or not ascending", ("k", {"t": t[::-1], "x": t}), {}),
        (InputError, "a time occurs more than twice", ("k", {"t": [0.0, 1, 1, 1], "x": np.ones(4)}), {}),
        (InputError, "has values of the shape", ("k", {"t": t, "x": np.ones((7, 2))}), {}),
        (InputError, "a dictionary, a data frame or a file with the times", ("k", {"x": t}), {}),
        (InputError, "or a column that is not an array of numbers", ("k", {"t": t, "x": "fast"}), {}),
        (UnknownNameError, "no entry named", ("k", {"t": t, "x[4]": t}), {}),
        (InputError, "starts at 1, outside its bounds", ("k", data), {"bounds": {"k": (2.0, 3.0)}}),
        (InputError, "give the bounds in ascending order", ("k", data), {"bounds": {"k": (3.0, 2.0)}}),
        (UnknownNameError, "no fitted parameter named", ("k", data), {"bounds": {"d": (3.0, 4.0)}}),
        (UnknownNameError, "no fitted parameter named", ("k", data), {"start": {"d": 3.0}}),
        (InputError, "the noise of the signal", ("k", data), {"noise": {"x": 0.0}}),
    ]
    for kind, message, arguments, options in cases:
        with pytest.raises(kind, match=message):
            ab.fit(first_order(), *arguments, **options)
    result = ab.fit(first_order(), "k", data)
    with pytest.raises(UnknownNameError, match="no fitted parameter named 'z'"):
        result["z"]
    with pytest.raises(InputError, match="a probability between 0 and 1"):
        result.confidence_intervals(0.0)

"""``ab.optimise``: closed forms, conditions of minima, robust objectives, and refusals by name."""

from __future__ import annotations

import math
import pickle
from pathlib import Path

import pytest
from numpy.testing import assert_allclose

import armblocks as ab
from armblocks.blocks import (
    CompareToConstant,
    Gain,
    Integrator,
    Product,
    Saturation,
    Step,
    StopSimulation,
    Sum,
)
from armblocks.errors import InputError, SimulationError, UnknownNameError

SETTINGS = {"stop_time": 1.0, "sample_time": 0.005, "rtol": 1e-9, "atol": 1e-11}
"""For runs of :func:`integrator`: the measures are exact up to the interpolation."""


def integrator() -> ab.Diagram:
    """``x' = k m - x`` with ``x(0) = 0``: ``x(1) = k m (1 - 1/e)``; ``y = x - w``."""
    builder = ab.DiagramBuilder("first order")
    builder.parameter("m", 1.0, minimum=-10.0, maximum=10.0)
    u = builder.add("u", Step(time=0.0, final=ab.formula("m")))
    e = builder.add("e", Sum(signs="+-"), builder.add("k", Gain(gain=2.0), u))
    x = builder.add("x", Integrator(initial=0.0), e)
    builder.connect(x, e["u2"])
    w = builder.add("w", Step(time=0.0, final=0.7))
    builder.add("y", Sum(signs="+-"), x, w)
    return builder.build()


GAIN = 1.0 - math.exp(-1.0)
"""``x(1)`` for ``k m = 1``."""


def test_a_quadratic_problem_has_the_closed_solution_and_multipliers() -> None:
    objective = "(final(x) - 3)^2 + 0.5 * ({k.gain} - 1)^2"
    free = ab.optimise(integrator(), {"k.gain": (0.0, 10.0)}, objective, **SETTINGS)
    expected = (3.0 * GAIN + 0.5) / (GAIN**2 + 0.5)
    assert free.converged and free.feasible and free.method == "gradient" and not free.active
    assert_allclose(free["k.gain"], expected, rtol=1e-5)
    assert_allclose(free.objective, (GAIN * expected - 3.0) ** 2 + 0.5 * (expected - 1.0) ** 2, rtol=1e-6)
    assert_allclose(free.bound_multipliers, 0.0, atol=1e-4)
    # With a limit the multiplier is minus the derivative of the objective by the limit.
    found = ab.optimise(integrator(), {"k.gain": (0.0, 10.0)}, objective, "final(x) <= 1.2", **SETTINGS)
    k = 1.2 / GAIN
    slope = 2.0 * (1.2 - 3.0) + (k - 1.0) / GAIN
    assert_allclose(found["k.gain"], k, rtol=1e-6)
    (constraint,) = found.constraints
    assert constraint.active and constraint.satisfied and found.active == ("final(x) <= 1.2",)
    assert_allclose(constraint.multiplier, -slope, rtol=1e-3)
    low = ab.optimise(integrator(), {"k.gain": (0.0, 10.0)}, objective, "final(x) >= 2.8", **SETTINGS)
    k = 2.8 / GAIN
    assert_allclose(low.constraints[0].multiplier, -(2.0 * (2.8 - 3.0) + (k - 1.0) / GAIN), rtol=1e-3)
    bound = ab.optimise(integrator(), {"k.gain": (0.0, 2.5)}, objective, **SETTINGS)
    assert bound.active == ("k.gain <= 2.5",) and bound["k.gain"] == pytest.approx(2.5)
    assert_allclose(bound.bound_multipliers[0], -(2.0 * GAIN * (2.5 * GAIN - 3.0) + 1.5), rtol=1e-3)
    # The result is the diagram with these values, and reopens as a run.
    run = found.run()
    assert_allclose(run["x"][-1], 1.2, rtol=1e-6)
    assert_allclose(ab.simulate(found.diagram, **SETTINGS)["x"], run["x"], rtol=0, atol=0)


def test_mask_parameters_entries_and_products_of_variables(tmp_path: Path) -> None:
    """``k m`` alone is determined; a constraint on the sum selects equal factors."""
    found = ab.optimise(
        integrator(),
        {"k.gain": ab.loguniform(0.1, 10.0), "m": (0.1, 10.0)},
        "({k.gain} + {m})",
        ["final(x) == 2", "{k.gain} >= 0"],
        start={"k.gain": 0.5, "m": 5.0},
        **SETTINGS,
    )
    root = math.sqrt(2.0 / GAIN)
    assert found.converged
    assert_allclose(found.values, [root, root], rtol=1e-4)
    assert_allclose(found.constraints[0].value, 2.0, rtol=1e-6)
    # d (2 sqrt(c / G)) / dc = 1 / sqrt(c G)
    assert_allclose(found.constraints[0].multiplier, -1.0 / math.sqrt(2.0 * GAIN), rtol=1e-3)
    text = str(found)
    assert "k.gain" in text and "final(x) == 2" in text and "multiplier" in text
    assert "OptimisationResult first order" in repr(found) and len(found.table()) == 2
    found.plot(save=tmp_path / "history.svg")
    assert (tmp_path / "history.svg").stat().st_size > 1000
    copy = pickle.loads(pickle.dumps(found))
    assert copy.values.tolist() == found.values.tolist() and copy.run().time.size == 201


def test_peaks_at_a_tie_are_found_by_both_methods() -> None:
    """``max |x - w|`` is least where the negative peak at 0 equals the positive one at 1... or is bounded
    by it: the peak at the start is 0.7 for every gain, so that the smallest peak leaves a range of gains."""
    measure = "maximum(y) - minimum(y) + 0.2 * {k.gain} ^ 2"  # maximum - minimum is x(1)
    by_gradient = ab.optimise(integrator(), {"k.gain": (-5.0, 5.0)}, measure, **SETTINGS)
    # The minimum is at k = 0, where maximum and minimum are at all samples: |k| G + 0.2 k².
    assert_allclose(by_gradient["k.gain"], 0.0, atol=1e-3)
    assert_allclose(by_gradient.objective, 0.0, atol=1e-3)
    by_search = ab.optimise(
        integrator(), {"k.gain": (-5.0, 5.0)}, measure, method="search", evaluations=150, **SETTINGS
    )
    assert_allclose(by_search["k.gain"], 0.0, atol=1e-3)
    assert by_search.method == "search" and math.isnan(by_search.bound_multipliers[0])


def test_the_worst_scenario_is_least_where_two_scenarios_are_equally_bad() -> None:
    """Over the references w = 0.4 and 1.4 the worst |x(1) - w| is least at the middle: x(1) = 0.9."""
    over = {"w.final": [0.4, 1.0, 1.4]}
    objective = "(final(y))^2"
    worst = ab.optimise(
        integrator(), {"k.gain": (0.0, 5.0)}, objective, over=over, statistic="worst", **SETTINGS
    )
    assert worst.converged and len(worst.scenarios) == 3
    assert_allclose(worst["k.gain"] * GAIN, 0.9, rtol=1e-4)
    assert_allclose(worst.scenario_objectives, [0.25, 0.01, 0.25], rtol=1e-3)
    assert_allclose(worst.run(1)["y"][-1] ** 2, 0.01, rtol=1e-3)
    assert set(worst.worst(2).tolist()) == {0, 2}
    mean = ab.optimise(integrator(), {"k.gain": (0.0, 5.0)}, objective, over=over, **SETTINGS)
    assert_allclose(mean["k.gain"] * GAIN, 2.8 / 3.0, rtol=1e-4)
    # The constraint holds in all scenarios; with a share it may be violated in the others.
    all_hold = ab.optimise(
        integrator(), {"k.gain": (0.0, 5.0)}, objective, "final(y) <= 0.3", over=over, **SETTINGS
    )
    assert_allclose(all_hold["k.gain"] * GAIN, 0.7, rtol=1e-4)
    assert_allclose(all_hold.constraints[0].value, 0.3, rtol=1e-4)
    few = {"method": "auto", "evaluations": 200, "over": over, **SETTINGS}
    some = ab.optimise(integrator(), {"k.gain": (0.0, 5.0)}, objective, "final(y) <= 0.3", share=0.6, **few)
    assert some.method == "search" and "quantile" in some.reason
    assert_allclose(some["k.gain"] * GAIN, 2.8 / 3.0, rtol=1e-3)
    middle = ab.optimise(integrator(), {"k.gain": (0.0, 5.0)}, objective, statistic=0.5, **few)
    # The second smallest of the squares is least between the two nearest references.
    assert_allclose(middle["k.gain"] * GAIN, 1.2, rtol=2e-3)
    assert "quantile 0.5 of 3 scenarios" in str(middle)


def test_scenarios_with_other_equations_and_several_starts() -> None:
    """Signs of a sum are constants of the equations; the objective has two local minima."""
    over = [{"e.signs": "+-", "w.final": 0.2}, {"e.signs": "++", "w.final": 0.4}]
    objective = "(({k.gain} - 1)^2 - 1)^2 + 0.3 * {k.gain} + 0 * final(x)"
    bounds = {"k.gain": (-1.0, 3.0)}
    one = ab.optimise(integrator(), bounds, objective, over=over, start={"k.gain": 2.5}, **SETTINGS)
    several = ab.optimise(
        integrator(), bounds, objective, over=over, start={"k.gain": 2.5}, starts=3, seed=2, **SETTINGS
    )
    assert abs(several["k.gain"] + 0.0356) < 1e-3 and several.objective <= one.objective + 1e-6
    assert len(several.solutions) == 3
    assert any("starts end at this objective" in text for text in several.findings)


def test_python_functions_integers_and_stopped_runs_use_the_search() -> None:
    def distance(result: ab.SimulationResult) -> float:
        return float(abs(result["x"][-1] - 1.5))

    few = {"evaluations": 120, **SETTINGS}
    found = ab.optimise(integrator(), {"k.gain": (0.0, 5.0)}, distance, [(distance, -math.inf, 4.0)], **few)
    assert "Python code" in found.reason and found.objective_name == "distance"
    assert_allclose(found["k.gain"] * GAIN, 1.5, rtol=1e-3)
    assert found.constraints[0].name == "distance <= 4"
    count = ab.optimise(integrator(), {"k.gain": (0.0, 5.0)}, "events() + final(x)", **few)
    assert count.method == "search" and "no derivative" in count.reason
    assert_allclose(count["k.gain"], 0.0, atol=1e-4)
    builder = ab.DiagramBuilder("stops")
    x = builder.add("x", Integrator(initial=0.0), builder.add("u", Step(time=0.0, final=1.0)))
    builder.add("stop", StopSimulation(), builder.add("c", CompareToConstant(constant=0.9, relation=">="), x))
    diagram = builder.build()
    # A run that a block ends is no success: its integral would be smaller.
    limited = ab.optimise(diagram, {"u.final": (0.1, 5.0)}, "-integral(x)", method="search", **few)
    assert limited["u.final"] == pytest.approx(0.9, abs=1e-3) and limited.feasible
    stopped = ab.optimise(diagram, {"u.final": (0.1, 5.0)}, "-final(x) - {u.final}", allow_stops=True, **few)
    assert stopped["u.final"] == pytest.approx(5.0) and "a block ends" in stopped.reason
    never = ab.optimise(diagram, {"u.final": (0.1, 0.5)}, "-final(x)", **SETTINGS)
    assert never["u.final"] == pytest.approx(0.5) and never.method == "gradient"


def test_a_feasible_problem_is_not_called_infeasible_from_a_start_without_descent() -> None:
    """The peak of a saturated signal has no derivative: the gradient at the start shows no way out."""
    builder = ab.DiagramBuilder("saturated")
    k = builder.add("k", Gain(gain=4.0), builder.add("u", Step(time=0.0, final=1.0)))
    builder.add("x", Integrator(initial=0.0), builder.add("s", Saturation(lower=-1.0, upper=1.0), k))
    diagram, limit = builder.build(), "peak(s) <= 0.6"
    found = ab.optimise(diagram, {"k.gain": (0.0, 5.0)}, "(final(x) - 3)^2", limit, **SETTINGS)
    assert found.converged and found.feasible and found.method == "gradient"
    assert_allclose(found["k.gain"], 0.6, rtol=1e-5)
    assert not found.solutions[0].feasible and len(found.solutions) > 1
    # Without bounds there is no sweep.
    alone = ab.optimise(diagram, ["k.gain"], "(final(x) - 3)^2", limit, method="gradient", **SETTINGS)
    assert not alone.feasible and "not satisfied" in str(alone)
    budget = {"evaluations": 12, "method": "gradient"}
    few = ab.optimise(diagram, {"k.gain": (0.0, 5.0)}, "(final(x) - 3)^2", limit, **budget, **SETTINGS)
    assert len(few.history) <= 14


def test_failed_points_are_avoided_and_failed_starts_are_errors() -> None:
    """``x' = k x²`` has no solution up to 1 s for k >= 1."""
    builder = ab.DiagramBuilder("blow up")
    x = builder.add("x", Integrator(initial=1.0))
    k = builder.add("k", Gain(gain=0.5), builder.add("square", Product(), x, x))
    builder.connect(k, x["u"])
    diagram = builder.build()
    settings = {"stop_time": 1.0}
    found = ab.optimise(diagram, {"k.gain": (0.0, 3.0)}, "(final(x) - 4)^2", **settings)
    assert_allclose(found["k.gain"], 0.75, rtol=1e-3)
    with pytest.raises(SimulationError, match="no run has a value of the objective"):
        ab.optimise(diagram, {"k.gain": (2.0, 3.0)}, "final(x)", evaluations=60, **settings)


def test_an_interrupt_returns_the_best_values_so_far() -> None:
    def interrupts(count: int, _: float) -> None:
        if count >= 6:
            raise KeyboardInterrupt

    for method in ("gradient", "search"):
        found = ab.optimise(
            integrator(),
            {"k.gain": (0.0, 9.0)},
            "(final(x) - 3)^2",
            method=method,
            progress=interrupts,
            **SETTINGS,
        )
        assert found.message == "stopped by Ctrl-C" and not found.converged
        assert any("no minimum is confirmed" in text for text in found.findings)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"variables": {"k.gian": (0, 1)}}, "k.gain"),
        ({"variables": {}}, "the variables are"),
        ({"variables": {"k.gain": (1, 0)}}, "the bounds of 'k.gain' are"),
        ({"variables": {"k.gain": 3}}, "the bounds of 'k.gain' are"),
        ({"variables": {"m": (-20, 5)}}, "within the parameter's rule"),
        ({"variables": {"e.signs": (0, 1)}}, "has no finite numbers"),
        ({"start": {"k.gain": 7}}, "starts at 7, outside its bounds"),
        ({"start": {"m": 7}}, "m"),
        ({"objective": 3}, "the objective is 3"),
        ({"objective": "final(x) + speed"}, "no measure or variable named 'speed'"),
        ({"objective": "final(x) + {m}"}, "no variable named 'm'"),
        ({"objective": "final(x) * [1 2]"}, "the formula has 2 entries"),
        ({"objective": "final(z)"}, "no signal named 'z'"),
        ({"constraints": "final(x)"}, "the text has no comparisons"),
        ({"constraints": "final(x) < 2"}, "the text has other comparisons"),
        ({"constraints": "1 <= 2"}, "both sides are numbers"),
        ({"constraints": "1 <= final(x) >= 2"}, "do not enclose an expression between numbers"),
        ({"constraints": "3 <= final(x) <= 2"}, "the limits of '3 <= final(x) <= 2' are"),
        ({"constraints": [4]}, "the constraint 4 is not suitable"),
        ({"constraints": [("final(x)", 0, "1")]}, "is not suitable"),
        ({"statistic": "median"}, "the statistic is 'median'"),
        ({"share": 1.5}, "the share is 1.5"),
        ({"starts": 0}, "starts is 0, not an integer above 0"),
        ({"method": "newton"}, "no method named 'newton'"),
        ({"method": "gradient", "objective": "events()"}, "the derivatives do not exist, because"),
        ({"variables": ["k.gain"], "method": "search"}, "has no finite bounds, and the search"),
        ({"variables": ["k.gain"], "starts": 2}, "has no finite bounds, and a choice of several starts"),
        ({"over": {"k.gain": [1.0, 2.0]}}, "is a variable, and the scenarios have values of it"),
        ({"objectiv": "final(x)"}, "objective"),
    ],
)
def test_invalid_arguments_are_refused_by_name(arguments: dict[str, object], words: str) -> None:
    given: dict[str, object] = {"variables": {"k.gain": (0.0, 5.0)}, "objective": "final(x)", **arguments}
    with pytest.raises((InputError, UnknownNameError, TypeError)) as caught:
        ab.optimise(integrator(), **given, **SETTINGS)  # pyright: ignore[reportArgumentType, reportCallIssue]
    assert words in str(caught.value)


def test_results_refuse_numbers_that_do_not_exist() -> None:
    found = ab.optimise(
        integrator(), {"k.gain": (0.0, 5.0)}, "(final(x) - 1)^2", "-9 <= final(x) <= 9", **SETTINGS
    )
    with pytest.raises(InputError, match="scenario 1 does not exist"):
        found.run(1)
    with pytest.raises(InputError, match="an integer number of scenarios"):
        found.worst(-1)
    with pytest.raises(UnknownNameError, match=r"k\.gain"):
        found["k.gian"]
    both = found.constraints[0]
    assert both.low == -9.0 and both.high == 9.0 and not both.active and both.multiplier == 0.0
    assert_allclose(both.value, 1.0, rtol=1e-4)

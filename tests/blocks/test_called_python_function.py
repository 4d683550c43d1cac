"""Python functions called at ticks: agreement with traced functions, run messages, and errors."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import (
    CalledPythonFunction,
    Clock,
    Constant,
    Gain,
    Integrator,
    PythonFunction,
    SineWave,
    Sum,
    TransportDelay,
    UnitDelay,
    ZeroOrderHold,
)
from armblocks.diagram import Block, Diagram, DiagramBuilder, trace_diagram
from armblocks.errors import AlgebraicLoopError, DiagramError, FormatError, InputError, SimulationError

T = 0.1
SETTINGS: list[dict[str, Any]] = [{"solver": "rk4", "step": 0.01}, {"rtol": 1e-9, "atol": 1e-12}]
RUNS = pytest.mark.parametrize("settings", SETTINGS, ids=["rk4", "rk45"])


def bang_bang(u: float) -> float:
    """A function that cannot be traced."""
    return 1.0 if u < 0.3 else -1.0


def loop(controller: Block, *, delay: bool = False) -> Diagram:
    """A sampled controller of y' = u - y / 2, between sampled blocks with the same clock."""
    builder = DiagramBuilder("d")
    plant = builder.add("plant", Integrator())
    measured = builder.add("measurement", TransportDelay(delay=0.07), plant) if delay else plant
    sampled = builder.add(
        "sampled", Gain(gain=2.0), builder.add("hold", ZeroOrderHold(sample_time=T), measured)
    )
    action = builder.add("controller", controller, sampled)
    after = builder.add("after", UnitDelay(sample_time=T), action)
    force = builder.add("force", Sum(signs="++-"), action, after, builder.add("half", Gain(gain=0.5), plant))
    builder.connect(force, plant["u"])
    return builder.build()


def recurrence(count: int) -> np.ndarray:
    """The same loop, computed tick by tick with the closed form of y' = c - y / 2 between ticks."""
    y, before, outputs = 0.0, 0.0, list[float]()
    for _ in range(count):
        outputs.append(y)
        output = bang_bang(2.0 * y)
        c, before = output + before, output
        y = 2 * c + (y - 2 * c) * np.exp(-T / 2)
    return np.array(outputs)


@RUNS
def test_a_called_function_is_evaluated_in_order_with_the_other_sampled_blocks(
    settings: dict[str, Any],
) -> None:
    result = ab.simulate(
        loop(CalledPythonFunction(function=bang_bang, sample_time=T)),
        stop_time=3.0,
        sample_time=T,
        **settings,
    )
    assert result["plant"] == pytest.approx(recurrence(31), abs=1e-8)
    assert result.run.calls == 31
    assert 0.0 < result.run.call_time < result.run.wall_time
    assert "Python was called 31 times for 'controller'" in result.run.message
    assert "% of the run" in result.run.message


@RUNS
@pytest.mark.parametrize("delay", [False, True])
def test_a_called_function_agrees_with_the_traced_function(settings: dict[str, Any], delay: bool) -> None:
    """With the same clock, for a function that can be called and traced, with and without delayed signals."""

    def law(u: Any, t: Any) -> Any:
        return 1.0 - u * u / 4 + 0.1 * t

    def law_at_ticks(u: Any, s: Any) -> Any:
        return law(u, s)

    called = loop(CalledPythonFunction(function=law, sample_time=T), delay=delay)
    builder = DiagramBuilder("inside")
    held = builder.add("u", ab.blocks.Inport())
    ticked = builder.add("t", ZeroOrderHold(sample_time=T), builder.add("clock", Clock()))
    builder.add(
        "y",
        ab.blocks.Outport(),
        builder.add("f", PythonFunction(function=law_at_ticks), held, ticked),
    )
    traced = loop(ab.blocks.Subsystem(diagram=builder.build()), delay=delay)
    first, second = (
        ab.simulate(diagram, stop_time=2.0, sample_time=T, **settings) for diagram in (called, traced)
    )
    for name in ("plant", "force", "after"):
        np.testing.assert_allclose(first[name], second[name], rtol=1e-8, atol=1e-9, err_msg=name)


def test_functions_in_series_are_called_once_per_tick_in_order() -> None:
    calls: list[tuple[str, float]] = []

    def first(u: float, t: float) -> float:
        calls.append(("first", t))
        return u + 1.0

    def second(a: float, v: np.ndarray) -> tuple[float, np.ndarray]:
        calls.append(("second", a))
        return a * v.sum(), np.outer(v, v)

    builder = DiagramBuilder("d")
    clock, vector = builder.add("t", Clock()), builder.add("v", Constant(value=[1.0, 2.0]))
    later = builder.add(
        "a", CalledPythonFunction(function=second, results="s, m", shapes="1, 2x2", sample_time=0.5)
    )
    builder.connect(
        builder.add("z", CalledPythonFunction(function=first, sample_time=0.25), clock), later["a"]
    )
    builder.connect(vector, later["v"])
    result = ab.simulate(builder.build(), stop_time=1.0, sample_time=0.25)
    assert result["z"].tolist() == [1.0, 1.25, 1.5, 1.75, 2.0]
    assert result["a/s"].tolist() == [3.0, 3.0, 4.5, 4.5, 6.0]
    assert result["a/m"][-1].tolist() == [[1.0, 2.0], [2.0, 4.0]]
    assert calls == [
        *[("first", 0.0), ("second", 1.0), ("first", 0.25), ("first", 0.5), ("second", 1.5)],
        *[("first", 0.75), ("first", 1.0), ("second", 2.0)],
    ]


@RUNS
def test_pauses_logs_and_saved_states_do_not_change_the_result(
    settings: dict[str, Any], tmp_path: Path
) -> None:
    diagram = loop(CalledPythonFunction(function=bang_bang, sample_time=T))
    whole = ab.simulate(diagram, stop_time=2.0, sample_time=0.02, **settings)
    run = ab.begin(diagram, stop_time=2.0, sample_time=0.02, **settings)
    while not run.finished:
        run.advance(steps=3)
    np.testing.assert_array_equal(run.result()["plant"], whole["plant"])
    logged = ab.simulate(diagram, stop_time=2.0, sample_time=0.02, log=tmp_path / "log.csv", **settings)
    assert logged.run.calls == 21
    first = ab.simulate(diagram, stop_time=1.05, sample_time=0.02, **settings)
    second = ab.simulate(
        diagram, stop_time=2.0, sample_time=0.02, initial_state=first.final_state, **settings
    )
    assert second["plant"][-1] == pytest.approx(whole["plant"][-1], abs=1e-9)
    assert first.run.calls + second.run.calls == 21


def test_an_algebraic_loop_through_a_called_function_is_refused() -> None:
    builder = DiagramBuilder("d")
    handle = builder.add("f", CalledPythonFunction(function=bang_bang))
    builder.connect(builder.add("g", Gain(gain=0.5), handle), handle["u"])
    with pytest.raises(AlgebraicLoopError, match=r"f/y[\s\S]*put a Unit Delay into the loop"):
        trace_diagram(builder.build())


def test_a_failed_call_names_block_and_time_and_keeps_the_earlier_samples() -> None:
    def late(u: float, t: float) -> Any:
        return {0.0: 1.0, 1.0: np.ones(3), 2.0: np.nan}.get(t, 1 / 0 if t > 2.5 else u)

    for begin, expected_message in (
        (0.0, r"block 'f' at t = 1 s: 'y' is \[1\. 1\. 1\.\], of shape \(3,\)"),
        (1.0, r"'y' is nan"),
        (2.0, r"the function late failed: ZeroDivisionError"),
    ):
        builder = DiagramBuilder("d")

        def shifted(u: float, t: float, begin: float = begin) -> Any:
            return u if t < 0.5 else 1 / 0 if begin == 2.0 else late(u, t + begin)

        shifted.__name__ = "late"
        block = CalledPythonFunction(function=shifted, sample_time=1.0)
        builder.add("x", Integrator(), builder.add("f", block, builder.add("u", SineWave())))
        with pytest.raises(SimulationError, match=expected_message) as caught:
            ab.simulate(builder.build(), stop_time=5.0, sample_time=0.25)
        partial = caught.value.partial
        assert isinstance(partial, ab.SimulationResult)
        assert partial.time[-1] == 0.75
    builder = DiagramBuilder("d")

    def twice(u: float) -> tuple[float, float]:
        return u, u

    block = CalledPythonFunction(function=twice, results="a b c")
    builder.add("f", block, builder.add("u", SineWave()))
    with pytest.raises(SimulationError, match="returns 2 values for the results a, b, c"):
        ab.simulate(builder.build(), stop_time=1.0)


def test_derivatives_through_a_called_function_are_refused() -> None:
    diagram = loop(CalledPythonFunction(function=bang_bang, sample_time=T))
    with pytest.raises(
        InputError, match=r"block 'controller' calls Python, which has no derivatives[\s\S]*traceable"
    ):
        ab.linearize(diagram, inputs="half.gain", outputs="plant")
    with pytest.raises(InputError, match=r"block 'controller' calls Python, which has no derivatives"):
        ab.sensitivity(diagram, "half.gain", "plant")
    from armblocks.equations import SimulationOptions
    from armblocks.integration.system import compile_system
    from armblocks.simulation import simulate

    with pytest.raises(
        InputError, match=r"no function is given for the blocks 'controller'[\s\S]*armblocks\.simulate"
    ):
        simulate(compile_system(trace_diagram(diagram)), SimulationOptions(stop_time=1.0))


def test_invalid_parameters_of_a_called_function_are_refused() -> None:
    with pytest.raises(InputError, match=r"the shapes are '3' for the results a, b[\s\S]*as many shapes"):
        CalledPythonFunction(results="a, b", shapes="3")
    with pytest.raises(InputError, match=r"the shapes are '0'"):
        CalledPythonFunction(shapes="0")
    with pytest.raises(InputError, match=r"CalledPythonFunction.results: the results are 'u'"):
        CalledPythonFunction(results="u")
    builder = DiagramBuilder("d")
    held = builder.add("held", ZeroOrderHold(sample_time=T), builder.add("u", SineWave()))
    builder.add("f", CalledPythonFunction(function=bang_bang, sample_time=-1.0), held)
    with pytest.raises(DiagramError, match=r"a block that calls Python has no clock[\s\S]*period"):
        ab.simulate(builder.build(), stop_time=1.0)


def test_a_file_with_a_python_function_is_loaded_only_with_trust(tmp_path: Path) -> None:
    (tmp_path / "law.py").write_text("def bang(u):\n    return 1.0 if u < 0.3 else -1.0\n")
    document = ab.save_diagram(loop(CalledPythonFunction(sample_time=T)), tmp_path / "d.json")
    document.write_text(document.read_text().replace('"function": ""', '"function": "law.py:bang"'))
    with pytest.raises(FormatError, match="trust"):
        ab.load_diagram(document)
    result = ab.simulate(ab.load_diagram(document, trust=True), stop_time=3.0, sample_time=T, rtol=1e-9)
    assert result["plant"] == pytest.approx(recurrence(31), abs=1e-6)

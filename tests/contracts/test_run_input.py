"""Settings of runs: messages about invalid values, and behaviour at the limits."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import armblocks as ab
from armblocks import blocks as bl
from armblocks.errors import ArmblocksError

MAX_CHARACTERS = 400


def ramp() -> ab.Diagram:
    """A diagram that integrates 1."""
    builder = ab.DiagramBuilder("ramp")
    builder.add("x", bl.Integrator(), builder.add("one", bl.Constant()))
    return builder.build()


def message(error: ArmblocksError) -> str:
    """Return the text of an error after checks: all its parts are present, and it is short."""
    assert error.what
    assert error.where
    assert error.fix
    assert len(str(error)) < MAX_CHARACTERS
    return str(error)


INVALID_SETTINGS: list[tuple[dict[str, Any], str]] = [
    *(({"stop_time": value}, "ramp: stop_time is") for value in (-1, math.inf, -math.inf, math.nan)),
    *(({"stop_time": value}, "ramp: stop_time is") for value in (True, "3", None, [1.0], 3 + 0j)),
    *(({"step": value}, "ramp: step is") for value in (0, -1, math.nan, True, "0.1", 2.0, 1e-20)),
    ({"step": 1e-13}, "1e+13 steps"),
    *(({"rtol": value}, "ramp: rtol is") for value in (0, 1e-14, 1.1, math.nan, True, "tight")),
    *(({"atol": value}, "ramp: atol is") for value in (0, -1, math.inf, math.nan, True)),
    *(({"sample_time": value}, "ramp: sample_time is") for value in (0, -1, math.nan, math.inf, True)),
    ({"sample_time": 1e-12}, "records 1e+12 samples"),
    *(({"max_step": value}, "ramp: max_step is") for value in (0, -1, math.nan, True, 1e-18)),
    ({"solver": ""}, "there is no solver named ''"),
    ({"solver": "od45"}, "did you mean 'ode45'?"),
    ({"solver": 3}, "Allowed: a name. Fix: 'auto' chooses one"),
    ({"solver": "rk45", "step": 0.1}, "chooses its own steps"),
    ({"initial_state": [1.0, 2.0]}, "initial_state is a list"),
    ({"initial_state": {"x": 3.0}}, "initial_state is a dict"),
    ({"initial_state": "nowhere.npz"}, "there is no such file"),
    ({"parameters": {"x.initail": 1.0}}, "did you mean 'initial'?"),
    ({"parameters": {"x.initial": math.nan}}, "the value is nan"),
    ({"stoptime": 1.0}, "did you mean 'stop_time'?"),
]


@pytest.mark.parametrize(
    ("settings", "words"),
    INVALID_SETTINGS,
    ids=[" ".join(f"{k}={v}" for k, v in s.items()) for s, _ in INVALID_SETTINGS],
)
def test_an_invalid_setting_is_refused_with_one_message(settings: dict[str, Any], words: str) -> None:
    arguments: dict[str, Any] = {"stop_time": 1.0, **settings}
    with pytest.raises(ArmblocksError) as caught:
        ab.simulate(ramp(), **arguments)
    assert words in message(caught.value)


def test_a_run_with_stop_time_0_records_one_sample() -> None:
    result = ab.simulate(ramp(), stop_time=0.0)
    assert result.time.tolist() == [0.0]
    assert result["x"].tolist() == [0.0]


@pytest.mark.parametrize("stop", [1e-320, 1e-9, 1e15, 1e308, np.float32(2.0), np.int64(2)])
def test_runs_of_any_duration_and_number_type(stop: float) -> None:
    result = ab.simulate(ramp(), stop_time=stop)
    assert result.time[-1] == stop
    # rounding errors of some hundred steps
    assert result["x"][-1] == pytest.approx(float(stop), rel=1e-12)


def test_a_stop_time_before_the_initial_state_is_refused() -> None:
    state = ab.simulate(ramp(), stop_time=1.0).final_state
    for stop in (0.5, 1.0):
        with pytest.raises(ArmblocksError) as caught:
            ab.simulate(ramp(), stop_time=stop, initial_state=state)
        assert "the run continues from 1 s" in message(caught.value)


def test_an_initial_state_of_another_diagram_is_refused() -> None:
    builder = ab.DiagramBuilder("three")
    builder.add("x", bl.Integrator(), builder.add("one", bl.Constant(value=[1.0, 2.0, 3.0])))
    state = ab.simulate(builder.build(), stop_time=0.5).final_state
    with pytest.raises(ArmblocksError) as caught:
        ab.simulate(ramp(), stop_time=1.0, initial_state=state)
    assert "ramp: the state of 'three' at 0.5 s belongs to another system" in message(caught.value)


SAMPLE_TIMES: list[tuple[Any, str]] = [
    (0, "the sample time is [0.0]"),
    (-1, "but 't' changes continuously"),
    (-2, "the sample time is [-2.0]"),
    (math.nan, "the value is nan"),
    (math.inf, "the value is inf"),
    (1e-12, "1e+12 steps"),
    (1e-300, "1e+300 steps"),
    (True, "the value is True"),
    ("0.1", "the value is '0.1'"),
    (None, "the value is None"),
    ((0.1, 0.1), "0 <= offset < period"),
    ((0.1, -0.05), "0 <= offset < period"),
    ((0.1, 0.0, 0.0), "0 <= offset < period"),
    ((-1, 0.1), "0 <= offset < period"),
    ((0, 1), "0 <= offset < period"),
]


@pytest.mark.parametrize(("sample_time", "words"), SAMPLE_TIMES)
def test_an_invalid_sample_time_is_refused_with_one_message(sample_time: Any, words: str) -> None:
    with pytest.raises(ArmblocksError) as caught:
        builder = ab.DiagramBuilder("sampled")
        builder.add("hold", bl.ZeroOrderHold(sample_time=sample_time), builder.add("t", bl.Clock()))
        ab.simulate(builder.build(), stop_time=1.0)
    assert words in message(caught.value)


def test_a_sample_time_longer_than_the_run_ticks_once() -> None:
    builder = ab.DiagramBuilder("sampled")
    builder.add("hold", bl.ZeroOrderHold(sample_time=1e9), builder.add("t", bl.Clock()))
    assert ab.simulate(builder.build(), stop_time=1.0).run.ticks == 1

"""A run with a real-time factor is never ahead of the clock and sends all samples."""

from __future__ import annotations

import json
import math
from functools import partial
from typing import Any

import numpy as np
import pytest
from run_frames import read_frame

import armblocks as ab
from armblocks.formats import diagram_to_bytes, load_robot
from armblocks.studio.protocol.messages import runs as run_messages
from armblocks.studio.runs import worker as run_worker
from armblocks.studio.runs.pace import Pace


class Clock:
    """A clock that advances only while the worker waits."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def test_target_time_follows_the_clock_from_its_reference() -> None:
    clock = Clock()
    pace = Pace(0.5, clock)
    assert pace.target_time == 0.0
    clock.now += 3.0
    assert pace.target_time == 1.5
    pace.count_from(4.0)
    pace.speed = 10.0
    clock.now += 0.25
    assert pace.target_time == 6.5
    pace.speed = None
    assert pace.target_time == math.inf


class Pipe:
    """A page that sends commands at given displayed times; waiting advances the clock."""

    def __init__(
        self, clock: Clock, speed: float, commands: list[tuple[float, run_messages.Message]]
    ) -> None:
        self.clock = clock
        self.speed = speed
        self.commands = commands
        self.events: list[dict[str, Any]] = []
        self.times: list[float] = []
        self.values: list[float] = []

    def send_bytes(self, data: bytes) -> None:
        if data[:1] == b"S":
            header, time, signals = read_frame(data[1:])
            assert header["first"] == len(self.times), "no sample is lost or repeated"
            assert self.speed == math.inf or time[-1] <= self.speed * (self.clock.now - 100.0) + 1e-12
            self.times += time.tolist()
            self.values += signals[-1].tolist()
            return
        event = json.loads(data[1:])
        self.events.append(event)
        if event["kind"] == "run_rewound":
            del self.times[event["count"] :], self.values[event["count"] :]

    def poll(self, wait: float) -> bool:
        if self.commands and (self.clock.now - 100.0) * self.speed >= self.commands[0][0]:
            return True
        self.clock.now += wait
        return False

    def recv_bytes(self) -> bytes:
        return self.commands.pop(0)[1].model_dump_json().encode()


def lag() -> ab.Diagram:
    """A unit step through a lag of 1 s: a solver step is much longer than a frame."""
    builder = ab.DiagramBuilder(
        "lag", settings=ab.SimulationOptions(stop_time=20.0, rtol=1e-9, atol=1e-12, sample_time=0.01)
    )
    gain = builder.add(
        "gain", ab.blocks.Gain(gain=1.0), builder.add("one", ab.blocks.Constant(value=1.0))["y"]
    )
    builder.add("lag", ab.blocks.FirstOrderLag(time_constant=1.0), gain["y"])
    return builder.build()


def completed_run(
    monkeypatch: pytest.MonkeyPatch, speed: float, *commands: tuple[float, run_messages.Message]
) -> Pipe:
    clock = Clock()
    monkeypatch.setattr(run_worker, "perf_counter", clock)
    monkeypatch.setattr(run_worker, "Pace", partial(Pace, clock=clock))
    pipe = Pipe(clock, speed, list(commands))
    job: dict[str, Any] = {"run": "r", "document": "d", "speed": speed, "folder": ".", "tuned": {}}
    job["diagram"] = diagram_to_bytes(lag(), load_robot).decode()
    run_worker._Run(pipe, job).run()  # pyright: ignore
    assert pipe.events[-1]["state"] == "done"
    return pipe


def test_a_slow_run_is_never_ahead_of_the_clock(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pipe = completed_run(monkeypatch, 0.5)
    shown = [event["real_time_factor"] for event in pipe.events if event["kind"] == "run_progress"]
    assert len(shown) > 1000
    assert max(shown) <= 0.5 + 1e-12
    complete = ab.simulate(lag())
    np.testing.assert_array_equal(pipe.times, complete.time)
    np.testing.assert_array_equal(pipe.values, complete["lag/y"])


def test_a_tuned_value_applies_from_the_displayed_instant(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    tune = run_messages.Tune(run="r", values={"gain.gain": 2.0})
    pause, resume = (run_messages.Control(run="r", action=action) for action in ("pause", "resume"))
    pipe = completed_run(monkeypatch, 1.0, (12.005, tune), (15.005, pause), (15.005, resume))
    (tuned,) = (event for event in pipe.events if event["kind"] == "run_tuned")
    (paused,) = (event for event in pipe.events if event.get("state") == "paused")
    assert 12.005 <= tuned["time"] < 12.03
    assert 15.005 <= paused["time"] < 15.03
    time, at = np.array(pipe.times), tuned["time"]
    # The change is a jump of the gain: both of its sides are sent.
    assert np.count_nonzero(np.diff(time) == 0.0) == 1
    np.testing.assert_array_equal(time[np.abs(time - at) > 1e-9], ab.simulate(lag()).time)
    exact = np.where(time < at, 1 - np.exp(-time), 2 - (1 + np.exp(-at)) * np.exp(at - np.maximum(time, at)))
    np.testing.assert_allclose(pipe.values, exact, rtol=1e-7, atol=1e-9)

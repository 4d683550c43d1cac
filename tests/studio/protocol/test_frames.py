"""Samples sent to a client: all of them, or the extreme values of a long run."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from run_frames import read_frame

from armblocks.blocks import BLOCKS
from armblocks.face.model import CompiledDiagram
from armblocks.formats import diagram_to_bytes, load_diagram, load_robot
from armblocks.studio.protocol.frames import sample_frame, thinned
from armblocks.studio.runs import worker as run_worker

Array = Any


def test_a_decoded_frame_equals_the_encoded_samples() -> None:
    rng = np.random.default_rng(1)
    time, signals = np.arange(5.0), rng.normal(size=(3, 5))
    header, decoded_time, decoded = read_frame(sample_frame("ä", 7, time, signals))
    assert header == {"run": "ä", "first": 7, "count": 5}
    np.testing.assert_array_equal(decoded_time, time)
    np.testing.assert_array_equal(decoded, signals)


@given(st.integers(1, 60), st.integers(2, 9), st.integers(0, 2**32 - 1))
def test_thinning_keeps_all_extremes_and_time_increases(count: int, stride: int, seed: int) -> None:
    time: Array = np.arange(count) * 0.1
    signals = np.random.default_rng(seed).normal(size=(2, count))
    few_time, few = thinned(time, signals, stride)
    assert few.shape == (2, few_time.size)
    assert few_time.size <= 2 * -(-count // stride)
    assert np.all(np.diff(few_time) > 0)
    for start in range(0, count, stride):
        part = slice(start, start + stride)
        inside = (few_time >= time[part][0]) & (few_time <= time[part][-1])
        np.testing.assert_array_equal(few[:, inside].min(axis=1), signals[:, part].min(axis=1))
        np.testing.assert_array_equal(few[:, inside].max(axis=1), signals[:, part].max(axis=1))


class Pipe:
    """The worker's end of a pipe without commands."""

    def __init__(self) -> None:
        self.messages: list[bytes] = []

    def send_bytes(self, data: bytes) -> None:
        self.messages.append(data)

    def poll(self, _: float) -> bool:
        return False


@pytest.mark.parametrize("max_numbers", [10**9, 4000])
def test_a_long_run_sends_extremes_and_a_short_run_all_samples(
    max_numbers: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run_worker, "MAX_NUMBERS", max_numbers)
    diagram = load_diagram("van_der_pol_pid", BLOCKS)
    pipe = Pipe()
    source = diagram_to_bytes(diagram, load_robot).decode()
    job: dict[str, Any] = {
        "run": "r",
        "document": "d",
        "speed": None,
        "folder": ".",
        "diagram": source,
        "tuned": {},
    }
    run_worker._Run(pipe, job).run()  # pyright: ignore
    events = [json.loads(data[1:]) for data in pipe.messages if data[:1] == b"J"]
    assert events[-1]["state"] == "done"
    frames = [read_frame(data[1:]) for data in pipe.messages if data[:1] == b"S"]
    sent = 0
    for header, _, _ in frames:
        assert header["first"] == sent
        sent += header["count"]
    time = np.concatenate([frame[1] for frame in frames])
    signals = np.concatenate([frame[2] for frame in frames], axis=1)
    whole = CompiledDiagram(diagram).simulate()
    if max_numbers == 10**9:
        assert events[0]["stride"] == 1
        np.testing.assert_array_equal(time, whole.time)
        np.testing.assert_array_equal(signals, whole.signals)
        return
    assert events[0]["stride"] > 1
    assert time.size * (1 + signals.shape[0]) < 1.1 * max_numbers
    assert time[-1] == whole.time[-1]
    np.testing.assert_array_equal(signals.max(axis=1), whole.signals.max(axis=1))
    np.testing.assert_array_equal(signals.min(axis=1), whole.signals.min(axis=1))
    np.testing.assert_array_equal(signals[:, -1], whole.signals[:, -1])

"""A run that returns to an earlier time and continues equals the original run exactly."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from run_frames import read_frame

from armblocks.blocks import BLOCKS
from armblocks.errors import ArmblocksError
from armblocks.face.model import CompiledDiagram
from armblocks.formats import diagram_to_bytes, load_diagram, load_robot
from armblocks.studio.protocol.messages import runs as run_messages
from armblocks.studio.runs.history import RunHistory
from armblocks.studio.runs.process import RunProcess
from armblocks.studio.runs.tunables import tunables
from armblocks.studio.runs.workers import Worker


@pytest.mark.parametrize(
    "name",
    ["bouncing_ball", "dc_motor_sampled_pid", "falling_pendulum", "kr180model", "puma560_payload_drop"],
)
def test_a_run_continued_after_going_back_equals_the_original_run(name: str) -> None:
    model = CompiledDiagram(load_diagram(name, BLOCKS))
    original = model.simulate()
    history = RunHistory(model)
    history.run.advance(0.3 * history.run.stop_time)
    history.add_snapshot()
    for _ in range(5):
        history.step()
    before = history.recorded
    history.return_to_sample(before - 1)
    assert before - 20 < history.recorded < before, "one step back is at most one step of the solver"
    history.return_to_sample(before // 2)
    remaining = history.recorded
    assert 0.8 * before // 2 < remaining <= before // 2
    history.run.advance()
    rest = history.samples(remaining)
    assert rest.begin == remaining
    np.testing.assert_array_equal(rest.time, original.time[remaining:])
    np.testing.assert_array_equal(rest.signals, original.signals[:, remaining:])


def test_every_sample_is_reachable_with_a_bounded_number_of_snapshots(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("armblocks.studio.runs.history.MAX_BYTES", 20_000)
    history = RunHistory(CompiledDiagram(load_diagram("falling_pendulum", BLOCKS)))
    for _ in range(200):
        history.step()
    snapshots = history._snapshots  # pyright: ignore[reportPrivateUsage]
    assert len(snapshots) < 100
    for row in (150, 77, 3):
        history.return_to_sample(row)
        assert row - 5 < history.recorded <= row


def test_tuned_values_apply_from_the_time_to_which_the_run_returns() -> None:
    model = CompiledDiagram(load_diagram("van_der_pol_pid", BLOCKS))
    history = RunHistory(model)
    history.run.advance(2.0)
    history.add_snapshot()
    count, state = history.recorded, history.run.state()
    history.run.advance(4.0)
    history.tune({"PID.P": 7.0})
    history.run.advance(5.0)
    history.return_to_sample(count)
    assert history.recorded == count
    assert history.run.parameters["PID.P"] == 7.0
    history.run.advance()
    other = model.simulate(parameters={"PID.P": 7.0}, initial_state=state)
    np.testing.assert_array_equal(history.samples(count).time, other.time[1:])
    np.testing.assert_allclose(history.samples(count).signals, other.signals[:, 1:], rtol=1e-9, atol=1e-12)


def test_tunable_parameters_are_listed_with_their_bounds() -> None:
    by_path = {tunable.path: tunable for tunable in tunables(load_diagram("van_der_pol_pid", BLOCKS))}
    assert "PID.P" in by_path
    block = load_diagram("van_der_pol_pid", BLOCKS).block("PID")
    assert by_path["PID.P"].value == block.parameter_value("P")
    assert all(tunable.doc for tunable in by_path.values())


class Listener:
    """Collects the messages of a run, and the samples of its frames by their index."""

    def __init__(self) -> None:
        self.events: list[Any] = []
        self.times: list[float] = []
        self.changed = asyncio.Event()

    async def notify(self, event: run_messages.Message | bytes) -> None:
        if isinstance(event, bytes):
            header, time, _ = read_frame(event)
            assert header["first"] == len(self.times), "no sample is lost or repeated"
            self.times += time.tolist()
        else:
            self.events.append(event)
            if isinstance(event, run_messages.RunRewound):
                del self.times[event.count :]
        self.changed.set()

    async def until(self, kind: type, condition: Callable[[Any], bool] = lambda _: True) -> Any:
        async def waiting() -> Any:
            while True:
                for event in self.events:
                    if isinstance(event, kind) and condition(event):
                        return event
                self.changed.clear()
                await self.changed.wait()

        try:
            return await asyncio.wait_for(waiting(), 120)
        except TimeoutError:
            raise AssertionError(f"no such {kind} among {self.events}") from None


def test_a_run_in_a_process_is_tuned_rewound_and_finished() -> None:
    async def main() -> None:
        received = Listener()
        run = RunProcess("r", "d", Worker(), received.notify)
        source = diagram_to_bytes(load_diagram("van_der_pol_pid", BLOCKS), load_robot).decode()
        run.start({"diagram": source, "folder": ".", "speed": 5.0, "tuned": {"PID.I": "1/2"}})
        started = await received.until(run_messages.RunStarted)
        assert {t.path: t.value for t in started.tunables}["PID.I"] == 0.5, (
            "tried values apply from the start"
        )
        while len(received.times) < 100:
            await asyncio.sleep(0.02)
        run.send_command(run_messages.Control(run="r", action="pause"))
        await received.until(
            run_messages.RunProgress, lambda event: event.state == "paused"
        )  # after the last samples
        paused_count = len(received.times)
        run.send_command(run_messages.Tune(run="r", values={"PID.P": "2*3"}))
        assert (await received.until(run_messages.RunTuned)).parameter == "PID.P"
        run.send_command(run_messages.Tune(run="r", values={"PID.P": "six"}))
        assert "six" in (await received.until(run_messages.RunProgress, lambda event: event.fault)).message
        run.send_command(run_messages.Control(run="r", action="back"))
        assert (await received.until(run_messages.RunRewound)).count < paused_count
        received.events.clear()
        run.send_command(run_messages.Rewind(run="r", time=0.5))
        rewound = await received.until(run_messages.RunRewound)
        assert received.times[-1] <= 0.5
        assert rewound.count == len(received.times)
        run.send_command(run_messages.SetSpeed(run="r", speed=None))
        run.send_command(run_messages.Control(run="r", action="resume"))
        end = await received.until(run_messages.RunProgress, lambda event: event.state == "done")
        assert end.solver
        assert "auto" in end.reason
        assert np.all(np.diff(received.times) > 0)
        with pytest.raises(ArmblocksError, match="the run has ended"):
            run.send_command(run_messages.Control(run="r", action="back"))
        run.end()

    asyncio.run(main())

"""The worker process of one run: started in advance, given one job, ended with the run.

A job is JSON with these keys:

- ``diagram``: a canonical document.
- ``folder``: the folder of the project.
- ``trusted``: paths and digests of Python files whose code may run.
- ``run``, ``document``: keys.
- ``speed``: simulated seconds per second; ``null`` for as fast as possible.
- ``tuned``: tried values of tunable parameters.

Commands are the requests of :mod:`armblocks.studio.protocol.messages`. The worker executes them between two
parts of the run.
"""

from __future__ import annotations

import contextlib
import json
import math
import signal
import sys
from collections.abc import Mapping
from multiprocessing.connection import Connection
from time import perf_counter, sleep
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from armblocks import formats
from armblocks.blocks import BLOCKS
from armblocks.compiler.target import host_target
from armblocks.diagram import Diagram, TimeTable, diagram_views
from armblocks.errors import ArmblocksError, DiagramError, SimulationError
from armblocks.face.diagram_run import DiagramRun
from armblocks.face.model import CompiledDiagram
from armblocks.simulation import SimulationResult
from armblocks.simulation.jumps import Jumps, merged
from armblocks.studio.documents.project_data import ProjectData, files_of, unloaded_fault
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.documents.trusted_files import TrustedFiles
from armblocks.studio.protocol.frames import sample_frame, thinned
from armblocks.studio.protocol.messages import runs as run_messages
from armblocks.studio.runs.history import RunHistory
from armblocks.studio.runs.pace import Pace
from armblocks.studio.runs.tunables import tunables
from armblocks.studio.sheet.parameter_values import tuned_value

Array = NDArray[np.float64]
FRAME_SECONDS = 1 / 60
MAX_MEMORY_BYTES = 8 * 2**30
"""Limit of the address space of a worker, bytes."""
MAX_CPU_SECONDS = 3600
MAX_NUMBERS = 16_000_000
"""Limit of the numbers of one run that a client receives (128 MB); longer records are reduced to extremes."""


def work(pipe: Connection) -> None:
    """Prepare for any run, wait for the job, and run it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the server handles Ctrl-C in the terminal
    limit_process()
    host_target()  # starts LLVM, which takes longer than most runs
    with contextlib.suppress(EOFError, OSError):
        job = json.loads(pipe.recv_bytes())
        _Run(pipe, job).run()


def stride_of(run: DiagramRun) -> int:
    """Number of samples that are reduced to their extremes; 1 unless the samples fill the client's memory."""
    numbers = run.simulation.planned * (1 + run.simulation.compiled.signals_layout.size)
    return 1 if numbers <= MAX_NUMBERS else math.ceil(2 * numbers / MAX_NUMBERS)


def limit_process() -> None:
    """Limit memory and processor time of this process."""
    if sys.platform == "win32":
        return
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY_BYTES, MAX_MEMORY_BYTES))
    # The soft limit sends SIGXCPU, which identifies its cause; the hard limit would look like lack of memory.
    resource.setrlimit(resource.RLIMIT_CPU, (MAX_CPU_SECONDS, MAX_CPU_SECONDS + 5))


def begin_run(job: Mapping[str, Any]) -> RunHistory:
    """Return the run of a job before its first step; raises ``ArmblocksError``."""
    diagram = diagram_of(job)
    for path, value in files_of(diagram):
        fault = value.fault if isinstance(value, TimeTable) else unloaded_fault(value)
        if fault is not None:
            raise DiagramError(fault.what, where=f"block '{path}'", allowed=fault.allowed, fix=fault.fix)
    history = RunHistory(CompiledDiagram(diagram))
    if job["tuned"]:
        history.tune({path: tuned_value(value, path) for path, value in job["tuned"].items()})
    return history


def diagram_of(job: Mapping[str, Any]) -> Diagram:
    """Return the diagram of a job, possibly incomplete; runs the code of its trusted Python files."""
    folder = ProjectFolder(job["folder"])
    return formats.diagram_from_bytes(
        job["diagram"].encode(),
        "model",
        BLOCKS,
        formats.load_robot,
        folder=folder.root,
        read_library=folder.read_library,
        read_data=ProjectData(folder, TrustedFiles(pairs=job.get("trusted", ())), runs_code=True),
        draft=True,  # tracing rejects diagrams that cannot run
    )


class _Run:
    def __init__(self, pipe: Connection, job: dict[str, Any]) -> None:
        self.pipe = pipe
        self.key: str = job["run"]
        self.document: str = job["document"]
        self.pace = Pace(job["speed"])
        self.job = job
        self.tuned: dict[str, Any] = job["tuned"]
        self.state: Literal["running", "paused", "done", "stopped", "failed"] = "running"
        self.time = 0.0
        """Time up to which samples were sent, s; without a real-time factor the run may be one step ahead."""
        self.count = 0
        """Number of samples that were sent."""
        self.stride = 1
        """Number of samples that are reduced to their extremes."""
        self.times: Array = np.empty(0)
        """Times of the rows that were sent: samples and both sides of jumps, s."""
        self.numbers: NDArray[np.intp] = np.empty(0, dtype=np.intp)
        """For each row, the number of samples up to the sample with which it was sent."""
        self.began = perf_counter()

    def run(self) -> None:
        """Execute the run to its end or to an error."""
        try:
            self._simulate()
        except SimulationError as error:
            self._send_rest(error.partial)
            self._fail(error)
        except ArmblocksError as error:
            self._fail(error)
        except MemoryError:
            fix = "record fewer samples, or shorten the run"
            self._fail(SimulationError("the run exceeds its memory limit", fix=fix, where="run"))
        except OSError:
            raise  # the server has ended
        except Exception as error:  # a defect is reported; the model is not affected
            self._fail(_defect(error))

    def _simulate(self) -> None:
        history = begin_run(self.job)
        self.stride = stride_of(history.run)
        self._notify_start(history.run)
        self.began = perf_counter()
        self.pace.count_from(0.0)
        while True:
            self._advance(history)
            self._send_samples(history)
            if history.run.finished and self.count == history.recorded:
                report = history.run.result().run
                self._end("done", report.message, report.solver, report.reason)
                return
            self._progress()
            if not self._listen(history):
                self._end("stopped", f"stopped at {self.time:g} s")
                return

    def _advance(self, history: RunHistory) -> None:
        """Advance by one sample if paused, else up to the clock time or for the duration of a frame."""
        run = history.run
        if self.state == "paused":
            history.step()
            return
        target = self.pace.target_time
        if run.time < target:
            history.add_snapshot()
            run.advance(None if target == math.inf else target, wall_time=FRAME_SECONDS)

    def _listen(self, history: RunHistory) -> bool:
        """Execute pending commands, wait if paused or ahead of the clock; return ``False`` to stop."""
        while True:
            wait = 0.0
            if self.state == "paused":
                wait = 0.5
            elif self.pace.speed is not None:
                wait = FRAME_SECONDS
            if not self.pipe.poll(wait):
                if self.state == "paused":
                    continue
                return True
            command = json.loads(self.pipe.recv_bytes())
            match command["kind"], command.get("action"):
                case "control", "stop":
                    return False
                case "control", "pause":
                    self._return_to_shown_time(history)
                    self._set_state("paused")
                case "control", "resume":
                    self._set_state("running")
                case "control", "step":
                    return True
                case "control", "back":
                    self._go_back(history, self.count - 1)
                case "rewind", _:
                    sample_count = int(np.searchsorted(self.times, float(command["time"]), "right"))
                    self._go_back(history, int(self.numbers[sample_count - 1]) if sample_count else 0)
                case "speed", _:
                    self.pace.speed = command["speed"]
                    self.pace.count_from(self.time)
                case _:
                    self._tune(history, command["values"])

    def _set_state(self, state: Literal["running", "paused"]) -> None:
        self.state = state
        self.pace.count_from(self.time)
        self._progress()

    def _tune(self, history: RunHistory, values: Mapping[str, Any]) -> None:
        """Change parameters from the present time on; report an invalid value and continue."""
        try:
            self._return_to_shown_time(history)
            history.tune({path: tuned_value(value, path) for path, value in values.items()})
        except ArmblocksError as error:
            self._progress(error.what, _fault(error))
            return
        self.tuned |= values
        for path, value in values.items():
            self._notify(run_messages.RunTuned(run=self.key, time=self.time, parameter=path, value=value))

    def _go_back(self, history: RunHistory, recorded: int) -> None:
        """Return to at most ``recorded`` samples; tuned values apply from there on."""
        history.return_to_sample(max(recorded, 1))
        self.count, self.time = history.recorded, history.run.time
        sample_count = int(np.searchsorted(self.numbers, self.count, "right"))
        self.times, self.numbers = self.times[:sample_count], self.numbers[:sample_count]
        self._notify(run_messages.RunRewound(run=self.key, time=self.time, count=sample_count))
        self._set_state("paused")

    def _return_to_shown_time(self, history: RunHistory) -> None:
        """Return to the displayed time if the run is beyond it, and send all samples up to there."""
        if history.run.time > self.time:
            history.return_to_time(self.time)
            self._send_samples(history)

    # -- messages to the hub ---------------------------------------------------------------------------------

    def _notify(self, event: run_messages.Message) -> None:
        self.pipe.send_bytes(b"J" + event.model_dump_json().encode())

    def _notify_start(self, run: DiagramRun) -> None:
        compiled, diagram = run.simulation.compiled, run.diagram
        self._notify(
            run_messages.RunStarted(
                document=self.document,
                run=self.key,
                stop_time=run.stop_time,
                channels=[
                    run_messages.Channel(
                        name=slot.name,
                        shape=list(slot.shape),
                        unit=slot.unit,
                        entries=list(slot.entries),
                        title=slot.title,
                    )
                    for slot in run.simulation.signals_layout
                ],
                views=[
                    run_messages.SinkView(
                        block=name,
                        kind=view.kind.value,
                        signals=list(view.signals),
                        labels=list(view.labels),
                        title=view.title,
                    )
                    for name, view in diagram_views(diagram)
                ],
                aliases=dict(compiled.aliases),
                tunables=tunables(diagram),
                stride=self.stride,
            )
        )

    def _send_samples(self, history: RunHistory) -> None:
        """Send the recorded samples that are due by the clock; if paused, all."""
        samples = history.samples(self.count)
        target = math.inf if self.state == "paused" else self.pace.target_time
        count = int(np.searchsorted(samples.time, target, "right"))
        last = history.run.finished and count == samples.time.size
        if not last:
            count -= count % self.stride
        if count:
            self._send(samples.time[:count], samples.signals[:, :count], samples.jumps, last=last)
        self.time = min(target, history.run.time)

    def _send(self, time: Array, signals: Array, jumps: Jumps, *, last: bool) -> None:
        """Send samples, with both sides of the jumps between the last sample sent and the last of these."""
        begin = float(self.times[-1]) if self.times.size else -math.inf
        instants = time
        time, signals = merged(time, signals, jumps.table.selected(slice(None), begin, float(time[-1])))
        if self.stride > 1:
            ends = time[-1:], signals[:, -1:]
            time, signals = thinned(time, signals, self.stride)
            if last and time[-1] < ends[0][0]:
                time, signals = np.append(time, ends[0]), np.append(signals, ends[1], axis=1)
        self.pipe.send_bytes(b"S" + sample_frame(self.key, self.times.size, time, signals))
        self.times = np.concatenate([self.times, time])
        # A side of a jump belongs to the next sample: after a return to an earlier time, it is sent again.
        numbers = self.count + 1 + np.searchsorted(instants, time)
        self.numbers = np.concatenate([self.numbers, numbers])
        self.count += instants.size

    def _send_rest(self, partial: object) -> None:
        """Send the valid samples of a failed run."""
        if isinstance(partial, SimulationResult) and partial.time.size > self.count:
            rest = slice(self.count, None)
            self._send(partial.time[rest], partial.signals[:, rest], partial.jumps, last=True)
            self.time = float(partial.time[-1])

    def _progress(
        self, message: str = "", fault: run_messages.Fault | None = None, solver: str = "", reason: str = ""
    ) -> None:
        factor = self.time / max(perf_counter() - self.began, 1e-9)
        self._notify(
            run_messages.RunProgress(
                document=self.document,
                run=self.key,
                state=self.state,
                time=self.time,
                real_time_factor=factor,
                message=message,
                fault=fault,
                solver=solver,
                reason=reason,
            )
        )

    def _end(
        self, state: Literal["done", "stopped"], message: str, solver: str = "", reason: str = ""
    ) -> None:
        self.state = state
        self._progress(message, solver=solver, reason=reason)
        # The pipe must remain open until its messages were sent.
        sleep(0.05)

    def _fail(self, error: ArmblocksError) -> None:
        self.state = "failed"
        self._progress(error.what, _fault(error))
        sleep(0.05)


def _defect(error: Exception) -> SimulationError:
    return SimulationError(
        f"armblocks has a defect ({type(error).__name__}: {str(error)[:200]})",
        where="run",
        allowed="a run, or an error that explains why it is impossible",
        fix="report it with the model; your drawing is not affected",
    )


def _fault(error: ArmblocksError) -> run_messages.Fault:
    return run_messages.Fault(what=error.what, where=error.where, allowed=error.allowed, fix=error.fix)

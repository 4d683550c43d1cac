"""Runs: requests and events between client, server and the process of a run."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from armblocks.studio.protocol.message import Event, Fault, Message, Request

# -- data of a run -------------------------------------------------------------------------------------------


class SinkView(Message):
    """The plot or 3-D view of a sink; ``signals`` are the recorded signals that it shows."""

    block: str
    kind: str
    signals: list[str]
    labels: list[str]
    title: str


class Channel(Message):
    """One recorded signal of a run, in the order of the columns of a frame.

    ``entries`` are the names of the entries of a vector, such as joints; empty if the entries are numbered.
    """

    name: str
    shape: list[int]
    unit: str
    entries: list[str]
    title: str = ""
    """The name that the user has given to the signal."""


class Tunable(Message):
    """A parameter that can be changed during a run; ``path`` is ``block.parameter``.

    ``low`` and ``high`` are the bounds that the block declares, ``None`` if unbounded.
    """

    path: str
    value: Any
    unit: str
    doc: str
    low: float | None
    high: float | None


# -- requests ------------------------------------------------------------------------------------------------


class Run(Request[str]):
    """Start a run. ``speed`` is simulated seconds per second; ``None`` runs as fast as possible.

    ``tuned``: tried values of tunable parameters, by ``block.parameter``; the model keeps its own values.
    """

    kind: Literal["run"] = "run"
    document: str
    speed: float | None = Field(default=None, gt=0, le=1000)
    tuned: dict[str, Any] = Field(default_factory=dict[str, Any])


class RunCommand(Request[None]):
    """A request about a run in progress."""

    run: str


class Control(RunCommand):
    """Pause, resume, stop or step a run. ``step`` and ``back`` move by one sample."""

    kind: Literal["control"] = "control"
    action: Literal["pause", "resume", "step", "back", "stop"]


class Rewind(RunCommand):
    """Pause a run and return to a time (s). Later samples are discarded; tuned values remain."""

    kind: Literal["rewind"] = "rewind"
    time: float


class SetSpeed(RunCommand):
    """Change the speed of a run; ``None`` runs as fast as possible."""

    kind: Literal["speed"] = "speed"
    speed: float | None = Field(default=None, gt=0, le=1000)


class Tune(RunCommand):
    """Change tunable parameters during a run, by ``block.parameter``, all at the same time."""

    kind: Literal["tune"] = "tune"
    values: dict[str, Any]


# -- events --------------------------------------------------------------------------------------------------


class RunEvent(Event):
    """A message from the process of a run, other than samples."""


class RunStarted(RunEvent):
    """The start of a run: its recorded signals, views and tunable parameters."""

    kind: Literal["run_started"] = "run_started"
    document: str
    run: str
    stop_time: float
    channels: list[Channel]
    views: list[SinkView]
    aliases: dict[str, str]
    tunables: list[Tunable]
    stride: int
    """Number of samples that are reduced to two extreme values of each signal; 1: no reduction."""


class RunTuned(RunEvent):
    """A parameter of a run has this value from this time (s) on."""

    kind: Literal["run_tuned"] = "run_tuned"
    run: str
    time: float
    parameter: str
    value: Any


class RunRenamed(RunEvent):
    """Blocks of the diagram of a run were renamed; ``renamed`` has their old and new paths."""

    kind: Literal["run_renamed"] = "run_renamed"
    run: str
    renamed: dict[str, str]


class RunRewound(RunEvent):
    """A run has returned to an earlier time (s); only the first ``count`` samples remain valid."""

    kind: Literal["run_rewound"] = "run_rewound"
    run: str
    time: float
    count: int


class RunProgress(RunEvent):
    """State and time of a run. At the end, ``solver`` and ``reason`` state which solver was used and why."""

    kind: Literal["run_progress"] = "run_progress"
    document: str
    run: str
    state: Literal["running", "paused", "done", "stopped", "failed"]
    time: float
    real_time_factor: float
    message: str
    fault: Fault | None = None
    solver: str = ""
    reason: str = ""

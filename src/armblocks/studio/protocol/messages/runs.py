"""What page, server and the process of a run say to each other about it."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from armblocks.studio.protocol.message import Event, Fault, Message, Request

# -- what is shown of a run ----------------------------------------------------------------------------------


class ViewOf(Message):
    """A picture that a sink asks for. ``robot`` is the key of its scene where the kind is ``robot``."""

    block: str
    kind: str
    signals: list[str]
    labels: list[str]
    title: str


class Channel(Message):
    """One recorded signal of a run and where its numbers lie in the columns of a frame.

    ``entries`` are names of the entries of a vector, such as joints; empty where they are numbered.
    """

    name: str
    shape: list[int]
    unit: str
    entries: list[str]


class Tunable(Message):
    """A parameter that can be changed while the run goes on; ``path`` is ``block.parameter``.

    ``low`` and ``high`` bound its numbers as the block declares it; ``None`` where nothing does.
    """

    path: str
    value: Any
    unit: str
    doc: str
    low: float | None
    high: float | None


# -- requests ------------------------------------------------------------------------------------------------


class Run(Request[str]):
    """Start the model. ``speed`` is simulated seconds per second, ``None`` as fast as possible.

    ``tuned``: values of tunable parameters, ``block.parameter``, that are tried without being in the model.
    """

    kind: Literal["run"] = "run"
    document: str
    speed: float | None = Field(default=None, gt=0, le=1000)
    tuned: dict[str, Any] = Field(default_factory=dict[str, Any])


class RunCommand(Request[None]):
    """A request to a run that is under way."""

    run: str


class Control(RunCommand):
    """Say how a run goes on. ``step`` and ``back`` go to the next and to the last recorded instant."""

    kind: Literal["control"] = "control"
    action: Literal["pause", "resume", "step", "back", "stop"]


class Rewind(RunCommand):
    """Pause a run and take it back to an instant (s): what came later is forgotten, tuned values stay."""

    kind: Literal["rewind"] = "rewind"
    time: float


class SetSpeed(RunCommand):
    """Change the speed of a run; ``None``: as fast as possible."""

    kind: Literal["speed"] = "speed"
    speed: float | None = Field(default=None, gt=0, le=1000)


class Tune(RunCommand):
    """Change a tunable parameter of a run that is under way."""

    kind: Literal["tune"] = "tune"
    parameter: str
    value: Any


# -- events --------------------------------------------------------------------------------------------------


class RunEvent(Event):
    """What the process of a run has to say, besides its samples."""


class RunStarted(RunEvent):
    """A run has begun: what it records and how it is to be shown."""

    kind: Literal["run_started"] = "run_started"
    document: str
    run: str
    stop_time: float
    channels: list[Channel]
    views: list[ViewOf]
    aliases: dict[str, str]
    tunables: list[Tunable]
    stride: int
    """Of so many recorded instants the page gets the extremes of each signal, as two; 1: it gets all."""


class RunTuned(RunEvent):
    """From this instant (s) on a parameter of a run has this value."""

    kind: Literal["run_tuned"] = "run_tuned"
    run: str
    time: float
    parameter: str
    value: Any


class RunRewound(RunEvent):
    """A run stands at an earlier instant (s) again: only the first ``count`` samples are still true."""

    kind: Literal["run_rewound"] = "run_rewound"
    run: str
    time: float
    count: int


class RunProgress(RunEvent):
    """Where a run stands. ``solver`` and ``reason`` say at its end what worked it out, and why that."""

    kind: Literal["run_progress"] = "run_progress"
    run: str
    state: Literal["running", "paused", "done", "stopped", "failed"]
    time: float
    real_time_factor: float
    message: str
    fault: Fault | None = None
    solver: str = ""
    reason: str = ""

"""Descriptions of a block's ports, states, guards, conditions and views."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from armblocks.argument_errors import ArgumentErrors
from armblocks.equations import Shape


@dataclass(frozen=True)
class Port(metaclass=ArgumentErrors):
    """One input or output of a block.

    - ``shape``: the only allowed shape, or ``None`` if it follows from the connections.
    - ``unit``: SI, or ``""`` if the port has no unit or the unit of its signal.
    - ``names``: the names of the entries of a vector, such as joints, if the block has names for them.
    - ``before_events``: an output with the value before the events of its block at the same instant, such as
      the state of an integrator before a reset.
    - ``internal``: a port between blocks of a flat diagram that a pass has added. A run does not record its
      signal.
    """

    name: str
    doc: str
    unit: str = ""
    shape: Shape | None = None
    names: tuple[str, ...] = ()
    before_events: bool = False
    internal: bool = False


@dataclass(frozen=True)
class State(metaclass=ArgumentErrors):
    """One state or mode of a block; the integrator stores its value, the block does not.

    - ``follows``: whether a mode is a following mode, that is, a function of the present signals. Following
      modes are made consistent before any event (an edge, a trigger, a reset) is processed. Other modes are
      stateful.
    - ``hysteresis``: whether a following mode also depends on its previous value: the value before the
      instant, or before the latest event at this instant. A discrete state with ``hysteresis`` is captured at
      the same times.
    - ``stored_while``: a mode of the same block. While it is 0, the previous value does not change.
    - ``momentary``: whether a discrete state becomes 0 at the end of every instant.
    - ``captured_when_enabled``: whether a discrete state is also captured when the subsystem of the block is
      enabled.
    """

    name: str
    shape: Shape
    doc: str
    unit: str = ""
    follows: bool = False
    hysteresis: bool = False
    stored_while: str = ""
    momentary: bool = False
    captured_when_enabled: bool = False

    @property
    def before(self) -> str:
        """The name of the discrete state with the previous value of this mode."""
        return name_before(self.name)


def name_before(mode: str) -> str:
    """The name of the discrete state with the previous value of a mode."""
    return f"{mode} before"


@dataclass(frozen=True)
class Guard:
    """A quantity of a block whose zero crossings are events; each entry of a vector is a separate guard.

    - ``direction``: +1 for upward crossings, -1 for downward, 0 for both.
    - ``action``: effect on the run where the guard is positive: ``stop`` ends the run, ``fail`` is an error,
      ``warn`` is reported at the end.
    - ``locates``: whether a zero crossing only locates a change of a following mode.
    - ``disabled_by``: the momentary state that disables the guard while it is not 0. At the end of the
      instant, the guard is initialised again with its sign at that time.
    """

    name: str
    shape: Shape
    doc: str
    direction: int = 0
    action: str = ""
    locates: bool = False
    disabled_by: str = ""


@dataclass(frozen=True)
class DelayLine:
    """The delayed value of an ``input`` of a block, with the input's ``shape``."""

    name: str
    shape: Shape
    doc: str
    input: str


@dataclass(frozen=True)
class Condition:
    """A boolean function of a block's values, by element: 1 where a quantity is positive, else 0.

    ``closed``: whether 0 itself counts as positive. ``located``: whether a change of the condition is an
    event; if not, the condition is evaluated together with the equations.
    """

    name: str
    shape: Shape
    doc: str
    closed: bool = True
    located: bool = True


@dataclass(frozen=True, order=True)
class PortRef:
    """A port of a named block, written ``block/port``."""

    block: str
    port: str

    def __str__(self) -> str:
        return f"{self.block}/{self.port}"


class ViewKind(Enum):
    """The kinds of views of sinks."""

    TRACES = "traces"
    """Every signal over time (Scope)."""
    PATH = "path"
    """The second signal over the first, equal axes where the units agree (XY Graph)."""
    VALUE = "value"
    """The value at the end or at the selected time (Display)."""
    ROBOT = "robot"
    """A moving robot: the only signal is the poses of its links, shape (L+2, 4, 4)."""
    SPECTRUM = "spectrum"
    """Every signal over the frequency (Spectrum); ``subject`` is a ``SpectrumSettings``."""
    DATA = "data"
    """Stored for export only (To Workspace)."""
    FILE = "file"
    """Stored in a separate file (To File); ``subject`` is a ``FileSettings``."""


@dataclass(frozen=True, kw_only=True)
class SpectrumSettings:
    """Settings of a spectrum; see the block Spectrum, whose parameters these are."""

    quantity: str
    window: str
    averages: int
    sample_rate: float
    begin: float
    remove_mean: bool
    decibels: bool
    logarithmic: bool


@dataclass(frozen=True, kw_only=True)
class FileSettings:
    """Settings of a file output; see the block ToFile, whose parameters these are."""

    file: str
    decimation: int
    limit: int


@dataclass(frozen=True, kw_only=True)
class View:
    """One view of a block; report and studio draw it without knowledge of the block's class.

    ``signals`` names ports or records of the block itself, so that ``f"{block}/{signal}"`` is the name of a
    signal of the simulation result. ``labels`` gives a text for each (``""``: the signal's own name).
    ``subject`` is the ``Robot`` to draw for the kind ``ROBOT``, and the settings for ``SPECTRUM`` and
    ``FILE``.
    """

    kind: ViewKind
    signals: tuple[str, ...]
    labels: tuple[str, ...] = ()
    title: str = ""
    subject: object | None = None

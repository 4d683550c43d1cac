"""Subsystems that work only at times: enabled, triggered, reset, or chosen by an If or Switch Case block.

A flat diagram has, in the place of the subsystem, a *control* block that works out from the control signal
whether the blocks inside work, start anew, or do their work just now; each output holds its value while they
do not. The blocks inside find it on hidden inputs: see :mod:`armblocks.diagram.conditional_equations`.

A control signal that flows makes an event where it passes zero, located exactly. One that jumps at a tick
acts within the same tick: first the control follows, then the blocks inside, in their order.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from numpy.typing import ArrayLike

from armblocks.diagram.block import Block
from armblocks.diagram.parameter import ParameterKind, parameter
from armblocks.diagram.port import Port
from armblocks.diagram.structure import DiagramBlock
from armblocks.diagram.worked_example import WorkedExample, made

_STATES = ("held", "reset")
_EDGES = ("rising", "falling", "either")
_PULSES = made("PulseGenerator", period=4.0, width=50.0)


@dataclass(frozen=True, kw_only=True)
class EnabledSubsystem(DiagramBlock):
    """A subsystem that works while its input enable is positive, and stands still while it is not.

    While it is off, its continuous and sampled states keep their values, and its outputs are held, or go back
    to what their Out blocks have as ``initial``. When it is switched on, its states go on from where they
    were or start anew.
    """

    title: ClassVar[str] = "Enabled Subsystem"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="While the pulse is 0 the output keeps the value that the sine had last.",
        inputs={"enable": _PULSES},
        shown=("In1", "enable", "Out1"),
    )

    states_when_enabling: str = parameter(
        "held", choices=_STATES, doc="whether states go on or start anew when it is switched on"
    )

    def control_ports(self) -> tuple[Port, ...]:
        return (Port("enable", "works while it is positive", "", ()),)


@dataclass(frozen=True, kw_only=True)
class TriggeredSubsystem(DiagramBlock):
    """A subsystem that works once, at the instant, whenever its input trigger fires; outputs are held.

    The trigger fires where it becomes positive (rising), stops being positive (falling), or either. Sampled
    blocks inside take one step at each firing, with the time since the last one as their period.
    """

    title: ClassVar[str] = "Triggered Subsystem"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Each time the pulse rises the output takes the value of the sine, and holds it.",
        inputs={"trigger": _PULSES},
        shown=("In1", "trigger", "Out1"),
    )

    edge: str = parameter("rising", choices=_EDGES, doc="when the trigger fires")

    def control_ports(self) -> tuple[Port, ...]:
        return (Port("trigger", "works when it fires", "", ()),)


@dataclass(frozen=True, kw_only=True)
class EnabledTriggeredSubsystem(DiagramBlock):
    """A subsystem that works once, at the instant, whenever its trigger fires while enable is positive."""

    title: ClassVar[str] = "Enabled and Triggered Subsystem"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The output takes the value of the sine where the pulse rises, but only while enable is 1.",
        inputs={"trigger": _PULSES, "enable": made("Step", time=3.0)},
        shown=("In1", "trigger", "Out1"),
    )

    edge: str = parameter("rising", choices=_EDGES, doc="when the trigger fires")

    def control_ports(self) -> tuple[Port, ...]:
        return (
            Port("enable", "the trigger counts while it is positive", "", ()),
            Port("trigger", "works when it fires", "", ()),
        )


@dataclass(frozen=True, kw_only=True)
class ResettableSubsystem(DiagramBlock):
    """A subsystem that always works, and whose states all start anew whenever its input reset fires."""

    title: ClassVar[str] = "Resettable Subsystem"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A subsystem without states: the output is the input, whatever the reset does.",
        inputs={"reset": _PULSES},
        shown=("In1", "reset", "Out1"),
    )

    edge: str = parameter("rising", choices=_EDGES, doc="when the reset fires")

    def control_ports(self) -> tuple[Port, ...]:
        return (Port("reset", "starts all states anew when it fires", "", ()),)


@dataclass(frozen=True, kw_only=True)
class ActionSubsystem(DiagramBlock):
    """A subsystem that works while an If or Switch Case block chooses it: while its input action is 1."""

    title: ClassVar[str] = "Action Subsystem"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The If block chooses the subsystem while the sine is positive; its output is held otherwise.",
        inputs={"action": made("If").by(u="In1").at("if1")},
        shown=("In1", "Out1"),
    )

    states_when_resuming: str = parameter(
        "held", choices=_STATES, doc="whether states go on or start anew when it is chosen again"
    )

    def control_ports(self) -> tuple[Port, ...]:
        return (Port("action", "works while it is 1", "", ()),)


@dataclass(frozen=True, kw_only=True)
class Merge(Block):
    """The outputs of several conditional subsystems on one wire: y = that of the one which worked last."""

    title: ClassVar[str] = "Merge"
    virtual: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="An If block chooses one of two subsystems by the sign of a sine; "
        "the merged signal is what it gives.",
        inputs={
            "u1": made("ActionSubsystem")
            .named("positive")
            .by(In1=made("Constant"), action=made("If").by(u=made("SineWave")).named("if").at("if1")),
            "u2": made("ActionSubsystem")
            .named("negative")
            .by(
                In1=made("Constant", value=-1.0),
                action="if/else",
            ),
        },
        shown=("sine wave/y", "y"),
    )

    inputs: int = parameter(2, minimum=1, doc="how many inputs")
    initial: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, doc="the output before any of them has worked"
    )

    def input_ports(self) -> tuple[Port, ...]:
        return tuple(
            Port(f"u{number}", f"output {number} of a conditional subsystem")
            for number in range(1, self.inputs + 1)
        )

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the output of the one that worked last"),)


Conditional = (
    EnabledSubsystem | TriggeredSubsystem | EnabledTriggeredSubsystem | ResettableSubsystem | ActionSubsystem
)

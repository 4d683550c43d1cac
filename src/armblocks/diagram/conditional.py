"""Conditional subsystems: enabled, triggered, resettable, or activated by an If or Switch Case block.

In a flat diagram a *control* block replaces the subsystem. It computes from the control signal whether the
blocks inside are active, reset, or triggered; the outputs hold their values while the subsystem is inactive.
The blocks inside read these values from hidden inputs: see :mod:`armblocks.diagram.conditional_equations`.

A zero crossing of a continuous control signal is an event, located exactly. A control signal that jumps at a
tick acts within the same tick: first the control block is updated, then the blocks inside, in evaluation
order.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from numpy.typing import ArrayLike

from armblocks.diagram.block import Block
from armblocks.diagram.parameter import ParameterKind, parameter
from armblocks.diagram.port import Port
from armblocks.diagram.structure import DiagramBlock
from armblocks.diagram.worked_example import WorkedExample, driver

_STATES = ("held", "reset")
_EDGES = ("rising", "falling", "either")
_PULSES = driver("PulseGenerator", period=4.0, width=50.0)


@dataclass(frozen=True, kw_only=True)
class EnabledSubsystem(DiagramBlock):
    """An enabled subsystem: it is active while its input enable is positive.

    While it is disabled, its states keep their values, and its outputs are held or return to ``initial`` of
    their Out blocks. When it is enabled, its states continue from their values or are reset.
    """

    title: ClassVar[str] = "Enabled Subsystem"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="While the pulse is 0, the output holds the last value of the sine.",
        inputs={"enable": _PULSES},
        shown=("In1", "enable", "Out1"),
    )

    states_when_enabling: str = parameter(
        "held", choices=_STATES, doc="whether the states are held or reset when it is enabled"
    )

    def control_ports(self) -> tuple[Port, ...]:
        return (Port("enable", "active while positive", "", ()),)


@dataclass(frozen=True, kw_only=True)
class TriggeredSubsystem(DiagramBlock):
    """A triggered subsystem: it executes once whenever its input trigger fires; outputs are held in between.

    The trigger fires where it becomes positive (rising), stops being positive (falling), or at both (either).
    Sampled blocks inside take one step at each trigger event; their period is the time since the previous
    event. Integrals therefore use the interval from the previous to the present event.
    """

    title: ClassVar[str] = "Triggered Subsystem"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="At each rising edge of the pulse the output samples the sine and holds the value.",
        inputs={"trigger": _PULSES},
        shown=("In1", "trigger", "Out1"),
    )

    edge: str = parameter("rising", choices=_EDGES, doc="edge that executes the subsystem")

    def control_ports(self) -> tuple[Port, ...]:
        return (Port("trigger", "each event executes the subsystem", "", ()),)


@dataclass(frozen=True, kw_only=True)
class EnabledTriggeredSubsystem(DiagramBlock):
    """An enabled and triggered subsystem: it executes when its trigger fires while enable is positive."""

    title: ClassVar[str] = "Enabled and Triggered Subsystem"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The output samples the sine at rising edges of the pulse, but only while enable is 1.",
        inputs={"trigger": _PULSES, "enable": driver("Step", time=3.0)},
        shown=("In1", "trigger", "Out1"),
    )

    edge: str = parameter("rising", choices=_EDGES, doc="edge that executes the subsystem")

    def control_ports(self) -> tuple[Port, ...]:
        return (
            Port("enable", "enables the trigger while positive", "", ()),
            Port("trigger", "each event executes the subsystem", "", ()),
        )


@dataclass(frozen=True, kw_only=True)
class ResettableSubsystem(DiagramBlock):
    """A resettable subsystem: always active; each event at the input ``reset`` resets all inner states."""

    title: ClassVar[str] = "Resettable Subsystem"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Each rising edge of the pulse resets the integrator inside the subsystem.",
        inputs={"reset": _PULSES},
        shown=("In1", "reset", "Out1"),
    )

    edge: str = parameter("rising", choices=_EDGES, doc="edge that resets the states")

    def control_ports(self) -> tuple[Port, ...]:
        return (Port("reset", "each event resets all states", "", ()),)


@dataclass(frozen=True, kw_only=True)
class ActionSubsystem(DiagramBlock):
    """An action subsystem: active while an If or Switch Case block selects it (input action = 1)."""

    title: ClassVar[str] = "Action Subsystem"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The If block activates the subsystem while the sine is positive, else its output is held.",
        inputs={"action": driver("If").by(u="In1").at("if1")},
        shown=("In1", "Out1"),
    )

    states_when_resuming: str = parameter(
        "held", choices=_STATES, doc="whether the states are held or reset when it is activated again"
    )

    def control_ports(self) -> tuple[Port, ...]:
        return (Port("action", "active while it is 1", "", ()),)


@dataclass(frozen=True, kw_only=True)
class Merge(Block):
    """Merges outputs of conditional subsystems: y is the output of the subsystem that was active last."""

    title: ClassVar[str] = "Merge"
    virtual: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="An If block activates one of two subsystems by the sign of a sine; "
        "Merge passes the output of the active one.",
        inputs={
            "u1": driver("ActionSubsystem")
            .named("positive")
            .by(In1=driver("Constant"), action=driver("If").by(u=driver("SineWave")).named("if").at("if1")),
            "u2": driver("ActionSubsystem")
            .named("negative")
            .by(
                In1=driver("Constant", value=-1.0),
                action="if/else",
            ),
        },
        shown=("sine wave/y", "y"),
    )

    inputs: int = parameter(2, minimum=1, doc="number of inputs")
    initial: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, doc="the output before any subsystem has been active"
    )

    def input_ports(self) -> tuple[Port, ...]:
        return tuple(
            Port(f"u{number}", f"output {number} of a conditional subsystem")
            for number in range(1, self.inputs + 1)
        )

    def bus_inputs(self) -> tuple[str, ...]:
        return tuple(port.name for port in self.input_ports())

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the output of the subsystem that was active last"),)


Conditional = (
    EnabledSubsystem | TriggeredSubsystem | EnabledTriggeredSubsystem | ResettableSubsystem | ActionSubsystem
)

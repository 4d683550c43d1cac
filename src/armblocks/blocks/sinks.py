"""Blocks that show or keep what they receive: they have no outputs, only views."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.blocks.elementwise import numbered_ports
from armblocks.diagram import Block, Port, View, ViewKind, WorkedExample, made, parameter


@dataclass(frozen=True, kw_only=True)
class Scope(Block):
    """Traces of all inputs over time."""

    family: ClassVar[str] = "sinks"
    title: ClassVar[str] = "Scope"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Two signals of one unit, in one panel.",
        parameters={"inputs": 2},
        inputs={"u1": made("SineWave"), "u2": made("PulseGenerator")},
    )

    inputs: int = parameter(1, minimum=1, doc="how many inputs")

    def input_ports(self) -> tuple[Port, ...]:
        return numbered_ports("u", self.inputs, "what is traced")

    def views(self) -> tuple[View, ...]:
        return (View(kind=ViewKind.TRACES, signals=tuple(port.name for port in self.input_ports())),)


@dataclass(frozen=True, kw_only=True)
class XYGraph(Block):
    """The path of one signal over another."""

    family: ClassVar[str] = "sinks"
    title: ClassVar[str] = "XY Graph"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A figure of Lissajous: two sines of different frequency, one over the other.",
        inputs={"x": made("SineWave", frequency=2.0), "y": made("SineWave", frequency=3.0)},
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("x", "along the horizontal axis"), Port("y", "along the vertical axis"))

    def views(self) -> tuple[View, ...]:
        return (View(kind=ViewKind.PATH, signals=("x", "y")),)


@dataclass(frozen=True, kw_only=True)
class Display(Block):
    """The numbers themselves: of one signal, or of several."""

    family: ClassVar[str] = "sinks"
    title: ClassVar[str] = "Display"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The number as it stands at the end of the run.",
        inputs={"u": made("Ramp", slope=0.5)},
    )

    inputs: int = parameter(1, minimum=1, doc="how many inputs")

    def input_ports(self) -> tuple[Port, ...]:
        return numbered_ports("u", self.inputs, "what is shown")

    def views(self) -> tuple[View, ...]:
        return (View(kind=ViewKind.VALUE, signals=tuple(port.name for port in self.input_ports())),)


@dataclass(frozen=True, kw_only=True)
class ToWorkspace(Block):
    """Keeps the signal under a name in the exported data."""

    family: ClassVar[str] = "sinks"
    title: ClassVar[str] = "To Workspace"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The signal is kept under the name that is given; a scope shows it here.",
        inputs={"u": made("SineWave")},
        shown=("u",),
    )

    variable: str = parameter("simout", doc="the name of the variable")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "what is kept"),)

    def views(self) -> tuple[View, ...]:
        return (View(kind=ViewKind.DATA, signals=("u",), labels=(self.variable,)),)


@dataclass(frozen=True, kw_only=True)
class Terminator(Block):
    """Takes a signal that nobody needs."""

    family: ClassVar[str] = "sinks"
    title: ClassVar[str] = "Terminator"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Nothing is done with the signal; a scope shows it here.",
        inputs={"u": made("SineWave")},
        shown=("u",),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "what is not needed"),)

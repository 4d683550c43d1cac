"""Blocks that show or keep what they receive: they have no outputs, only views."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.blocks.elementwise import numbered_ports
from armblocks.diagram import Block, Port, View, ViewKind, parameter


@dataclass(frozen=True, kw_only=True)
class Scope(Block):
    """Traces of all inputs over time."""

    family: ClassVar[str] = "sinks"
    title: ClassVar[str] = "Scope"

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

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("x", "along the horizontal axis"), Port("y", "along the vertical axis"))

    def views(self) -> tuple[View, ...]:
        return (View(kind=ViewKind.PATH, signals=("x", "y")),)


@dataclass(frozen=True, kw_only=True)
class Display(Block):
    """The numbers themselves: of one signal, or of several."""

    family: ClassVar[str] = "sinks"
    title: ClassVar[str] = "Display"

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

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "what is not needed"),)

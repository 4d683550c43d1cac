"""Virtual blocks of connections: Goto and From tags, and buses of several named signals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.diagram.block import Block
from armblocks.diagram.parameter import parameter
from armblocks.diagram.port import Port
from armblocks.diagram.signs import Outline
from armblocks.diagram.worked_example import WorkedExample, driver
from armblocks.errors import InputError

_NAMES = "unique names of letters, digits and _, separated by commas"
_PATHS = "unique paths of elements, such as speed or motor.speed, separated by commas"


def listed(text: str) -> tuple[str, ...]:
    """The entries of a list such as ``"speed, torque"``."""
    return tuple(entry.strip() for entry in text.split(",") if entry.strip())


def port_names(paths: tuple[str, ...]) -> tuple[str, ...]:
    """A port name for each path of a bus element: its last part, or the whole path if that is not unique."""
    last = [path.rpartition(".")[2] for path in paths]
    return tuple(
        short if last.count(short) == 1 else path.replace(".", "_") for short, path in zip(last, paths)
    )


def _check_list(text: str, where: str, *, nested: bool) -> None:
    entries = listed(text)
    parts = [part for entry in entries for part in (entry.split(".") if nested else [entry])]
    invalid = [part for part in parts if not part.isidentifier()]
    duplicates = [entry for entry in entries if entries.count(entry) > 1]
    if invalid or duplicates or not entries:
        problem = (
            f"'{(invalid or duplicates)[0]}' in '{text}' is not allowed"
            if invalid or duplicates
            else "the list is empty"
        )
        raise InputError(problem, where=where, allowed=_PATHS if nested else _NAMES, fix="correct the list")


@dataclass(frozen=True, kw_only=True)
class Goto(Block):
    """Sends a signal to the From blocks with the same tag, without a connection.

    A local tag is visible in this diagram only, a scoped tag also in its subsystems, a global tag everywhere.
    """

    title: ClassVar[str] = "Goto"
    outline: ClassVar[Outline] = Outline.TAG
    virtual: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A From block receives the signal of the Goto block with the same tag.",
        shown=("u", driver("From")),
    )

    tag: str = parameter("A", doc="tag of the signal")
    visibility: str = parameter("local", choices=("local", "scoped", "global"), doc="visibility of the tag")

    def check(self) -> None:
        _check_tag(self.tag, "Goto.tag")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "signal to send"),)


@dataclass(frozen=True, kw_only=True)
class From(Block):
    """Receives the signal of the Goto block with the same tag."""

    title: ClassVar[str] = "From"
    outline: ClassVar[Outline] = Outline.TAG
    virtual: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A From block receives the signal of the Goto block with the same tag.",
        extra_blocks=(driver("Goto").by(u=driver("SineWave")),),
    )

    tag: str = parameter("A", doc="tag of the signal")

    def check(self) -> None:
        _check_tag(self.tag, "From.tag")

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "received signal"),)


@dataclass(frozen=True, kw_only=True)
class BusCreator(Block):
    """Combines several named signals in a bus; a bus may be an element of a bus."""

    title: ClassVar[str] = "Bus Creator"
    outline: ClassVar[Outline] = Outline.BUS
    virtual: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A bus of two signals: the scope shows both under their names.",
        parameters={"names": "position, speed"},
        shown=("bus",),
    )

    names: str = parameter("a, b", doc="the names of the elements, in order")

    def check(self) -> None:
        _check_list(self.names, "BusCreator.names", nested=False)

    def input_ports(self) -> tuple[Port, ...]:
        return tuple(Port(name, f"element {name}") for name in listed(self.names))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("bus", "the bus of all elements"),)


@dataclass(frozen=True, kw_only=True)
class BusSelector(Block):
    """Selects elements of a bus by their paths: speed, or motor.speed of a nested bus."""

    title: ClassVar[str] = "Bus Selector"
    outline: ClassVar[Outline] = Outline.BUS
    virtual: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The speed is selected from a bus of position and speed.",
        parameters={"elements": "speed"},
        inputs={"bus": driver("BusCreator", names="position, speed")},
        shown=("bus", "speed"),
    )

    elements: str = parameter("a, b", doc="the paths of the elements, in order")

    def check(self) -> None:
        _check_list(self.elements, "BusSelector.elements", nested=True)

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("bus", "the bus"),)

    def output_ports(self) -> tuple[Port, ...]:
        paths = listed(self.elements)
        return tuple(Port(name, f"element {path}") for name, path in zip(port_names(paths), paths))


@dataclass(frozen=True, kw_only=True)
class BusAssignment(Block):
    """Replaces some elements of a bus by other signals."""

    title: ClassVar[str] = "Bus Assignment"
    outline: ClassVar[Outline] = Outline.BUS
    virtual: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The speed in the bus is replaced by another signal; the position is unchanged.",
        parameters={"elements": "speed"},
        inputs={
            "bus": driver("BusCreator", names="position, speed"),
            "speed": driver("SineWave", frequency=3.0).named("new speed"),
        },
        shown=("bus assignment/bus",),
    )

    elements: str = parameter("a", doc="the paths of the elements that are replaced")

    def check(self) -> None:
        _check_list(self.elements, "BusAssignment.elements", nested=True)
        if "bus" in port_names(listed(self.elements)):
            raise InputError(
                "an element is named 'bus', like the port of the bus itself",
                where="BusAssignment.elements",
                allowed="other names",
                fix="rename the element in the Bus Creator",
            )

    def input_ports(self) -> tuple[Port, ...]:
        paths = listed(self.elements)
        assigned = (Port(name, f"the new {path}") for name, path in zip(port_names(paths), paths))
        return (Port("bus", "the bus"), *assigned)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("bus", "the bus with the new elements"),)


def _check_tag(tag: str, where: str) -> None:
    if not tag.isidentifier():
        raise InputError(
            f"the tag is '{tag[:60]}'",
            where=where,
            allowed="letters, digits and _, not beginning with a digit",
            fix="choose another tag",
        )

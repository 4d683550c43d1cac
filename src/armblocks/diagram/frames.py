"""Frame ports and the undirected lines between them: physical connections of a diagram.

A signal has a direction, from an output to an input. A frame has none: a line between two frame ports states
that both frames are the same frame, and all frame ports that lines connect are one frame. Frame ports are
therefore a separate list of a block, and lines a separate field of a diagram: everything that concerns the
direction of signals needs no exception for them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

from armblocks.argument_errors import ArgumentErrors
from armblocks.diagram.port import PortRef
from armblocks.errors import InputError

Side = Literal["left", "right"]
"""A side of a block."""


@dataclass(frozen=True)
class FramePort(metaclass=ArgumentErrors):
    """A port of a block that is a coordinate frame, such as the base or the follower of a joint.

    ``side``: where drawings put the port on a block that is not flipped.
    """

    name: str
    doc: str
    side: Side = "left"


@dataclass(frozen=True, order=True)
class FrameLine(metaclass=ArgumentErrors):
    """A line between two frame ports, which are then the same frame.

    A line has no direction: its ends are stored in sorted order, so that equal lines compare equal. Raises
    ``InputError`` for a line from a port to itself.
    """

    first: PortRef
    second: PortRef

    def __post_init__(self) -> None:
        if self.first == self.second:
            raise InputError(
                f"a line connects '{self.first}' with itself",
                where="frame line",
                allowed="lines between two frame ports",
                fix="remove the line, or choose another port for one of its ends",
            )
        if self.second < self.first:
            first, second = self.second, self.first
            object.__setattr__(self, "first", first)
            object.__setattr__(self, "second", second)

    def __str__(self) -> str:
        return f"{self.first} -- {self.second}"

    @property
    def ends(self) -> tuple[PortRef, PortRef]:
        """Both ports."""
        return self.first, self.second

    def renamed(self, names: Mapping[str, str]) -> FrameLine:
        """The line after its blocks have new names."""
        first, second = (PortRef(names.get(end.block, end.block), end.port) for end in self.ends)
        return FrameLine(first, second)


def frames_of(lines: Iterable[FrameLine]) -> Iterator[tuple[PortRef, ...]]:
    """The ports of each frame: the sets of ports that lines connect, each sorted, in the order of the first.

    Ports without a line are not included.
    """
    neighbours: dict[PortRef, list[PortRef]] = {}
    for line in lines:
        for one, other in (line.ends, line.ends[::-1]):
            neighbours.setdefault(one, []).append(other)
    seen: set[PortRef] = set()
    for port in sorted(neighbours):
        if port in seen:
            continue
        members, waiting = {port}, [port]
        while waiting:
            for other in neighbours[waiting.pop()]:
                if other not in members:
                    members.add(other)
                    waiting.append(other)
        seen |= members
        yield tuple(sorted(members))


def lines_without(lines: Iterable[FrameLine], is_removed: Callable[[PortRef], bool]) -> tuple[FrameLine, ...]:
    """The lines after the removal of ports; the other ports of each frame remain one frame.

    Lines state which ports are one frame, but not along which line: without a body between two joints, both
    joints are still at the same frame.
    """
    given = tuple(lines)
    kept = {line for line in given if not any(map(is_removed, line.ends))}
    if len(kept) == len(given):
        return given
    for ports in frames_of(given):
        others = [port for port in ports if not is_removed(port)]
        if 1 < len(others) < len(ports):
            kept = {line for line in kept if line.first not in others}
            kept |= {FrameLine(others[0], port) for port in others[1:]}
    return tuple(sorted(kept))

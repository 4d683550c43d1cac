"""Buses: several named signals in one connection."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from armblocks.diagram.port import PortRef


@dataclass(frozen=True)
class Bus:
    """An ordered collection of named signals in one connection; a bus may contain buses."""

    elements: Mapping[str, Carried]

    def leaves(self) -> Iterator[tuple[str, PortRef]]:
        """Path and source of every signal: ``("motor.speed", …)``."""
        for name, carried in self.elements.items():
            if isinstance(carried, Bus):
                yield from ((f"{name}.{path}", source) for path, source in carried.leaves())
            else:
                yield name, carried

    def paths(self) -> tuple[str, ...]:
        """The paths of all elements, buses within this bus included."""
        all_paths: list[str] = []
        for name, carried in self.elements.items():
            all_paths.append(name)
            if isinstance(carried, Bus):
                all_paths += [f"{name}.{path}" for path in carried.paths()]
        return tuple(all_paths)

    def element(self, path: str) -> Carried | None:
        """The element of this path, if there is one."""
        name, _, rest = path.partition(".")
        carried = self.elements.get(name)
        if not rest or carried is None:
            return carried
        return carried.element(rest) if isinstance(carried, Bus) else None

    def replaced(self, path: str, carried: Carried) -> Bus:
        """The same bus with another element at a path that exists."""
        name, _, rest = path.partition(".")
        inner = self.elements[name]
        new = inner.replaced(rest, carried) if rest and isinstance(inner, Bus) else carried
        return Bus({**self.elements, name: new})


Carried = PortRef | Bus
"""The content of a connection: an output signal of the flat diagram, or a bus of such signals."""

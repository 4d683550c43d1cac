"""Buses: several named signals in one connection."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from armblocks.diagram.port import PortRef


@dataclass(frozen=True)
class Bus:
    """An ordered collection of named signals in one connection; a bus may contain buses."""

    elements: Mapping[str, PortContent]

    def leaves(self) -> Iterator[tuple[str, PortRef]]:
        """Path and source of every signal: ``("motor.speed", …)``."""
        for name, content in self.elements.items():
            if isinstance(content, Bus):
                yield from ((f"{name}.{path}", source) for path, source in content.leaves())
            else:
                yield name, content

    def paths(self) -> tuple[str, ...]:
        """The paths of all elements, buses within this bus included."""
        all_paths: list[str] = []
        for name, content in self.elements.items():
            all_paths.append(name)
            if isinstance(content, Bus):
                all_paths += [f"{name}.{path}" for path in content.paths()]
        return tuple(all_paths)

    def element(self, path: str) -> PortContent | None:
        """The element of this path, if there is one."""
        name, _, rest = path.partition(".")
        content = self.elements.get(name)
        if not rest or content is None:
            return content
        return content.element(rest) if isinstance(content, Bus) else None

    def replaced(self, path: str, content: PortContent) -> Bus:
        """The same bus with another element at a path that exists."""
        name, _, rest = path.partition(".")
        inner = self.elements[name]
        new = inner.replaced(rest, content) if rest and isinstance(inner, Bus) else content
        return Bus({**self.elements, name: new})


PortContent = PortRef | Bus
"""The content of a connection: an output signal of the flat diagram, or a bus of such signals."""

"""The kinds of blocks that exist, by name and by family."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from types import MappingProxyType

from armblocks.diagram.block import Block
from armblocks.errors import UnknownNameError


class BlockLibrary(Mapping[str, type[Block]]):
    """Kinds of blocks by type name, ``library["Gain"]``; an unknown name says the nearest."""

    def __init__(self, kinds: Iterable[type[Block]]) -> None:
        self._kinds = MappingProxyType({kind.type_name(): kind for kind in kinds})

    def __getitem__(self, name: str) -> type[Block]:
        try:
            return self._kinds[name]
        except KeyError:
            raise UnknownNameError("block type", name, self._kinds) from None

    def __contains__(self, name: object) -> bool:
        return name in self._kinds

    def __iter__(self) -> Iterator[str]:
        return iter(self._kinds)

    def __len__(self) -> int:
        return len(self._kinds)

    def by_family(self) -> Mapping[str, tuple[type[Block], ...]]:
        """The kinds of each family, both in the order in which the library was given them."""
        families: dict[str, list[type[Block]]] = {}
        for kind in self._kinds.values():
            families.setdefault(kind.family, []).append(kind)
        return {family: tuple(kinds) for family, kinds in families.items()}

"""The library of block types, by name and by family."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from types import MappingProxyType

from armblocks.diagram.block import Block
from armblocks.errors import DiagramError, UnknownNameError


class BlockLibrary(Mapping[str, type[Block]]):
    """Block types by name, ``library["Gain"]``; an unknown name raises an error with the nearest names.

    ``families``: the types of each family, in display order.
    """

    def __init__(self, families: Mapping[str, Iterable[type[Block]]]) -> None:
        self._families = MappingProxyType({family: tuple(kinds) for family, kinds in families.items()})
        self._family_of = {kind: family for family, kinds in self._families.items() for kind in kinds}
        self._kinds = MappingProxyType({kind.type_name(): kind for kind in self._family_of})

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

    def with_kinds(self, family: str, kinds: Iterable[type[Block]]) -> BlockLibrary:
        """This library with further types of one family.

        Raises ``DiagramError`` for a type name that exists already.
        """
        added = tuple(kinds)
        for kind in added:
            if kind.type_name() in self._kinds:
                raise DiagramError(
                    f"there is a block type named '{kind.type_name()}' already",
                    where=f"{kind.__module__}.{kind.__qualname__}",
                    allowed="class names that are not in the library",
                    fix="rename the class",
                )
        return BlockLibrary({**self._families, family: (*self._families.get(family, ()), *added)})

    @property
    def families(self) -> Mapping[str, tuple[type[Block], ...]]:
        """The types of each family, both in display order."""
        return self._families

    def family_of(self, kind: type[Block]) -> str:
        """The family of a type; raises an error for a type that is not in the library."""
        try:
            return self._family_of[kind]
        except KeyError:
            raise UnknownNameError("block type", kind.type_name(), self._kinds) from None

"""The library of block types, by name and by family."""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

from armblocks.diagram.block import Block
from armblocks.errors import DiagramError, UnknownNameError


@dataclass(frozen=True)
class UnimportedBlock:
    """The name and the module of a block type that is imported at its first use."""

    name: str
    module: str

    def type_name(self) -> str:
        """The name of the block type in files."""
        return self.name

    def imported(self) -> type[Block]:
        """The block type."""
        kind: type[Block] = getattr(importlib.import_module(self.module), self.name)
        return kind


class BlockLibrary(Mapping[str, type[Block]]):
    """Block types by name, ``library["Gain"]``; an unknown name raises an error with the nearest names.

    ``families``: the types of each family, in display order. Types that are not imported yet are imported
    when they are looked up.
    """

    def __init__(self, families: Mapping[str, Iterable[type[Block] | UnimportedBlock]]) -> None:
        self._members = {family: tuple(kinds) for family, kinds in families.items()}
        self._kinds = {kind.type_name(): kind for kinds in self._members.values() for kind in kinds}

    def __getitem__(self, name: str) -> type[Block]:
        try:
            kind = self._kinds[name]
        except KeyError:
            raise UnknownNameError("block type", name, self._kinds) from None
        if isinstance(kind, UnimportedBlock):
            self._kinds[name] = kind = kind.imported()
        return kind

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
        return BlockLibrary({**self._members, family: (*self._members.get(family, ()), *added)})

    @cached_property
    def families(self) -> Mapping[str, tuple[type[Block], ...]]:
        """The types of each family, both in display order."""
        return {
            family: tuple(self[kind.type_name()] for kind in kinds) for family, kinds in self._members.items()
        }

    @cached_property
    def _family_of(self) -> Mapping[str, str]:
        return {kind.type_name(): family for family, kinds in self._members.items() for kind in kinds}

    def family_of(self, kind: type[Block]) -> str:
        """The family of a type; raises an error for a type that is not in the library."""
        name = kind.type_name()
        if name not in self._kinds or self[name] is not kind:
            raise UnknownNameError("block type", name, self._kinds)
        return self._family_of[name]

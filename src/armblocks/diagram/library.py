"""The library of block types, by name and by family."""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

from armblocks.argument_errors import ArgumentErrors
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
        block_type: type[Block] = getattr(importlib.import_module(self.module), self.name)
        return block_type


class BlockLibrary(Mapping[str, type[Block]], metaclass=ArgumentErrors):
    """Block types by name, ``library["Gain"]``; an unknown name raises an error with the nearest names.

    ``families``: the types of each family, in display order. Types that are not imported yet are imported
    when they are looked up.
    """

    def __init__(self, families: Mapping[str, Iterable[type[Block] | UnimportedBlock]]) -> None:
        self._members = {family: tuple(members) for family, members in families.items()}
        self._types = {member.type_name(): member for members in self._members.values() for member in members}

    def __getitem__(self, name: str) -> type[Block]:
        try:
            block_type = self._types[name]
        except KeyError:
            raise UnknownNameError("block type", name, self._types) from None
        if isinstance(block_type, UnimportedBlock):
            self._types[name] = block_type = block_type.imported()
        return block_type

    def __contains__(self, name: object) -> bool:
        return name in self._types

    def __iter__(self) -> Iterator[str]:
        return iter(self._types)

    def __len__(self) -> int:
        return len(self._types)

    def with_kinds(self, family: str, kinds: Iterable[type[Block]]) -> BlockLibrary:
        """This library with further types of one family.

        Raises ``DiagramError`` for a type name that already exists.
        """
        added = tuple(kinds)
        for kind in added:
            if kind.type_name() in self._types:
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
            family: tuple(self[member.type_name()] for member in members)
            for family, members in self._members.items()
        }

    @cached_property
    def _family_of(self) -> Mapping[str, str]:
        return {member.type_name(): family for family, members in self._members.items() for member in members}

    def family_of(self, kind: type[Block]) -> str:
        """The family of a type; raises an error for a type that is not in the library."""
        name = kind.type_name()
        if name not in self._types or self[name] is not kind:
            raise UnknownNameError("block type", name, self._types)
        return self._family_of[name]

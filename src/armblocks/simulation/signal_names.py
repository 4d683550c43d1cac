"""Names of recorded signals and of their elements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from armblocks.equations import Signature, Slot
from armblocks.errors import UnknownNameError


def element_names(slot: Slot) -> tuple[str, ...]:
    """A name for each scalar of a quantity; a user's signal name replaces the path."""
    return replace(slot, name=slot.title).elements if slot.title else slot.elements


def signal_path(name: str, layout: Signature, aliases: Mapping[str, str], where: str) -> str:
    """The path of a signal, which ``name`` may denote by an alias. Raises ``UnknownNameError``."""
    if name in layout.ranges:
        return name
    if name in aliases:
        return aliases[name]
    raise UnknownNameError("signal", name, [*layout.names, *aliases], where=where)

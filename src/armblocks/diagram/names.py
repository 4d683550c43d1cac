"""Block names: which names are legal, and which names count as equal."""

from __future__ import annotations

import unicodedata

from armblocks.errors import DiagramError

LONGEST_NAME = 200
"""Characters."""


def check_block_name(name: str, where: str) -> None:
    """Raise ``DiagramError`` for a name unfit for a path, ``block/port`` or ``block.parameter``."""
    allowed = f"1 to {LONGEST_NAME} characters, without '/', '.' and control characters"
    shown = repr(name if len(name) <= 60 else name[:57] + "...")
    if not name.strip():
        raise DiagramError("a block has an empty name", where=where, allowed=allowed, fix="name it")
    if len(name) > LONGEST_NAME:
        raise DiagramError(
            f"the block name {shown} has {len(name)} characters",
            where=where,
            allowed=allowed,
            fix="shorten it",
        )
    for character in name:
        # Category C: control characters, and the invisible marks that turn the reading direction.
        if character in "/." or unicodedata.category(character).startswith("C"):
            raise DiagramError(
                f"the block name {shown} contains {character!r}",
                where=where,
                allowed=allowed,
                fix="rename it",
            )


def folded(name: str) -> str:
    """The form in which names are compared: ignores case and Unicode composition."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFKD", name).casefold())

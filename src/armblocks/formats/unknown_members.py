"""Members of a document that this version does not support, from another program or a newer armblocks.

They are stored in ``Diagram.extras`` and written again.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import cast

from armblocks.formats.json_document import Node, split_members

Extras = dict[str, dict[str, object]]
"""Unknown members by location: ``""``, ``"blocks"``, ``"layout"``, ``"settings"``."""


def split_extras(
    node: Node, known: tuple[str, ...], extras: Extras, section: str, key: str = ""
) -> dict[str, Node]:
    """The known members; unknown members are stored in ``extras[section]``, under ``key`` if it is not
    empty."""
    members, unknown = split_members(node, known)
    if unknown:
        extras.setdefault(section, {}).update({key: unknown} if key else unknown)
    return members


def members_of(extra: object) -> Mapping[str, object]:
    """The unknown members of an entry; none where the entry has no extras."""
    return cast("Mapping[str, object]", extra or {})

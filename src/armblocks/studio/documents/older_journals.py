"""Requests as the journals of earlier versions have them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

_ROBOT_EDITS_OF_0_2 = {
    "rename": "rename_link",
    "add": "add_joint",
    "remove": "remove_joint",
    "move": "move_joint",
}


def as_of_today(request: Mapping[str, Any]) -> dict[str, Any]:
    """The request in the form of this version.

    In 0.2.0 robots had requests of their own, whose edits had the kinds of those of diagrams, and arranging a
    sheet was no edit.
    """
    kind = request["kind"]
    if kind == "arrange":
        return {**request, "kind": "change", "edit": {"kind": "arrange"}}
    if not kind.startswith("robot_"):
        return dict(request)
    changed = {**request, "kind": kind.removeprefix("robot_")}
    if "edit" in changed:
        edit = changed["edit"]
        changed["edit"] = {**edit, "kind": _ROBOT_EDITS_OF_0_2.get(edit["kind"], edit["kind"])}
    return changed

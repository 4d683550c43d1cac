"""Conversion of requests from the journals of earlier versions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

_ROBOT_EDITS_OF_0_2 = {
    "rename": "rename_link",
    "add": "add_joint",
    "remove": "remove_joint",
    "move": "move_joint",
}


def converted(request: Mapping[str, Any]) -> dict[str, Any]:
    """Convert a journaled request to the form of this version.

    In 0.2.0, requests about robots were separate messages, their edits used the kinds of diagram edits, and
    arranging a sheet was a request instead of an edit.
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

"""Facts about a robot that are not part of its model: payload, reach, sources and licence of the numbers.

The member ``facts`` of ``robot.json`` contains them::

    "facts": {
      "checked": "the table of another publication",
      "licence": "BSD-3-Clause (package); only facts are used",
      "masses": "published",
      "payload": 3,
      "reach": 0.855,
      "sources": ["author, title, year, table"]
    }

``Robot`` objects do not contain the facts, and the writer omits them.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cache
from typing import Any, cast

from armblocks.formats.json_document import Node, closed_members, read_document
from armblocks.formats.shipped import ROBOT_FILE, shipped_folder
from armblocks.robot import JOINT_TYPES, Fixed

MAX_BYTES = 16 * 2**20


class MassOrigin(StrEnum):
    """The origin of the masses, centres of mass and inertias of a robot."""

    PUBLISHED = "published"
    """Values of a publication or of the manufacturer."""
    CAD = "cad"
    """Computed from CAD models by the authors of a package."""
    PACKAGE = "package"
    """Values of a package that does not state their origin."""
    ESTIMATED = "estimated"
    """Estimated from the kinematics, see ``scripts/estimated_masses.py`` and ``scripts/palletisers.py``."""
    CHOSEN = "chosen"
    """Chosen for exercises; there is no real robot."""


@dataclass(frozen=True, kw_only=True)
class RobotFacts:
    """``payload`` kg and ``reach`` m of the data sheet, or ``None``; ``checked``: the second source."""

    sources: tuple[str, ...] = ()
    licence: str = ""
    masses: MassOrigin | None = None
    payload: float | None = None
    reach: float | None = None
    checked: str = ""
    notes: str = ""


def facts_from_json(node: Node) -> RobotFacts:
    """The facts in a member ``facts``, without the notes. Raises ``FormatError`` with file, line and path."""
    members = closed_members(node, ("checked", "licence", "masses", "payload", "reach", "sources"))
    origin = (
        members["masses"].choice([origin.value for origin in MassOrigin]) if "masses" in members else None
    )
    return RobotFacts(
        sources=tuple(source.text() for source in members["sources"].elements())
        if "sources" in members
        else (),
        licence=members["licence"].text() if "licence" in members else "",
        masses=None if origin is None else MassOrigin(origin),
        payload=members["payload"].number() if "payload" in members else None,
        reach=members["reach"].number() if "reach" in members else None,
        checked=members["checked"].text() if "checked" in members else "",
    )


def shipped_facts(name: str) -> RobotFacts:
    """The facts about a shipped robot, with the notes of its file. ``name`` must be the name of one."""
    path = shipped_folder("robots") / name / ROBOT_FILE
    members = read_document(path.read_bytes(), str(path), MAX_BYTES).members()
    facts = facts_from_json(members["facts"]) if "facts" in members else RobotFacts()
    notes = members["notes"].text() if "notes" in members else ""
    return replace(facts, notes=notes)


@dataclass(frozen=True, kw_only=True)
class RobotSummary:
    """``title``, ``manufacturer`` and ``comment`` of a robot; ``joint_letters`` as in ``RRRRRR``."""

    title: str
    manufacturer: str
    comment: str
    joint_letters: str


@cache
def shipped_summary(name: str) -> RobotSummary:
    """A summary of a shipped robot, which is not built: lists show many robots."""
    path = shipped_folder("robots") / name / ROBOT_FILE
    document = cast("dict[str, Any]", json.loads(path.read_bytes()))
    letters = {kind.__name__.lower(): "" if kind is Fixed else kind.letter for kind in JOINT_TYPES}
    coupled = [entry for entry in document.get("constraints", ()) if entry["type"] == "coupling"]
    dependent = {entry["terms"][0]["joint"] for entry in coupled}
    kinds = (
        link["dh"].get("joint", "revolute") if "dh" in link else link.get("joint", {}).get("type", "revolute")
        for link in document["links"]
        if link["name"] not in dependent
    )
    return RobotSummary(
        title=document["name"],
        manufacturer=document.get("manufacturer", ""),
        comment=document.get("comment", ""),
        joint_letters="".join(letters[kind] for kind in kinds),
    )

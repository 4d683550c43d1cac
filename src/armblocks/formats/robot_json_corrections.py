"""Corrections of robots in JSON: limits of joints that are certainly in degrees."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from armblocks.formats.canonical_json import canonical_bytes
from armblocks.formats.file_corrections import Change, Correction, are_degrees
from armblocks.formats.file_findings import FileFinding
from armblocks.formats.robot_json import is_one_line
from armblocks.formats.robot_rules import IMPLAUSIBLE


def corrected_json(data: bytes, name: str, findings: Sequence[FileFinding]) -> Correction:
    """The document with ``"180 deg"`` for 180 in limits, in canonical form."""
    document: dict[str, Any] = json.loads(data)
    links = {link["name"]: link for link in document["links"]}
    changes: list[Change] = []
    for finding in findings:
        limits = links.get(finding.link, {}).get("limits", {})
        ends = limits.get("position", [])
        numbers = [end for end in ends if isinstance(end, (int, float))]
        if (
            finding.rule is not IMPLAUSIBLE
            or not ends
            or len(numbers) < len(ends)
            or not are_degrees(numbers)
        ):
            continue
        limits["position"] = [f"{end:g} deg" for end in numbers]
        changes.append(Change(finding, f"limits {ends[0]:g} and {ends[1]:g} marked as degrees"))
    if not changes:
        return Correction(data)
    return Correction(canonical_bytes(document, one_line=is_one_line), tuple(changes))

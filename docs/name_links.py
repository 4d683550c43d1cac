"""Replaces the names of armblocks in the tables of names by links to their pages in the reference."""

from __future__ import annotations

import re

from armblocks.blocks import BLOCKS

PAGES = ("from-simulink", "from-robotics-toolbox")
CLASSES = {
    "ab": "armblocks",
    "arm": "armblocks.Arm",
    "builder": "armblocks.DiagramBuilder",
    "result": "armblocks.SimulationResult",
    "robot": "armblocks.Robot",
    "run": "armblocks.DiagramRun",
}
"""The names of objects of these classes in the code of the tables."""


def link_names(_app: object, page: str, source: list[str]) -> None:
    """Rewrite the last column of every table of these pages. Sphinx calls the function with each page's
    text."""
    if page in PAGES:
        source[0] = re.sub(r"(?m)^(\| .*\| )([^|\n]+)(\|)$", _linked_row, source[0])


def _linked_row(row: re.Match[str]) -> str:
    return row[1] + re.sub(r"(?<!\})`([^`]+)`", _linked, row[2]) + row[3]


def _linked(code: re.Match[str]) -> str:
    name = re.match(r"\w+", code[1])
    if name and name[0] in BLOCKS:
        return f"[{code[0]}](reference/blocks/{name[0]}.md)"
    member = re.match(r"(\w+)\.(\w+)", code[1])
    if member and member[1] in CLASSES:
        return f"{{py:obj}}`{code[1]} <{CLASSES[member[1]]}.{member[2]}>`"
    return code[0]

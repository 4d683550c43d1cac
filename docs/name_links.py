"""Links from the tables of names to the pages of the reference."""

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
"""Classes of the variables in the code of the tables."""


def link_names(_app: object, page: str, source: list[str]) -> None:
    """Insert links in the last column of the tables on ``PAGES``. Sphinx calls it for each page."""
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

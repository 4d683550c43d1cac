"""Scripts copied from a printed page: recovery of statements that were merged into a comment line.

A page breaks lines at its margin. If a comment line was filled with the following statements, MATLAB would
treat them as comment::

    % Inertia of the segment L{1}.Jm =
    200e-6; L{2}.Jm = 200e-6;

Such a line is recognised by three criteria: it is a comment, its last statement is an unfinished assignment
to a field of an element, and the next line is its rest (it starts with a number, a sign or a bracket, or with
``=``), with which no statement of a script begins. Commented-out statements that are whole stay comments.
"""

from __future__ import annotations

import re
from dataclasses import replace

from armblocks.matlab.source import Source

_TARGET = r"[A-Za-z]\w*(?:\{\s*\d+\s*\}|\(\s*\d+\s*\))(?:\.[A-Za-z]\w*)+"
_FIRST_STATEMENT = re.compile(rf"{_TARGET}\s*(?:=(?!=)|$)")
_UNFINISHED_VALUE = re.compile(rf"{_TARGET}\s*=(?!=)\s*(?:[^\[\]]*[-+*/^]|\[[^\]]*|)")
_BARE_TARGET = re.compile(_TARGET)
_REST_OF_VALUE = re.compile(r"\s*[-+.\d\[]")
_REST_FROM_EQUALS = re.compile(r"\s*=(?!=)")


def without_page_breaks(source: Source) -> tuple[Source, tuple[int, ...]]:
    """The source with such comments blanked up to their first statement, and the numbers of those lines.

    Lines and columns stay where they were.
    """
    lines = list(source.lines)
    changed: list[int] = []
    for i, line in enumerate(lines):
        if not line.lstrip().startswith("%") or (found := _FIRST_STATEMENT.search(line)) is None:
            continue
        following = next((text for text in lines[i + 1 :] if text.strip()), "")
        unfinished = line[found.start() :].rpartition(";")[2].strip()
        value_goes_on = _UNFINISHED_VALUE.fullmatch(unfinished) and _REST_OF_VALUE.match(following)
        equals_follows = _BARE_TARGET.fullmatch(unfinished) and _REST_FROM_EQUALS.match(following)
        if value_goes_on or equals_follows:
            lines[i] = " " * found.start() + line[found.start() :]
            changed.append(i + 1)
    return replace(source, lines=tuple(lines)), tuple(changed)

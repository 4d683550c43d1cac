"""Scripts copied from a printed page: recovery of statements that were merged into a comment line.

A printed page breaks lines at its margin. If a statement was moved to the end of a comment line, MATLAB
treats it as a comment::

    % Inertia of the segment L{1}.Jm =
    200e-6; L{2}.Jm = 200e-6;

Such a line is recognised by three criteria. It is a comment; its last statement is an incomplete assignment
to a field of an element; and the next line is the rest of this statement: it starts with a number, a sign, a
bracket or ``=``, with which no statement begins. Complete statements in comments stay comments.
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
    """The source with merged statements restored, and the numbers of the restored lines.

    The comment text before the first statement of such a line is replaced by spaces.

    Line and column numbers do not change.
    """
    lines = list(source.lines)
    changed: list[int] = []
    for i, line in enumerate(lines):
        if not line.lstrip().startswith("%") or (match := _FIRST_STATEMENT.search(line)) is None:
            continue
        following = next((text for text in lines[i + 1 :] if text.strip()), "")
        unfinished = line[match.start() :].rpartition(";")[2].strip()
        value_goes_on = _UNFINISHED_VALUE.fullmatch(unfinished) and _REST_OF_VALUE.match(following)
        equals_follows = _BARE_TARGET.fullmatch(unfinished) and _REST_FROM_EQUALS.match(following)
        if value_goes_on or equals_follows:
            lines[i] = " " * match.start() + line[match.start() :]
            changed.append(i + 1)
    return replace(source, lines=tuple(lines)), tuple(changed)

"""The text of a script and places in it: every refusal names file, line and the line's text."""

from __future__ import annotations

import re
from dataclasses import dataclass

from armblocks.errors import FormatError

SUPPORTED = (
    "straight-line scripts of the Robotics Toolbox: link, robot, Link, Revolute, Prismatic, SerialLink, "
    "their fields, cell arrays, matrices, arithmetic, common functions, comments, clear"
)

LONGEST_QUOTE = 100
"""Characters of a line that a message repeats."""


@dataclass(frozen=True, kw_only=True)
class Source:
    """A script's lines, and the name under which messages speak of it."""

    name: str
    lines: tuple[str, ...]

    def place(self, line: int) -> Place:
        """The place of a line, counted from 1."""
        return Place(self, line)


@dataclass(frozen=True)
class Place:
    """One line of a source."""

    source: Source
    line: int

    def error(self, what: str, *, allowed: str = SUPPORTED, fix: str = "") -> FormatError:
        """The refusal of something on this line, to be raised by the caller."""
        lines = self.source.lines
        text = lines[self.line - 1].strip() if 1 <= self.line <= len(lines) else ""
        if len(text) > LONGEST_QUOTE:
            text = text[:LONGEST_QUOTE] + " …"
        shown = f"{what}, in: {text}" if text else what
        return FormatError(shown, where=f"{self.source.name}:{self.line}", allowed=allowed, fix=fix)


def decode(data: bytes, name: str) -> Source:
    """Bytes of a script as lines: UTF-8 with or without a byte order mark, else Latin-1 (old editors).

    Raises ``FormatError`` where the bytes are no text at all (they hold NUL).
    """
    if b"\0" in data:
        line = data[: data.index(b"\0")].count(b"\n") + 1
        raise FormatError(
            "the file is not text (it holds a NUL byte)", where=f"{name}:{line}", fix="save it as UTF-8 text"
        )
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    # Only MATLAB's own line ends: str.splitlines would also break at form feeds and Unicode separators.
    return Source(name=name, lines=tuple(re.split(r"\r\n|\r|\n", text)))

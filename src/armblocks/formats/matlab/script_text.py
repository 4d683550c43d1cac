"""The bytes of a script file as text."""

from __future__ import annotations

from armblocks.errors import FormatError
from armblocks.matlab.source import Source, script_source


def decode(data: bytes, name: str) -> Source:
    """Bytes of a script as lines: UTF-8 with or without a byte order mark, else Latin-1 (old editors).

    Raises ``FormatError`` if the file is not text (it contains a NUL byte).
    """
    if b"\0" in data:
        line = data[: data.index(b"\0")].count(b"\n") + 1
        raise FormatError(
            "the file is not text (it contains a NUL byte)",
            where=f"{name}:{line}",
            fix="save it as UTF-8 text",
        )
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    return script_source(text, name)

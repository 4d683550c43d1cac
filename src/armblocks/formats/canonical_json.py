"""Canonical JSON: the same bytes for the same content, and small differences for small changes.

Keys are sorted, every level is indented by two spaces, every member has its own line, and a row of numbers is
on one line. Floats have the fewest digits that read back to the same bits. The text ends with a newline.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from typing import cast

from armblocks.errors import FormatError
from armblocks.formats.json_document import MAX_DEPTH, KeyPath, path_text


def canonical_bytes(
    value: object, *, one_line: Callable[[KeyPath], bool] = lambda path: False, max_depth: int = MAX_DEPTH
) -> bytes:
    """The canonical text of a document of dicts, lists, strings, numbers, booleans and ``None``.

    ``one_line`` returns for the path of an object or array whether it is written on one line. ``max_depth``:
    the maximum nesting. Raises ``FormatError`` for numbers that are not finite, strings that are not valid
    Unicode, keys that are not strings, and unsupported types.
    """
    parts: list[str] = []
    _check_depth(value, max_depth)
    _write(value, (), 0, one_line, parts.append)
    try:
        return ("".join(parts) + "\n").encode("utf-8")
    except UnicodeEncodeError as error:
        raise FormatError(
            "a string cannot be written, as it is not valid Unicode",
            fix="correct the text",
            where="JSON document",
        ) from error


def _check_depth(value: object, max_depth: int) -> None:
    level, depth = [value], 0
    while level:
        if depth > max_depth:
            raise FormatError(
                "objects and arrays are nested too deeply",
                allowed=f"{max_depth} levels",
                where="JSON document",
                fix="reduce the nesting",
            )
        next_level: list[object] = []
        for entry in level:
            if isinstance(entry, Mapping):
                next_level += cast("Mapping[object, object]", entry).values()
            elif isinstance(entry, list | tuple):
                next_level += cast("list[object] | tuple[object, ...]", entry)
        level, depth = next_level, depth + 1


def _write(
    value: object,
    path: KeyPath,
    depth: int,
    one_line: Callable[[KeyPath], bool],
    append: Callable[[str], None],
) -> None:
    """Append the text of one value."""
    match value:
        case Mapping():
            members = cast("Mapping[object, object]", value)
            keys = [key for key in members if isinstance(key, str)]
            if len(keys) < len(members):
                raise FormatError(
                    "a key is not text",
                    where=path_text(path),
                    allowed="strings as keys",
                    fix="use strings as keys",
                )
            flat = one_line(path)
            _write_group(
                "{}",
                [(json.dumps(key, ensure_ascii=False) + ": ", key, members[key]) for key in sorted(keys)],
                (path, depth, flat, one_line, append),
            )
        case list() | tuple():
            elements = cast("list[object] | tuple[object, ...]", value)
            flat = not any(isinstance(element, Mapping | list | tuple | str) for element in elements)
            _write_group(
                "[]",
                [("", i, element) for i, element in enumerate(elements)],
                (path, depth, flat or not elements or one_line(path), one_line, append),
            )
        case _:
            append(_scalar(value, path))


def _write_group(
    brackets: str,
    entries: list[tuple[str, str | int, object]],
    context: tuple[KeyPath, int, bool, Callable[[KeyPath], bool], Callable[[str], None]],
) -> None:
    path, depth, flat, one_line, append = context
    outer, inner = ("", "") if flat else ("\n" + "  " * depth, "\n" + "  " * (depth + 1))
    append(brackets[0])
    for position, (label, step, entry) in enumerate(entries):
        append(("," + (" " if flat else "") if position else "") + inner + label)
        _write(entry, (*path, step), depth + 1, (lambda path: True) if flat else one_line, append)
    append((outer if entries else "") + brackets[1])


def _scalar(value: object, path: KeyPath) -> str:
    match value:
        case None:
            return "null"
        case bool():
            return "true" if value else "false"
        case str():
            return json.dumps(value, ensure_ascii=False)
        case int():
            return str(value)
        case float():
            if not math.isfinite(value):
                raise FormatError(
                    f"the number {value} cannot be written",
                    where=path_text(path),
                    allowed="finite numbers",
                    fix="replace it by a finite number",
                )
            # 10.0 is written as 10, as in JavaScript, but not -0.0, whose sign would be lost.
            is_whole = (
                value.is_integer() and abs(value) < 1e15 and math.copysign(1.0, value) * (value or 1.0) > 0
            )
            return str(int(value)) if is_whole else repr(value)
        case _:
            raise FormatError(
                f"a {type(value).__name__} cannot be written",
                where=path_text(path),
                allowed="null, booleans, numbers, strings, arrays and objects",
                fix="convert it to numbers, strings, lists and objects",
            )

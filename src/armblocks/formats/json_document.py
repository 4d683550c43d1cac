"""A strict JSON reader, whose messages have file, line and the path inside the document.

The reader requires UTF-8, limits size and depth, and rejects duplicate keys, NaN and infinity (``json`` alone
accepts ``NaN`` and ``1e999``). :mod:`armblocks.formats.canonical_json` writes JSON.
"""

from __future__ import annotations

import difflib
import json
import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import cast

from armblocks.errors import FormatError, counted

MAX_DEPTH = 64
"""Default maximum nesting of objects and arrays."""
MAX_INTEGER_DIGITS = 18
"""Maximum number of digits of an integer, so that it fits into 64 bits."""

KeyPath = tuple[str | int, ...]


@dataclass(frozen=True)
class Document:
    """The name and text of a file, from which messages get line numbers."""

    name: str
    text: str

    def where(self, path: KeyPath) -> str:
        """The location of a value: ``model.json:12, blocks.jtraj.parameters.q0[2]``"""
        line = _line_of(self.text, path)
        location = f"{self.name}:{line}" if line else self.name
        return f"{location}, {path_text(path)}" if path else location


@dataclass(frozen=True)
class Node:
    """One value of a document and its path in it. All readers raise ``FormatError`` with file and line."""

    document: Document
    path: KeyPath
    value: object

    @property
    def where(self) -> str:
        """File, line and path of this value."""
        return self.document.where(self.path)

    def error(self, what: str, *, allowed: str = "", fix: str = "") -> FormatError:
        """The error for this value, which the caller raises."""
        return FormatError(what, where=self.where, allowed=allowed, fix=fix)

    def members(self) -> dict[str, Node]:
        """The members of an object, by key."""
        value = self.value
        if not isinstance(value, dict):
            raise self._type_error("an object {…}")
        entries = cast("dict[str, object]", value)
        return {key: Node(self.document, (*self.path, key), value) for key, value in entries.items()}

    def elements(self) -> list[Node]:
        """The elements of an array."""
        value = self.value
        if not isinstance(value, list):
            raise self._type_error("an array […]")
        entries = cast("list[object]", value)
        return [Node(self.document, (*self.path, i), value) for i, value in enumerate(entries)]

    def text(self) -> str:
        """A string."""
        if not isinstance(self.value, str):
            raise self._type_error("text")
        return self.value

    def number(self) -> float:
        """A number, which is finite because the reader rejects other numbers."""
        if isinstance(self.value, bool) or not isinstance(self.value, int | float):
            raise self._type_error("a number")
        return float(self.value)

    def boolean(self) -> bool:
        """The value ``true`` or ``false``."""
        if not isinstance(self.value, bool):
            raise self._type_error("true or false")
        return self.value

    def numbers(self, count: int) -> tuple[float, ...]:
        """An array of ``count`` numbers."""
        elements = self.elements()
        if len(elements) != count:
            raise self.error(
                f"{counted(len(elements), 'number is', 'numbers are')} given",
                allowed=counted(count, "number"),
            )
        return tuple(element.number() for element in elements)

    def choice(self, choices: Iterable[str]) -> str:
        """A string, which must be one of ``choices``."""
        word, words = self.text(), list(choices)
        if word not in words:
            raise self.error(
                f"'{_short(word)}' is not known here",
                allowed=", ".join(words),
                fix=_nearest(word, words) or "choose an allowed value",
            )
        return word

    def _type_error(self, allowed: str) -> FormatError:
        return self.error(f"the value is {describe(self.value)}", allowed=allowed)


def read_document(data: bytes, name: str, max_bytes: int, max_depth: int = MAX_DEPTH) -> Node:
    """The root of a JSON document. ``name`` is the name of the file in messages.

    ``max_bytes`` and ``max_depth`` limit the size of the document and the nesting of objects and arrays.

    Raises ``FormatError`` for data that are not strict JSON or exceed the limits.
    """
    if len(data) > max_bytes:
        raise FormatError(
            "the document is too large",
            where=name,
            allowed=f"at most {max_bytes} bytes",
            fix="split the document, or store long tables in separate files",
        )
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise FormatError(
            "the file is not UTF-8 text", where=f"{name}:{line}", fix="save the file as UTF-8"
        ) from error
    document = Document(name, text)
    _check_depth(document, max_depth)
    try:
        value = json.loads(
            text,
            object_pairs_hook=_unique_members,
            parse_constant=_reject_constant,
            parse_float=_finite_number,
            parse_int=_bounded_integer,
        )
    except json.JSONDecodeError as error:
        raise FormatError(
            f"the file is not valid JSON: {error.msg} (column {error.colno})",
            where=f"{name}:{error.lineno}",
            fix="correct this line: a comma, a bracket or a quote may be missing",
        ) from error
    except _RejectedError as rejection:
        line = _line_with(text, rejection.token_text)
        raise FormatError(
            rejection.what, where=f"{name}:{line}", allowed=rejection.allowed, fix="correct this line"
        ) from None
    root = Node(document, (), value)
    _check_text(root)
    return root


def describe(value: object) -> str:
    """A value in a few words, for messages."""
    match value:
        case None:
            return "null"
        case bool():
            return "true" if value else "false"
        case str():
            return f"the text '{_short(value)}'"
        case int() | float():
            return f"the number {value!r}"
        case list():
            return _array_text(len(cast("list[object]", value)))
        case _:
            return "an object"


def _array_text(length: int) -> str:
    return f"an array of {counted(length, 'element')}"


def path_text(path: KeyPath) -> str:
    """``("blocks", "XY Graph", "q", 2)`` as ``blocks."XY Graph".q[2]``."""
    text = ""
    for step in path:
        if isinstance(step, int):
            text += f"[{step}]"
        else:
            word = step if re.fullmatch(r"[\w-]+", step) else json.dumps(_short(step), ensure_ascii=False)
            text += f".{word}" if text else word
    return text


def split_members(node: Node, known: Iterable[str]) -> tuple[dict[str, Node], dict[str, object]]:
    """The known members of an object, and the unknown ones as plain values, which a writer must preserve.

    An unknown key similar to a known one is a typing error and raises ``FormatError``.
    """
    names = list(known)
    members = node.members()
    extra: dict[str, object] = {}
    for key, member in list(members.items()):
        if key in names:
            continue
        matches = difflib.get_close_matches(key.casefold(), names, n=1, cutoff=0.7)
        if matches and matches[0] not in members:
            raise member.error(
                f"the key '{_short(key)}' is not known here",
                allowed=", ".join(names),
                fix=f"did you mean '{matches[0]}'?",
            )
        extra[key] = member.value
        del members[key]
    return members, extra


def closed_members(node: Node, known: Iterable[str], required: Iterable[str] = ()) -> dict[str, Node]:
    """The members of an object whose keys must be in ``known``. Raises ``FormatError`` with the nearest
    name."""
    names, members = list(known), node.members()
    for key, member in members.items():
        if key not in names:
            raise member.error(
                f"the key '{_short(key)}' is not known here",
                allowed=", ".join(names),
                fix=_nearest(key, names) or f"remove '{_short(key)}'",
            )
    for key in required:
        if key not in members:
            raise node.error(f"the key '{key}' is missing", allowed=", ".join(names), fix=f"add '{key}'")
    return members


class _RejectedError(Exception):
    """An error that Python's JSON parser does not detect. It is found during parsing, when the line is
    unknown."""

    def __init__(self, what: str, token_text: str, allowed: str) -> None:
        self.what, self.token_text, self.allowed = what, token_text, allowed
        super().__init__(what)


def _unique_members(pairs: list[tuple[str, object]]) -> dict[str, object]:
    members = dict(pairs)
    if len(members) < len(pairs):
        keys = [key for key, _ in pairs]
        duplicate = next(key for i, key in enumerate(keys) if key in keys[:i])
        raise _RejectedError(
            f"the key '{_short(duplicate)}' occurs twice in one object",
            json.dumps(duplicate),
            "every key once",
        )
    return members


def _reject_constant(word: str) -> object:
    raise _RejectedError(f"{word} is not a JSON number", word, "finite numbers")


def _finite_number(text: str) -> float:
    value = float(text)
    if math.isinf(value):
        raise _RejectedError(f"the number {_short(text)} is too large", text, "magnitudes below 1.8e308")
    return value


def _bounded_integer(text: str) -> int:
    if len(text) > MAX_INTEGER_DIGITS + 1:
        raise _RejectedError(
            f"the integer {_short(text)} is too long", text, f"at most {MAX_INTEGER_DIGITS} digits"
        )
    return int(text)


_TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"?|[\[\]{}:,]|\n|[^\s\[\]{}:,"]+', re.DOTALL)


def _check_depth(document: Document, max_depth: int) -> None:
    """Check the depth before parsing, because Python's parser is recursive."""
    depth, line = 0, 1
    for match in _TOKEN.finditer(document.text):
        token = match.group()
        line += token.count("\n")
        if token in "[{":
            depth += 1
            if depth > max_depth:
                raise FormatError(
                    "objects and arrays are nested too deeply",
                    where=f"{document.name}:{line}",
                    allowed=f"{max_depth} levels",
                    fix="reduce the nesting",
                )
        elif token in "]}":
            depth -= 1


def _check_text(root: Node) -> None:
    """Reject halves of surrogate pairs, which ``"\\ud800"`` creates and a file cannot contain."""
    pending = [root]
    while pending:
        node = pending.pop()
        texts = [node.value] if isinstance(node.value, str) else []
        if isinstance(node.value, dict):
            members = node.members()
            texts += list(members)
            pending += members.values()
        elif isinstance(node.value, list):
            pending += node.elements()
        for text in texts:
            if any("\ud800" <= character <= "\udfff" for character in text):
                raise node.error(
                    "a string is not valid Unicode (half of a surrogate pair)", allowed="whole characters"
                )


def _line_with(text: str, token_text: str) -> int:
    """The line of the last occurrence of a text; for a duplicate key this is usually the second key."""
    return text.count("\n", 0, max(text.rfind(token_text), 0)) + 1


@dataclass
class _Level:
    """An open object or array during the search; ``step`` is the key or index of its current value."""

    bracket: str
    step: str | int | None


def _line_of(text: str, path: KeyPath) -> int:
    """The line on which the value at ``path`` starts, or 0. The text is known to be valid JSON."""
    stack: list[_Level] = []
    line, key = 1, ""
    for match in _TOKEN.finditer(text):
        token = match.group()
        level = stack[-1] if stack else None
        if token == "\n":
            line += 1
        elif token in ("]", "}"):
            stack.pop()
        elif token == "," and level is not None:
            level.step = level.step + 1 if isinstance(level.step, int) else None
        elif token == ":" and level is not None:
            level.step = key
        elif level is not None and level.step is None:
            key = json.loads(token)
        else:
            if tuple(entry.step for entry in stack) == path:
                return line
            if token in ("[", "{"):
                stack.append(_Level(token, 0 if token == "[" else None))
    return 0


def _short(text: str) -> str:
    return text if len(text) <= 60 else text[:57] + "…"


def _nearest(word: str, known: list[str]) -> str:
    matches = difflib.get_close_matches(word, known, n=1, cutoff=0.5)
    return f"did you mean '{matches[0]}'?" if matches else ""

"""The outline of a diagram (its tree of sheets) and the search for blocks and bookmarks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from armblocks.diagram import Block, Diagram, DiagramBlock, ParameterKind
from armblocks.robot import Robot
from armblocks.studio.protocol.messages.sheets import FoundBlock, Outline
from armblocks.studio.sheet.bookmarks import bookmarks_of
from armblocks.studio.sheet.parameter_values import parameter_json

MAX_RESULTS = 50
MAX_TEXT_LENGTH = 60
"""Maximum number of displayed characters of a matching parameter, ``name = value``."""


def outline(diagram: Diagram) -> Outline:
    """Return the sheets of a diagram as a tree."""
    subsystems = {name: block for name, block in diagram.blocks.items() if isinstance(block, DiagramBlock)}
    return Outline(
        name=diagram.name,
        blocks=len(diagram.blocks),
        subsystems=[
            outline(block.diagram).model_copy(update={"name": name}) for name, block in subsystems.items()
        ],
    )


def find(diagram: Diagram, text: str) -> list[FoundBlock]:
    """Return the blocks and bookmarks of all sheets that contain every word of ``text``, best first.

    A block contains a word in its name, its type or its parameter values, a bookmark in its name. A word at
    the beginning of a name ranks first, then a word in a name, in a type, in a value. The worst rank of all
    words is the rank of the result.
    """
    words = text.lower().split()
    ranked: list[tuple[int, int, FoundBlock]] = []
    for path, name, block in _blocks(diagram, ()):
        rank, matches = 0, list[str]()
        for word in words:
            word_rank, match = _rank(name, block, word)
            rank = max(rank, word_rank)
            matches += [match] if match else []
        if words and rank < _NO_MATCH:
            result = FoundBlock(
                inside=list(path), name=name, title=block.title, match=", ".join(dict.fromkeys(matches))
            )
            ranked.append((rank, len(path), result))
    for bookmark in bookmarks_of(diagram) if words else ():
        rank = max(_name_rank(bookmark.name, word) for word in words)
        if rank < _NO_MATCH:
            part, inside = bookmark.part, bookmark.inside
            result = FoundBlock(inside=inside, name=bookmark.name, title="", match="", part=part)
            ranked.append((rank, len(inside), result))
    ranked.sort(key=lambda entry: entry[:2])
    return [result for _, _, result in ranked[:MAX_RESULTS]]


_NO_MATCH = 9
"""Rank of a block or a bookmark without the word."""


def _name_rank(name: str, word: str) -> int:
    if name.lower().startswith(word):
        return 0
    return 1 if word in name.lower() else _NO_MATCH


def _rank(name: str, block: Block, word: str) -> tuple[int, str]:
    if (name_rank := _name_rank(name, word)) < _NO_MATCH:
        return name_rank, ""
    if word in block.title.lower() or word in block.type_name().lower():
        return 2, ""
    for rule in block.parameters():
        if rule.kind is ParameterKind.DIAGRAM:
            continue
        text = f"{rule.name} = {_value_text(block.parameter_value(rule.name))}"
        if word in text.lower():
            return 3, text if len(text) <= MAX_TEXT_LENGTH else f"{text[: MAX_TEXT_LENGTH - 1]}…"
    return _NO_MATCH, ""


def _value_text(value: object) -> str:
    """Format a value as in the dialogs; for a robot, list its manufacturer, name and source."""
    if isinstance(value, Robot):
        names = dict.fromkeys((value.manufacturer, value.name, value.source))
        return ", ".join(name for name in names if name)
    return _text(parameter_json(value))


def _text(value: object) -> str:
    if isinstance(value, dict):
        return str(value.get("source", ""))  # pyright: ignore[reportUnknownMemberType, reportUnknownArgumentType]
    if isinstance(value, float) and value.is_integer():
        return str(int(value))
    return str(value)


def _blocks(diagram: Diagram, path: Sequence[str]) -> Iterator[tuple[Sequence[str], str, Block]]:
    for name, block in diagram.blocks.items():
        yield path, name, block
        if isinstance(block, DiagramBlock):
            yield from _blocks(block.diagram, (*path, name))

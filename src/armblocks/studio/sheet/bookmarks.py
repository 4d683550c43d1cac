"""Bookmarks of views in the editor: their edits, and the list of the bookmarks of all sheets.

A bookmark is stored in the sheet that it shows. It is therefore moved, removed and copied with its subsystem.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

from armblocks.diagram import Bookmark, Diagram, DiagramBlock
from armblocks.diagram.bookmarks import check_bookmark_name
from armblocks.errors import UnknownNameError
from armblocks.studio.protocol.messages.sheet_edits import (
    AddBookmark,
    RemoveBookmark,
    RenameBookmark,
    SheetPart,
)
from armblocks.studio.protocol.messages.sheets import SheetBookmark


def addition_title(edit: AddBookmark) -> str:
    """Return the name of the step in the undo menu."""
    return f"{'update the bookmark' if edit.replace else 'bookmark'} {edit.name.strip()}"


def added(edit: AddBookmark, sheet: Diagram, _context: object) -> Diagram:
    """Return the sheet with a new bookmark, or with another part of the sheet for an existing bookmark."""
    name = edit.name.strip()
    if edit.replace:
        _check_exists(name, sheet)
    else:
        check_bookmark_name(name, sheet.bookmarks, f"diagram '{sheet.name}'")
    part = Bookmark(**edit.part.model_dump())
    return dataclasses.replace(sheet, bookmarks={**sheet.bookmarks, name: part})


def renamed(edit: RenameBookmark, sheet: Diagram, _context: object) -> Diagram:
    """Return the sheet with a renamed bookmark."""
    _check_exists(edit.name, sheet)
    part, name = sheet.bookmarks[edit.name], edit.to.strip()
    others = _without(edit.name, sheet)
    check_bookmark_name(name, others, f"diagram '{sheet.name}'")
    return dataclasses.replace(sheet, bookmarks={**others, name: part})


def removed(edit: RemoveBookmark, sheet: Diagram, _context: object) -> Diagram:
    """Return the sheet without a bookmark."""
    _check_exists(edit.name, sheet)
    return dataclasses.replace(sheet, bookmarks=_without(edit.name, sheet))


def _without(name: str, sheet: Diagram) -> dict[str, Bookmark]:
    return {other: part for other, part in sheet.bookmarks.items() if other != name}


def _check_exists(name: str, sheet: Diagram) -> None:
    if name not in sheet.bookmarks:
        raise UnknownNameError("bookmark", name, sheet.bookmarks, where=f"diagram '{sheet.name}'")


def bookmarks_of(diagram: Diagram) -> list[SheetBookmark]:
    """Return the bookmarks of all sheets of a model, sheet by sheet."""
    return list(_bookmarks(diagram, (), linked=False))


def _bookmarks(sheet: Diagram, path: Sequence[str], *, linked: bool) -> Iterator[SheetBookmark]:
    linked = linked or bool(sheet.link)
    for name, bookmark in sheet.bookmarks.items():
        part = SheetPart(**dataclasses.asdict(bookmark))
        yield SheetBookmark(inside=list(path), name=name, part=part, linked=linked)
    for name, block in sheet.blocks.items():
        if isinstance(block, DiagramBlock):
            yield from _bookmarks(block.diagram, (*path, name), linked=linked)

"""The titles of edits in the undo button, where they depend on what is edited."""

from __future__ import annotations

from collections.abc import Sequence, Sized

from armblocks.errors import counted
from armblocks.studio.protocol.messages.sheet_edits import (
    AddBlocks,
    MoveBlocks,
    PasteBlocks,
    RemoveBlocks,
    SetAppearance,
)


def addition_title(edit: AddBlocks) -> str:
    """The added blocks, or else the connected ports."""
    names = [block.name for block in edit.blocks]
    if names:
        return f"add {name_list(names)}"
    if len(edit.wires) == 1:
        return f"connect {edit.wires[0].source} to {edit.wires[0].target}"
    return f"connect {count_text(edit.wires, 'wire')}"


def paste_title(edit: PasteBlocks) -> str:
    """The pasted blocks by their new names."""
    names = [name for name in edit.names.values() if not name.startswith("/")]
    return f"add {name_list(names)}" if names else "paste"


def removal_title(edit: RemoveBlocks) -> str:
    """The deleted blocks, or else the number of wires or notes."""
    if edit.blocks:
        return f"delete {name_list(edit.blocks)}"
    return f"delete {count_text(edit.wires, 'wire') if edit.wires else count_text(edit.notes, 'note')}"


def move_title(edit: MoveBlocks) -> str:
    """The moved, inserted or disconnected blocks, or else the number of notes."""
    if edit.instead and edit.places:
        inserts = len(edit.wires) > len(edit.instead)
        return f"{'insert' if inserts else 'disconnect'} {name_list(list(edit.places))}"
    return f"move {name_list(list(edit.places)) if edit.places else count_text(edit.notes, 'note')}"


def appearance_title(edit: SetAppearance) -> str:
    """The blocks with another colour, or with a hidden or moved name."""
    if edit.colour is not None:
        return f"colour {name_list(edit.blocks)}"
    return f"{'hide' if edit.name_side == 'hidden' else 'move'} the name of {name_list(edit.blocks)}"


def name_list(names: Sequence[str]) -> str:
    """The name of one block, or the number of several."""
    return names[0] if len(names) == 1 else count_text(names, "block")


def count_text(items: Sized, noun: str) -> str:
    """The number of items with a noun: ``2 wires``."""
    return counted(len(items), noun)

"""Blocks that an edit, an undo or a redo has renamed, for views that identify blocks by their paths."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from armblocks.diagram import Block, Diagram, DiagramBlock


def renamed_paths(before: Diagram, after: Diagram, path: str = "") -> dict[str, str]:
    """Return the paths of renamed blocks: old path to new path.

    Each step renames at most one block, or moves blocks into a new subsystem. For a renamed subsystem the
    result has its own path only; :func:`path_after` also follows the blocks inside.
    """
    if before is after:
        return {}
    removed, added = before.blocks.keys() - after.blocks.keys(), after.blocks.keys() - before.blocks.keys()
    if removed or added:
        if len(removed) == len(added) == 1:
            (old,), (new,) = removed, added
            if _is_same(before.blocks[old], after.blocks[new]):
                return {path + old: path + new}
        grouped = _moved_inside(before, removed, after, added)
        ungrouped = _moved_inside(after, added, before, removed)
        return {path + old: path + new for old, new in grouped.items()} or {
            path + old: path + new for new, old in ungrouped.items()
        }
    renamed: dict[str, str] = {}
    for name, old_block in before.blocks.items():
        new_block = after.blocks[name]
        if old_block is new_block or not isinstance(old_block, DiagramBlock):
            continue
        if isinstance(new_block, DiagramBlock):
            renamed |= renamed_paths(old_block.diagram, new_block.diagram, f"{path}{name}/")
    return renamed


def _is_same(before: Block, after: Block) -> bool:
    """Whether a block with another name can be the same: its type, and the blocks inside a subsystem."""
    if isinstance(before, DiagramBlock) and isinstance(after, DiagramBlock):
        return before.diagram.blocks.keys() == after.diagram.blocks.keys()
    return type(before) is type(after)


def _moved_inside(
    before: Diagram, removed: Collection[str], after: Diagram, added: Collection[str]
) -> dict[str, str]:
    """The new paths of removed blocks that are inside the only added block, a subsystem."""
    if len(added) != 1 or not removed:
        return {}
    (name,) = added
    part = after.blocks[name]
    if not isinstance(part, DiagramBlock):
        return {}
    inner = part.diagram.blocks
    is_moved = all(inner.get(old) is before.blocks[old] for old in removed)
    return {old: f"{name}/{old}" for old in removed} if is_moved else {}


def path_after(path: str, renamed: Mapping[str, str]) -> str:
    """Return the path of a block, port (``block/port``) or parameter (``block.parameter``) after renames."""
    for old, new in renamed.items():
        if path == old or path.startswith((f"{old}/", f"{old}.")):
            return new + path.removeprefix(old)
    return path


class PathNames:
    """The paths of the blocks of a diagram at the start of a run, and their present paths."""

    def __init__(self) -> None:
        self.renames: list[dict[str, str]] = []
        self.started = False
        """Whether the paths at the start of the run have been sent to clients."""

    def rename(self, renamed: Mapping[str, str]) -> None:
        """Add the next renames: old path to new path."""
        self.renames.append(dict(renamed))

    def present(self, path: str) -> str:
        """Return the present path of a block, port or parameter."""
        for renamed in self.renames:
            path = path_after(path, renamed)
        return path

    def original(self, path: str) -> str:
        """Return the path at the start of the run."""
        for renamed in reversed(self.renames):
            path = path_after(path, {new: old for old, new in renamed.items()})
        return path

"""Blocks that an edit, an undo or a redo has renamed, for views that identify blocks by their paths.

A block that is cut and pasted on another sheet of its diagram is renamed, too: see :class:`MovedBlocks`.
"""

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


class MovedBlocks:
    """The blocks of a diagram that were removed from one sheet and pasted on another one."""

    def __init__(self) -> None:
        self._removed: dict[str, Block] = {}
        self._moves: list[tuple[str, str]] = []

    def remove(self, before: Diagram, after: Diagram, path: str) -> None:
        """Store the blocks that an edit has removed from a sheet; ``path`` is its prefix, ``"a/b/"``."""
        for name in before.blocks.keys() - after.blocks.keys():
            self._removed.pop(path + name, None)
            self._removed[path + name] = before.blocks[name]

    def paste(self, names: Mapping[str, str], after: Diagram, sheet: Diagram, path: str) -> None:
        """Find the removed blocks among pasted ones: the same block under its old name.

        ``names`` are the old and new names, ``sheet`` is the sheet after the edit, at the prefix ``path``.
        """
        for old_name, new_name in names.items():
            new = path + new_name
            for old, block in reversed(self._removed.items()):
                is_same = old.rpartition("/")[2] == old_name and block == sheet.blocks.get(new_name)
                if is_same and old != new and not _exists(after, old):
                    del self._removed[old]
                    earlier_paths = [first for first, last in self._moves if last == old]
                    self._moves += [(one, new) for one in (old, *earlier_paths)]
                    break

    def renamed(self, before: Diagram, after: Diagram) -> dict[str, str]:
        """Return the paths of renamed and of moved blocks: old path to new path."""
        if before is after:
            return {}
        renamed = renamed_paths(before, after)
        for old, new in () if renamed else self._moves:
            had, has = _exists(before, new), _exists(after, new)
            if has and not had and not _exists(after, old):
                renamed[old] = new
            elif had and not has and not _exists(before, old):
                renamed[new] = old
        return renamed


def _exists(diagram: Diagram, path: str) -> bool:
    """Whether a diagram has a block at a path."""
    first, _, rest = path.partition("/")
    block = diagram.blocks.get(first)
    if block is None or not rest:
        return block is not None
    return isinstance(block, DiagramBlock) and _exists(block.diagram, rest)


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

"""The objects that an edit changes, for the detection of conflicts between concurrent edits.

An aspect is a tuple: the names of the enclosing subsystems and of the block, followed by the changed part of
the block. The part is ``""`` (the block was added or removed), ``place``, ``comment``, ``u <- wire``, ``u <-
bends`` or the name of a parameter. For the diagram itself, ``/`` replaces the block name; no block name
contains ``/``.
"""

from __future__ import annotations

from collections.abc import Iterable, Set

from armblocks.diagram import Block, Diagram

Aspect = tuple[str, ...]


def changed_aspects(before: Diagram, after: Diagram, path: Aspect = ()) -> set[Aspect]:
    """Return the aspects in which two diagrams differ; identical objects are skipped."""
    if before is after:
        return set()
    aspects: set[Aspect] = set()
    for name in before.blocks.keys() | after.blocks.keys():
        old, new = before.blocks.get(name), after.blocks.get(name)
        if old is not new:
            aspects |= _block_aspects((*path, name), old, new)
        if before.layout.get(name) != after.layout.get(name):
            aspects.add((*path, name, "place"))
    if before.connections is not after.connections:
        for wire in set(before.connections) ^ set(after.connections):
            aspects.add((*path, wire.target.block, f"{wire.target.port} <- wire"))
    for line in set(before.frame_lines) ^ set(after.frame_lines):
        for end in line.ends:
            aspects.add((*path, end.block, f"{end.port} -- line"))
    for wire in before.bends.keys() | after.bends.keys():
        if before.bends.get(wire) != after.bends.get(wire):
            aspects.add((*path, wire.target.block, f"{wire.target.port} <- bends"))
    for name in before.commented.keys() | after.commented.keys():
        if before.commented.get(name) != after.commented.get(name):
            aspects.add((*path, name, "comment"))
    for ref in before.signal_names.keys() | after.signal_names.keys():
        if before.signal_names.get(ref) != after.signal_names.get(ref):
            aspects.add((*path, ref.block, f"{ref.port} -> name"))
    for note in before.notes.keys() | after.notes.keys():
        if before.notes.get(note) != after.notes.get(note):
            aspects.add((*path, "/", note))
    for name in before.bookmarks.keys() | after.bookmarks.keys():
        if before.bookmarks.get(name) != after.bookmarks.get(name):
            aspects.add((*path, "/", f"bookmark {name}"))
    for name in before.mask_values.keys() | after.mask_values.keys():
        if before.mask_values.get(name) != after.mask_values.get(name):
            aspects.add((*path, "/", f"mask parameter {name}"))
    for name in before.parameter_sets.keys() | after.parameter_sets.keys():
        if before.parameter_sets.get(name) != after.parameter_sets.get(name):
            aspects.add((*path, "/", f"parameter set {name}"))
    for field in ("name", "description", "settings", "extras", "mask", "scope_trigger"):
        if getattr(before, field) != getattr(after, field):
            aspects.add((*path, "/", field))
    return aspects


def clash(aspects: Iterable[Aspect], others: Set[Aspect]) -> bool:
    """Whether two sets of aspects conflict. Adding or removing a block conflicts with every change inside."""
    aspects = set(aspects)
    if aspects & others:
        return True
    return _covers(aspects, others) or _covers(others, aspects)


def _covers(aspects: Set[Aspect], others: Set[Aspect]) -> bool:
    whole = {aspect[:-1] for aspect in aspects if aspect[-1] == ""}
    return any(other[:k] in whole for other in others for k in range(1, len(other) + 1)) if whole else False


def _block_aspects(path: Aspect, old: Block | None, new: Block | None) -> set[Aspect]:
    if old is None or new is None or type(old) is not type(new):
        return {(*path, "")}
    aspects: set[Aspect] = set()
    for rule in new.parameters():
        old_value, new_value = old.parameter_value(rule.name), new.parameter_value(rule.name)
        if isinstance(old_value, Diagram) and isinstance(new_value, Diagram):
            aspects |= changed_aspects(old_value, new_value, path)
        elif old_value != new_value:
            aspects.add((*path, rule.name))
    return aspects

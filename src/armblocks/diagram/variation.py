"""Copies of a diagram with other parameter values or comments."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

from armblocks.diagram.block import Block
from armblocks.diagram.check import check_diagram
from armblocks.diagram.comments import Comment, check_comment
from armblocks.diagram.diagram import Diagram
from armblocks.diagram.mask import formula_names
from armblocks.diagram.structure import DiagramBlock
from armblocks.errors import DiagramError, InputError, UnknownNameError, check_type

_Changed = TypeVar("_Changed")


def with_parameters(diagram: Diagram, values: Mapping[str, object]) -> Diagram:
    """A copy of a diagram with other parameter values, ``{"jtraj.tmax": 5.0}``; the copy is checked.

    The path of a parameter is ``"controller/pid.kp"`` inside a subsystem, ``"controller.kp"`` for the mask of
    a subsystem, and ``"kp"`` for the mask of the diagram. Parameters with formulas and parameters inside a
    subsystem that is linked to a library cannot be set. Raises ``UnknownNameError`` for an unknown block or
    parameter, ``DiagramError`` for a value that is invalid for the block or makes the diagram inconsistent.
    """
    of_blocks: dict[str, dict[str, object]] = {}
    for path, value in values.items():
        name, _, parameter = path.rpartition(".")
        of_blocks.setdefault(name, {})[parameter] = value
    for name, of_block in of_blocks.items():
        diagram = _with_values(diagram, name, of_block)
    check_diagram(diagram)
    return diagram


def with_comments(diagram: Diagram, comments: Mapping[str, Comment | None]) -> Diagram:
    """A copy of a diagram with blocks commented out or through.

    Example of ``comments``: ``{"filter": "through", "plant/drag": "out", "gain": None}``.

    A block that is commented ``"out"`` is excluded from the model; its outputs are zeros of the same shapes.
    A block that is commented ``"through"`` is replaced by connections from its inputs to its outputs.
    ``None`` removes a comment. Blocks inside subsystems are named by their paths. The copy is checked. Raises
    ``UnknownNameError`` for an unknown block, ``DiagramError`` for a block that cannot be commented, or is
    linked to a library, and for an inconsistent diagram.
    """
    check_type(diagram, Diagram, "a Diagram", where="with_comments")
    check_type(comments, Mapping, "a dictionary of comments by block", where="with_comments")
    for path, comment in comments.items():
        outside, level, name = found_block(diagram, path)
        _check_unlinked(outside, path)
        if comment is not None:
            check_comment(path, level.block(name), comment)
        others = {other: mark for other, mark in level.commented.items() if other != name}
        commented = others if comment is None else {**others, name: comment}
        diagram = _rebuilt(outside, dataclasses.replace(level, commented=commented))
    check_diagram(diagram)
    return diagram


Outside = Sequence[tuple[Diagram, str, DiagramBlock]]
"""The enclosing subsystems of a level: their levels, names and blocks, outer subsystems first."""


def found_block(diagram: Diagram, path: str) -> tuple[Outside, Diagram, str]:
    """The enclosing subsystems, the level and the name of the block at a path.

    Raises ``UnknownNameError`` for an unknown block.
    """
    outside: list[tuple[Diagram, str, DiagramBlock]] = []
    name = path
    while name not in diagram.blocks and "/" in name:
        first, _, rest = name.partition("/")
        block = diagram.blocks.get(first)
        if not isinstance(block, DiagramBlock):
            break
        outside.append((diagram, first, block))
        diagram, name = block.diagram, rest
    diagram.block(name)
    return outside, diagram, name


def _rebuilt(outside: Outside, changed: Diagram) -> Diagram:
    """The outermost diagram with another innermost level."""
    for level, first, subsystem in reversed(outside):
        inside = dataclasses.replace(subsystem, diagram=changed)
        changed = dataclasses.replace(level, blocks={**level.blocks, first: inside})
    return changed


def _with_values(diagram: Diagram, path: str, values: Mapping[str, object]) -> Diagram:
    """A copy in which some parameters of the block at a path have other values.

    The values of a block are checked together, because some parameters limit others.
    """
    if not path:
        for parameter in values:
            if parameter not in diagram.mask_values:
                valid_paths = [*diagram.mask_values, *(f"{name}.…" for name in diagram.blocks)]
                raise UnknownNameError("parameter", parameter, valid_paths, where=f"diagram '{diagram.name}'")
        return _with_location("", lambda: diagram.with_mask_values(values))
    outside, diagram, name = found_block(diagram, path)
    block = diagram.block(name)
    for parameter in values:
        check_settable(outside, path, block, parameter)
    changed = dataclasses.replace(
        diagram,
        blocks={**diagram.blocks, name: _with_location(path, lambda: block.with_parameters(**values))},
    )
    return _rebuilt(outside, changed)


def _check_unlinked(outside: Outside, path: str) -> None:
    """Raise ``DiagramError`` for a change inside a library block."""
    linked = next((k for k, (_, _, inside) in enumerate(outside) if inside.diagram.link), None)
    if linked is not None:
        subsystem = "/".join(name for _, name, _ in outside[: linked + 1])
        library_diagram = outside[linked][2].diagram
        own = ", ".join(f"{subsystem}.{rule.name}" for rule in library_diagram.mask)
        raise DiagramError(
            f"'{path}' is inside the library block '{library_diagram.link}'",
            where=f"block '{subsystem}'",
            allowed=own or "no parameters: the library block has none",
            fix="change a parameter of its mask, or break the link",
        )


def check_settable(outside: Outside, path: str, block: Block, parameter: str) -> None:
    """Raise ``DiagramError`` for a parameter that is set by a formula or a library."""
    _check_unlinked(outside, f"{path}.{parameter}")
    text = dict(block.formulas).get(parameter)
    if text is not None:
        outer = "/".join(name for _, name, _ in outside)
        names = [f"{outer}.{name}" if outer else name for name in sorted(formula_names(text))]
        raise DiagramError(
            f"'{path}.{parameter}' is set by the formula '{text}'",
            where=f"block '{path}'",
            allowed=", ".join(names),
            fix="change the parameters of the formula, or replace the formula in the diagram",
        )


def _with_location(path: str, change: Callable[[], _Changed]) -> _Changed:
    """The result of a change; errors get the block's path."""
    block = f"block '{path}'" if path else ""
    try:
        return change()
    except UnknownNameError as error:
        raise UnknownNameError(error.kind, error.name, error.known, where=block or error.where) from None
    except InputError as error:
        where = ", ".join(filter(None, (block, error.where)))
        raise DiagramError(error.what, where=where, allowed=error.allowed, fix=error.fix) from None

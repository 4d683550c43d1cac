"""Copies of a diagram with other parameter values."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

from armblocks.diagram.block import Block
from armblocks.diagram.check import check_diagram
from armblocks.diagram.diagram import Diagram
from armblocks.diagram.mask import formula_names
from armblocks.diagram.structure import DiagramBlock
from armblocks.errors import DiagramError, InputError, UnknownNameError

_Changed = TypeVar("_Changed")


def with_parameters(diagram: Diagram, values: Mapping[str, object]) -> Diagram:
    """A copy with other parameter values, ``{"jtraj.tmax": 5.0}``, which are checked.

    A block inside subsystems is named by its path, ``"controller/pid.kp"``; parameters of a subsystem's mask
    by the subsystem, ``"controller.kp"``; those of the diagram's own mask have no block, ``"kp"``. Parameters
    with formulas are computed from them and cannot be set, nor can parameters inside a subsystem that is
    linked to a library. Raises ``UnknownNameError`` for an unknown block or parameter, ``DiagramError`` for a
    value that is invalid for the block or makes the diagram inconsistent.
    """
    for path, value in values.items():
        name, _, parameter = path.rpartition(".")
        diagram = _with_value(diagram, name, parameter, value)
    check_diagram(diagram)
    return diagram


def _with_value(diagram: Diagram, path: str, parameter: str, value: object) -> Diagram:
    """A copy in which one parameter of the block at a path has another value."""
    if not path:
        if parameter not in diagram.mask_values:
            known = [*diagram.mask_values, *(f"{name}.…" for name in diagram.blocks)]
            raise UnknownNameError("parameter", parameter, known, where=f"diagram '{diagram.name}'")
        return _located("", lambda: diagram.with_mask_values({parameter: value}))
    outside: list[tuple[Diagram, str, DiagramBlock]] = []
    name = path
    while name not in diagram.blocks and "/" in name:
        first, _, rest = name.partition("/")
        block = diagram.blocks.get(first)
        if not isinstance(block, DiagramBlock):
            break
        outside.append((diagram, first, block))
        diagram, name = block.diagram, rest
    block = diagram.block(name)
    _check_free(outside, path, block, parameter)
    changed = dataclasses.replace(
        diagram,
        blocks={
            **diagram.blocks,
            name: _located(path, lambda: block.with_parameters(**{parameter: value})),
        },
    )
    for level, first, subsystem in reversed(outside):
        inside = dataclasses.replace(subsystem, diagram=changed)
        changed = dataclasses.replace(level, blocks={**level.blocks, first: inside})
    return changed


def _check_free(
    outside: Sequence[tuple[Diagram, str, DiagramBlock]], path: str, block: Block, parameter: str
) -> None:
    """Raise ``DiagramError`` for a parameter that is set by a formula or a library."""
    linked = next((place for place, (_, _, inside) in enumerate(outside) if inside.diagram.link), None)
    if linked is not None:
        subsystem = "/".join(name for _, name, _ in outside[: linked + 1])
        found = outside[linked][2].diagram
        own = ", ".join(f"{subsystem}.{rule.name}" for rule in found.mask)
        raise DiagramError(
            f"'{path}.{parameter}' is inside the library block '{found.link}'",
            where=f"block '{subsystem}'",
            allowed=own or "nothing: the library block has no parameters",
            fix="change a parameter of its mask, or break the link",
        )
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


def _located(path: str, change: Callable[[], _Changed]) -> _Changed:
    """The result of a change; errors get the block's path."""
    block = f"block '{path}'" if path else ""
    try:
        return change()
    except UnknownNameError as error:
        raise UnknownNameError(error.kind, error.name, error.known, where=block or error.where) from None
    except InputError as error:
        where = ", ".join(filter(None, (block, error.where)))
        raise DiagramError(error.what, where=where, allowed=error.allowed, fix=error.fix) from None

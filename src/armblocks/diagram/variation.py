"""The same diagram with other parameter values."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from armblocks.diagram.block import Block
from armblocks.diagram.check import check_diagram
from armblocks.diagram.diagram import Diagram
from armblocks.diagram.structure import Subsystem
from armblocks.errors import DiagramError, InputError, UnknownNameError


def with_parameters(diagram: Diagram, values: Mapping[str, object]) -> Diagram:
    """A copy with other parameter values, ``{"jtraj.tmax": 5.0}``, checked like the first ones.

    A block inside subsystems is named by its path, ``"controller/pid.kp"``. Raises ``UnknownNameError`` for
    an unknown block or parameter, ``DiagramError`` for a value that the block refuses or with which the
    diagram no longer fits together.
    """
    for path, value in values.items():
        name, _, parameter = path.rpartition(".")
        diagram = _with_value(diagram, name, parameter, value)
    check_diagram(diagram)
    return diagram


def _with_value(diagram: Diagram, path: str, parameter: str, value: object) -> Diagram:
    """A copy in which one parameter of the block at a path has another value."""
    outside: list[tuple[Diagram, str, Subsystem]] = []
    name = path
    while name not in diagram.blocks and "/" in name:
        first, _, rest = name.partition("/")
        block = diagram.blocks.get(first)
        if not isinstance(block, Subsystem):
            break
        outside.append((diagram, first, block))
        diagram, name = block.diagram, rest
    block = diagram.block(name)
    changed = dataclasses.replace(
        diagram, blocks={**diagram.blocks, name: _block_with(block, path, parameter, value)}
    )
    for level, first, subsystem in reversed(outside):
        inside = dataclasses.replace(subsystem, diagram=changed)
        changed = dataclasses.replace(level, blocks={**level.blocks, first: inside})
    return changed


def _block_with(block: Block, path: str, parameter: str, value: object) -> Block:
    known = [rule.name for rule in block.parameters()]
    if parameter not in known:
        raise UnknownNameError("parameter", parameter, known, where=f"block '{path}'")
    try:
        return dataclasses.replace(block, **{parameter: value})  # pyright: ignore[reportArgumentType]
    except InputError as error:
        where = f"block '{path}', {error.where}"
        raise DiagramError(error.what, where=where, allowed=error.allowed, fix=error.fix) from None

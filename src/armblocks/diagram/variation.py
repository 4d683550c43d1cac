"""The same diagram with other parameter values."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from armblocks.diagram.check import check_diagram
from armblocks.diagram.diagram import Diagram
from armblocks.errors import DiagramError, InputError, UnknownNameError


def with_parameters(diagram: Diagram, values: Mapping[str, object]) -> Diagram:
    """A copy with other parameter values, ``{"jtraj.tmax": 5.0}``, checked like the first ones.

    Raises ``UnknownNameError`` for an unknown block or parameter, ``DiagramError`` for a value that the
    block refuses or with which the diagram no longer fits together.
    """
    blocks = dict(diagram.blocks)
    for path, value in values.items():
        name, _, parameter = path.rpartition(".")
        known = [rule.name for rule in diagram.block(name).parameters()]
        if parameter not in known:
            raise UnknownNameError("parameter", parameter, known, where=f"block '{name}'")
        try:
            blocks[name] = dataclasses.replace(blocks[name], **{parameter: value})
        except InputError as error:
            where = f"block '{name}', {error.where}"
            raise DiagramError(error.what, where=where, allowed=error.allowed, fix=error.fix) from None
    changed = dataclasses.replace(diagram, blocks=blocks)
    check_diagram(changed)
    return changed

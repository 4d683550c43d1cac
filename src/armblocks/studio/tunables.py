"""Which parameters of a diagram a page may change while it runs, with what their blocks say of them."""

from __future__ import annotations

import math

import numpy as np

from armblocks.diagram import Diagram, flat_diagram
from armblocks.studio.messages import Tunable
from armblocks.studio.parameter_values import parameter_json

LONGEST = 64
"""Numbers of a parameter that a page would show: longer tables are edited in their file."""


def tunables(diagram: Diagram) -> list[Tunable]:
    """The tunable parameters of all blocks, by ``block.parameter``, with the values that they have now."""
    flat = flat_diagram(diagram)
    # Blocks that share their parameters say the same under one name.
    blocks = {flat.owner(name): block for name, block in flat.blocks.items()}
    return [
        Tunable(
            path=f"{name}.{rule.name}",
            value=parameter_json(value),
            unit=rule.unit,
            doc=rule.doc,
            low=_bound(rule.minimum if rule.above is None else rule.above),
            high=_bound(rule.maximum),
        )
        for name, block in blocks.items()
        for rule in block.inputs_of_the_run()
        if rule.tunable and np.size(np.asarray(value := block.parameter_value(rule.name))) <= LONGEST
    ]


def _bound(value: float) -> float | None:
    return value if math.isfinite(value) else None

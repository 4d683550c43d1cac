"""Evaluation of a single block with numbers, by CasADi's interpreter."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from armblocks.blocks import Constant
from armblocks.diagram import Block, DiagramBuilder, trace_diagram


def evaluate(block: Block, *inputs: ArrayLike, t: float = 0.0, x: ArrayLike = ()) -> dict[str, np.ndarray]:
    """Return all outputs and records of a block with constant inputs at time ``t`` and states ``x``."""
    builder = DiagramBuilder("one block")
    sources = [builder.add(f"in{k}", Constant(value=value)) for k, value in enumerate(inputs)]
    builder.add("block", block, *sources)
    system = trace_diagram(builder.build())
    p = system.parameter_values
    z = np.zeros(0)
    if system.discrete.size:
        (start,) = system.initial_discrete(p)
        # a reset without events: the modes become consistent
        _, z = system.reset(t, x, start, (), p, np.zeros(system.guards.outputs.size))
    (y,) = system.signals(t, x, z, (), p)
    values = system.signals_layout.unpack(y)
    return {path.removeprefix("block/"): value for path, value in values.items() if path[:6] == "block/"}

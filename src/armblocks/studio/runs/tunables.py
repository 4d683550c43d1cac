"""The tunable parameters of a diagram, with the rules of their blocks."""

from __future__ import annotations

import math

import numpy as np

from armblocks.diagram import Diagram
from armblocks.diagram.mask_tuning import tunable_parameters
from armblocks.studio.protocol.messages.runs import Tunable
from armblocks.studio.sheet.parameter_values import parameter_json

MAX_NUMBERS = 64
"""Limit of the numbers in a displayed parameter; larger tables are edited in their file."""


def tunables(diagram: Diagram) -> list[Tunable]:
    """Return the tunable parameters of masks and blocks, ``block.parameter``, with their present values."""
    return [
        Tunable(
            path=path,
            value=parameter_json(value),
            unit=rule.unit,
            doc=rule.doc,
            low=_bound(rule.minimum if rule.above is None else rule.above),
            high=_bound(rule.maximum),
        )
        for path, rule, value in tunable_parameters(diagram)
        if np.size(np.asarray(value)) <= MAX_NUMBERS
    ]


def _bound(value: float) -> float | None:
    return value if math.isfinite(value) else None

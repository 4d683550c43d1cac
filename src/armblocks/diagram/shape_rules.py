"""Shape compatibility rules."""

from __future__ import annotations

import math
from collections.abc import Mapping

from armblocks.equations import Shape
from armblocks.errors import InputError


def broadcast(shapes: Mapping[str, Shape]) -> Shape:
    """The shape of an elementwise result: scalars and single elements are broadcast, as in Simulink.

    All other shapes must be equal.

    Raises ``InputError`` that names two ports that do not agree.
    """
    result: Shape = ()
    first = ""
    for name, shape in shapes.items():
        if math.prod(shape) == 1:
            if math.prod(result) == 1 and len(shape) > len(result):
                result, first = shape, name
        elif math.prod(result) == 1:
            result, first = shape, name
        elif shape != result:
            raise InputError(
                f"'{first}' has shape {result} and '{name}' has shape {shape}",
                allowed="equal shapes, or a scalar with any shape",
                fix="change the width of one of the signals",
            )
    return result


def shapes_agree(signal: Shape, port: Shape) -> bool:
    """Whether a signal fits a port: equal shapes, or one element each."""
    return signal == port or math.prod(signal) == math.prod(port) == 1

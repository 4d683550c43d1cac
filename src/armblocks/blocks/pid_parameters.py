"""The parameters that all PID controllers have, declared once."""

from __future__ import annotations

import math
from typing import Any

from armblocks.blocks.pid_laws import ANTI_WINDUP, FORMS, METHODS, RESETS
from armblocks.diagram import ParameterKind, parameter


def gain_parameter(default: float, doc: str, unit: str = "", **rules: Any) -> Any:
    """A number, or one for each element."""
    return parameter(default, kind=ParameterKind.ARRAY, doc=doc, unit=unit, **rules)


def bandwidth_parameter() -> Any:
    """The corner of the derivative's filter."""
    return gain_parameter(100.0, "bandwidth of the derivative's filter", "rad/s", above=0.0)


def lower_limit_parameter() -> Any:
    """The least output."""
    return gain_parameter(-math.inf, "the least output", finite=False)


def upper_limit_parameter() -> Any:
    """The greatest output."""
    return gain_parameter(math.inf, "the greatest output", finite=False)


def limit_output_parameter() -> Any:
    """Whether the limits are there at all."""
    return parameter(False, doc="whether the output is held between lower and upper")


def form_parameter() -> Any:
    """How the three gains are combined."""
    return parameter("parallel", choices=FORMS, doc="ideal: P multiplies I and D too")


def anti_windup_parameter() -> Any:
    """What happens to the integral at a limit."""
    return parameter("none", choices=ANTI_WINDUP, doc="what keeps the integral in bounds")


def external_reset_parameter() -> Any:
    """When the trigger sets the states anew."""
    return parameter(
        "none", choices=tuple(RESETS), doc="when the input reset sets both states to their start values"
    )


def tracking_parameter() -> Any:
    """Whether the output is pulled towards a port."""
    return parameter(False, doc="whether the input tracking pulls the output towards it")


def method_parameter(doc: str) -> Any:
    """The rule of a sum."""
    return parameter("forward_euler", choices=METHODS, doc=doc)

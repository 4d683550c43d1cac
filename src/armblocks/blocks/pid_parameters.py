"""The parameters, inputs and checks that all PID controllers share."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from armblocks.blocks.pid_laws import ANTI_WINDUP, FORMS, METHODS, RESETS
from armblocks.blocks.switching import limits_in_order
from armblocks.diagram import (
    Block,
    ParameterKind,
    Port,
    Shapes,
    WorkedExample,
    broadcast,
    made,
    parameter,
    shape_of,
)
from armblocks.equations import Shape
from armblocks.errors import InputError


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


TWO_INPUTS = (Port("r", "the reference"), Port("u", "the measured output of the plant"))


def pid_example(kind: str, **parameters: Any) -> WorkedExample:
    """The step of a loop with two lags."""
    plant = made("SecondOrderLag", natural_frequency=2.0, damping=0.8).named("plant")
    step = made("Step")
    feeds = (
        {"r": step, "u": plant.by(u="y")}
        if kind == "two"
        else {"u": made("Sum", signs="+-").by(u1=step, u2=plant.by(u="y"))}
    )
    return WorkedExample(
        shows="The plant follows a step of the reference; below it what the controller gives.",
        parameters=parameters,
        inputs=feeds,
        shown=(step, "plant/y", "y"),
    )


def check_limits(block: Block, limited: bool) -> None:
    """Raise where the limits are not in order, or are given to a controller whose output is not limited."""
    limits_in_order(block, "lower", "upper")
    ends = [np.ravel(np.asarray(block.parameter_value(name))) for name in ("lower", "upper")]
    if not limited and np.isfinite(np.concatenate(ends)).any():
        raise InputError(
            "there are limits, but limit_output is false",
            where=block.type_name(),
            allowed="limits together with limit_output=True",
            fix="set limit_output, or leave lower and upper out",
        )


def pid_shape(block: Block, inputs: Shapes) -> Shape:
    """The shape that inputs and gains broadcast to."""
    wide = {name: shape for name, shape in inputs.items() if name != "reset"}
    own = {
        rule.name: shape_of(block.parameter_value(rule.name)) for rule in block.parameters() if rule.tunable
    }
    return broadcast({**wide, **own})

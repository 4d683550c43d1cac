"""The common parameters, inputs and checks of the PID controllers."""

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
    driver,
    parameter,
    shape_of,
)
from armblocks.equations import Shape
from armblocks.errors import InputError


def gain_parameter(default: float, doc: str, unit: str = "", **rules: Any) -> Any:
    """Declare a gain: a scalar, or one value for each element."""
    return parameter(default, kind=ParameterKind.ARRAY, doc=doc, unit=unit, **rules)


def bandwidth_parameter() -> Any:
    """Declare the corner frequency of the derivative filter."""
    return gain_parameter(100.0, "bandwidth of the derivative filter", "rad/s", above=0.0)


def lower_limit_parameter(doc: str = "lower limit of the output") -> Any:
    """Declare the lower limit of the output."""
    return gain_parameter(-math.inf, doc, finite=False)


def upper_limit_parameter(doc: str = "upper limit of the output") -> Any:
    """Declare the upper limit of the output."""
    return gain_parameter(math.inf, doc, finite=False)


def limit_output_parameter() -> Any:
    """Declare ``limit_output``: whether the output is limited."""
    return parameter(False, doc="whether the output is limited to the range from lower to upper")


def form_parameter() -> Any:
    """Declare ``form``, which combines the three gains."""
    return parameter("parallel", choices=FORMS, doc="parallel, or ideal: P also multiplies I and D")


def anti_windup_parameter() -> Any:
    """Declare ``anti_windup``."""
    return parameter("none", choices=ANTI_WINDUP, doc="anti-windup method")


def external_reset_parameter() -> Any:
    """Declare ``external_reset``, which adds the input ``reset``."""
    return parameter(
        "none",
        choices=tuple(RESETS),
        doc="edge at the input reset that sets both states to their initial values",
    )


def tracking_parameter() -> Any:
    """Declare ``tracking``, which adds the input ``tracking``."""
    return parameter(False, doc="whether the output follows the signal at the input tracking")


def method_parameter(doc: str) -> Any:
    """Declare the integration method of a sum."""
    return parameter("forward_euler", choices=METHODS, doc=doc)


TWO_INPUTS = (Port("r", "the reference"), Port("u", "the measured output of the plant"))


def further_inputs(external_reset: str, tracking: bool) -> tuple[Port, ...]:
    """The inputs that these parameters enable."""
    reset = (Port("reset", "the trigger", shape=()),) if external_reset != "none" else ()
    tracked = (Port("tracking", "signal that the output should track"),) if tracking else ()
    return (*reset, *tracked)


def pid_example(kind: str, **parameters: Any) -> WorkedExample:
    """A closed loop with a second-order lag as the plant, and a step of the reference."""
    plant = driver("SecondOrderLag", natural_frequency=2.0, damping=0.8).named("plant")
    step = driver("Step")
    inputs = (
        {"r": step, "u": plant.by(u="y")}
        if kind == "two"
        else {"u": driver("Sum", signs="+-").by(u1=step, u2=plant.by(u="y"))}
    )
    return WorkedExample(
        shows="The plant follows a step of the reference; the control action is largest at the step.",
        parameters=parameters,
        inputs=inputs,
        shown=(step, "plant/y", "y"),
    )


def check_limits(block: Block, limited: bool) -> None:
    """Raise ``InputError`` unless lower <= upper, and for limits without ``limit_output``."""
    limits_in_order(block, "lower", "upper")
    limits = [np.ravel(np.asarray(block.parameter_value(name))) for name in ("lower", "upper")]
    if not limited and np.isfinite(np.concatenate(limits)).any():
        raise InputError(
            "there are limits, but limit_output is false",
            where=block.type_name(),
            allowed="limits together with limit_output=True",
            fix="set limit_output, or omit lower and upper",
        )


def pid_shape(block: Block, inputs: Shapes) -> Shape:
    """The broadcast shape of inputs and gains."""
    input_shapes = {name: shape for name, shape in inputs.items() if name != "reset"}
    parameter_shapes = {
        declared.name: shape_of(block.parameter_value(declared.name))
        for declared in block.parameters()
        if declared.tunable
    }
    return broadcast({**input_shapes, **parameter_shapes})

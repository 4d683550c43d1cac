"""Blocks with continuous states, and the exact time derivative."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX
from numpy.typing import ArrayLike

from armblocks.diagram import (
    Block,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    integral_unit,
    parameter,
    rate_unit,
    shape_of,
)
from armblocks.diagram.signs import FaceSign, Fraction


@dataclass(frozen=True, kw_only=True)
class Integrator(Block):
    """The integral over time: y' = u, y(0) = initial."""

    title: ClassVar[str] = "Integrator"
    sign: ClassVar[FaceSign] = Fraction("1", "s")
    broadcast_parameters: ClassVar[tuple[str, ...]] = ("initial",)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The integral of a sine that starts at 0: 1 - cos t.",
    )

    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the output at t = 0")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "signal to integrate"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the integral"),)

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", self.output_shapes(inputs)["y"], "the integral"),)

    def assumed_output_shapes(self) -> Shapes:
        return {"y": shape_of(self.initial)}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": integral_unit(inputs["u"])}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["x"]}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": u["u"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial"]}


@dataclass(frozen=True, kw_only=True)
class Derivative(Block):
    """The exact time derivative of the input: y = du/dt, from the equations of the blocks that compute u.

    There is no filter and no finite difference. Where the input jumps (Step), the output is the derivative
    just after the jump.
    """

    title: ClassVar[str] = "Derivative"
    sign: ClassVar[FaceSign] = Fraction("du", "dt")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The derivative of a sine is exactly a cosine, from t = 0 on.",
    )
    time_derivatives: ClassVar[Mapping[str, str]] = {"y": "u"}

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "signal to differentiate"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "its time derivative"),)

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": rate_unit(inputs["u"])}

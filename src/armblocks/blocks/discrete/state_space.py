"""Sampled linear systems in state space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, mtimes
from numpy.typing import ArrayLike

from armblocks.blocks.linear_blocks import LinearBlock
from armblocks.diagram import (
    Shapes,
    Signals,
    State,
    WorkedExample,
    driver,
    sample_time_parameter,
)
from armblocks.diagram.signs import FaceSign, Lines


@dataclass(frozen=True, kw_only=True)
class DiscreteStateSpace(LinearBlock):
    """A linear sampled system: x(k+1) = A x(k) + B u(k), y(k) = C x(k) + D u(k), x(0) = initial.

    D is not tunable: where D is zero the output has no feedthrough, and the block may be part of a feedback
    loop.
    """

    title: ClassVar[str] = "Discrete State-Space"
    sign: ClassVar[FaceSign] = Lines(("x⁺ = A x + B u", "y = C x + D u"))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The step response of x(k+1) = 0.5 x + u: each tick halves the distance to 2.",
        inputs={"u": driver("Step")},
    )
    sampled: ClassVar[bool] = True

    sample_time: ArrayLike = sample_time_parameter()

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (self._state,)

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": mtimes(p["A"], x["x"]) + mtimes(p["B"], u["u"])}

"""Linear systems in state-space form."""

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
    parameter,
)
from armblocks.diagram.signs import FaceSign, Lines


@dataclass(frozen=True, kw_only=True)
class StateSpace(LinearBlock):
    """A linear system: x' = A x + B u, y = C x + D u, x(0) = initial.

    D is not tunable: where D is zero the output has no feedthrough, and the block may be part of a feedback
    loop.
    """

    title: ClassVar[str] = "State-Space"
    sign: ClassVar[FaceSign] = Lines(("x' = A x + B u", "y = C x + D u"))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A mass with spring and damper under a constant force from 1 s on: it oscillates and settles.",
        parameters={
            "A": ((0.0, 1.0), (-4.0, -0.8)),
            "B": ((0.0,), (4.0,)),
            "C": ((1.0, 0.0),),
            "D": ((0.0,),),
        },
        inputs={"u": driver("Step")},
    )

    A: ArrayLike = parameter(((-1.0,),), dimensions=(2,), doc="the system matrix (n, n)", unit="1/s")

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (self._state,)

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": mtimes(p["A"], x["x"]) + mtimes(p["B"], u["u"])}

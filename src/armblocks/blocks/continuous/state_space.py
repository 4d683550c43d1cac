"""Linear systems by their matrices, in state space."""

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
    made,
    parameter,
)
from armblocks.diagram.signs import FaceSign, Lines


@dataclass(frozen=True, kw_only=True)
class StateSpace(LinearBlock):
    """A linear system: x' = A x + B u, y = C x + D u, x(0) = initial.

    D belongs to the structure (it is not tunable), so that a zero in it leaves the output free of the input
    and the block may stand in a loop.
    """

    title: ClassVar[str] = "State-Space"
    sign: ClassVar[FaceSign] = Lines(("x' = A x + B u", "y = C x + D u"))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A mass on a spring with a damper, pushed from 1 s on: it swings in.",
        parameters={
            "A": ((0.0, 1.0), (-4.0, -0.8)),
            "B": ((0.0,), (4.0,)),
            "C": ((1.0, 0.0),),
            "D": ((0.0,),),
        },
        inputs={"u": made("Step")},
    )

    A: ArrayLike = parameter(((-1.0,),), dimensions=(2,), doc="the system matrix (n, n)", unit="1/s")

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (self._state,)

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": mtimes(p["A"], x["x"]) + mtimes(p["B"], u["u"])}

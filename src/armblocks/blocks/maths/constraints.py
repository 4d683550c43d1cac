"""Algebraic constraints: signals that an equation determines."""

from __future__ import annotations

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
    WorkedExample,
    broadcast,
    driver,
    parameter,
    shape_of,
)
from armblocks.diagram.signs import FaceSign, Words


@dataclass(frozen=True, kw_only=True)
class AlgebraicConstraint(Block):
    """An algebraic constraint: the output z solves f(z) = 0, where the input is f(z).

    - An equation that is linear in z is solved symbolically when the diagram is compiled.
    - Other equations are solved by Newton's method with the exact Jacobian. The iteration starts from
      ``initial`` at t = 0 and later from the previous solution. If the equation has several solutions, the
      start value selects one.
    - A vector z has as many equations as elements, which are solved together.
    - An input that does not depend on z is an error.
    """

    title: ClassVar[str] = "Algebraic Constraint"
    sign: ClassVar[FaceSign] = Words("f(z) = 0")
    implicit_outputs: ClassVar[tuple[str, ...]] = ("z",)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The solution z of the equation z + z^3 = sin t.",
        inputs={
            "u": driver("Expression", formula="u2 + u2 ^ 3 - u1", inputs=2).by(
                u1=driver("SineWave").named("sine"), u2="z"
            )
        },
        shown=("sine/y", "z"),
    )

    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="start value of the iteration")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "f(z), the residual"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("z", "the solution"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"z": broadcast({**inputs, "initial": shape_of(self.initial)})}

    def assumed_output_shapes(self) -> Shapes:
        return {"z": shape_of(self.initial)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"z": u["u"]}

    def initial_guesses(self, p: Signals) -> Signals:
        return {"z": p["initial"]}

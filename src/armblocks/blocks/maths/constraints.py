"""Signals that are sought: what they have to be follows from an equation."""

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
    made,
    parameter,
    shape_of,
)
from armblocks.diagram.signs import FaceSign, Words


@dataclass(frozen=True, kw_only=True)
class AlgebraicConstraint(Block):
    """A signal that makes another one zero: z such that f(z) = 0, where f leads from z back to the input u.

    An equation that is linear in z is solved while the diagram is compiled; else Newton's method with the
    exact Jacobian searches from ``initial`` at the start, later from where it was. Of several solutions the
    start decides. As many equations as unknowns: a vector is solved as a whole. An input that z has no
    influence on is refused.
    """

    title: ClassVar[str] = "Algebraic Constraint"
    sign: ClassVar[FaceSign] = Words("f(z) = 0")
    implicit_outputs: ClassVar[tuple[str, ...]] = ("z",)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The z for which z + z^3 is the sine.",
        inputs={
            "u": made("Expression", formula="u2 + u2 ^ 3 - u1", inputs=2).by(
                u1=made("SineWave").named("sine"), u2="z"
            )
        },
        shown=("sine/y", "z"),
    )

    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="where the search begins")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "f(z), which is to be 0"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("z", "the signal that is sought"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"z": broadcast({**inputs, "initial": shape_of(self.initial)})}

    def assumed_output_shapes(self) -> Shapes:
        return {"z": shape_of(self.initial)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"z": u["u"]}

    def initial_guesses(self, p: Signals) -> Signals:
        return {"z": p["initial"]}

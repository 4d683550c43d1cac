"""Rational transfer functions from their coefficients."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from casadi import SX

from armblocks.blocks.linear_blocks import RationalBlock
from armblocks.diagram import (
    Shapes,
    Signals,
    State,
    WorkedExample,
    driver,
)
from armblocks.diagram.signs import FaceSign, Fraction, polynomial


@dataclass(frozen=True, kw_only=True)
class TransferFunction(RationalBlock):
    """A rational transfer function: y = (b0 s^m + … + bm) / (a0 s^n + … + an) u, initially at rest.

    Coefficients are listed from the highest power to the lowest, as in MATLAB. The states belong to the
    controllable canonical form: xn is u filtered by 1/denominator, x1 its derivative of order n - 1.
    """

    title: ClassVar[str] = "Transfer Fcn"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The step response of 4 / (s^2 + 0.8 s + 4): damping 0.2, natural frequency 2 rad/s.",
        parameters={"numerator": (4.0,), "denominator": (1.0, 0.8, 4.0)},
        inputs={"u": driver("Step")},
    )

    def face_sign(self) -> FaceSign:
        return Fraction(polynomial("b", self.numerator), polynomial("a", self.denominator))

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", (self.degree,), "states of the controllable canonical form"),)

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return self._shifted(x, u, p)

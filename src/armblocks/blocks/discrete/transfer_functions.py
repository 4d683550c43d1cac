"""Sampled transfer functions and filters from their coefficients.

In their equations k counts the ticks and T is the period of the clock.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from casadi import SX, dot, vertcat
from numpy.typing import ArrayLike

from armblocks.blocks.linear_blocks import RationalBlock
from armblocks.diagram import (
    Block,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    driver,
    parameter,
    sample_time_parameter,
    shape_of,
)
from armblocks.diagram.signs import FaceSign, Fraction, Words, polynomial
from armblocks.errors import InputError


@dataclass(frozen=True, kw_only=True)
class DiscreteTransferFunction(RationalBlock):
    """A rational transfer function in z: y = (b0 z^m + … + bm) / (a0 z^n + … + an) u, initially at rest.

    Coefficients are listed from the highest power of z to the lowest, as in MATLAB.
    """

    title: ClassVar[str] = "Discrete Transfer Fcn"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The step response of z / (z - 0.5): each tick halves the distance to 2.",
        parameters={"numerator": (1.0, 0.0), "denominator": (1.0, -0.5)},
        inputs={"u": driver("Step")},
    )
    sampled: ClassVar[bool] = True

    denominator: ArrayLike = parameter((1.0, 0.5), dimensions=(1,), doc="a0 … an, highest power first")
    sample_time: ArrayLike = sample_time_parameter()

    def face_sign(self) -> FaceSign:
        return Fraction(polynomial("b", self.numerator, "z"), polynomial("a", self.denominator, "z"))

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", (self.degree,), "the last values of u filtered by 1/denominator, latest first"),)

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return self._shifted(x, u, p)


@dataclass(frozen=True, kw_only=True)
class DiscreteFilter(RationalBlock):
    """A digital filter: y = (b0 + b1 z^-1 + … + bm z^-m) / (a0 + … + an z^-n) u, initially at rest."""

    title: ClassVar[str] = "Discrete Filter"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A low-pass filter smooths pulses.",
        parameters={"numerator": (0.2,), "denominator": (1.0, -0.8), "sample_time": 0.1},
        inputs={"u": driver("PulseGenerator", period=4.0)},
    )
    sampled: ClassVar[bool] = True

    numerator: ArrayLike = parameter((1.0,), dimensions=(1,), doc="b0 … bm, ascending powers of 1/z")
    denominator: ArrayLike = parameter((1.0, 0.5), dimensions=(1,), doc="a0 … an, ascending powers of 1/z")
    sample_time: ArrayLike = sample_time_parameter()

    def face_sign(self) -> FaceSign:
        return Fraction(
            polynomial("b", self.numerator, "z", delays=True),
            polynomial("a", self.denominator, "z", delays=True),
        )

    def check(self) -> None:
        a = np.asarray(self.denominator)
        if a[0] == 0.0 or self.degree < 1:
            raise InputError(
                f"the denominator is {a.tolist()}",
                where=self.type_name(),
                allowed="a0 not zero, and at least two coefficients in the numerator or the denominator",
                fix="use a Gain for a filter without memory",
            )

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the filtered input", shape=()),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", (self.degree,), "the last values of u filtered by 1/denominator, latest first"),)

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return self._shifted(x, u, p)

    @property
    def degree(self) -> int:
        """Number of states."""
        return max(shape_of(self.numerator)[0], shape_of(self.denominator)[0]) - 1

    def _coefficients(self, p: Signals) -> tuple[SX, SX]:
        b, a = (
            vertcat(p[name], SX(self.degree + 1 - p[name].numel(), 1))
            for name in ("numerator", "denominator")
        )
        return b, a


@dataclass(frozen=True, kw_only=True)
class DiscreteFir(Block):
    """A filter with finite impulse response: y(k) = b0 u(k) + b1 u(k-1) + … + bm u(k-m)."""

    title: ClassVar[str] = "Discrete FIR Filter"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The mean of the last four samples of pulses: edges become ramps.",
        parameters={"coefficients": (0.25, 0.25, 0.25, 0.25), "sample_time": 0.2},
        inputs={"u": driver("PulseGenerator", period=4.0)},
    )
    sampled: ClassVar[bool] = True

    coefficients: ArrayLike = parameter((0.5, 0.5), dimensions=(1,), doc="b0 … bm")
    sample_time: ArrayLike = sample_time_parameter()

    def face_sign(self) -> FaceSign:
        return Words(polynomial("b", self.coefficients, "z", delays=True))

    def check(self) -> None:
        if shape_of(self.coefficients)[0] < 2:
            raise InputError(
                "there is one coefficient",
                where="DiscreteFir.coefficients",
                allowed="two or more",
                fix="use a Gain for a filter without memory",
            )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the input", shape=()),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the filtered input", shape=()),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", (shape_of(self.coefficients)[0] - 1,), "the last inputs, newest first"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": dot(p["coefficients"], vertcat(u["u"], x["x"]))}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": vertcat(u["u"], x["x"])[: x["x"].numel()]}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": SX(0.0)}

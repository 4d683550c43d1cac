"""Blocks with continuous states, and the exact time derivative."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from casadi import SX, dot, mtimes, vertcat
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
    made,
    parameter,
    rate_unit,
    shape_of,
)
from armblocks.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Integrator(Block):
    """The integral over time: y' = u, y(0) = initial."""

    family: ClassVar[str] = "continuous"
    title: ClassVar[str] = "Integrator"
    spreads: ClassVar[tuple[str, ...]] = ("initial",)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The integral of a sine that starts at 0: 1 - cos t.",
    )

    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the output at t = 0")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the rate"),)

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
    """The exact rate of change: y = du/dt, worked out from the equations of what feeds it.

    Nothing is filtered or differenced. Where the input jumps (Step), the jump is ignored and the rate on
    its right side is given.
    """

    family: ClassVar[str] = "continuous"
    title: ClassVar[str] = "Derivative"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The slope of a sine: a cosine, exactly, from the first instant on.",
    )
    time_derivatives: ClassVar[Mapping[str, str]] = {"y": "u"}

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "what is differentiated"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "its rate of change"),)

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": rate_unit(inputs["u"])}


@dataclass(frozen=True, kw_only=True)
class StateSpace(Block):
    """A linear system: x' = A x + B u, y = C x + D u, x(0) = initial.

    D belongs to the structure (it is not tunable), so that a zero in it leaves the output free of the input
    and the block may stand in a loop.
    """

    family: ClassVar[str] = "continuous"
    title: ClassVar[str] = "State-Space"
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
    B: ArrayLike = parameter(((1.0,),), dimensions=(2,), doc="the input matrix (n, m)")
    C: ArrayLike = parameter(((1.0,),), dimensions=(2,), doc="the output matrix (k, n)")
    D: ArrayLike = parameter(((0.0,),), dimensions=(2,), doc="the feedthrough (k, m)", tunable=False)
    initial: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, dimensions=(0, 1), doc="the state (n,) at t = 0, or one number for all"
    )

    def check(self) -> None:
        A, B, C, D = (shape_of(self.parameter_value(name)) for name in "ABCD")
        if A[0] != A[1] or B[0] != A[0] or C[1] != A[0] or (C[0], B[1]) != D:
            raise InputError(
                f"A is {A}, B is {B}, C is {C}, D is {D}",
                where="StateSpace",
                allowed="A (n, n), B (n, m), C (k, n), D (k, m)",
                fix="make the four matrices fit each other",
            )
        if shape_of(self.initial) not in ((), A[:1]):
            raise InputError(
                f"initial has shape {shape_of(self.initial)}",
                where="StateSpace",
                allowed=f"() or {A[:1]}",
                fix="give one number for each row of A, or one for all",
            )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the input", shape=shape_of(self.B)[1:]),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the output", shape=shape_of(self.C)[:1]),)

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", shape_of(self.A)[:1], "the state of the system"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        D = SX(np.asarray(self.D))
        return {"y": mtimes(p["C"], x["x"]) + mtimes(D, u["u"])}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": mtimes(p["A"], x["x"]) + mtimes(p["B"], u["u"])}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial"]}


@dataclass(frozen=True, kw_only=True)
class TransferFunction(Block):
    """A rational transfer function: y = (b0 s^m + … + bm) / (a0 s^n + … + an) u, at rest at the start.

    Coefficients stand from the highest power to the lowest, as in MATLAB. Its state is the controllable
    canonical form's: x1 = u filtered by 1/denominator, differentiated n - 1 times, … xn.
    """

    family: ClassVar[str] = "continuous"
    title: ClassVar[str] = "Transfer Fcn"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The step response of 4 / (s^2 + 0.8 s + 4): damping 0.2, natural frequency 2 rad/s.",
        parameters={"numerator": (4.0,), "denominator": (1.0, 0.8, 4.0)},
        inputs={"u": made("Step")},
    )

    numerator: ArrayLike = parameter((1.0,), dimensions=(1,), doc="b0 … bm, highest power first")
    denominator: ArrayLike = parameter((1.0, 1.0), dimensions=(1,), doc="a0 … an, highest power first")

    def check(self) -> None:
        b, a = np.asarray(self.numerator), np.asarray(self.denominator)
        if a[0] == 0.0 or len(a) < 2 or len(b) > len(a):
            raise InputError(
                f"the denominator is {a.tolist()} and the numerator has {len(b)} coefficients",
                where="TransferFunction",
                allowed="a0 not zero, at least two a, and no more b than a",
                fix="leave out leading zeros; a system with more zeros than poles cannot be simulated",
            )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the input", shape=()),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the output", shape=()),)

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", (self._degree,), "the canonical state"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        a = p["denominator"] / p["denominator"][0]
        b = vertcat(SX.zeros(self._degree + 1 - p["numerator"].numel()), p["numerator"]) / p["denominator"][0]
        # y = b0 u + sum (b_i - b0 a_i) x_i; a strictly proper system has no b0, so nothing feeds through.
        return {"y": b[0] * u["u"] + dot(b[1:] - b[0] * a[1:], x["x"])}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        a = p["denominator"] / p["denominator"][0]
        first = u["u"] - dot(a[1:], x["x"])
        return {"x": vertcat(first, x["x"])[: self._degree]}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": SX(0.0)}

    @property
    def _degree(self) -> int:
        return shape_of(self.denominator)[0] - 1

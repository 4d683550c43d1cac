"""Linear sampled systems: filters, transfer functions in z and state space.

In their equations k counts the ticks and T is the period of the clock.
"""

from __future__ import annotations

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
    made,
    parameter,
    sample_time_parameter,
    shape_of,
)
from armblocks.errors import InputError


def _direct_form(x: SX, u: SX, b: SX, a: SX) -> tuple[SX, SX]:
    """Output and next state of (b0 + b1 z^-1 + … bn z^-n) / (a0 + … + an z^-n), direct form II."""
    b, a = b / a[0], a / a[0]
    first = u - dot(a[1:], x)
    # y = b0 u + sum (b_i - b0 a_i) x_i; a strictly proper system has no b0, so nothing feeds through.
    return b[0] * u + dot(b[1:] - b[0] * a[1:], x), vertcat(first, x)[: x.numel()]


@dataclass(frozen=True, kw_only=True)
class DiscreteStateSpace(Block):
    """A linear sampled system: x(k+1) = A x(k) + B u(k), y(k) = C x(k) + D u(k), x(0) = initial.

    D belongs to the structure (it is not tunable), so that a zero in it leaves the output free of the input
    and the block may stand in a loop.
    """

    family: ClassVar[str] = "discrete"
    title: ClassVar[str] = "Discrete State-Space"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The step response of x(k+1) = 0.5 x + u: it goes to 2, half of the way with every tick.",
        inputs={"u": made("Step")},
    )
    sampled: ClassVar[bool] = True

    A: ArrayLike = parameter(((0.5,),), dimensions=(2,), doc="the system matrix (n, n)")
    B: ArrayLike = parameter(((1.0,),), dimensions=(2,), doc="the input matrix (n, m)")
    C: ArrayLike = parameter(((1.0,),), dimensions=(2,), doc="the output matrix (k, n)")
    D: ArrayLike = parameter(((0.0,),), dimensions=(2,), doc="the feedthrough (k, m)", tunable=False)
    initial: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, dimensions=(0, 1), doc="the state (n,) at the first tick"
    )
    sample_time: ArrayLike = sample_time_parameter()

    def check(self) -> None:
        A, B, C, D = (shape_of(self.parameter_value(name)) for name in "ABCD")
        if A[0] != A[1] or B[0] != A[0] or C[1] != A[0] or (C[0], B[1]) != D:
            raise InputError(
                f"A is {A}, B is {B}, C is {C}, D is {D}",
                where="DiscreteStateSpace",
                allowed="A (n, n), B (n, m), C (k, n), D (k, m)",
                fix="make the four matrices fit each other",
            )
        if shape_of(self.initial) not in ((), A[:1]):
            raise InputError(
                f"initial has shape {shape_of(self.initial)}",
                where="DiscreteStateSpace.initial",
                allowed=f"() or {A[:1]}",
                fix="give one number for each row of A, or one for all",
            )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the input", shape=shape_of(self.B)[1:]),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the output", shape=shape_of(self.C)[:1]),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", shape_of(self.A)[:1], "the state of the system"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": mtimes(p["C"], x["x"]) + mtimes(SX(np.asarray(self.D)), u["u"])}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": mtimes(p["A"], x["x"]) + mtimes(p["B"], u["u"])}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial"]}


@dataclass(frozen=True, kw_only=True)
class DiscreteTransferFunction(Block):
    """A rational transfer function in z: y = (b0 z^m + … + bm) / (a0 z^n + … + an) u, at rest at the start.

    Coefficients stand from the highest power of z to the lowest, as in MATLAB.
    """

    family: ClassVar[str] = "discrete"
    title: ClassVar[str] = "Discrete Transfer Fcn"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The step response of z / (z - 0.5): each tick halves the way to 2.",
        parameters={"numerator": (1.0, 0.0), "denominator": (1.0, -0.5)},
        inputs={"u": made("Step")},
    )
    sampled: ClassVar[bool] = True

    numerator: ArrayLike = parameter((1.0,), dimensions=(1,), doc="b0 … bm, highest power first")
    denominator: ArrayLike = parameter((1.0, 0.5), dimensions=(1,), doc="a0 … an, highest power first")
    sample_time: ArrayLike = sample_time_parameter()

    def check(self) -> None:
        b, a = np.asarray(self.numerator), np.asarray(self.denominator)
        if a[0] == 0.0 or len(a) < 2 or len(b) > len(a):
            raise InputError(
                f"the denominator is {a.tolist()} and the numerator has {len(b)} coefficients",
                where="DiscreteTransferFunction",
                allowed="a0 not zero, at least two a, and no more b than a",
                fix="leave out leading zeros; an output cannot come before its input",
            )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the input", shape=()),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the output", shape=()),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", (shape_of(self.denominator)[0] - 1,), "u / denominator at the last ticks"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": self._step(x, u, p)[0]}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": self._step(x, u, p)[1]}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": SX(0.0)}

    def _step(self, x: Signals, u: Signals, p: Signals) -> tuple[SX, SX]:
        missing = p["denominator"].numel() - p["numerator"].numel()
        return _direct_form(x["x"], u["u"], vertcat(SX(missing, 1), p["numerator"]), p["denominator"])


@dataclass(frozen=True, kw_only=True)
class DiscreteFilter(Block):
    """A digital filter: y = (b0 + b1 z^-1 + … + bm z^-m) / (a0 + … + an z^-n) u, at rest at the start."""

    family: ClassVar[str] = "discrete"
    title: ClassVar[str] = "Discrete Filter"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A low-pass: pulses come out smoothed.",
        parameters={"numerator": (0.2,), "denominator": (1.0, -0.8), "sample_time": 0.1},
        inputs={"u": made("PulseGenerator", period=4.0)},
    )
    sampled: ClassVar[bool] = True

    numerator: ArrayLike = parameter((1.0,), dimensions=(1,), doc="b0 … bm, rising powers of 1/z")
    denominator: ArrayLike = parameter((1.0, 0.5), dimensions=(1,), doc="a0 … an, rising powers of 1/z")
    sample_time: ArrayLike = sample_time_parameter()

    def check(self) -> None:
        a = np.asarray(self.denominator)
        if a[0] == 0.0 or self._degree < 1:
            raise InputError(
                f"the denominator is {a.tolist()}",
                where="DiscreteFilter",
                allowed="a0 not zero, and two coefficients in one of both",
                fix="use a Gain where nothing is remembered",
            )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the input", shape=()),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the filtered input", shape=()),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", (self._degree,), "u / denominator at the last ticks"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": self._step(x, u, p)[0]}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": self._step(x, u, p)[1]}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": SX(0.0)}

    def _step(self, x: Signals, u: Signals, p: Signals) -> tuple[SX, SX]:
        b, a = (
            vertcat(p[name], SX(self._degree + 1 - p[name].numel(), 1))
            for name in ("numerator", "denominator")
        )
        return _direct_form(x["x"], u["u"], b, a)

    @property
    def _degree(self) -> int:
        return max(shape_of(self.numerator)[0], shape_of(self.denominator)[0]) - 1


@dataclass(frozen=True, kw_only=True)
class DiscreteFir(Block):
    """A filter with finite memory: y(k) = b0 u(k) + b1 u(k-1) + … + bm u(k-m)."""

    family: ClassVar[str] = "discrete"
    title: ClassVar[str] = "Discrete FIR Filter"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The mean of the last four samples of pulses: edges become slopes.",
        parameters={"coefficients": (0.25, 0.25, 0.25, 0.25), "sample_time": 0.2},
        inputs={"u": made("PulseGenerator", period=4.0)},
    )
    sampled: ClassVar[bool] = True

    coefficients: ArrayLike = parameter((0.5, 0.5), dimensions=(1,), doc="b0 … bm")
    sample_time: ArrayLike = sample_time_parameter()

    def check(self) -> None:
        if shape_of(self.coefficients)[0] < 2:
            raise InputError(
                "there is one coefficient",
                where="DiscreteFir.coefficients",
                allowed="two or more",
                fix="use a Gain where nothing is remembered",
            )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the input", shape=()),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the filtered input", shape=()),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", (shape_of(self.coefficients)[0] - 1,), "the last inputs, the newest first"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": dot(p["coefficients"], vertcat(u["u"], x["x"]))}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": vertcat(u["u"], x["x"])[: x["x"].numel()]}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": SX(0.0)}

"""Sampled blocks: they work at the ticks of their clock and hold their outputs in between.

In their equations k counts the ticks and T is the period of the clock.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from casadi import SX, dot, fmax, fmin, if_else, logic_and, mtimes, vertcat
from numpy.typing import ArrayLike

from armblocks.diagram import (
    Block,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    State,
    broadcast,
    parameter,
    sample_time_parameter,
    shape_of,
)
from armblocks.equations import Shape
from armblocks.errors import InputError

INPUT = Port("u", "what is sampled")
OUTPUT = Port("y", "what is held")


@dataclass(frozen=True, kw_only=True)
class UnitDelay(Block):
    """The input one tick before: y(k) = u(k-1), y(0) = initial."""

    family: ClassVar[str] = "discrete"
    title: ClassVar[str] = "Unit Delay"
    sampled: ClassVar[bool] = True

    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the output at the first tick")
    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (INPUT,)

    def output_ports(self) -> tuple[Port, ...]:
        return (OUTPUT,)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast({**inputs, "initial": shape_of(self.initial)})}

    def assumed_output_shapes(self) -> Shapes:
        return {"y": shape_of(self.initial)}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", self.output_shapes(inputs)["y"], "the input at the tick before"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["x"]}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": u["u"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial"]}

    def initial_outputs(self, p: Signals) -> Signals:
        return {"y": p["initial"]}


@dataclass(frozen=True, kw_only=True)
class Delay(Block):
    """The input some ticks before: y(k) = u(k - length), y = initial for k < length."""

    family: ClassVar[str] = "discrete"
    title: ClassVar[str] = "Delay"
    sampled: ClassVar[bool] = True

    length: int = parameter(2, minimum=1, doc="by how many ticks")
    initial: float = parameter(0.0, doc="every element of the first outputs")
    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (INPUT,)

    def output_ports(self) -> tuple[Port, ...]:
        return (OUTPUT,)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        if len(inputs["u"]) > 1:
            raise InputError(f"'u' has shape {inputs['u']}", allowed="a scalar or a vector")
        return {"y": inputs["u"]}

    def assumed_output_shapes(self) -> Shapes:
        return {"y": ()}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", (self.length, math.prod(inputs["u"])), "the last inputs, the oldest first"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["x"][0, :].T}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": vertcat(x["x"][1:, :], u["u"].T)}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial"]}

    def initial_outputs(self, p: Signals) -> Signals:
        return {"y": p["initial"]}


@dataclass(frozen=True, kw_only=True)
class TappedDelay(Block):
    """The last inputs in one vector: y(k) = [u(k - length), …, u(k - 1)]."""

    family: ClassVar[str] = "discrete"
    title: ClassVar[str] = "Tapped Delay"
    sampled: ClassVar[bool] = True

    length: int = parameter(4, minimum=1, doc="how many inputs are kept")
    initial: float = parameter(0.0, doc="every element at the first tick")
    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "what is sampled", shape=()),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the last inputs, the oldest first", shape=(self.length,)),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", (self.length,), "the last inputs, the oldest first"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["x"]}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": vertcat(x["x"][1:], u["u"])}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial"]}

    def initial_outputs(self, p: Signals) -> Signals:
        return {"y": p["initial"]}


@dataclass(frozen=True, kw_only=True)
class ZeroOrderHold(Block):
    """The input as it was at the last tick: y(t) = u(k T) until the next one."""

    family: ClassVar[str] = "discrete"
    title: ClassVar[str] = "Zero-Order Hold"
    sampled: ClassVar[bool] = True

    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (INPUT,)

    def output_ports(self) -> tuple[Port, ...]:
        return (OUTPUT,)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": u["u"]}


@dataclass(frozen=True, kw_only=True)
class RateTransition(Block):
    """Hands a signal from one sample time to another: y(t) = u(k T) at the ticks of the receiving clock.

    Where both clocks tick at the same instant, the value of that instant is handed over.
    """

    family: ClassVar[str] = "discrete"
    title: ClassVar[str] = "Rate Transition"
    sampled: ClassVar[bool] = True

    sample_time: ArrayLike = sample_time_parameter(1.0)

    def input_ports(self) -> tuple[Port, ...]:
        return (INPUT,)

    def output_ports(self) -> tuple[Port, ...]:
        return (OUTPUT,)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": u["u"]}


_METHODS = ("forward_euler", "backward_euler", "trapezoidal")


@dataclass(frozen=True, kw_only=True)
class DiscreteIntegrator(Block):
    """The integral as a sum: x(k+1) = x(k) + gain T u(k), held between two limits, x(0) = initial.

    The output is that of Simulink's Discrete-Time Integrator. Forward Euler: y(k) = x(k). Backward Euler:
    y(k) = x(k) + gain T u(k). Trapezoidal: y(k) = x(k) + gain T u(k) / 2 and x(k+1) = y(k) + gain T u(k) / 2.
    """

    family: ClassVar[str] = "discrete"
    title: ClassVar[str] = "Discrete-Time Integrator"
    sampled: ClassVar[bool] = True

    method: str = parameter("forward_euler", choices=_METHODS, doc="the rule of integration")
    gain: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="the factor")
    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the state at the first tick")
    lower: float = parameter(-math.inf, finite=False, doc="the least value")
    upper: float = parameter(math.inf, finite=False, doc="the greatest value")
    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the rate"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the sum"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        own = {"gain": shape_of(self.gain), "initial": shape_of(self.initial)}
        return {"y": broadcast({**inputs, **own})}

    def assumed_output_shapes(self) -> Shapes:
        return {"y": broadcast({"gain": shape_of(self.gain), "initial": shape_of(self.initial)})}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", self.output_shapes(inputs)["y"], "the sum"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        if self.method == "forward_euler":
            return {"y": x["x"]}
        share = 1.0 if self.method == "backward_euler" else 0.5
        return {"y": self._limited(x["x"] + share * p["gain"] * p["T"] * u["u"], p)}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": self._limited(x["x"] + p["gain"] * p["T"] * u["u"], p)}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial"]}

    def initial_outputs(self, p: Signals) -> Signals:
        return {"y": p["initial"]}

    def _limited(self, value: SX, p: Signals) -> SX:
        return fmin(fmax(value, p["lower"]), p["upper"])


@dataclass(frozen=True, kw_only=True)
class Difference(Block):
    """What the input gained since the tick before: y(k) = u(k) - u(k-1)."""

    family: ClassVar[str] = "discrete"
    title: ClassVar[str] = "Difference"
    sampled: ClassVar[bool] = True

    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the input before the first tick")
    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (INPUT,)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the difference"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast({**inputs, "initial": shape_of(self.initial)})}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", self.output_shapes(inputs)["y"], "the input at the tick before"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": u["u"] - x["x"]}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": u["u"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial"]}


@dataclass(frozen=True, kw_only=True)
class DiscreteDerivative(Block):
    """The rate of change between two ticks: y(k) = gain (u(k) - u(k-1)) / T."""

    family: ClassVar[str] = "discrete"
    title: ClassVar[str] = "Discrete Derivative"
    sampled: ClassVar[bool] = True

    gain: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="the factor")
    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the input before the first tick")
    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (INPUT,)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the rate of change"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        own = {"gain": shape_of(self.gain), "initial": shape_of(self.initial)}
        return {"y": broadcast({**inputs, **own})}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", self.output_shapes(inputs)["y"], "the input at the tick before"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": p["gain"] * (u["u"] - x["x"]) / p["T"]}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": u["u"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial"]}


@dataclass(frozen=True, kw_only=True)
class DiscreteStateSpace(Block):
    """A linear sampled system: x(k+1) = A x(k) + B u(k), y(k) = C x(k) + D u(k), x(0) = initial.

    D belongs to the structure (it is not tunable), so that a zero in it leaves the output free of the input
    and the block may stand in a loop.
    """

    family: ClassVar[str] = "discrete"
    title: ClassVar[str] = "Discrete State-Space"
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
                where="DiscreteStateSpace",
                allowed=f"() or {A[:1]}",
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


def _direct_form(x: SX, u: SX, b: SX, a: SX) -> tuple[SX, SX]:
    """Output and next state of (b0 + b1 z^-1 + … bn z^-n) / (a0 + … + an z^-n), direct form II."""
    b, a = b / a[0], a / a[0]
    first = u - dot(a[1:], x)
    # y = b0 u + sum (b_i - b0 a_i) x_i; a strictly proper system has no b0, so nothing feeds through.
    return b[0] * u + dot(b[1:] - b[0] * a[1:], x), vertcat(first, x)[: x.numel()]


@dataclass(frozen=True, kw_only=True)
class DiscreteTransferFunction(Block):
    """A rational transfer function in z: y = (b0 z^m + … + bm) / (a0 z^n + … + an) u, at rest at the start.

    Coefficients stand from the highest power of z to the lowest, as in MATLAB.
    """

    family: ClassVar[str] = "discrete"
    title: ClassVar[str] = "Discrete Transfer Fcn"
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


@dataclass(frozen=True, kw_only=True)
class DiscretePID(Block):
    """Sampled PID: y = limit(P u + i + N (D u - f)), i(k+1) = i + T I u, f(k+1) = f + T N (D u - f).

    That is Simulink's Discrete PID Controller (parallel) with forward Euler rules. Where the output is
    limited, ``clamping`` stops the integral while it would drive the output further out, and
    ``back_calculation`` adds T Kb (y - unlimited y) to it.
    """

    family: ClassVar[str] = "discrete"
    title: ClassVar[str] = "Discrete PID Controller"
    sampled: ClassVar[bool] = True

    P: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="proportional gain")
    I: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="integral gain", unit="1/s")  # noqa: E741
    D: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="derivative gain", unit="s")
    N: ArrayLike = parameter(
        100.0, kind=ParameterKind.ARRAY, doc="bandwidth of the derivative's filter", unit="rad/s", above=0.0
    )
    lower: ArrayLike = parameter(-math.inf, kind=ParameterKind.ARRAY, finite=False, doc="the least output")
    upper: ArrayLike = parameter(math.inf, kind=ParameterKind.ARRAY, finite=False, doc="the greatest output")
    anti_windup: str = parameter(
        "none", choices=("none", "clamping", "back_calculation"), doc="what keeps the integral in bounds"
    )
    Kb: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="back-calculation gain", unit="1/s")
    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the error"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the control action"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": self._shape(inputs)}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        shape = self._shape(inputs)
        return (
            State("integral", shape, "the integral action"),
            State("filter", shape, "the filtered D u"),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": self._limited(self._unlimited(x, u, p), p)}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        rate = p["I"] * u["u"]
        free = self._unlimited(x, u, p)
        excess = free - self._limited(free, p)
        if self.anti_windup == "clamping":
            outwards = logic_and(excess != 0.0, excess * rate > 0.0)
            rate = if_else(outwards, SX(0.0), rate)
        elif self.anti_windup == "back_calculation":
            rate = rate - p["Kb"] * excess
        return {
            "integral": x["integral"] + p["T"] * rate,
            "filter": x["filter"] + p["T"] * p["N"] * (p["D"] * u["u"] - x["filter"]),
        }

    def initial_states(self, p: Signals) -> Signals:
        return {"integral": SX(0.0), "filter": SX(0.0)}

    def _unlimited(self, x: Signals, u: Signals, p: Signals) -> SX:
        return p["P"] * u["u"] + x["integral"] + p["N"] * (p["D"] * u["u"] - x["filter"])

    def _limited(self, value: SX, p: Signals) -> SX:
        return fmin(fmax(value, p["lower"]), p["upper"])

    def _shape(self, inputs: Shapes) -> Shape:
        names = ("P", "I", "D", "N", "lower", "upper", "Kb")
        return broadcast({**inputs, **{name: shape_of(self.parameter_value(name)) for name in names}})


@dataclass(frozen=True, kw_only=True)
class RateLimiter(Block):
    """The input, no faster than allowed: y(k) is u(k) held to y(k-1) + falling T … y(k-1) + rising T."""

    family: ClassVar[str] = "discontinuities"
    title: ClassVar[str] = "Rate Limiter"
    sampled: ClassVar[bool] = True

    rising: ArrayLike = parameter(
        1.0, kind=ParameterKind.ARRAY, minimum=0.0, doc="the fastest rise", unit="1/s"
    )
    falling: ArrayLike = parameter(
        -1.0, kind=ParameterKind.ARRAY, maximum=0.0, doc="the fastest fall, not positive", unit="1/s"
    )
    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the output before the first tick")
    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (INPUT,)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the limited signal"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        names = ("rising", "falling", "initial")
        return {"y": broadcast({**inputs, **{name: shape_of(self.parameter_value(name)) for name in names}})}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", self.output_shapes(inputs)["y"], "the output at the tick before"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        least, most = x["x"] + p["falling"] * p["T"], x["x"] + p["rising"] * p["T"]
        return {"y": fmin(fmax(u["u"], least), most)}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": self.outputs(t, x, u, p)["y"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial"]}

    def initial_outputs(self, p: Signals) -> Signals:
        return {"y": p["initial"]}


@dataclass(frozen=True, kw_only=True)
class CounterLimited(Block):
    """Counts the ticks and starts again: y(k) = k mod (upper + 1)."""

    family: ClassVar[str] = "sources"
    title: ClassVar[str] = "Counter Limited"
    sampled: ClassVar[bool] = True

    upper: int = parameter(7, minimum=0, doc="the greatest count")
    sample_time: ArrayLike = sample_time_parameter(1.0)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the count", shape=()),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", (), "the count"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["x"]}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": if_else(x["x"] >= self.upper, 0.0, x["x"] + 1.0)}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": SX(0.0)}


@dataclass(frozen=True, kw_only=True)
class DigitalClock(Block):
    """The time at the last tick: y = k T + offset."""

    family: ClassVar[str] = "sources"
    title: ClassVar[str] = "Digital Clock"
    sampled: ClassVar[bool] = True

    sample_time: ArrayLike = sample_time_parameter(1.0)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "time of the last tick", "s", shape=()),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": t}

"""Sampled integrals, differences and derivatives.

In their equations k counts the ticks and T is the period of the clock.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from casadi import SX, fmax, fmin, if_else
from numpy.typing import ArrayLike

from armblocks.blocks.external_resets import (
    PREVIOUS_TRIGGER,
    external_reset_parameter,
    fires_at_tick,
    initial_source_parameter,
    reset_ports,
    trigger_state,
)
from armblocks.blocks.integration_rules import included_fraction, interval_of_update
from armblocks.blocks.switching import limits_in_order
from armblocks.diagram import (
    Block,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    parameter,
    sample_time_parameter,
)
from armblocks.diagram.signs import FaceSign, Fraction, Words, times

INPUT = Port("u", "sampled signal")

_METHODS = {
    "forward_euler": ("T", "z − 1"),
    "backward_euler": ("T z", "z − 1"),
    "trapezoidal": ("T (z + 1)", "2 (z − 1)"),
}
"""Integration methods, each with numerator and denominator of its transfer function."""


@dataclass(frozen=True, kw_only=True)
class DiscreteIntegrator(Block):
    """A discrete-time integrator: x(k+1) = x(k) + gain T u(k), within two limits, x(0) = initial.

    The block corresponds to Simulink's Discrete-Time Integrator. Its methods:

    - forward Euler: y(k) = x(k)
    - backward Euler: y(k) = x(k) + gain T u(k)
    - trapezoidal: y(k) = x(k) + gain T u(k) / 2 and x(k+1) = y(k) + gain T u(k) / 2

    In a triggered subsystem the interval is T(k) = t(k) - t(k-1). Forward Euler is then y(k) = y(k-1) + gain
    T(k) u(k-1), and the trapezoidal rule is y(k) = y(k-1) + gain T(k) (u(k-1) + u(k)) / 2.

    An external reset sets x(k) to the initial value before the output of that tick is computed. The
    ``state_port`` outputs x(k) before the reset, so that a loop through this port is not algebraic.
    """

    title: ClassVar[str] = "Discrete-Time Integrator"
    broadcast_parameters: ClassVar[tuple[str, ...]] = ("gain", "initial")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The integral of a sine by the forward Euler method: one rectangle for each tick.",
    )
    sampled: ClassVar[bool] = True
    reads_next_period: ClassVar[bool] = True

    method: str = parameter("forward_euler", choices=tuple(_METHODS), doc="integration method")
    gain: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="the gain")
    external_reset: str = external_reset_parameter("none")
    initial_condition_source: str = initial_source_parameter()
    initial: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, doc="the state at the first tick and at a reset, if no port gives it"
    )
    lower: float = parameter(-math.inf, finite=False, doc="lower limit of the state and the output")
    upper: float = parameter(math.inf, finite=False, doc="upper limit of the state and the output")
    state_port: bool = parameter(False, doc="whether an output gives the state before a reset")
    saturation_port: bool = parameter(False, doc="whether an output shows which limit is active")
    sample_time: ArrayLike = sample_time_parameter()

    def face_sign(self) -> FaceSign:
        return Fraction(
            times(self.gain, _METHODS[self.method][0]),
            _METHODS[self.method][1],
            bool(np.any(np.isfinite(self.lower)) or np.any(np.isfinite(self.upper))),
        )

    def check(self) -> None:
        limits_in_order(self, "lower", "upper")

    def input_ports(self) -> tuple[Port, ...]:
        return (
            Port("u", "signal to integrate"),
            *reset_ports(self.external_reset, self.initial_condition_source),
        )

    def output_ports(self) -> tuple[Port, ...]:
        saturated = Port("saturated", "1 at the upper limit, -1 at the lower limit, else 0")
        return (
            Port("y", "the integral"),
            *((saturated,) if self.saturation_port else ()),
            *((Port("state", "the integral before a reset", before_events=True),) if self.state_port else ()),
        )

    def assumed_output_shapes(self) -> Shapes:
        return self.output_shapes({})

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        x = State("x", self.output_shapes(inputs)["y"], "the integral")
        return (x, PREVIOUS_TRIGGER) if self._has_resets else (x,)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        share = included_fraction(self.method)
        unlimited = self._state_after_reset(x, u, p)
        if share:
            unlimited = unlimited + share * p["gain"] * p["T"] * u["u"]
        y = self._limited(unlimited, p) if share or self._has_resets else unlimited
        values = {"y": y}
        if self.saturation_port:
            values["saturated"] = if_else(y >= p["upper"], 1.0, if_else(y <= p["lower"], -1.0, 0.0))
        return values | (
            {"state": self._limited(self._state_before_reset(x, u, p), p)} if self.state_port else {}
        )

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        interval = interval_of_update(self.method, p)
        after = {"x": self._limited(self._state_after_reset(x, u, p) + p["gain"] * interval * u["u"], p)}
        if self._has_resets:
            untriggered = self.external_reset == "none"
            after["previous"] = SX(0.0) if untriggered else trigger_state(self.external_reset, u["reset"])
        return after

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial"], **({"previous": SX(-1.0)} if self._has_resets else {})}

    def initial_outputs(self, p: Signals) -> Signals:
        return {port.name: SX(0.0) for port in self.output_ports()} | {"y": p["initial"]}

    @property
    def _has_resets(self) -> bool:
        return self.external_reset != "none" or self.initial_condition_source != "internal"

    def _state_after_reset(self, x: Signals, u: Signals, p: Signals) -> SX:
        """The state at this tick, after a possible reset."""
        state = self._state_before_reset(x, u, p)
        if self.external_reset == "none":
            return state
        resets = fires_at_tick(self.external_reset, u["reset"], x["previous"])
        return if_else(resets, u.get("initial", p["initial"]), state)

    def _state_before_reset(self, x: Signals, u: Signals, p: Signals) -> SX:
        """The state at this tick; at the first tick, the initial value."""
        if self.initial_condition_source != "external":
            return x["x"]
        return if_else(x["previous"] < 0.0, u["initial"], x["x"])

    def _limited(self, value: SX, p: Signals) -> SX:
        return fmin(fmax(value, p["lower"]), p["upper"])


@dataclass(frozen=True, kw_only=True)
class Difference(Block):
    """The difference of the input from the previous tick: y(k) = u(k) - u(k-1)."""

    title: ClassVar[str] = "Difference"
    sign: ClassVar[FaceSign] = Words("1 − z⁻¹")
    broadcast_parameters: ClassVar[tuple[str, ...]] = ("initial",)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The change of the sine since the last tick.",
    )
    sampled: ClassVar[bool] = True

    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the input before the first tick")
    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (INPUT,)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the difference"),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", self.output_shapes(inputs)["y"], "the input at the previous tick"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": u["u"] - x["x"]}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": u["u"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial"]}


@dataclass(frozen=True, kw_only=True)
class DiscreteDerivative(Block):
    """The difference quotient between two ticks: y(k) = gain (u(k) - u(k-1)) / T."""

    title: ClassVar[str] = "Discrete Derivative"
    broadcast_parameters: ClassVar[tuple[str, ...]] = ("gain", "initial")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The derivative of the sine from two samples: it lags by half a sample time.",
    )
    sampled: ClassVar[bool] = True

    gain: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="the gain")
    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the input before the first tick")
    sample_time: ArrayLike = sample_time_parameter()

    def face_sign(self) -> FaceSign:
        return Fraction(times(self.gain, "(z − 1)"), "T z")

    def input_ports(self) -> tuple[Port, ...]:
        return (INPUT,)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the rate of change of the input"),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", self.output_shapes(inputs)["y"], "the input at the previous tick"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": p["gain"] * (u["u"] - x["x"]) / p["T"]}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": u["u"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial"]}

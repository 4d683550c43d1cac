"""Integrators with resets and limits, whose events are located exactly."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, fabs, fmax, fmin, if_else, logic_and, logic_or, mmax
from numpy.typing import ArrayLike

from armblocks.blocks.elementwise import parameters_shape
from armblocks.blocks.external_resets import (
    EDGES,
    LEVELS,
    external_reset_parameter,
    initial_source_parameter,
    reset_ports,
    trigger_state,
)
from armblocks.blocks.switching import SAME_VALUE, THRESHOLD_OFFSET, limits_in_order
from armblocks.diagram import (
    Block,
    Guard,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    broadcast,
    driver,
    integral_unit,
    parameter,
)
from armblocks.diagram.signs import FaceSign, Fraction
from armblocks.equations import Shape

_SATURATED = Port("saturated", "1 at the upper limit, -1 at the lower limit, else 0")


@dataclass(frozen=True, kw_only=True)
class ResettableIntegrator(Block):
    """The integral over time with resets: y' = u, and y = initial at t = 0 and at each reset.

    The block corresponds to Simulink's Integrator with its optional ports:

    - With the resets ``level`` and ``level hold``, y equals the present initial value while the trigger is
      not 0.
    - The initial value may come from a port: always (``external``), or only at resets (``external at
      resets``), so that this value may depend on y.
    - The ``state_port`` outputs the state before a reset, so that a loop through this port is not algebraic.
      At the start with ``external``, y and the state port have the value of the port of the initial value; a
      loop through the state port is then algebraic.
    - With ``limit_output`` y stays between ``lower`` and ``upper``.
    """

    title: ClassVar[str] = "Integrator with Reset"
    sign: ClassVar[FaceSign] = Fraction("1", "s")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The integral of 1, reset to 0 by every rising edge.",
        inputs={"u": driver("Constant"), "reset": driver("PulseGenerator", period=3.0, delay=1.0)},
    )

    external_reset: str = external_reset_parameter("rising")
    initial_condition_source: str = initial_source_parameter()
    initial: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, doc="the output at t = 0 and at a reset, if no port gives it"
    )
    state_port: bool = parameter(False, doc="whether an output gives the state before a reset")
    limit_output: bool = parameter(
        False, doc="whether the output is limited to the range from lower to upper"
    )
    lower: ArrayLike = parameter(
        -1.0, kind=ParameterKind.ARRAY, finite=False, doc="lower limit of the output"
    )
    upper: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, finite=False, doc="upper limit of the output")

    def check(self) -> None:
        limits_in_order(self, "lower", "upper")

    def input_ports(self) -> tuple[Port, ...]:
        further = reset_ports(self.external_reset, self.initial_condition_source)
        return (Port("u", "signal to integrate"), *further)

    def output_ports(self) -> tuple[Port, ...]:
        saturated = (_SATURATED,) if self.limit_output else ()
        state = (Port("state", "the integral before a reset", before_events=True),) if self.state_port else ()
        return (Port("y", "the integral"), *saturated, *state)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        signal_shapes = {name: shape for name, shape in inputs.items() if name != "reset"}
        own = ("initial", "lower", "upper") if self.limit_output else ("initial",)
        shape = broadcast({**signal_shapes, "initial value": parameters_shape(self, *own)})
        return {port.name: shape for port in self.output_ports()}

    def assumed_output_shapes(self) -> Shapes:
        return self.output_shapes({})

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        unit = integral_unit(inputs["u"])
        return {"y": unit, "state": unit} if self.state_port else {"y": unit}

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", self.output_shapes(inputs)["y"], "the integral"),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        shape = self.output_shapes(inputs)["y"]
        from_port = (
            State("initialised", (), "0 until the initial value has been read from the port, then 1"),
            State("starts", (), "1 from then to the end of the instant", momentary=True),
        )
        left_limit = (State("left_limit", shape, "left limit of the initial value"),)
        return (
            *(from_port if self._starts_from_port else ()),
            *(left_limit if self.external_reset == "level hold" else ()),
        )

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        held = (State("held", (), "1 while the trigger is not 0, else 0"),)
        started = (State("started", (), "1 after the initial value has been read from the port"),)
        shape = self.output_shapes(inputs)["y"]
        return (
            *(held if self._by_level else ()),
            *(started if self._starts_from_port else ()),
            *((_limit_mode(shape),) if self.limit_output else ()),
        )

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        reset = Guard("reset", (), "the trigger", EDGES.get(self.external_reset, 0))
        initialisation = Guard("initialisation", (), "the initial value is read from the port", 1)
        shape = self.output_shapes(inputs)["y"]
        return (
            *(() if self.external_reset == "none" else (reset,)),
            *((initialisation,) if self._starts_from_port else ()),
            *(_limit_guards(shape) if self.limit_output else ()),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        state = if_else(self._starts(x), self._start(u, p), x["x"]) if self._starts_from_port else x["x"]
        y = if_else(x["held"], self._start(u, p), state) if self._by_level else state
        saturated = {"saturated": x["mode"]} if self.limit_output else {}
        return {"y": y, **saturated, **({"state": state} if self.state_port else {})}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        rate = if_else(x["mode"] == 0.0, u["u"], 0.0) if self.limit_output else u["u"]
        return {"x": if_else(x["held"], 0.0, rate) if self._by_level else rate}

    def initial_states(self, p: Signals) -> Signals:
        start = self._within(p["initial"], p)
        return {
            "x": start,
            **({"initialised": SX(0.0), "starts": SX(0.0)} if self._starts_from_port else {}),
            **({"left_limit": start} if self.external_reset == "level hold" else {}),
        }

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        values = _limit_guard_values(x, u, p) if self.limit_output else {}
        if self.external_reset != "none":
            values["reset"] = (self._level(u) if self._by_level else u["reset"]) - THRESHOLD_OFFSET
        if self._starts_from_port:
            values["initialisation"] = 0.5 - x["initialised"]
        return values

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        held = {"held": self._level(u) > 0.0} if self._by_level else {}
        started = {"started": SX(1.0)} if self._starts_from_port else {}
        limit = {"mode": _limit_side(x["x"], x["mode"], u, p)} if self.limit_output else {}
        return {**held, **started, **limit}

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        contradictions = dict(super().contradictions(t, x, u, p))
        if self._starts_from_port:
            # At the restart of a subsystem no guard fires. The contradiction causes the reset, and repeats it
            # where the signal at the port changes within the instant.
            start = self._start(u, p)
            differs = mmax(fabs(x["x"] - start) > SAME_VALUE * fmax(fabs(x["x"]), fabs(start)))
            contradictions["started"] = if_else(x["starts"], differs, x["initialised"] == 0.0)
        return contradictions

    def captures(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"left_limit": self._start(u, p)} if self.external_reset == "level hold" else {}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        after = _limited(x, p, e) if self.limit_output else {"x": x["x"]}
        is_reset, start = SX(0.0), self._start(u, p)
        if self._by_level:
            # When the trigger returns to 0, the state starts from the value that was held.
            is_reset = e["reset"] < 0.0
            start = x["left_limit"] if self.external_reset == "level hold" else start
            after["held"] = if_else(e["reset"] == 0.0, x["held"], e["reset"] > 0.0)
        elif self.external_reset != "none":
            is_reset = e["reset"] != 0.0
        if self._starts_from_port:
            # The signal at the port may still change during the mode iteration of the instant.
            start = if_else(self._starts(x), self._start(u, p), start)
            is_reset = logic_or(is_reset, self._starts(x))
            after["starts"] = if_else(x["initialised"], x["starts"], 1.0)
            after["initialised"] = SX(1.0)
        after["x"] = if_else(is_reset, start, after["x"])
        if self.limit_output:
            after["mode"] = if_else(is_reset, _limit_side(after["x"], SX(0.0), u, p), after["mode"])
        return after

    @property
    def _by_level(self) -> bool:
        return self.external_reset in LEVELS

    @property
    def _starts_from_port(self) -> bool:
        return self.initial_condition_source == "external"

    @staticmethod
    def _starts(x: Signals) -> SX:
        """Whether the state follows the port: before the initial value is read, and at the same instant."""
        return logic_or(x["initialised"] == 0.0, x["starts"] != 0.0)

    def _level(self, u: Signals) -> SX:
        return if_else(trigger_state(self.external_reset, u["reset"]), 1.0, 0.0)

    def _start(self, u: Signals, p: Signals) -> SX:
        """The state after a reset."""
        return self._within(u.get("initial", p["initial"]), p)

    def _within(self, value: SX, p: Signals) -> SX:
        return fmin(fmax(value, p["lower"]), p["upper"]) if self.limit_output else value


@dataclass(frozen=True, kw_only=True)
class IntegratorLimited(Block):
    """The integral over time between two limits: y' = u, but y' = 0 at a limit while u points outwards."""

    title: ClassVar[str] = "Integrator Limited"
    sign: ClassVar[FaceSign] = Fraction("1", "s", limited=True)
    broadcast_parameters: ClassVar[tuple[str, ...]] = ("initial", "lower", "upper")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows=("The integral of a sine is limited to 1. It leaves the limit when the sine changes its sign."),
    )

    initial: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, doc="the output at t = 0, within the limits"
    )
    lower: ArrayLike = parameter(
        -1.0, kind=ParameterKind.ARRAY, finite=False, doc="lower limit of the output"
    )
    upper: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, finite=False, doc="upper limit of the output")

    def check(self) -> None:
        limits_in_order(self, "lower", "upper")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "signal to integrate"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the integral"), _SATURATED)

    def assumed_output_shapes(self) -> Shapes:
        return self.output_shapes({})

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", self.output_shapes(inputs)["y"], "the integral"),)

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (_limit_mode(self.output_shapes(inputs)["y"]),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return _limit_guards(self.output_shapes(inputs)["y"])

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["x"], "saturated": x["mode"]}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": if_else(x["mode"] == 0.0, u["u"], 0.0)}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": fmin(fmax(p["initial"], p["lower"]), p["upper"])}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return _limit_guard_values(x, u, p)

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"mode": _limit_side(x["x"], x["mode"], u, p)}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return _limited(x, p, e)


# The next functions are for a state x between the limits p["lower"] and p["upper"] with the rate u["u"].


def _limit_mode(shape: Shape) -> State:
    return State("mode", shape, "1 at the upper limit, -1 at the lower limit, else 0")


def _limit_guards(shape: Shape) -> tuple[Guard, ...]:
    return (
        Guard("upper", shape, "y reaches the upper limit", 1),
        Guard("lower", shape, "y reaches the lower limit", -1),
        Guard("rises", shape, "u becomes positive", 1),
        Guard("falls", shape, "u becomes negative", -1),
    )


def _limit_guard_values(x: Signals, u: Signals, p: Signals) -> dict[str, SX]:
    return {
        "upper": x["x"] - p["upper"],
        "lower": x["x"] - p["lower"],
        "rises": u["u"] - THRESHOLD_OFFSET,
        "falls": u["u"] + THRESHOLD_OFFSET,
    }


def _limit_side(x: SX, mode: SX, u: Signals, p: Signals) -> SX:
    """The consistent mode: a state at a limit stays there until its rate leads away from it."""
    downwards = logic_or(u["u"] < 0.0, logic_and(mode < 0.0, u["u"] == 0.0))
    upwards = logic_or(u["u"] > 0.0, logic_and(mode > 0.0, u["u"] == 0.0))
    at_lower = logic_and(x <= p["lower"], downwards)
    at_upper = logic_and(x >= p["upper"], upwards)
    return if_else(at_upper, 1.0, if_else(at_lower, -1.0, 0.0))


def _limited(x: Signals, p: Signals, e: Signals) -> dict[str, SX]:
    """State and mode after the events."""
    stays_upper = logic_and(x["x"] >= p["upper"], e["rises"] > 0.0)
    stays_lower = logic_and(x["x"] <= p["lower"], e["falls"] < 0.0)
    upper, lower = logic_or(e["upper"] > 0.0, stays_upper), logic_or(e["lower"] < 0.0, stays_lower)
    leaves = logic_or(
        logic_and(x["mode"] > 0.0, e["falls"] < 0.0), logic_and(x["mode"] < 0.0, e["rises"] > 0.0)
    )
    inner = if_else(leaves, 0.0, x["mode"])
    # A state slightly beyond a limit is set to the limit.
    within = fmin(fmax(x["x"], p["lower"]), p["upper"])
    return {
        "mode": if_else(upper, 1.0, if_else(lower, -1.0, inner)),
        "x": if_else(upper, p["upper"], if_else(lower, p["lower"], within)),
    }

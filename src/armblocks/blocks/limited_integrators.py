"""Integrators whose state jumps or stops at exactly located events."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, fmax, fmin, if_else, logic_and, logic_or
from numpy.typing import ArrayLike

from armblocks.blocks.switching import JUST, limits_in_order
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
    made,
    parameter,
    shape_of,
)
from armblocks.equations import Shape

_TRIGGERS: Mapping[str, int] = {"rising": 1, "falling": -1, "either": 0}


@dataclass(frozen=True, kw_only=True)
class ResettableIntegrator(Block):
    """The integral over time, set anew by a trigger: y' = u, y = initial at t = 0 and whenever it fires.

    With an external initial value the input ``initial`` says what y becomes; it may come from y itself. The
    trigger fires where it becomes positive (rising), stops being positive (falling), or either.
    """

    family: ClassVar[str] = "continuous"
    title: ClassVar[str] = "Integrator with Reset"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The integral of 1, set back to 0 by every rising edge.",
        inputs={"u": made("Constant"), "reset": made("PulseGenerator", period=3.0, delay=1.0)},
    )

    external_reset: str = parameter("rising", choices=tuple(_TRIGGERS), doc="when the trigger fires")
    initial_condition_source: str = parameter(
        "internal", choices=("internal", "external"), doc="whether a port says what y becomes at a reset"
    )
    initial: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, doc="the output at t = 0, and at a reset without port"
    )

    def input_ports(self) -> tuple[Port, ...]:
        ports = (Port("u", "the rate"), Port("reset", "the trigger", shape=()))
        if self.initial_condition_source == "external":
            return (*ports, Port("initial", "what the output becomes at a reset"))
        return ports

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the integral"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        wide = {name: shape for name, shape in inputs.items() if name != "reset"}
        return {"y": broadcast({**wide, "initial value": shape_of(self.initial)})}

    def assumed_output_shapes(self) -> Shapes:
        return {"y": shape_of(self.initial)}

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", self.output_shapes(inputs)["y"], "the integral"),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return (Guard("reset", (), "the trigger", _TRIGGERS[self.external_reset]),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["x"]}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": u["u"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial"]}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"reset": u["reset"] - JUST}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return {"x": if_else(e["reset"] == 0.0, x["x"], u.get("initial", p["initial"]))}


@dataclass(frozen=True, kw_only=True)
class IntegratorLimited(Block):
    """The integral over time, held between two limits: y' = u, but 0 at a limit while u drives beyond it."""

    family: ClassVar[str] = "continuous"
    title: ClassVar[str] = "Integrator Limited"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows=(
            "The integral of a sine would reach 2; it stays at the limit 1 and leaves it as soon as "
            "the sine turns."
        ),
    )

    initial: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, doc="the output at t = 0, within the limits"
    )
    lower: ArrayLike = parameter(-1.0, kind=ParameterKind.ARRAY, finite=False, doc="the least output")
    upper: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, finite=False, doc="the greatest output")

    def check(self) -> None:
        limits_in_order(self, "lower", "upper")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the rate"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the integral"), Port("saturated", "1 at the upper limit, -1 at the lower, else 0"))

    def output_shapes(self, inputs: Shapes) -> Shapes:
        shape = self._shape(inputs)
        return {"y": shape, "saturated": shape}

    def assumed_output_shapes(self) -> Shapes:
        shape = self._shape({})
        return {"y": shape, "saturated": shape}

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", self._shape(inputs), "the integral"),)

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("mode", self._shape(inputs), "1 at the upper limit, -1 at the lower, else 0"),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        shape = self._shape(inputs)
        return (
            Guard("upper", shape, "y reaches the upper limit", 1),
            Guard("lower", shape, "y reaches the lower limit", -1),
            Guard("rises", shape, "u becomes positive", 1),
            Guard("falls", shape, "u becomes negative", -1),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["x"], "saturated": x["mode"]}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": if_else(x["mode"] == 0.0, u["u"], 0.0)}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": fmin(fmax(p["initial"], p["lower"]), p["upper"])}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {
            "upper": x["x"] - p["upper"],
            "lower": x["x"] - p["lower"],
            "rises": u["u"] - JUST,
            "falls": u["u"] + JUST,
        }

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        at_lower = logic_and(x["x"] <= p["lower"], u["u"] < 0.0)
        at_upper = logic_and(x["x"] >= p["upper"], u["u"] > 0.0)
        return {"mode": if_else(at_upper, 1.0, if_else(at_lower, -1.0, 0.0))}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        stands = logic_and(x["x"] >= p["upper"], e["rises"] > 0.0)
        stands_low = logic_and(x["x"] <= p["lower"], e["falls"] < 0.0)
        upper, lower = logic_or(e["upper"] > 0.0, stands), logic_or(e["lower"] < 0.0, stands_low)
        freed = logic_or(
            logic_and(x["mode"] > 0.0, e["falls"] < 0.0), logic_and(x["mode"] < 0.0, e["rises"] > 0.0)
        )
        inner = if_else(freed, 0.0, x["mode"])
        return {
            "mode": if_else(upper, 1.0, if_else(lower, -1.0, inner)),
            "x": if_else(upper, p["upper"], if_else(lower, p["lower"], x["x"])),
        }

    def _shape(self, inputs: Shapes) -> Shape:
        names = ("initial", "lower", "upper")
        return broadcast({**inputs, **{name: shape_of(self.parameter_value(name)) for name in names}})

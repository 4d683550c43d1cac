"""Blocks that look at their input once a period and give a course in continuous time until they look again.

T is the period, t_k = offset + k T is the k-th instant. What is looked at is the signal as the ticks and
events of that instant have left it: after the event of the look itself a second one looks again.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, fmax, fmin, if_else, logic_and, logic_or
from numpy.typing import ArrayLike

from armblocks.blocks.switching import since
from armblocks.diagram import (
    Block,
    Guard,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    made,
    parameter,
    shape_of,
)

_COUNT = State("count", (), "how often the input has been looked at")
_FRESH = State("fresh", (), "1 until the input has been looked at again, else 0")
_INSTANT = Guard("instant", (), "t - the next instant", 1)
_AGAIN = Guard("again", (), "the input has been looked at", -1)


def _instant(p: Signals, count: SX) -> SX:
    """The instant t_k: one product and one sum, as for the ticks of a clock."""
    return p["offset"] + count * p["period"]


def _look(t: SX, x: Signals, p: Signals, e: Signals) -> tuple[SX, SX, Signals]:
    """Whether a period begins, whether the input has to be looked at, and the states that say so next.

    The start needs no event; it is settled in turns at the same instant, each of which looks again.
    """
    due = logic_or(e["instant"] > 0.0, t >= _instant(p, x["count"]))
    same = logic_and(x["count"] > 0.0, t <= _instant(p, x["count"] - 1.0))
    looks = logic_or(due, logic_or(same, e["again"] < 0.0))
    fresh = if_else(e["instant"] > 0.0, 1.0, if_else(e["again"] < 0.0, 0.0, x["fresh"]))
    return due, looks, {"count": x["count"] + due, "fresh": fresh}


def _look_guards(t: SX, x: Signals, p: Signals) -> Signals:
    return {"instant": since(t, _instant(p, x["count"])), "again": 0.5 - x["fresh"]}


@dataclass(frozen=True, kw_only=True)
class FirstOrderHold(Block):
    """Straight lines through samples: y(t) = u(t_k) + (u(t_k) - u(t_(k-1))) (t - t_k) / T until t_(k+1).

    ``extrapolation`` goes on as between the last two samples, and is exact for a straight line; at each
    instant y may jump to the new sample. ``interpolation`` goes from sample to sample without a jump, one
    period late: y(t) = u(t_(k-1)) + (u(t_k) - u(t_(k-1))) (t - t_k) / T. Simulink's First Order Hold
    extrapolates. The sample before the first one is ``initial``, which is also y before the offset.

    A sampled block that ticks at t_k itself sees y as it was just before.
    """

    family: ClassVar[str] = "continuous"
    title: ClassVar[str] = "First Order Hold"
    spreads: ClassVar[tuple[str, ...]] = ("initial",)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A sine, sampled every second, as straight lines from sample to sample, one second late.",
        parameters={"method": "interpolation", "period": 1.0},
        inputs={"u": made("SineWave")},
    )

    method: str = parameter(
        "extrapolation", choices=("extrapolation", "interpolation"), doc="which line is drawn"
    )
    period: float = parameter(0.1, above=0.0, doc="T, from sample to sample", unit="s")
    offset: float = parameter(0.0, minimum=0.0, doc="when the first sample is taken", unit="s")
    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the sample before the first one")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "what is sampled"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the straight lines"),)

    def assumed_output_shapes(self) -> Shapes:
        return {"y": shape_of(self.initial)}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        shape = self.output_shapes(inputs)["y"]
        samples = (State("last", shape, "the last sample"), State("before", shape, "the one before"))
        return (_COUNT, _FRESH, *samples)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return _INSTANT, _AGAIN

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        start = x["last"] if self.method == "extrapolation" else x["before"]
        since = fmax(t - _instant(p, x["count"] - 1.0), 0.0) / p["period"]
        line = start + (x["last"] - x["before"]) * since
        return {"y": if_else(x["count"] > 0.0, line, x["last"])}

    def initial_states(self, p: Signals) -> Signals:
        return {"count": SX(0.0), "fresh": SX(0.0), "last": p["initial"], "before": p["initial"]}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return _look_guards(t, x, p)

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        due, looks, counted = _look(t, x, p, e)
        return {
            **counted,
            "last": if_else(looks, u["u"], x["last"]),
            "before": if_else(due, x["last"], x["before"]),
        }


@dataclass(frozen=True, kw_only=True)
class PWM(Block):
    """Pulse width modulation: y = amplitude for t_k <= t < t_k + D(t_k) T, else 0, with D held to 0 … 1.

    The duty cycle D is looked at where a pulse may begin, as in Simulink's PWM; both edges are located
    exactly. The mean of y over a period is D times the amplitude. A sampled block that ticks at an edge
    sees y as it was just before.
    """

    family: ClassVar[str] = "sources"
    title: ClassVar[str] = "PWM"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Pulses that become wider as the duty cycle rises from 0 to 1.",
        parameters={"period": 1.0},
        inputs={"D": made("Ramp", slope=0.1)},
    )

    period: float = parameter(0.1, above=0.0, doc="T, from pulse to pulse", unit="s")
    offset: float = parameter(0.0, minimum=0.0, doc="when the first pulse may begin", unit="s")
    amplitude: float = parameter(1.0, doc="the height of the pulses")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("D", "the duty cycle, 0 … 1", shape=()),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the pulses", shape=()),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        high = State("high", (), "1 during a pulse, else 0")
        return (_COUNT, _FRESH, State("duty", (), "the duty cycle of this period"), high)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return _INSTANT, _AGAIN, Guard("edge", (), "t - the end of the pulse", 1)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": p["amplitude"] * x["high"]}

    def initial_states(self, p: Signals) -> Signals:
        return dict.fromkeys(("count", "fresh", "duty", "high"), SX(0.0))

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        edge = since(t, _instant(p, x["count"] - 1.0 + x["duty"]))
        return {**_look_guards(t, x, p), "edge": edge}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        _, looks, counted = _look(t, x, p, e)
        duty = if_else(looks, fmin(fmax(u["D"], 0.0), 1.0), x["duty"])
        ends = logic_and(e["edge"] > 0.0, x["duty"] < 1.0)
        high = if_else(looks, duty > 0.0, if_else(ends, 0.0, x["high"]))
        return {**counted, "duty": duty, "high": high}

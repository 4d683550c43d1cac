"""Pulse width modulation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, fmax, fmin, if_else, logic_and, logic_or

from armblocks.blocks.periodic import (
    COUNT,
    INSTANT,
    ODD,
    RESAMPLE,
    UP_TO_DATE,
    WHEN,
    sample_time,
    sampled,
    sampling_contradictions,
    sampling_guards,
)
from armblocks.blocks.switching import since
from armblocks.diagram import (
    Block,
    Guard,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    driver,
    parameter,
)
from armblocks.diagram.signs import FaceSign, pulses


@dataclass(frozen=True, kw_only=True)
class PWM(Block):
    """Pulse width modulation: y = amplitude for t_k <= t < t_k + D(t_k) T, else 0, with D limited to 0 … 1.

    The duty cycle D is sampled at the start of each period, as in Simulink's PWM. Both edges are located
    exactly. The mean of y over a period is D times the amplitude. A sampled block that ticks at an edge reads
    the left limit of y. A period that begins while the block is in a subsystem that is off has no pulse.
    """

    title: ClassVar[str] = "PWM"
    sign: ClassVar[FaceSign] = pulses((0.2, 0.5, 0.8))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Pulses that become wider as the duty cycle rises from 0 to 1.",
        parameters={"period": 1.0},
        inputs={"D": driver("Ramp", slope=0.1)},
    )

    period: float = parameter(0.1, above=0.0, doc="period T of the pulses", unit="s")
    offset: float = parameter(0.0, minimum=0.0, doc="start time of the first period", unit="s")
    amplitude: float = parameter(1.0, doc="amplitude of the pulses")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("D", "the duty cycle, 0 … 1", shape=()),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the pulses", shape=()),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        high = State("high", (), "1 during a pulse, else 0")
        return (COUNT, WHEN, ODD, State("duty", (), "the duty cycle of this period"), high)

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (UP_TO_DATE,)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return INSTANT, RESAMPLE, Guard("edge", (), "t - the end of the pulse", 1)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": p["amplitude"] * x["high"]}

    def initial_states(self, p: Signals) -> Signals:
        return dict.fromkeys(("count", "when", "odd", "duty", "high"), SX(0.0))

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        edge = since(t, sample_time(p, x["count"] - 1.0 + x["duty"]))
        return {**sampling_guards(t, x, p, _limited(u["D"]), x["duty"]), "edge": edge}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"up_to_date": SX(1.0)}

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return sampling_contradictions(t, x, p, _limited(u["D"]), x["duty"])

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        sampling = sampled(t, x, p, e)
        duty = if_else(sampling.missed, 0.0, if_else(sampling.samples, _limited(u["D"]), x["duty"]))
        pulse_ends = logic_or(sampling.missed, logic_and(e["edge"] > 0.0, x["duty"] < 1.0))
        high = if_else(sampling.samples, duty > 0.0, if_else(pulse_ends, 0.0, x["high"]))
        return {**sampling.states, "duty": duty, "high": high}


def _limited(duty: SX) -> SX:
    return fmin(fmax(duty, 0.0), 1.0)

"""Trains of square pulses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, floor, if_else
from numpy.typing import ArrayLike

from armblocks.blocks.switching import (
    edge_count,
    since,
)
from armblocks.diagram import (
    Block,
    Guard,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    parameter,
    shape_of,
)
from armblocks.diagram.signs import FaceSign, pulses


@dataclass(frozen=True, kw_only=True)
class PulseGenerator(Block):
    """Square pulses: y = amplitude during the first width % of each period after the delay, else 0."""

    following_modes: ClassVar[bool] = True
    title: ClassVar[str] = "Pulse Generator"
    sign: ClassVar[FaceSign] = pulses((0.5, 0.5))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="High for the first 30 % of every two seconds.",
        parameters={"width": 30.0},
    )

    amplitude: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="amplitude of the pulses")
    period: float = parameter(2.0, above=0.0, doc="period of the pulses", unit="s")
    width: float = parameter(50.0, above=0.0, maximum=99.999, doc="width of a pulse in % of the period")
    delay: float = parameter(0.0, minimum=0.0, doc="start time of the first pulse", unit="s")

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the pulses"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": shape_of(self.amplitude)}

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("edges", (), "number of past edges"),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return (Guard("edge", (), "t - the next edge", 1),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": p["amplitude"] * (x["edges"] - 2.0 * floor(x["edges"] / 2.0))}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        pulses = floor(x["edges"] / 2.0)
        high = x["edges"] - 2.0 * pulses
        return {"edge": since(t, p["delay"] + (pulses + high * p["width"] / 100.0) * p["period"])}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        # k * period / period may be rounded to slightly less than k.
        periods = (t - p["delay"]) / p["period"] * (1.0 + 1e-14)
        pulses = floor(periods)
        ended = (periods - pulses) * 100.0 >= p["width"] * (1.0 - 1e-12)
        passed = if_else(t < p["delay"], 0.0, 2.0 * pulses + 1.0 + ended)
        return {"edges": edge_count(passed, x["edges"], self.contradictions(t, x, u, p)["edges"])}

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"edges": self.guard_values(t, x, u, p)["edge"] > 0.0}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return {"edges": x["edges"] + (e["edge"] > 0.0)}

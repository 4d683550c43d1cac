"""Variable limits, crossing counters and wrapping to zero. Each switching time is an event."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, fabs, if_else
from numpy.typing import ArrayLike

from armblocks.blocks.switching import located, zero_crossing_parameter
from armblocks.diagram import (
    Block,
    Condition,
    Guard,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    broadcast,
    driver,
    parameter,
)
from armblocks.diagram.signs import DEAD_ZONE, SATURATION, FaceSign, graph


@dataclass(frozen=True, kw_only=True)
class MovingLimits(Block):
    """Base class of blocks with two limits that are signals."""

    zero_crossing: bool = zero_crossing_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("upper", "the upper limit"), Port("u", "the signal"), Port("lower", "the lower limit"))

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        shape = broadcast(inputs)
        above = Condition("above", shape, "1 while u is above the upper limit", closed=False)
        below = Condition("below", shape, "1 while u is below the lower limit", closed=False)
        return located(self, above, below)

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"above": u["u"] - u["upper"], "below": u["lower"] - u["u"]}


@dataclass(frozen=True, kw_only=True)
class SaturationDynamic(MovingLimits):
    """The input limited by two signals: y = min(max(u, lower), upper).

    If ``lower`` exceeds ``upper``, y is ``upper`` where u > upper; otherwise it is ``lower`` where u < lower.
    """

    title: ClassVar[str] = "Saturation Dynamic"
    sign: ClassVar[FaceSign] = SATURATION
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A sine between -0.2 and a limit that rises.",
        inputs={
            "upper": driver("Ramp", slope=0.1).named("upper"),
            "u": driver("SineWave"),
            "lower": driver("Constant", value=-0.2).named("lower"),
        },
    )

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the limited signal"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": if_else(x["above"], u["upper"], if_else(x["below"], u["lower"], u["u"]))}


@dataclass(frozen=True, kw_only=True)
class DeadZoneDynamic(MovingLimits):
    """A dead zone between two signals: y = u - upper above the zone, u - lower below it, 0 within it."""

    title: ClassVar[str] = "Dead Zone Dynamic"
    sign: ClassVar[FaceSign] = DEAD_ZONE
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The part of a sine outside a zone whose upper end rises.",
        inputs={
            "upper": driver("Ramp", slope=0.1).named("upper"),
            "u": driver("SineWave"),
            "lower": driver("Constant", value=-0.2).named("lower"),
        },
    )

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "signed distance of the input from the zone"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": if_else(x["above"], u["u"] - u["upper"], if_else(x["below"], u["u"] - u["lower"], 0.0))}


@dataclass(frozen=True, kw_only=True)
class WrapToZero(Block):
    """The input, or zero if it exceeds a threshold: y = u where u <= threshold, else 0."""

    title: ClassVar[str] = "Wrap To Zero"
    sign: ClassVar[FaceSign] = graph((0, 0), (0.6, 1), (0.6, 0), (1, 0))
    broadcast_parameters: ClassVar[tuple[str, ...]] = ("threshold",)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A ramp; the output falls to 0 once the ramp exceeds 5.",
        parameters={"threshold": 5.0},
        inputs={"u": driver("Ramp")},
    )

    threshold: ArrayLike = parameter(255.0, kind=ParameterKind.ARRAY, doc="upper limit of the output")
    zero_crossing: bool = zero_crossing_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the signal, or 0"),)

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        shape = self.output_shapes(inputs)["y"]
        return located(self, Condition("above", shape, "1 while u is above the threshold", closed=False))

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"above": u["u"] - p["threshold"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": if_else(x["above"], 0.0, u["u"])}


@dataclass(frozen=True, kw_only=True)
class HitCrossing(Block):
    """The number of crossings of an offset and the time of the last crossing; crossings are located exactly.

    Simulink's block outputs 1 during the step that ends at the crossing. Here the count keeps its value after
    the crossing, and a triggered subsystem can detect the change of the count.
    """

    title: ClassVar[str] = "Hit Crossing"
    broadcast_parameters: ClassVar[tuple[str, ...]] = ("offset",)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A sine crosses 0.5 upwards and downwards: the count increases at each crossing.",
        parameters={"offset": 0.5},
    )

    offset: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="level whose crossings are counted")
    direction: str = parameter(
        "either", choices=("rising", "falling", "either"), doc="direction of the counted crossings"
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (
            Port("count", "number of crossings so far"),
            Port("last", "time of the last crossing; 0 before the first crossing", "s"),
        )

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        shape = self.output_shapes(inputs)["count"]
        return (
            State("count", shape, "number of crossings so far"),
            State("last", shape, "time of the last crossing", "s"),
        )

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        direction = {"rising": 1, "falling": -1, "either": 0}[self.direction]
        return (Guard("crosses", self.output_shapes(inputs)["count"], "u - offset", direction),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"count": x["count"], "last": x["last"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"count": SX(0.0), "last": SX(0.0)}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"crosses": u["u"] - p["offset"]}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return {"count": x["count"] + fabs(e["crosses"]), "last": if_else(e["crosses"] == 0.0, x["last"], t)}

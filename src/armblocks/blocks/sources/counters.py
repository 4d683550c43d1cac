"""Sources that count ticks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, if_else
from numpy.typing import ArrayLike

from armblocks.diagram import (
    Block,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    driver,
    parameter,
    sample_time_parameter,
)
from armblocks.diagram.signs import FaceSign, stairs


@dataclass(frozen=True, kw_only=True)
class CounterLimited(Block):
    """Counts the ticks up to a limit and restarts at 0: y(k) = k mod (upper + 1)."""

    title: ClassVar[str] = "Counter Limited"
    sign: ClassVar[FaceSign] = stairs((0.0, 0.5, 1.0, 0.0, 0.5, 1.0))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Counts 0, 1, 2, 3 at its ticks and restarts at 0.",
        parameters={"upper": 3, "sample_time": 0.5},
    )
    sampled: ClassVar[bool] = True

    upper: int = parameter(7, minimum=0, doc="the maximum count")
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

    title: ClassVar[str] = "Digital Clock"
    sign: ClassVar[FaceSign] = stairs((0.0, 0.25, 0.5, 0.75, 1.0))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The time of the last tick, and the simulation time.",
        inputs={},
        shown=("y", driver("Clock")),
    )
    sampled: ClassVar[bool] = True

    sample_time: ArrayLike = sample_time_parameter(1.0)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "time of the last tick", "s", shape=()),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": t}


@dataclass(frozen=True, kw_only=True)
class CounterFreeRunning(Block):
    """A counter of ticks that overflows like an unsigned integer: y(k) = k mod 2^bits."""

    title: ClassVar[str] = "Counter Free-Running"
    sign: ClassVar[FaceSign] = stairs((0.0, 0.33, 0.67, 1.0, 0.0))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A counter of two bits returns to 0 after 3.",
        parameters={"bits": 2},
    )
    sampled: ClassVar[bool] = True

    bits: int = parameter(16, minimum=1, maximum=52, doc="number of bits of the counter")
    sample_time: ArrayLike = sample_time_parameter(1.0)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the count", shape=()),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("k", (), "the count"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["k"]}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"k": if_else(x["k"] >= 2.0**self.bits - 1.0, 0.0, x["k"] + 1.0)}

    def initial_states(self, p: Signals) -> Signals:
        return {"k": SX(0.0)}

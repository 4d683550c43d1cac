"""Sources: blocks whose output depends on time alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, if_else, sin
from numpy.typing import ArrayLike

from armblocks.blocks.elementwise import parameters_shape
from armblocks.diagram import Block, ParameterKind, Port, Shapes, Signals, WorkedExample, parameter, shape_of
from armblocks.diagram.signs import FaceSign, Words, graph, sine_curve


@dataclass(frozen=True, kw_only=True)
class Constant(Block):
    """A number, vector or matrix that does not change: y = value."""

    title: ClassVar[str] = "Constant"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A constant value.",
        parameters={"value": 2.0},
    )

    value: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="value of the output")

    def face_sign(self) -> FaceSign:
        return Words(self.stated_text("value"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the value"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": shape_of(self.value)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": p["value"]}


@dataclass(frozen=True, kw_only=True)
class Clock(Block):
    """The time of the simulation: y = t."""

    title: ClassVar[str] = "Clock"
    sign: ClassVar[FaceSign] = Words("t")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The simulation time.",
    )

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "simulation time", "s", shape=()),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": t}


@dataclass(frozen=True, kw_only=True)
class Step(Block):
    """A step at a given time: y = initial for t < time, y = final from there on.

    The output of a Derivative block after a Step has no impulse at the jump.
    """

    title: ClassVar[str] = "Step"
    sign: ClassVar[FaceSign] = graph((0, 0), (0.45, 0), (0.45, 1), (1, 1))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="From 0 to 1 at 2 s.",
        parameters={"time": 2.0},
    )

    time: float = parameter(1.0, doc="time of the step", unit="s")
    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="value before the step")
    final: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="value from the step on")

    def check(self) -> None:
        parameters_shape(self, "initial", "final")

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the step"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": parameters_shape(self, "initial", "final")}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": if_else(t < p["time"], p["initial"], p["final"])}

    def breakpoints(self, p: Signals) -> tuple[SX, ...]:
        return (p["time"],)


@dataclass(frozen=True, kw_only=True)
class Ramp(Block):
    """A ramp from a given time on: y = initial + slope max(t - start, 0)."""

    title: ClassVar[str] = "Ramp"
    sign: ClassVar[FaceSign] = graph((0, 0), (0.3, 0), (1, 1))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Constant until 2 s, then a slope of 0.5 per second.",
        parameters={"slope": 0.5, "start": 2.0},
    )

    slope: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="slope of the ramp", unit="1/s")
    start: float = parameter(0.0, doc="start time of the ramp", unit="s")
    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="value before the start")

    def check(self) -> None:
        parameters_shape(self, "slope", "initial")

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the ramp"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": parameters_shape(self, "slope", "initial")}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": p["initial"] + p["slope"] * if_else(t >= p["start"], t - p["start"], 0.0)}

    def breakpoints(self, p: Signals) -> tuple[SX, ...]:
        return (p["start"],)


@dataclass(frozen=True, kw_only=True)
class SineWave(Block):
    """A sine of time: y = amplitude sin(frequency t + phase) + bias."""

    title: ClassVar[str] = "Sine Wave"
    sign: ClassVar[FaceSign] = sine_curve(1.0)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A sine of 2 rad/s with bias 1.",
        parameters={"amplitude": 2.0, "frequency": 2.0, "bias": 1.0},
    )

    amplitude: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="half the peak-to-peak value")
    frequency: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="angular frequency", unit="rad/s")
    phase: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="angle at t = 0", unit="rad")
    bias: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="mean value")

    def check(self) -> None:
        parameters_shape(self, "amplitude", "frequency", "phase", "bias")

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the sine"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": parameters_shape(self, "amplitude", "frequency", "phase", "bias")}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": p["amplitude"] * sin(p["frequency"] * t + p["phase"]) + p["bias"]}

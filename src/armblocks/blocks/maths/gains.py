"""A gain with a slider, arithmetic with the sample time, and a sine of an input."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, sin
from numpy.typing import ArrayLike

from armblocks.blocks.elementwise import parameters_shape
from armblocks.blocks.switching import limits_in_order
from armblocks.diagram import (
    Block,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    WorkedExample,
    broadcast,
    driver,
    parameter,
    sample_time_parameter,
)
from armblocks.diagram.signs import FaceSign, Outline, Words, sine_curve
from armblocks.errors import InputError

_OPERATIONS: Mapping[str, Callable[[SX, SX], SX]] = {
    "+": lambda u, time: u + time,
    "-": lambda u, time: u - time,
    "*": lambda u, time: u * time,
    "/": lambda u, time: u / time,
}


@dataclass(frozen=True, kw_only=True)
class SliderGain(Block):
    """A gain with a slider that can be moved during a run: y = gain u, low <= gain <= high."""

    title: ClassVar[str] = "Slider Gain"
    outline: ClassVar[Outline] = Outline.TRIANGLE
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A sine times 1.5. The gain can be changed during the run.", parameters={"gain": 1.5}
    )

    gain: float = parameter(1.0, doc="the gain")
    low: float = parameter(0.0, tunable=False, doc="the lower end of the slider")
    high: float = parameter(2.0, tunable=False, doc="the upper end of the slider")

    def check(self) -> None:
        limits_in_order(self, "low", "high")
        if not self.low <= self.gain <= self.high:
            raise InputError(
                f"gain is {self.gain}",
                where="SliderGain",
                allowed=f"low <= gain <= high: {self.low} to {self.high}",
                fix="change the gain or the limits",
            )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "signal to multiply"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the product"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": p["gain"] * u["u"]}


@dataclass(frozen=True, kw_only=True)
class WeightedSampleTime(Block):
    """Arithmetic with the sample time T: y(k) = u(k) + weight T; the operation may also be -, * or /."""

    title: ClassVar[str] = "Weighted Sample Time Math"
    broadcast_parameters: ClassVar[tuple[str, ...]] = ("weight",)
    sampled: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = WorkedExample(shows="The sampled sine plus the sample time of 0.5 s.")

    operation: str = parameter("+", choices=tuple(_OPERATIONS), doc="operation")
    weight: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="the factor of the sample time")
    sample_time: ArrayLike = sample_time_parameter()

    def face_sign(self) -> FaceSign:
        return Words(f"u {self.operation} w T")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the result"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": _OPERATIONS[self.operation](u["u"], p["weight"] * p["T"])}


@dataclass(frozen=True, kw_only=True)
class SineWaveFunction(Block):
    """A sine of an input: y = amplitude sin(frequency u + phase) + bias."""

    title: ClassVar[str] = "Sine Wave Function"
    sign: ClassVar[FaceSign] = sine_curve(1.0)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The input rises by 2 s per second, so the frequency of the output is twice the parameter.",
        inputs={"u": driver("Ramp", slope=2.0)},
    )

    amplitude: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="half the peak-to-peak value")
    frequency: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="angular frequency", unit="rad/s")
    phase: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="angle at u = 0", unit="rad")
    bias: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="constant to add")

    def check(self) -> None:
        parameters_shape(self, "amplitude", "frequency", "phase", "bias")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the time", "s"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the sine"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        own = parameters_shape(self, "amplitude", "frequency", "phase", "bias")
        return {"y": broadcast({**inputs, "parameters": own})}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": p["amplitude"] * sin(p["frequency"] * u["u"] + p["phase"]) + p["bias"]}

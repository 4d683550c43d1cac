"""Random signals: seeded, the same on every machine to the last bit, drawn at the ticks of a clock.

Every element of a vector has a separate stream; blocks with different seeds never share a stream.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, sqrt
from numpy.typing import ArrayLike

from armblocks.blocks.elementwise import parameters_shape
from armblocks.blocks.random_streams import (
    SEED_BITS,
    draw,
    normal_quantile,
    stream_start,
    stream_states,
)
from armblocks.blocks.switching import limits_in_order
from armblocks.diagram import (
    Block,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    driver,
    parameter,
    sample_time_parameter,
    shape_of,
)
from armblocks.diagram.signs import FaceSign, graph, stairs

_MAX_SEED = float(2**SEED_BITS - 1)
_SEED = f"seed, an integer from 0 to {_MAX_SEED:.0f}"


_NOISE = (0.5, 0.75, 0.3, 0.55, 0.05, 0.6, 1.0, 0.4, 0.65, 0.2, 0.45, 0.9, 0.35, 0.0, 0.6, 0.5)


@dataclass(frozen=True, kw_only=True)
class RandomNumber(Block):
    """Normal random numbers, one at each tick: y(k) = mean + sqrt(variance) n(k), n of N(0, 1)."""

    title: ClassVar[str] = "Random Number"
    sign: ClassVar[FaceSign] = stairs(_NOISE[:9])
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A new number of the normal distribution every 0.1 s; the same seed gives the same numbers.",
    )
    sampled: ClassVar[bool] = True

    mean: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the mean")
    variance: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, minimum=0.0, doc="the variance")
    seed: float = parameter(0.0, minimum=0.0, maximum=_MAX_SEED, doc=_SEED)
    sample_time: ArrayLike = sample_time_parameter(0.1)

    def check(self) -> None:
        parameters_shape(self, "mean", "variance")

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the random number"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": parameters_shape(self, "mean", "variance")}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return stream_states(self.output_shapes(inputs)["y"])

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": p["mean"] + sqrt(p["variance"]) * normal_quantile(draw(x)[0])}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return draw(x)[1]

    def initial_states(self, p: Signals) -> Signals:
        return stream_start(p["seed"], self.output_shapes({})["y"])


@dataclass(frozen=True, kw_only=True)
class UniformRandomNumber(Block):
    """Uniform random numbers, one at each tick: minimum < y(k) < maximum."""

    title: ClassVar[str] = "Uniform Random Number"
    sign: ClassVar[FaceSign] = stairs((0.9, 0.2, 0.6, 0.1, 1.0, 0.45, 0.75, 0.0))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A new number between -1 and 1 every 0.1 s; the same seed gives the same numbers.",
    )
    sampled: ClassVar[bool] = True

    minimum: ArrayLike = parameter(-1.0, kind=ParameterKind.ARRAY, doc="the lower bound")
    maximum: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="the upper bound")
    seed: float = parameter(0.0, minimum=0.0, maximum=_MAX_SEED, doc=_SEED)
    sample_time: ArrayLike = sample_time_parameter(0.1)

    def check(self) -> None:
        limits_in_order(self, "minimum", "maximum")

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the random number"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": parameters_shape(self, "minimum", "maximum")}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return stream_states(self.output_shapes(inputs)["y"])

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": p["minimum"] + (p["maximum"] - p["minimum"]) * draw(x)[0]}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return draw(x)[1]

    def initial_states(self, p: Signals) -> Signals:
        return stream_start(p["seed"], self.output_shapes({})["y"])


@dataclass(frozen=True, kw_only=True)
class BandLimitedWhiteNoise(Block):
    """White noise for continuous systems: y(k) = sqrt(noise_power / T) n(k), n of N(0, 1), held for T.

    Well below the frequency 1 / T (Hz), its two-sided power spectral density is constant: ``noise_power``, so
    that the variance of a system's response does not depend on T. Choose T as about 1/100 of the smallest
    time constant of the system, as Simulink's documentation of the block advises.
    """

    title: ClassVar[str] = "Band-Limited White Noise"
    sign: ClassVar[FaceSign] = graph(*((k / 15, v) for k, v in enumerate(_NOISE)))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Noise, before and after a lag of 1 s.",
        parameters={"noise_power": 0.05},
        shown=("y", driver("FirstOrderLag").named("lag").by(u="y")),
    )
    sampled: ClassVar[bool] = True

    noise_power: ArrayLike = parameter(
        0.1, kind=ParameterKind.ARRAY, minimum=0.0, doc="two-sided power spectral density, y squared per Hz"
    )
    seed: float = parameter(23341.0, minimum=0.0, maximum=_MAX_SEED, doc=_SEED)
    sample_time: ArrayLike = sample_time_parameter(0.1)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the noise"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": shape_of(self.noise_power)}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return stream_states(shape_of(self.noise_power))

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": sqrt(p["noise_power"] / p["T"]) * normal_quantile(draw(x)[0])}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return draw(x)[1]

    def initial_states(self, p: Signals) -> Signals:
        return stream_start(p["seed"], shape_of(self.noise_power))

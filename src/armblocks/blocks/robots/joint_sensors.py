"""Joint sensors: noise, quantization by an encoder, the lag of a tachometer.

Source: Siciliano et al., Robotics, 2009, 5.3 (proprioceptive sensors).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

from casadi import SX, floor, if_else
from numpy.typing import ArrayLike

from armblocks.blocks.random_streams import SEED_BITS, draw, normal_quantile, stream_start, stream_states
from armblocks.blocks.robots.ports import check_joint_values, check_speeds_are_rates, q_port, qd_port
from armblocks.blocks.robots.robot_field import RobotField
from armblocks.diagram import (
    Block,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    broadcast,
    driver,
    parameter,
    sample_time_parameter,
    shape_of,
)
from armblocks.equations import Shape
from armblocks.robot import Robot

_TWO_PI = 2.0 * math.pi


@dataclass(frozen=True, kw_only=True)
class JointSensor(Block):
    """Measured joint coordinates and speeds: q + noise and qd + noise at each tick.

    The noise is Gaussian with zero mean and the given standard deviations. It is independent between joints,
    between q and qd, and between ticks. The same seed gives exactly the same noise.
    """

    title: ClassVar[str] = "Joint Sensor"
    sampled: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A motion of the Puma's joints, measured every 0.1 s with a noise of 0.05 rad.",
        parameters={"robot": "puma560", "q_deviation": 0.05, "sample_time": 0.1},
        inputs={name: driver("JTraj").named("motion").at(name) for name in ("q", "qd")},
        shown=("q", "q_measured"),
    )

    robot: RobotField = parameter(kind=ParameterKind.ROBOT, of_type=Robot, doc="the robot")
    q_deviation: ArrayLike = parameter(
        1e-4,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        minimum=0.0,
        doc="standard deviation of measured coordinates (n,), or one for all",
        unit="rad",
    )
    qd_deviation: ArrayLike = parameter(
        1e-3,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        minimum=0.0,
        doc="standard deviation of measured speeds (n,), or one for all",
        unit="rad/s",
    )
    seed: float = parameter(
        0.0, minimum=0.0, maximum=float(2**SEED_BITS - 1), doc="seed of the random numbers"
    )
    sample_time: ArrayLike = sample_time_parameter(1e-3)

    def check(self) -> None:
        check_speeds_are_rates(self, self.robot)
        for name in ("q_deviation", "qd_deviation"):
            check_joint_values(self, self.robot, name)

    def input_ports(self) -> tuple[Port, ...]:
        return q_port(self.robot), qd_port(self.robot)

    def output_ports(self) -> tuple[Port, ...]:
        q, qd = q_port(self.robot, "q_measured"), qd_port(self.robot, "qd_measured")
        return replace(q, doc="measured joint coordinates"), replace(qd, doc="measured joint speeds")

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return stream_states((2 * self.robot.n,))

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        noise, n = normal_quantile(draw(x)[0]), self.robot.n
        return {
            "q_measured": u["q"] + p["q_deviation"] * noise[:n],
            "qd_measured": u["qd"] + p["qd_deviation"] * noise[n:],
        }

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return draw(x)[1]

    def initial_states(self, p: Signals) -> Signals:
        return stream_start(p["seed"], (2 * self.robot.n,))


@dataclass(frozen=True, kw_only=True)
class Encoder(Block):
    """A joint angle (rad) measured by an incremental encoder behind a gear: y = 2 pi count / (G counts).

    - ``count`` is floor(G counts u / 2 pi), with the gear ratio G.
    - ``counts`` is the number of counts per turn after quadrature, four per line.
    - ``speed`` is the difference quotient (count(k) - count(k-1)) / T as a joint angle per second, and 0 at
      the first tick. Its resolution is 2 pi / (G counts T).
    """

    title: ClassVar[str] = "Encoder"
    sampled: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A slow oscillation at twenty counts per turn; one count in 0.2 s is the resolution of the "
        "speed.",
        parameters={"counts": 20.0, "sample_time": 0.2},
        inputs={"u": driver("SineWave")},
        shown=("u", "y", "speed"),
    )

    counts: ArrayLike = parameter(
        4096.0, kind=ParameterKind.ARRAY, above=0.0, doc="counts per turn of the encoder shaft"
    )
    gear_ratio: ArrayLike = parameter(
        1.0, kind=ParameterKind.ARRAY, doc="G, turns of the encoder per turn of the joint"
    )
    sample_time: ArrayLike = sample_time_parameter(1e-3)

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the angle of the joint", "rad"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (
            Port("y", "the measured angle", "rad"),
            Port("count", "the counter"),
            Port("speed", "joint speed from the counts of one period", "rad/s"),
        )

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return dict.fromkeys(("y", "count", "speed"), self._shape(inputs))

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        shape = self._shape(inputs)
        return State("before", shape, "the counter at the previous tick"), State(
            "ticked", (), "1 after the first tick"
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        count = self._count(u, p)
        step = _TWO_PI / (p["counts"] * p["gear_ratio"])
        rate = (count - x["before"]) * step / p["T"]
        return {"y": count * step, "count": count, "speed": if_else(x["ticked"], rate, 0.0)}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"before": self._count(u, p), "ticked": SX(1.0)}

    def initial_states(self, p: Signals) -> Signals:
        return {"before": SX(0.0), "ticked": SX(0.0)}

    def _count(self, u: Signals, p: Signals) -> SX:
        return floor(p["gear_ratio"] * p["counts"] * u["u"] / _TWO_PI)

    def _shape(self, inputs: Shapes) -> Shape:
        return broadcast({**inputs, "counts": shape_of(self.counts), "gear_ratio": shape_of(self.gear_ratio)})


@dataclass(frozen=True, kw_only=True)
class Tachometer(Block):
    """The voltage of a tachogenerator with a filter: time_constant y' = gain w - y."""

    title: ClassVar[str] = "Tachometer"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The output of a tachometer with a slow filter after a jump of the speed.",
        parameters={"gain": 0.5, "time_constant": 0.5},
        inputs={"w": driver("Step", time=1.0)},
        shown=("w", "y"),
    )

    gain: ArrayLike = parameter(0.02, kind=ParameterKind.ARRAY, doc="voltage per speed", unit="V s/rad")
    time_constant: ArrayLike = parameter(
        1e-3, kind=ParameterKind.ARRAY, above=0.0, doc="time constant of the filter", unit="s"
    )
    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the voltage at t = 0", unit="V")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("w", "the speed", "rad/s"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the voltage", "V"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": self._shape(inputs)}

    def assumed_output_shapes(self) -> Shapes:
        return {"y": self._shape({})}

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("y", self._shape(inputs), "the voltage", "V"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["y"]}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": (p["gain"] * u["w"] - x["y"]) / p["time_constant"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"y": p["initial"]}

    def _shape(self, inputs: Mapping[str, Shape]) -> Shape:
        own = {rule.name: shape_of(self.parameter_value(rule.name)) for rule in self.parameters()}
        return broadcast({**inputs, **own})

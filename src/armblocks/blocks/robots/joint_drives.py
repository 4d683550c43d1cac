"""Blocks between a controller and a joint: torque limits of a drive, and end stops.

Source: Siciliano et al., Robotics, 2009, 5.2 (drives).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, if_else, logic_and
from numpy.typing import ArrayLike

from armblocks.blocks.switching import located, zero_crossing_parameter
from armblocks.diagram import (
    Block,
    Condition,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    WorkedExample,
    broadcast,
    driver,
    parameter,
    shape_of,
)


@dataclass(frozen=True, kw_only=True)
class MotorDrive(Block):
    """The torque of a motor drive: the command u (N m), limited by the current and the voltage of the drive.

    - Current: the torque stays between -``peak`` and ``peak``.
    - Voltage: the torque stays between -stall (1 + w / w0) and stall (1 - w / w0), where w is the speed and
      w0 the ``no_load_speed``. These are the torque-speed lines of a DC motor.

    In the direction of motion the voltage limit falls from ``stall`` at rest to 0 at w0. Beyond w0 the drive
    can only brake, at most with the peak torque.
    """

    title: ClassVar[str] = "Motor Drive"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows=(
            "A torque command of 15 N m: the current limit is 10 N m, and with rising speed the "
            "voltage limit reduces the torque to 0."
        ),
        inputs={
            "u": driver("Constant", value=15.0).named("torque command"),
            "w": driver("Ramp", slope=12.0).named("speed"),
        },
        shown=("u", "y"),
    )

    peak: ArrayLike = parameter(10.0, kind=ParameterKind.ARRAY, above=0.0, doc="peak torque", unit="N m")
    stall: ArrayLike = parameter(20.0, kind=ParameterKind.ARRAY, above=0.0, doc="stall torque", unit="N m")
    no_load_speed: ArrayLike = parameter(
        100.0, kind=ParameterKind.ARRAY, above=0.0, doc="no-load speed w0", unit="rad/s"
    )
    zero_crossing: bool = zero_crossing_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "commanded torque", "N m"), Port("w", "speed", "rad/s"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "torque", "N m"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        names = ("peak", "stall", "no_load_speed")
        return {"y": broadcast({**inputs, **{name: shape_of(self.parameter_value(name)) for name in names}})}

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        shape = self.output_shapes(inputs)["y"]
        docs = {
            "fast": "1 where the forward speed reduces the upper limit",
            "overrun": "1 where the forward speed forces braking",
            "fast_back": "1 where the backward speed raises the lower limit",
            "overrun_back": "1 where the backward speed forces braking",
            "above": "1 above the upper limit",
            "below": "1 below the lower limit",
        }
        return located(self, *(Condition(name, shape, doc, closed=False) for name, doc in docs.items()))

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        forwards, backwards = self._voltage_limits(u, p)
        upper, lower = self._limits(x, u, p)
        return {
            "fast": p["peak"] - forwards,
            "overrun": -p["peak"] - forwards,
            "fast_back": p["peak"] + backwards,
            "overrun_back": backwards - p["peak"],
            "above": u["u"] - upper,
            "below": lower - u["u"],
        }

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        upper, lower = self._limits(x, u, p)
        return {"y": if_else(x["above"], upper, if_else(x["below"], lower, u["u"]))}

    @staticmethod
    def _voltage_limits(u: Signals, p: Signals) -> tuple[SX, SX]:
        """The voltage limits of both directions."""
        ratio = u["w"] / p["no_load_speed"]
        return p["stall"] * (1.0 - ratio), -p["stall"] * (1.0 + ratio)

    def _limits(self, x: Signals, u: Signals, p: Signals) -> tuple[SX, SX]:
        forwards, backwards = self._voltage_limits(u, p)
        upper = if_else(x["overrun"], -p["peak"], if_else(x["fast"], forwards, p["peak"]))
        return upper, if_else(x["overrun_back"], p["peak"], if_else(x["fast_back"], backwards, -p["peak"]))


@dataclass(frozen=True, kw_only=True)
class JointStops(Block):
    """Elastic end stops: tau = stiffness (lower - q) - damping qd below lower, likewise above upper.

    A stop only pushes: where this torque would point towards the stop, tau is 0.
    """

    title: ClassVar[str] = "Joint Stops"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A joint moves 0.05 rad into its stops at -1 and 1 rad, which push back.",
        inputs={
            "q": driver("SineWave", amplitude=1.05).named("q"),
            "qd": driver("Derivative").by(u=driver("SineWave", amplitude=1.05).named("q")),
        },
        shown=("q", "tau"),
    )

    lower: ArrayLike = parameter(-1.0, kind=ParameterKind.ARRAY, finite=False, doc="lower stop", unit="rad")
    upper: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, finite=False, doc="upper stop", unit="rad")
    stiffness: ArrayLike = parameter(
        1e4, kind=ParameterKind.ARRAY, minimum=0.0, doc="stiffness of the stops", unit="N m/rad"
    )
    damping: ArrayLike = parameter(
        100.0, kind=ParameterKind.ARRAY, minimum=0.0, doc="damping of the stops", unit="N m s/rad"
    )
    zero_crossing: bool = zero_crossing_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("q", "coordinates", "rad"), Port("qd", "speeds", "rad/s"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("tau", "torque of the stops on the joints", "N m"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        names = [rule.name for rule in self.parameters()]
        shapes = {name: shape_of(self.parameter_value(name)) for name in names}
        return {"tau": broadcast({**inputs, **shapes})}

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        shape = self.output_shapes(inputs)["tau"]
        docs = {
            "low": "1 below the lower stop",
            "pushed_up": "1 where the lower stop pushes",
            "high": "1 above the upper stop",
            "pushed_down": "1 where the upper stop pushes",
        }
        return located(self, *(Condition(name, shape, doc, closed=False) for name, doc in docs.items()))

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        up, down = self._stop_torques(u, p)
        return {
            "low": p["lower"] - u["q"],
            "pushed_up": up,
            "high": u["q"] - p["upper"],
            "pushed_down": -down,
        }

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        up, down = self._stop_torques(u, p)
        low = if_else(logic_and(x["low"], x["pushed_up"]), up, 0.0)
        return {"tau": low + if_else(logic_and(x["high"], x["pushed_down"]), down, 0.0)}

    @staticmethod
    def _stop_torques(u: Signals, p: Signals) -> tuple[SX, SX]:
        """The spring and damper torques of the lower and the upper stop in contact."""
        damping_torque = p["damping"] * u["qd"]
        return p["stiffness"] * (p["lower"] - u["q"]) - damping_torque, p["stiffness"] * (
            p["upper"] - u["q"]
        ) - damping_torque

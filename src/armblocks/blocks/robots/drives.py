"""Electric drives: the DC motor, and motor windings for arms whose model includes the rotors.

Source: Siciliano et al., Robotics, 2009, 5.2.1 (electric drives). One constant k serves as torque constant
(N m/A) and as back-EMF constant (V s/rad): in SI units they are the same number.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from casadi import SX
from numpy.typing import ArrayLike

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
    shape_of,
)
from armblocks.equations import Shape


@dataclass(frozen=True, kw_only=True)
class DcMotor(Block):
    """A DC motor: L i' = v - R i - k w, J w' = k i - b w - load, angle' = w.

    The model has one shaft and no Coulomb friction. All signals are on the motor side.
    """

    title: ClassVar[str] = "DC Motor"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The motor accelerates under 12 V. A load from 3 s on slows it down and increases the current.",
        parameters={"R": 2.0, "L": 0.1, "k": 0.3, "J": 0.02, "b": 0.01},
        inputs={"v": driver("Constant", value=12.0), "load": driver("Step", time=3.0, final=0.5)},
        shown=("w", "i"),
    )

    R: float = parameter(1.0, above=0.0, doc="resistance of the armature", unit="ohm")
    L: float = parameter(0.5, above=0.0, doc="inductance of the armature", unit="H")
    k: float = parameter(0.01, above=0.0, doc="torque constant and back-EMF constant", unit="N m/A")
    J: float = parameter(0.01, above=0.0, doc="inertia of rotor and load", unit="kg m2")
    b: float = parameter(0.1, minimum=0.0, doc="viscous friction coefficient", unit="N m s/rad")
    initial_current: float = parameter(0.0, doc="the current at t = 0", unit="A")
    initial_speed: float = parameter(0.0, doc="the speed at t = 0", unit="rad/s")
    initial_angle: float = parameter(0.0, doc="the angle at t = 0", unit="rad")

    def input_ports(self) -> tuple[Port, ...]:
        return (
            Port("v", "voltage", "V", ()),
            Port("load", "load torque; a positive load acts against positive rotation", "N m", ()),
        )

    def output_ports(self) -> tuple[Port, ...]:
        return (
            Port("w", "speed", "rad/s", ()),
            Port("angle", "angle of the shaft", "rad", ()),
            Port("i", "current", "A", ()),
            Port("torque", "motor torque k i", "N m", ()),
        )

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (
            State("i", (), "current", "A"),
            State("w", (), "speed", "rad/s"),
            State("angle", (), "angle of the shaft", "rad"),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {**x, "torque": p["k"] * x["i"]}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        torque = p["k"] * x["i"] - p["b"] * x["w"] - u["load"]
        return {
            "i": (u["v"] - p["R"] * x["i"] - p["k"] * x["w"]) / p["L"],
            "w": torque / p["J"],
            "angle": x["w"],
        }

    def initial_states(self, p: Signals) -> Signals:
        return {"i": p["initial_current"], "w": p["initial_speed"], "angle": p["initial_angle"]}


@dataclass(frozen=True, kw_only=True)
class MotorWinding(Block):
    """The windings of geared motors: L i' = v - R i - k G w, tau = G k i, independently for each motor.

    ``w`` and ``tau`` are joint speed and joint torque, as at the ports of an arm; G is the gear ratio, motor
    turns per joint turn. Inertia and friction of the rotors are part of the arm.
    """

    title: ClassVar[str] = "Motor Winding"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The current of a motor at rest after a step of 24 V, with the time constant L / R = 0.5 s.",
        parameters={"R": 2.0, "L": 1.0, "gear_ratio": 50.0},
        inputs={"v": driver("Step", time=1.0, final=24.0), "w": driver("Constant", value=0.0)},
        shown=("v", "i", "tau"),
    )

    R: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, above=0.0, doc="resistance", unit="ohm")
    L: ArrayLike = parameter(1e-3, kind=ParameterKind.ARRAY, above=0.0, doc="inductance", unit="H")
    k: ArrayLike = parameter(
        0.1, kind=ParameterKind.ARRAY, above=0.0, doc="torque constant and back-EMF constant", unit="N m/A"
    )
    gear_ratio: ArrayLike = parameter(
        1.0, kind=ParameterKind.ARRAY, doc="G, motor turns per joint turn; negative for a reversing gear"
    )
    initial_current: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, doc="the current at t = 0", unit="A"
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("v", "voltage", "V"), Port("w", "speed of the joint", "rad/s"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("tau", "torque at the joint", "N m"), Port("i", "current", "A"))

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return dict.fromkeys(("tau", "i"), self._shape(inputs))

    def assumed_output_shapes(self) -> Shapes:
        return dict.fromkeys(("tau", "i"), self._shape({}))

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("i", self._shape(inputs), "current", "A"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"tau": p["gear_ratio"] * p["k"] * x["i"], "i": x["i"]}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        back_emf = p["k"] * p["gear_ratio"] * u["w"]
        return {"i": (u["v"] - p["R"] * x["i"] - back_emf) / p["L"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"i": p["initial_current"]}

    def _shape(self, inputs: Shapes) -> Shape:
        own = {rule.name: shape_of(self.parameter_value(rule.name)) for rule in self.parameters()}
        return broadcast({**inputs, **own})

"""Build the shipped examples of robots and machines, and write their files.

``python3 scripts/robot_examples.py`` writes ``examples/NAME.json`` for every diagram below; a test reads the
files and compares them with what is built here.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from armblocks.blocks import (
    ComputedTorque,
    DiscretePID,
    ForwardDynamics,
    Gain,
    JTraj,
    MotorWinding,
    RobotPlot,
    Scope,
    Sum,
    ZeroOrderHold,
)
from armblocks.diagram import Diagram, DiagramBuilder
from armblocks.equations import SimulationOptions
from armblocks.face.diagrams import save_diagram
from armblocks.face.robots import load_robot

EXAMPLES = Path(__file__).parent.parent / "examples"


def puma560_multirate() -> Diagram:
    """Six axes with a position loop of 1 kHz around a current loop of 10 kHz in each motor.

    The current loop: PI with zero at R / L, crossing over at 3000 rad/s, of the voltage supply's 40 V.
    """
    robot = load_robot("puma560").robot.nofriction(viscous=False)
    k = np.array([0.19, 0.22, 0.20, 0.075, 0.066, 0.066])
    R = np.array([2.1, 2.1, 2.1, 6.7, 6.7, 6.7])
    L = R * 1e-3
    crossover = 3000.0
    builder = DiagramBuilder(
        "puma560_multirate",
        description="a Puma with a 1 kHz position and a 10 kHz current loop",
        settings=SimulationOptions(stop_time=10.0, sample_time=0.01),
    )
    path = builder.add("path", JTraj(q0=[0.0] * 6, qf=[0.5, 0.9, -0.8, 0.6, -0.4, 1.0], tmax=4.0))
    arm = builder.add("arm", ForwardDynamics(robot=robot))
    position = builder.add("position loop", ComputedTorque(robot=robot, Kp=900.0, Kd=60.0))
    for port in ("q", "qd", "qdd"):
        builder.connect(path[port], position[f"{port}r"])
    builder.connect(arm["q"], position["q"])
    builder.connect(arm["qd"], position["qd"])
    held = builder.add("1 kHz", ZeroOrderHold(sample_time=1e-3), position)
    wanted = builder.add("to current", Gain(gain=1.0 / (robot.gear_ratios * k)), held)
    error = builder.add("current error", Sum(signs="+-"), wanted)
    current = builder.add(
        "current loop",
        DiscretePID(
            P=crossover * L,
            I=crossover * R,
            lower=-40.0,
            upper=40.0,
            anti_windup="clamping",
            sample_time=1e-4,
        ),
        error,
    )
    motors = builder.add("motors", MotorWinding(R=R, L=L, k=k, gear_ratio=robot.gear_ratios))
    builder.connect(current, motors["v"])
    builder.connect(arm["qd"], motors["w"])
    builder.connect(motors["tau"], arm)
    builder.connect(motors["i"], error["u2"])
    builder.add("plot", RobotPlot(robot=robot), arm["q"])
    lag = builder.add("position error", Sum(signs="+-"), path["q"], arm["q"])
    builder.add("Tracking error", Scope(), lag)
    builder.add("Currents", Scope(), motors["i"])
    builder.add("Voltages", Scope(), current)
    for name, x, y in (
        ("path", 40, 160),
        ("position loop", 220, 160),
        ("1 kHz", 400, 180),
        ("to current", 520, 180),
        ("current error", 660, 180),
        ("current loop", 780, 180),
        ("motors", 960, 180),
        ("arm", 1140, 200),
        ("plot", 1340, 180),
        ("position error", 1340, 60),
        ("Tracking error", 1480, 60),
        ("Currents", 1140, 80),
        ("Voltages", 960, 60),
    ):
        builder.place(name, x, y)
    return builder.build()


BUILDERS: tuple[Callable[[], Diagram], ...] = (puma560_multirate,)


def main() -> None:
    """Write every file anew."""
    for build in BUILDERS:
        diagram = build()
        save_diagram(diagram, EXAMPLES / f"{diagram.name}.json")
        print(f"examples/{diagram.name}.json")


if __name__ == "__main__":
    main()

"""Build the shipped examples of robots and machines, and write their files.

``python3 scripts/robot_examples.py`` writes ``examples/NAME.json`` for every diagram below; a test compares
the files with the diagrams.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from armblocks.blocks import (
    ArmPlant,
    ComputedTorque,
    Constant,
    DcMotor,
    DiscretePID,
    Fkine,
    ForwardDynamics,
    Gain,
    JTraj,
    LoadedRne,
    MotorWinding,
    MultiSegment,
    Mux,
    RobotPlot,
    Scope,
    Step,
    Sum,
    T2xyz,
    XYGraph,
    ZeroOrderHold,
)
from armblocks.diagram import Diagram, DiagramBuilder
from armblocks.equations import SimulationOptions
from armblocks.face.diagrams import save_diagram
from armblocks.face.robots import load_robot
from armblocks.robot import Fixed, Link, Robot
from armblocks.robot.shapes import Box, Material, Pose
from armblocks.spatial import Transform

EXAMPLES = Path(__file__).parent.parent / "examples"


def puma560_multirate() -> Diagram:
    """A Puma 560 with a position controller at 1 kHz and a current controller at 10 kHz for each axis.

    The current loop is a PI controller with its zero at R / L, a crossover frequency of 3000 rad/s and a
    supply of 40 V. At the start the currents hold the arm against gravity.
    """
    puma = load_robot("puma560")
    robot = puma.robot.nofriction(viscous=False)
    k = np.array([0.19, 0.22, 0.20, 0.075, 0.066, 0.066])
    R = np.array([2.1, 2.1, 2.1, 6.7, 6.7, 6.7])
    L = R * 1e-3
    crossover = 3000.0
    hold = puma.gravload(np.zeros(6)) / (robot.gear_ratios * k)
    builder = DiagramBuilder(
        "puma560_multirate",
        description="Puma with a 1 kHz position loop and a 10 kHz current loop",
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
    reference = builder.add("to current", Gain(gain=1.0 / (robot.gear_ratios * k)), held)
    error = builder.add("current error", Sum(signs="+-"), reference)
    current = builder.add(
        "current loop",
        DiscretePID(
            P=crossover * L,
            I=crossover * R,
            lower=-40.0,
            upper=40.0,
            anti_windup="clamping",
            initial_integral=R * hold,
            sample_time=1e-4,
        ),
        error,
    )
    winding = MotorWinding(R=R, L=L, k=k, gear_ratio=robot.gear_ratios, initial_current=hold)
    motors = builder.add("motors", winding)
    builder.connect(current, motors["v"])
    builder.connect(arm["qd"], motors["w"])
    builder.connect(motors["tau"], arm)
    builder.connect(motors["i"], error["u2"])
    builder.add("plot", RobotPlot(robot=robot), arm["q"])
    lag = builder.add("position error", Sum(signs="+-"), path["q"], arm["q"])
    builder.add("Tracking error", Scope(), lag)
    builder.add("Currents", Scope(), motors["i"])
    builder.add("Voltages", Scope(), current)
    builder.place(position, 186, 161, width=130)
    for name, x, y in (
        ("path", 40, 160),
        ("1 kHz", 366, 190),
        ("to current", 472, 189),
        ("current error", 590, 180),
        ("current loop", 690, 172),
        ("motors", 840, 184),
        ("arm", 1000, 200),
        ("plot", 1134, 179),
        ("position error", 590, 340),
        ("Tracking error", 712, 327),
        ("Currents", 1000, 80),
        ("Voltages", 840, 60),
    ):
        builder.place(name, x, y)
    return builder.build()


def dc_motor_sampled_pid() -> Diagram:
    """A DC motor with a PID speed controller (100 rad/s, sample time 10 ms) and a load torque from 2 s on."""
    builder = DiagramBuilder(
        "dc_motor_sampled_pid",
        description="sampled PID speed control of a DC motor, load step at 2 s",
        settings=SimulationOptions(stop_time=4.0, sample_time=0.002),
    )
    reference = builder.add("speed reference", Step(time=0.2, final=100.0))
    error = builder.add("error", Sum(signs="+-"), reference)
    pid = DiscretePID(
        P=0.6, I=4.0, D=0.004, N=50.0, lower=-48.0, upper=48.0, anti_windup="clamping", sample_time=0.01
    )
    voltage = builder.add("controller", pid, error)
    load = builder.add("load", Step(time=2.0, final=0.5))
    motor = builder.add("motor", DcMotor(R=1.2, L=5e-3, k=0.25, J=8e-3, b=1e-3), voltage, load)
    builder.connect(motor["w"], error["u2"])
    builder.add("Speed", Scope(), builder.add("both", Mux(), reference, motor["w"]))
    builder.add("Current", Scope(), motor["i"])
    builder.add("Voltage", Scope(), voltage)
    for name, x, y in (
        ("speed reference", 40, 160),
        ("error", 180, 168),
        ("controller", 300, 160),
        ("load", 300, 280),
        ("motor", 500, 163),
        ("both", 720, 50),
        ("Speed", 840, 44),
        ("Current", 720, 150),
        ("Voltage", 500, 40),
    ):
        builder.place(name, x, y)
    return builder.build()


def puma560_payload_drop() -> Diagram:
    """A Puma 560 drops a payload of 3 kg at 4 s; its 1 kHz controller does not model the payload."""
    robot = load_robot("puma560").robot.nofriction(viscous=False)
    payload = (3.0, 0.0, 0.0, 0.1, 0.01, 0.01, 0.01, 0.0, 0.0, 0.0)
    builder = DiagramBuilder(
        "puma560_payload_drop",
        description="a Puma drops a payload that its controller does not model",
        settings=SimulationOptions(stop_time=6.0, sample_time=0.01),
    )
    path = builder.add("path", JTraj(q0=[0.0] * 6, qf=[0.7, 0.9, -0.8, 0.4, 0.9, 0.5], tmax=2.5))
    start = [0.0] * 6
    arm = builder.add("arm", ArmPlant(robot=robot, q0=start, payload_input=True))
    control = builder.add("computed torque", ComputedTorque(robot=robot, Kp=225.0, Kd=30.0))
    for port in ("q", "qd", "qdd"):
        builder.connect(path[port], control[f"{port}r"])
    builder.connect(arm["q"], control["q"])
    builder.connect(arm["qd"], control["qd"])
    held = builder.add("1 kHz", ZeroOrderHold(sample_time=1e-3), control)
    builder.connect(held, arm["tau"])
    carried = builder.add("payload", Step(time=4.0, initial=payload, final=(0.0,) * 10))
    builder.connect(carried, arm["payload"])
    error = builder.add("error", Sum(signs="+-"), path["q"], arm["q"])
    tool = builder.add("tool", T2xyz(), builder.add("fkine", Fkine(robot=robot), arm["q"]))
    builder.add("plot", RobotPlot(robot=robot), arm["q"])
    builder.add("Tracking error", Scope(), error)
    builder.add("Joint angles", Scope(), arm["q"])
    builder.add("Joint torques", Scope(), held)
    builder.add("Tool path", XYGraph(), tool["x"], tool["z"])
    builder.place(control, 200, 161, width=130)
    for name, x, y in (
        ("path", 40, 160),
        ("1 kHz", 420, 190),
        ("payload", 420, 300),
        ("arm", 600, 188),
        ("error", 820, 60),
        ("Tracking error", 980, 47),
        ("Joint angles", 980, 150),
        ("plot", 820, 320),
        ("fkine", 820, 240),
        ("tool", 980, 238),
        ("Tool path", 1140, 234),
        ("Joint torques", 600, 60),
    ):
        builder.place(name, x, y)
    return builder.build()


def kr180_cell() -> Robot:
    """The KR180 on a pedestal, with two pallets and a wall as fixed links."""
    arm = load_robot("kr180").robot
    scene = (
        ("pedestal", Box(size=(0.7, 0.7, 2.4), material=Material.BASE), (0.0, 0.0, 1.2)),
        ("pick pallet", Box(size=(0.8, 1.2, 0.14), material=Material.FLANGE), (0.28, -2.3, 0.07)),
        ("place pallet", Box(size=(0.8, 1.2, 0.14), material=Material.FLANGE), (1.57, 1.7, 0.07)),
        ("wall", Box(size=(2.8, 0.12, 1.5), material=Material.FLANGE), (2.4, -0.75, 0.75)),
    )
    fixed = [
        Link(name=name, joint=Fixed(), geometry=(replace(box, pose=_translation(x, y, z - 2.4)),))
        for name, box, (x, y, z) in scene
    ]
    return replace(
        arm,
        name="KR180 in a cell",
        comment="the paper's KR180 with a pedestal, two pallets and a wall",
        base=Transform(translation=(0.0, 0.0, 2.4)),
        links=(*fixed, *arm.links),
    )


def _translation(x: float, y: float, z: float) -> Pose:
    return ((1.0, 0.0, 0.0, x), (0.0, 1.0, 0.0, y), (0.0, 0.0, 1.0, z), (0.0, 0.0, 0.0, 1.0))


def kr180_pick_and_place() -> Diagram:
    """A KR180 moves a load of 60 kg over a wall, from pallet to pallet, on a path with rounded corners.

    The second and third axis of the KR180 of the paper coincide: each moves by half of the angle ``tilt``.
    The fourth axis keeps the edges of the load parallel to those of the pallets. Two equal consecutive points
    are a pause. The arm grips the load in the middle of the first pause (2.7 s) and releases it in the middle
    of the second (10.7 s).
    """
    robot = load_robot("kr180_cell").robot
    stations = ((-50.0, 45.0), (-50.0, 0.0), (-50.0, 0.0), (-50.0, 45.0), (15.0, 50.0))
    stations += ((80.0, 45.0), (80.0, 0.0), (80.0, 0.0), (80.0, 45.0))
    points = np.radians([(yaw, tilt / 2.0, tilt / 2.0, yaw) for yaw, tilt in stations])
    load = (60.0, 0.0, 0.0, 0.2, 2.05, 2.05, 2.5, 0.0, 0.0, 0.0)
    builder = DiagramBuilder(
        "kr180_pick_and_place",
        description="a KR180 carries 60 kg over a wall from pallet to pallet",
        settings=SimulationOptions(stop_time=14.0, sample_time=0.01),
    )
    motion = MultiSegment(points=points, durations=(2.0, 0.8, 2.0, 1.6, 1.6, 2.0, 0.8, 2.0), blend=0.6)
    path = builder.add("path", motion)
    gripped = builder.add("gripped", Step(time=2.7, final=load))
    released = builder.add("released", Step(time=10.7, final=load))
    carried = builder.add("payload", Sum(signs="+-"), gripped, released)
    free = builder.add("no force", Constant(value=(0.0,) * 6))
    torque = builder.add(
        "rne", LoadedRne(robot=robot), path["q"], path["qd"], path["qdd"], wrench=free, payload=carried
    )
    tool = builder.add("T2xyz", T2xyz(), builder.add("fkine", Fkine(robot=robot), path["q"]))
    builder.add("plot", RobotPlot(robot=robot), path["q"])
    builder.add("Seen from above", XYGraph(), tool["x"], tool["y"])
    builder.add("Height over y", XYGraph(), tool["y"], tool["z"])
    builder.add("Joint angles", Scope(), path["q"])
    builder.add("Joint speeds", Scope(), path["qd"])
    builder.add("Joint torques", Scope(), torque)
    for name, x, y in (
        ("path", 40, 160),
        ("gripped", 40, 300),
        ("released", 40, 400),
        ("payload", 180, 350),
        ("no force", 180, 260),
        ("rne", 340, 209),
        ("Joint torques", 560, 250),
        ("Joint angles", 340, 20),
        ("Joint speeds", 340, 110),
        ("plot", 560, 20),
        ("fkine", 560, 139),
        ("T2xyz", 720, 137),
        ("Seen from above", 880, 90),
        ("Height over y", 880, 200),
    ):
        builder.place(name, x, y)
    return builder.build()


BUILDERS: tuple[Callable[[], Diagram], ...] = (
    dc_motor_sampled_pid,
    kr180_pick_and_place,
    puma560_multirate,
    puma560_payload_drop,
)


def main() -> None:
    """Write all files."""
    for build in BUILDERS:
        diagram = build()
        save_diagram(diagram, EXAMPLES / f"{diagram.name}.json")
        print(f"examples/{diagram.name}.json")


if __name__ == "__main__":
    main()

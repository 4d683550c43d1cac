"""A Delta robot under computed torque control, with a load of 1 kg that the controller ignores.

    python delta_robot.py OUT [--film]

simulates one pick-and-place cycle and writes a report into the folder OUT (``report.html``), and with
``--film`` the video ``delta.mp4`` (extra ``film``). The printed lines compare the platform with the desired
path.

Three motors on the base turn three upper arms. Two parallel rods lead from each arm to the platform, which
therefore cannot rotate. Each rod has a universal joint at the arm and a ball at the platform. The desired
motion is a path of the platform: 25 mm up, 305 mm across and 25 mm down, and back without the load. The
desired angles of the arms follow in closed form.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import armblocks as ab
from armblocks.blocks import (
    ArmPlant,
    ComputedTorque,
    Fkine,
    MatrixGain,
    RobotPlot,
    Scope,
    Step,
    Sum,
    T2xyz,
    XYGraph,
)
from armblocks.robot.shapes import Box, Cylinder, Material
from armblocks.spatial import transl, troty, trotz

BASE_RADIUS, PLATFORM_RADIUS = 0.2, 0.06  # m, of the axes of the arms and of the ends of the rods
ARM, ROD, GAP = 0.3, 0.7, 0.08  # m, lengths of the arms and the rods, and distance of parallel rods
HEIGHT = float(np.sqrt(ROD**2 - (BASE_RADIUS + ARM - PLATFORM_RADIUS) ** 2))  # m, of the base at level arms
ARM_MASS, ROD_MASS, PLATFORM_MASS, LOAD = 0.8, 0.06, 0.4, 1.0  # kg
MOTOR = ab.Motor(inertia=6e-5, gear_ratio=20.0, viscous_friction=5e-5)
KP, KD = 6400.0, 160.0  # 1/s2 and 1/s: both poles of each arm at -80 rad/s

START = np.array([-0.1525, 0.0, -0.68])  # m, where the platform grips the load
LIFT, STRIDE = 0.025, 0.305  # m
GRIP, RELEASE, BACK = 0.1, 0.55, 0.65  # s: the load is gripped, and released; the platform returns
# start (s), duration (s) and displacement (m) of the strokes; successive strokes overlap
STROKES = [
    (start + delay, duration, displacement)
    for start, stride in ((GRIP + 0.05, STRIDE), (BACK, -STRIDE))
    for delay, duration, displacement in (
        (0.0, 0.12, (0.0, 0.0, LIFT)),
        (0.05, 0.25, (stride, 0.0, 0.0)),
        (0.23, 0.12, (0.0, 0.0, -LIFT)),
    )
]
STOP_TIME = 1.1  # s


def slender(mass: float, length: float, axis: int) -> dict[str, object]:
    """Inertial parameters of a slender beam from the origin along an axis."""
    centre, moments = np.zeros(3), np.full(3, mass * length**2 / 12)
    centre[axis], moments[axis] = length / 2, 0.0
    return {"mass": mass, "centre_of_mass": centre, "inertia": moments}


def delta() -> ab.Robot:
    """The mechanism; at zero coordinates its arms are level and the platform is below the centre."""
    lean = troty(np.pi + np.arctan2(BASE_RADIUS + ARM - PLATFORM_RADIUS, HEIGHT))  # of the rods
    beam = Box(size=(ARM, 0.03, 0.05), material=Material.PAINT, pose=transl(ARM / 2, 0, 0).matrix)
    tube = Cylinder(radius=0.006, length=ROD, material=Material.FLANGE, pose=transl(0, 0, ROD / 2).matrix)
    limits = ab.JointLimits(position=(np.radians(-40), np.radians(80)), torque=60.0)
    links, balls = [], []
    for k in range(3):
        around = trotz(2 * np.pi / 3 * k)
        links.append(
            ab.Link(
                name=f"arm{k + 1}",
                joint=ab.Revolute(axis=(0, 1, 0), limits=limits),
                before=around @ transl(BASE_RADIUS, 0, 0),
                motor=MOTOR,
                geometry=(beam,),
                **slender(ARM_MASS, ARM, 0),
            )
        )
        for side, letter in ((-1, "a"), (1, "b")):
            links.append(
                ab.Link(
                    name=f"rod{k + 1}{letter}",
                    parent=f"arm{k + 1}",
                    joint=ab.Universal(axis=(0, 1, 0), second_axis=(1, 0, 0)),
                    before=transl(ARM, side * GAP / 2, 0) @ lean,
                    geometry=(tube,),
                    **slender(ROD_MASS, ROD, 2),
                )
            )
            end = around @ transl(PLATFORM_RADIUS, side * GAP / 2, 0)
            balls.append(
                ab.SphericalClosure(
                    name=f"ball{k + 1}{letter}",
                    first=ab.Attachment(link=f"rod{k + 1}{letter}", pose=transl(0, 0, ROD)),
                    second=ab.Attachment(link="platform", pose=end),
                )
            )
    plate = Cylinder(radius=1.2 * PLATFORM_RADIUS, length=0.015, material=Material.PAINT)
    links.append(
        ab.Link(
            name="platform",
            joint=ab.Free(),
            before=transl(0, 0, -HEIGHT),
            mass=PLATFORM_MASS,
            inertia=(3e-4, 3e-4, 6e-4),
            geometry=(plate,),
        )
    )
    return ab.Robot(name="Delta robot", links=tuple(links), constraints=tuple(balls))


def desired(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position (m), velocity and acceleration of the platform at the times (N,): (N, 3) each."""
    total = START + np.zeros((len(t), 3)), np.zeros((len(t), 3)), np.zeros((len(t), 3))
    for start, duration, displacement in STROKES:
        step = ab.jtraj(np.zeros(3), displacement, [0, duration])(t - start)  # before and after it: at rest
        for sum_, part in zip(total, (step.q, step.qd, step.qdd)):
            sum_ += part
    return total


def arm_angles(p: np.ndarray, v: np.ndarray, a: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angles (N, 3) of the arms, rad, and their derivatives, from the motion (N, 3) of the platform.

    The vector s along a rod has constant length: s·s = ROD². With the elbow at R u + ARM e(θ) this is
    E cos(θ) + F sin(θ) = G, where u points outward. The derivatives are s·s' = 0 and s·s'' + s'·s' = 0.
    """
    columns = []
    for k in range(3):
        u = np.array([np.cos(2 * np.pi / 3 * k), np.sin(2 * np.pi / 3 * k), 0.0])
        z = np.array([0.0, 0.0, 1.0])
        w = p + (PLATFORM_RADIUS - BASE_RADIUS) * u  # from the axis of the arm to the end of the rod
        E, F = 2 * ARM * w @ u, -2 * ARM * w @ z
        G = (w * w).sum(axis=1) + ARM**2 - ROD**2
        angle = np.arctan2(F, E) - np.arccos(G / np.hypot(E, F))  # the elbow is outside
        c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
        e, de = c * u - s * z, -s * u - c * z
        rod = w - ARM * e
        across = ARM * (rod * de).sum(axis=1)
        rate = (rod * v).sum(axis=1) / across
        drift = v - ARM * rate[:, None] * de
        second = (rod * a).sum(axis=1) + ARM * rate**2 * (rod * e).sum(axis=1) + (drift * drift).sum(axis=1)
        columns.append((angle, rate, second / across))
    angle, rate, second = (np.column_stack(column) for column in zip(*columns))
    return angle, rate, second


def arm_motion() -> ab.JointTrajectory:
    """The desired motion of the arms, with exact derivatives in steps of 5 ms."""
    t = np.arange(0, 200 * STOP_TIME + 1) / 200
    q, qd, qdd = arm_angles(*desired(t))
    return ab.JointTrajectory(t=t, q=q, qd=qd, qdd=qdd)


def controlled() -> ab.Diagram:
    """The robot with its controller; the reference of the arms is distributed to the entries of q and qd."""
    robot = delta()
    names = [entry.name for entry in robot.positions]
    rows = [names.index(f"arm{k}") for k in (1, 2, 3)]  # the same in q and qd: the platform is last
    place = np.zeros((robot.nq, 3))
    place[rows, range(3)] = 1.0
    motion = arm_motion()
    q0 = ab.Arm(robot).assemble(robot.neutral + place @ motion.q[0], locked=("arm1", "arm2", "arm3")).q
    payload = (LOAD, *np.zeros(9))

    settings = ab.SimulationOptions(stop_time=STOP_TIME, sample_time=0.002)
    builder = ab.DiagramBuilder("delta_robot", settings=settings)
    path = builder.add("arms", motion.block())
    plant = builder.add("robot", ArmPlant(robot=robot, q0=q0, payload_input=True))
    control = builder.add("control", ComputedTorque(robot=robot, Kp=KP, Kd=KD))
    for port, source, gain in (("qr", "q", place), ("qdr", "qd", place[:-1]), ("qddr", "qdd", place[:-1])):
        builder.connect(builder.add(port, MatrixGain(gain=gain), path[source]), control[port])
    for port in ("q", "qd"):
        builder.connect(plant[port], control[port])
    builder.connect(control, plant["tau"])
    gripped = builder.add("gripped", Step(time=GRIP, final=payload))
    released = builder.add("released", Step(time=RELEASE, final=payload))
    builder.connect(builder.add("load", Sum(signs="+-"), gripped, released), plant["payload"])

    torques = builder.add("torques", MatrixGain(gain=place[:-1].T), control)
    angles = builder.add("angles", MatrixGain(gain=place.T), plant["q"])
    for source, title in ((torques, "torque"), (angles, "angle")):
        builder.name_signal(source, title)
        builder.add(f"Arm {title}s", Scope(), source)
    builder.add("plot", RobotPlot(robot=robot), plant["q"])
    centre = builder.add("centre", T2xyz(), builder.add("pose", Fkine(robot=robot), plant["q"]))
    for axis in "xyz":
        builder.name_signal(centre[axis], axis)
    builder.add("Path of the platform", XYGraph(), centre["x"], centre["z"])
    builder.add("Platform position", Scope(inputs=3), centre["x"], centre["y"], centre["z"])
    return builder.build()


def errors(result: ab.SimulationResult) -> tuple[float, float, float, float]:
    """The largest error of the path (mm), at the release (mm), rotation (rad) and torque (N m)."""
    poses = ab.Arm(delta()).fkine(result["robot/q"])
    position = 1e3 * np.linalg.norm(poses[:, :3, 3] - desired(result.time)[0], axis=1)
    rotation = np.abs(poses[:, :3, :3] - np.eye(3)).max()
    at_release = position[np.searchsorted(result.time, RELEASE) - 1]
    return position.max(), float(at_release), float(rotation), np.abs(result["torques/y"]).max()


def main(out: Path, *, film: bool = False) -> None:
    """Simulate the cycle, and write the report and the film."""
    out.mkdir(parents=True, exist_ok=True)
    diagram = controlled()
    result = ab.simulate(diagram)
    largest, at_release, rotation, torque = errors(result)
    print(f"error of the path {largest:.2f} mm, at the release {at_release:.2f} mm")
    print(f"rotation of the platform {rotation:.0e} rad, largest torque {torque:.1f} N m")
    ab.write_report(out, diagram, result)
    if film:
        ab.write_film(out / "delta.mp4", diagram, result)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "delta_results"), film="--film" in sys.argv)

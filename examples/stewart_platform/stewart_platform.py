"""A Stewart platform under position control, with a load on the platform that the controller ignores.

    python stewart_platform.py OUT [--film]

simulates the motion with two controllers of the leg lengths and writes into the folder OUT a report for each
(``gravity_compensation/report.html``, ``computed_torque/report.html``), and with ``--film`` the video
``platform.mp4`` (extra ``film``). The printed table compares the pose of the platform with the desired pose.

Each leg is a screw of 20 mm lead between a universal joint on the base and a ball on the platform. The
desired motion is a pose of the platform; the desired lengths of the legs follow in closed form.
"""

from __future__ import annotations

import sys
from itertools import pairwise
from pathlib import Path

import numpy as np

import armblocks as ab
from armblocks.blocks import (
    ComputedTorque,
    Fkine,
    ForwardDynamics,
    GravityCompensation,
    MatrixGain,
    Scope,
    T2xyz,
)
from armblocks.robot.shapes import Cylinder, Material
from armblocks.spatial import transl, trotz

BASE_RADIUS, PLATFORM_RADIUS, HEIGHT = 0.5, 0.3, 0.6  # m
CENTRE = np.array([0.0, 0.0, HEIGHT])
SPREAD = 0.3  # rad between a joint and the middle of its pair
TUBE, ROD = 0.4, 0.42  # m, lengths of the lower and the upper part of a leg
LOAD = 20.0  # kg on the platform, unknown to the controller
LEAD = 0.02  # m per revolution of the screw
MOTOR = ab.Motor(inertia=1e-4, gear_ratio=2 * np.pi / LEAD, viscous_friction=2e-4)
TILT_AXIS = np.array([0.8, 0.6, 0.0])
# x, y, z (m) and the angle about the tilt axis (rad), each reached at rest
STATIONS = [(0, 0, 0, 0), (0.03, -0.05, 0.06, 0.25), (-0.05, 0.04, -0.02, -0.2), (0, 0, 0, 0)]
DURATION = 1.0  # s, from station to station
KP, KD = 2.5e5, 1.0e4  # N/m and N s/m, gains of the legs

FEET = np.array(
    [(trotz(np.pi / 3 * k + (SPREAD if k % 2 else -SPREAD)) @ transl(BASE_RADIUS, 0, 0)).p for k in range(6)]
)
BALLS = np.array(
    [
        (trotz(np.pi / 3 * k + (-SPREAD if k % 2 else SPREAD)) @ transl(PLATFORM_RADIUS, 0, 0)).p
        for k in range(6)
    ]
)
NEUTRAL = np.linalg.norm(BALLS + CENTRE - FEET, axis=1)  # m, lengths of the legs at the start


def rod(mass: float, radius: float, start: float, end: float, material: Material) -> dict[str, object]:
    """Inertial parameters and shape of a cylinder along z."""
    across = mass * (3 * radius**2 + (end - start) ** 2) / 12
    centre = transl(0, 0, (start + end) / 2)
    shape = Cylinder(radius=2 * radius, length=end - start, material=material, pose=centre.matrix)
    inertia = (across, across, mass * radius**2 / 2)
    return {"mass": mass, "centre_of_mass": centre.p, "inertia": inertia, "geometry": (shape,)}


def platform(load: float) -> ab.Robot:
    """The mechanism with a load (kg) on the platform."""
    links, balls = [], []
    for k, (foot, ball) in enumerate(zip(FEET, BALLS)):
        z = (ball + CENTRE - foot) / NEUTRAL[k]
        x = np.array([-np.sin(np.pi / 3 * k), np.cos(np.pi / 3 * k), 0.0])
        x -= (x @ z) * z
        x /= np.linalg.norm(x)
        along = ab.Transform(rotation=np.column_stack([x, np.cross(z, x), z]), translation=foot)
        hinge = ab.Universal(axis=(1, 0, 0), second_axis=(0, 1, 0))
        stroke = ab.Prismatic(limits=ab.JointLimits(position=(-0.2, 0.2), torque=3000.0))
        tube = rod(2.0, 0.02, 0.0, TUBE, Material.PAINT)
        thin = rod(0.8, 0.01, -ROD, 0.0, Material.FLANGE)
        links += [
            ab.Link(name=f"tube{k + 1}", joint=hinge, before=along, **tube),
            ab.Link(
                name=f"leg{k + 1}",
                parent=f"tube{k + 1}",
                joint=stroke,
                before=transl(0, 0, NEUTRAL[k]),
                motor=MOTOR,
                **thin,
            ),
        ]
        ends = ab.Attachment(link=f"leg{k + 1}"), ab.Attachment(link="platform", pose=transl(*ball))
        balls.append(ab.SphericalClosure(name=f"ball{k + 1}", first=ends[0], second=ends[1]))
    mass = 10.0 + load
    plate = Cylinder(radius=1.1 * PLATFORM_RADIUS, length=0.03, material=Material.PAINT)
    links.append(
        ab.Link(
            name="platform",
            joint=ab.Free(),
            before=transl(0, 0, HEIGHT),
            mass=mass,
            inertia=np.array([0.3, 0.3, 0.5]) * mass / 10.0,
            geometry=(plate,),
        )
    )
    return ab.Robot(name="Stewart platform", links=tuple(links), constraints=tuple(balls))


def desired(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Displacement (m) and angle about the tilt axis (rad) at the times (N,): (N, 4), with derivatives."""
    total = [np.zeros((len(t), 4)) for _ in range(3)]
    for k, (start, end) in enumerate(pairwise(STATIONS)):
        step = ab.jtraj(start, end, [0, DURATION])(t - k * DURATION)  # before and after it: at rest
        total[0] += step.q - start
        total[1] += step.qd
        total[2] += step.qdd
    return total[0], total[1], total[2]


def rotations(angles: np.ndarray) -> np.ndarray:
    """Rotations (N, 3, 3) by the angles about the tilt axis."""
    x, y, z = TILT_AXIS
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angles)[:, None, None] * K + (1 - np.cos(angles))[:, None, None] * (K @ K)


def leg_motion() -> ab.JointTrajectory:
    """Strokes of the legs, with exact derivatives: L^2 = d . d, where d is the vector from foot to ball."""
    t = np.arange(0, 100 * (len(STATIONS) - 1) * DURATION + 1) / 100
    w, wd, wdd = desired(t)
    arms = np.einsum("nij,kj->nki", rotations(w[:, 3]), BALLS)
    turned = np.cross(TILT_AXIS, arms)
    d = arms + w[:, None, :3] + CENTRE - FEET
    dd = wd[:, None, :3] + wd[:, 3, None, None] * turned
    ddd = wdd[:, None, :3] + wdd[:, 3, None, None] * turned
    ddd += wd[:, 3, None, None] ** 2 * np.cross(TILT_AXIS, turned)
    length = np.linalg.norm(d, axis=2)
    rate = (d * dd).sum(axis=2) / length
    second = ((dd * dd).sum(axis=2) + (d * ddd).sum(axis=2) - rate**2) / length
    return ab.JointTrajectory(t=t, q=length - NEUTRAL, qd=rate, qdd=second)


def controlled(name: str, robot: ab.Robot, law: GravityCompensation | ComputedTorque) -> ab.Diagram:
    """The platform with a controller; the reference of the legs is distributed to the entries of q and qd."""
    builder = ab.DiagramBuilder(name)
    strokes = [k for k, entry in enumerate(robot.speeds) if entry.unit == "m" and k < 18]
    place = np.zeros((robot.nv, 6))
    place[strokes, range(6)] = 1.0
    at_q = np.vstack([place, np.zeros((1, 6))])  # q has one entry more than qd, behind those of the legs
    path = builder.add("legs", leg_motion().block())
    plant = builder.add("plant", ForwardDynamics(robot=robot, q0=robot.neutral))
    control = builder.add("control", law)
    references = {"qr": ("q", at_q), "qdr": ("qd", place), "qddr": ("qdd", place)}
    for port in law.input_ports():
        if port.name in references:
            source, gain = references[port.name]
            reference = builder.add(port.name, MatrixGain(gain=gain), path[source])
            builder.connect(reference, control[port.name])
        else:
            builder.connect(plant[port.name], control[port.name])
    builder.connect(control, plant["tau"])
    pick = np.zeros((6, robot.nv))
    pick[range(6), strokes] = 1.0
    forces = builder.add("forces", MatrixGain(gain=pick), control)
    strokes = builder.add("strokes", MatrixGain(gain=at_q.T), plant["q"])
    for source, title in ((forces, "force"), (strokes, "stroke")):
        builder.name_signal(source, title)
        builder.add(f"Leg {title}s", Scope(), source)
    pose = builder.add("pose", Fkine(robot=robot, frame="platform"), plant["q"])
    centre = builder.add("centre", T2xyz(), pose)
    builder.add("Platform position", Scope(inputs=3), centre["x"], centre["y"], centre["z"])
    return builder.build()


def main(out: Path, *, film: bool = False) -> dict[str, tuple[float, float, float]]:
    """Simulate both controllers and write the reports; the largest errors (mm, degrees) and force (N)."""
    out.mkdir(parents=True, exist_ok=True)
    robot, model = platform(LOAD), platform(0.0)
    reflected = MOTOR.gear_ratio**2 * MOTOR.inertia
    mass = reflected + (10.0 + LOAD) / 6
    laws = {
        "gravity_compensation": GravityCompensation(robot=model, Kp=KP, Kd=KD),
        "computed_torque": ComputedTorque(robot=model, Kp=KP / mass, Kd=KD / mass),
    }
    results = {}
    for name, law in laws.items():
        diagram = controlled(name, robot, law)
        result = ab.simulate(diagram, stop_time=DURATION * (len(STATIONS) - 1) + 0.5, sample_time=0.01)
        ab.write_report(out / name, diagram, result)
        moving = result.time <= DURATION * (len(STATIONS) - 1)
        w, _, _ = desired(result.time[moving])
        poses = ab.Arm(robot).fkine(result["plant/q"][moving], frame="platform")
        position = np.linalg.norm(poses[:, :3, 3] - w[:, :3] - CENTRE, axis=1)
        turned = np.einsum("nij,nik->njk", rotations(w[:, 3]), poses[:, :3, :3])
        tilt = np.degrees(np.linalg.norm(turned - np.eye(3), axis=(1, 2)) / np.sqrt(2))
        force = np.abs(result["forces/y"]).max()
        results[name] = 1e3 * position.max(), tilt.max(), force
        print(f"{name:22}: {1e3 * position.max():6.2f} mm, {tilt.max():6.3f}°, {force:6.0f} N")
        if film and name == "computed_torque":
            ab.write_film(out / "platform.mp4", diagram, result)
    return results


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "stewart_results"), film="--film" in sys.argv)

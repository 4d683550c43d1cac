"""Forces in the linkage of a KUKA KR 180-2 PA that moves 180 kg from a conveyor to a pallet.

    python palletiser_linkage.py OUT [--film]

plans a pick-and-place cycle, computes the forces of the rods and the torques of the drives, without and with
a counterbalance spring, and writes a report into the folder OUT (``report.html``), and with ``--film`` the
video ``palletiser.mp4`` (extra ``film``). The printed table has the largest force at the bearing of each
link.

The catalogue's robot ``kr180_2_pa`` describes its parallelograms by couplings: equations between angles,
which have no forces. Here each coupling is replaced by the pin at the end of its rod. The drive of axis 3
turns the drive lever, as in the real robot. Each rod ends in a prismatic joint that does not move: the force
of its "motor", which holds the coordinate at zero, is the axial force of the rod, positive in compression.

The masses are estimates (see the notes of the robot), and so are the forces.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import armblocks as ab
from armblocks.blocks import (
    Constant,
    Demux,
    Fkine,
    LoadedRne,
    MatrixGain,
    RobotPlot,
    Scope,
    Step,
    Sum,
    T2xyz,
    XYGraph,
)
from armblocks.diagram import BlockHandle
from armblocks.robot.shapes import Cylinder, Material
from armblocks.spatial import transl, trotx

LOAD = 180.0  # kg
START = np.array([0.0, -1.2, 0.9, 0.0])  # rad, axes A1, A2, A3 and A6 of the catalogue's robot
CONVEYOR, PALLET = (2.2, -1.1, 0.9), (1.7, 1.5, 0.5)  # m, positions of the tool when it grips and releases
LIFT, GRIP_TIME = 0.4, 0.3  # m, s
SPEED, ACCELERATION = (1.8, 1.8, 1.9, 4.0), (2.5, 2.5, 2.5, 8.0)  # rad/s and rad/s2, assumed

DRIVES = ("turret", "lower_arm", "drive_lever", "flange")
# rod: its length (m), and the link and the position (m) of the pin at its end
RODS = {
    "drive_rod": (1.25, "upper_arm", (-0.405, 0.0, 0.0)),
    "lower_level_rod": (1.25, "triangle", (-0.2025, 0.0, 0.2025)),
    "upper_level_rod": (1.35, "wrist", (0.0, 0.0, 0.2025)),
}
# A tension spring whose force is proportional to its length, from the turret to the lower end of the lower
# arm. It balances the lower arm and 248 kg at the elbow: the other links, and about 80 kg of the load.
ANCHOR, END, STIFFNESS = 0.45, 0.2, 44e3  # m below axis 2, m below axis 2 along the lower arm, N/m


def catalogue() -> ab.Robot:
    """The robot with couplings: four coordinates."""
    return ab.load_robot("kr180_2_pa").robot


def pinned(*, spring: bool) -> ab.Robot:
    """The robot with pins in place of the couplings, and a sensor of axial force at the end of each rod."""
    robot = catalogue()
    links = [replace(link, motor=ab.Motor() if link.name in DRIVES else None) for link in robot.links]
    pins = []
    bolt = Cylinder(radius=0.035, length=0.16, material=Material.FLANGE, pose=trotx(np.pi / 2).matrix)
    for rod, (length, link, place) in RODS.items():
        along = (1, 0, 0) if rod == "upper_level_rod" else (0, 0, 1)
        sensor = ab.Link(
            name=f"{rod}_end",
            parent=rod,
            joint=ab.Prismatic(axis=along),
            before=transl(*(length * np.array(along))),
            motor=ab.Motor(),
            geometry=(bolt,),
        )
        # The sensors come first, because the last link carries the tool.
        links.insert(0, sensor)
        ends = ab.Attachment(link=sensor.name), ab.Attachment(link=link, pose=transl(*place))
        pins.append(ab.SphericalClosure(name=f"pin of {rod}", first=ends[0], second=ends[1]))
    anchor = ab.Attachment(link="turret", pose=transl(0.35, 0, 0.67 - ANCHOR))
    end = ab.Attachment(link="lower_arm", pose=transl(0, 0, -END))
    balance = ab.LineSpring(name="counterbalance", first=anchor, second=end, stiffness=STIFFNESS, length=0.0)
    return replace(
        robot,
        name="KR 180-2 PA with spring" if spring else "KR 180-2 PA",
        links=tuple(links),
        constraints=tuple(pins),
        springs=(balance,) if spring else (),
    )


def joint_map(robot: ab.Robot) -> tuple[np.ndarray, np.ndarray]:
    """Matrix A (n, 4) and vector b (n,): the coordinates q = A a + b of a pinned robot at the axes a.

    The couplings of the catalogue's robot, each ``sum of coefficient * joint = constant``, have these values.
    """
    rows = {name: (np.eye(4)[k], 0.0) for k, name in enumerate(catalogue().joint_names)}
    for coupling in catalogue().constraints:
        (joint, own), *others = coupling.terms
        matrix = -sum(factor * rows[name][0] for name, factor in others) / own
        rows[joint] = (
            matrix,
            (coupling.constant - sum(factor * rows[name][1] for name, factor in others)) / own,
        )
    still = np.zeros(4), 0.0  # the sensors
    chosen = [rows.get(name, still) for name in robot.joint_names]
    return np.array([row for row, _ in chosen]), np.array([value for _, value in chosen])


def planned() -> ab.PickAndPlaceCycle:
    """The time-optimal cycle of the four axes."""
    pick, place = (transl(*p).matrix @ np.diag([1.0, -1.0, -1.0, 1.0]) for p in (CONVEYOR, PALLET))
    return ab.pick_and_place(
        ab.load_robot("kr180_2_pa"),
        START,
        pick,
        place,
        lift=LIFT,
        grip_time=GRIP_TIME,
        payload=LOAD,
        speed=SPEED,
        acceleration=ACCELERATION,
    )


def diagram(cycle: ab.PickAndPlaceCycle) -> ab.Diagram:
    """Inverse dynamics of the cycle, without and with the spring."""
    robot = pinned(spring=False)
    A, b = joint_map(robot)
    motion = cycle.trajectory
    joints = ab.JointTrajectory(t=motion.t, q=motion.q @ A.T + b, qd=motion.qd @ A.T, qdd=motion.qdd @ A.T)
    payload = (LOAD, *np.zeros(9))
    times = {phase.name: phase for phase in cycle.phases}

    settings = ab.SimulationOptions(stop_time=float(motion.t[-1]), sample_time=0.01)
    builder = ab.DiagramBuilder("palletiser_linkage", settings=settings)
    path = builder.add("path", joints.block())
    gripped = builder.add("gripped", Step(time=times["grip"].start, final=payload))
    released = builder.add("released", Step(time=times["transfer"].end, final=payload))
    load = builder.add("load", Sum(signs="+-"), gripped, released)
    free = builder.add("no force", Constant(value=np.zeros(6)))

    def show(title: str, law: BlockHandle, labels: dict[str, str], unit: str) -> None:
        """A scope with the torques or forces of some joints; ``labels``: joint and label of each."""
        rows = np.eye(len(A))[[robot.joint_names.index(joint) for joint in labels]]
        chosen = builder.add(title.lower(), MatrixGain(gain=rows), law)
        parts = builder.add(f"{title}, parts", Demux(parts=3), chosen)
        for k, label in enumerate(labels.values()):
            builder.name_signal(parts[f"y{k + 1}"], label)
        builder.add(f"{title}, {unit}", Scope(inputs=3), parts["y1"], parts["y2"], parts["y3"])

    motion_of = path["q"], path["qd"], path["qdd"], free, load
    plain = builder.add("rne", LoadedRne(robot=robot), *motion_of)
    show("Rod forces", plain, {f"{rod}_end": rod.replace("_", " ") for rod in RODS}, "N")
    show("Drive torques", plain, dict(zip(DRIVES, ("A1", "A2", "A3"))), "N m")
    sprung = builder.add("rne with spring", LoadedRne(robot=pinned(spring=True)), *motion_of)
    labels = ("A1 with spring", "A2 with spring", "A3 with spring")
    show("Torques with spring", sprung, dict(zip(DRIVES, labels)), "N m")
    builder.add("plot", RobotPlot(robot=robot), path["q"])
    tool = builder.add("tool", T2xyz(), builder.add("pose", Fkine(robot=robot), path["q"]))
    for axis in "xyz":
        builder.name_signal(tool[axis], axis)
    builder.add("Seen from above", XYGraph(), tool["x"], tool["y"])
    return builder.build()


def joint_forces(cycle: ab.PickAndPlaceCycle, *, spring: bool) -> dict[str, np.ndarray]:
    """Magnitude (N,) of the force (N) of each joint and pin at the samples of the cycle."""
    robot = pinned(spring=spring)
    arm, motion = ab.Arm(robot), cycle.trajectory
    A, b = joint_map(robot)
    state = motion.q @ A.T + b, motion.qd @ A.T, motion.qdd @ A.T
    loaded = np.any([(motion.t >= p.start) & (motion.t <= p.end) for p in cycle.phases if p.loaded], axis=0)
    empty, full = (arm.joint_wrenches(*state, payload=ab.Payload(mass=mass)) for mass in (0.0, LOAD))
    force = np.linalg.norm(np.where(loaded[:, None, None], full, empty)[:, :, :3], axis=2)
    names = [*(link.name for link in robot.links), *(closure.name for closure in robot.closures)]
    return dict(zip(names, force.T))


def main(out: Path, *, film: bool = False) -> None:
    """Print the forces of the joints, and write the report and the film."""
    out.mkdir(parents=True, exist_ok=True)
    cycle = planned()
    print(cycle)
    forces = [joint_forces(cycle, spring=spring) for spring in (False, True)]
    print(f"{'largest force':24}{'alone':>11}{'with spring':>14}")
    for name in (*RODS, *DRIVES, "upper_arm", "triangle", "wrist"):
        print(f"{name:24}{forces[0][name].max() / 1e3:8.2f} kN{forces[1][name].max() / 1e3:11.2f} kN")
    model = diagram(cycle)
    result = ab.simulate(model)
    torques = result["drive torques/y"], result["torques with spring/y"]
    for k, name in enumerate(("A1", "A2", "A3")):
        peak = [np.abs(torque[:, k]).max() / 1e3 for torque in torques]
        print(f"{'torque of ' + name:24}{peak[0]:8.2f} kN m{peak[1]:9.2f} kN m")
    ab.write_report(out, model, result)
    if film:
        ab.write_film(out / "palletiser.mp4", model, result)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "palletiser_results"), film="--film" in sys.argv)

"""A palletiser, a Stewart platform, a Delta robot and a top: time, error and gap, beside MuJoCo and Exudyn.

    ARMBLOCKS_PEERS=peers/bin/python python benchmarks/mechanism_peers.py

`mechanism_bodies.json` has the bodies, joints and springs of each mechanism in world axes at t = 0. All three
programs read the same description. MuJoCo: a tree with stiff equality constraints (`mechanisms.py`), RK4 in
steps of 2 ms. Exudyn: free bodies with constraints, generalised-alpha of index 3 in steps of 1 ms, in the
environment of ARMBLOCKS_PEERS (`pip install exudyn`). The reference of the errors is a run of armblocks at a
relative tolerance of 1e-11. Times are processor times without compilation, because other processes may run.
"""

# pyright: basic
from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from mechanisms import quaternion

import armblocks as ab
from armblocks.blocks import Constant, ForwardDynamics
from armblocks.dynamics.mechanism import Mechanism
from armblocks.robot import Robot, SphericalClosure

FOLDER = Path(__file__).parent
STOP_TIME = 2.0
LONG_TIME = 1000.0
Case = dict[str, Any]


def frame(joint: list[Any]) -> ab.Transform:
    """The joint's frame at t = 0: z along the axis; of a universal joint x and y along both axes."""
    kind, _, _, point, *axes = joint
    if kind == "sph":
        return ab.Transform(translation=point)
    first = np.array(axes[0]) / np.linalg.norm(axes[0])
    if kind == "uni":
        second = np.array(axes[1]) / np.linalg.norm(axes[1])
        return ab.Transform(
            rotation=np.column_stack([first, second, np.cross(first, second)]), translation=point
        )
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(first)))], first)
    x /= np.linalg.norm(x)
    return ab.Transform(rotation=np.column_stack([x, np.cross(first, x), first]), translation=point)


def placed(case: Case) -> dict[str | None, ab.Transform]:
    """The frames of all bodies at t = 0, in the centres of mass, and of the base (None)."""
    bodies = case["bodies"].items()
    frames = {name: ab.Transform(rotation=body["R"], translation=body["com"]) for name, body in bodies}
    return {None: ab.Transform(), **frames}


def split(case: Case) -> tuple[list[list[Any]], list[list[Any]]]:
    """The joints of a spanning tree, parents first, and the joints that close loops."""
    tree: list[list[Any]] = []
    closing: list[list[Any]] = []
    reached: set[str | None] = {None}
    for joint in case["joints"]:
        (closing if joint[2] in reached else tree).append(joint)
        reached.add(joint[2])
    return tree, closing


def robot_of(name: str, case: Case) -> Robot:
    at, (tree, closing) = placed(case), split(case)
    types = {
        "rev": ab.Revolute(),
        "pri": ab.Prismatic(),
        "sph": ab.Spherical(),
        "uni": ab.Universal(axis=(1, 0, 0), second_axis=(0, 1, 0)),
    }
    links = [
        ab.Link(
            name=joint[2],
            parent=joint[1],
            joint=types[joint[0]],
            before=at[joint[1]].inverse() @ frame(joint),
            after=frame(joint).inverse() @ at[joint[2]],
            mass=case["bodies"][joint[2]]["mass"],
            inertia=case["bodies"][joint[2]]["inertia_body_axes"],
        )
        for joint in tree
    ]
    closures = [
        {"rev": ab.RevoluteClosure, "sph": SphericalClosure}[joint[0]](
            name=f"{joint[1]}-{joint[2]}",
            first=ab.Attachment(link=joint[1], pose=at[joint[1]].inverse() @ frame(joint)),
            second=ab.Attachment(link=joint[2], pose=at[joint[2]].inverse() @ frame(joint)),
        )
        for joint in closing
    ]
    springs = [
        ab.LineSpring(
            name=f"spring {k}",
            first=ab.Attachment(
                link=s["a"], pose=ab.Transform(translation=at[s["a"]].inverse().apply(s["pa"]))
            ),
            second=ab.Attachment(
                link=s["b"], pose=ab.Transform(translation=at[s["b"]].inverse().apply(s["pb"]))
            ),
            stiffness=s["k"],
            length=s["L0"],
        )
        for k, s in enumerate(case["springs"])
    ]
    return Robot(
        name=name,
        links=tuple(links),
        gravity=case["gravity"],
        constraints=tuple(closures),
        springs=tuple(springs),
    )


def joint_speeds(case: Case, *, ball_in_body: bool) -> dict[str, list[float]]:
    """Speeds of the tree's joints at t = 0 by body; of balls in axes of the body, or of the joint's frame."""
    rest = {"v": [0.0] * 3, "omega": [0.0] * 3, "com": [0.0] * 3}
    speeds: dict[str, list[float]] = {}
    for joint in split(case)[0]:
        kind, a, b, point = joint[:4]
        first, second = case["bodies"].get(a, rest), case["bodies"][b]
        turn = np.subtract(second["omega"], first["omega"])
        shift = np.subtract(second["v"], first["v"])
        shift = shift + np.cross(second["omega"], np.subtract(point, second["com"]))
        shift = shift - np.cross(first["omega"], np.subtract(point, first["com"]))
        R = frame(joint).R
        speeds[b] = {
            "rev": [turn @ R[:, 2]],
            "pri": [shift @ R[:, 2]],
            "uni": [turn @ R[:, 0], turn @ R[:, 1]],
            "sph": list(np.transpose(second["R"]) @ turn if ball_in_body else turn),
        }[kind]
    return speeds


def processor_time(function: Callable[[], object], repeats: int = 7) -> float:
    """The least processor time of a call, s."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
    return min(times)


def ours(name: str, case: Case) -> tuple[Case, list[tuple[float, float, float, float]]]:
    """The centres of mass of the exact run; for both tolerances the time in ms per simulated second, the
    error, and the gaps after 2 s and after 1000 s."""
    robot = robot_of(name, case)
    arm = ab.Arm(robot, near=robot.neutral)
    speeds = np.concatenate(list(joint_speeds(case, ball_in_body=False).values()))
    start = arm.assemble(robot.neutral, qd=speeds)
    builder = ab.DiagramBuilder("mechanism")
    torque = builder.add("torque", Constant(value=np.zeros(robot.n)))
    builder.add("plant", ForwardDynamics(robot=robot, q0=start.q, qd0=start.qd), torque)
    compiled = ab.compile_diagram(builder.build())

    def end(stop_time: float, tolerances: dict[str, float]) -> np.ndarray:
        result = ab.simulate(compiled, stop_time=stop_time, sample_time=stop_time / 20, **tolerances)
        return result["plant/q"][-1]

    exact = arm.link_poses(end(STOP_TIME, {"rtol": 1e-11, "atol": 1e-13}))[1:-1, :3, 3]
    rows = []
    for tolerances in ({}, {"rtol": 1e-9, "atol": 1e-11}):
        q = end(STOP_TIME, tolerances)
        error = float(np.abs(arm.link_poses(q)[1:-1, :3, 3] - exact).max())
        seconds = processor_time(lambda tolerances=tolerances: end(STOP_TIME, tolerances))
        far = float("nan") if tolerances else largest_gap(robot, end(LONG_TIME, tolerances))
        rows.append((1e3 * seconds / STOP_TIME, error, largest_gap(robot, q), far))
    return {link.name: p.tolist() for link, p in zip(robot.links, exact)}, rows


def largest_gap(robot: Robot, q: np.ndarray) -> float:
    """The largest distance between the points of a closure, m."""
    return float(np.abs(Mechanism(robot).residuals(q)).max(initial=0.0)) if robot.constraints else 0.0


def mujoco_model(case: Case) -> mujoco.MjModel:
    spec = mujoco.MjSpec()
    spec.option.gravity, spec.option.timestep = case["gravity"], 0.002
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    at, (tree, closing) = placed(case), split(case)
    bodies = {None: spec.worldbody}
    kinds = mujoco.mjtJoint
    for joint in tree:
        kind, a, b = joint[:3]
        relative, local = at[a].inverse() @ at[b], at[b].inverse() @ frame(joint)
        body = bodies[a].add_body(name=b, pos=relative.p, quat=quaternion(relative.R))
        axes = {"rev": [2], "pri": [2], "uni": [0, 1], "sph": [2]}[kind]
        for k in axes:
            joint_type = {"pri": kinds.mjJNT_SLIDE, "sph": kinds.mjJNT_BALL}.get(kind, kinds.mjJNT_HINGE)
            body.add_joint(name=f"{b} {k}", type=joint_type, pos=local.p, axis=local.R[:, k])
        body.mass, body.ipos, body.explicitinertial = case["bodies"][b]["mass"], [0, 0, 0], True
        inertia = np.array(case["bodies"][b]["inertia_body_axes"])
        body.fullinertia = [inertia[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        bodies[b] = body

    def site(name: str, body: str | None, point: np.ndarray) -> str:
        bodies[body].add_site(name=name, pos=at[body].inverse().apply(point))
        return name

    for joint in closing:
        kind, a, b, point = joint[:4]
        for z in (0.0, 0.1) if kind == "rev" else (0.0,):
            p = np.add(point, z * frame(joint).R[:, 2])
            names = [site(f"{a} {b} {z} {end}", body, p) for end, body in enumerate((a, b))]
            equality = spec.add_equality(
                type=mujoco.mjtEq.mjEQ_CONNECT,
                name1=names[0],
                name2=names[1],
                objtype=mujoco.mjtObj.mjOBJ_SITE,
            )
            equality.solimp, equality.solref = [0.9999, 0.9999, 0.001, 0.5, 2], [0.004, 1]
    for k, spring in enumerate(case["springs"]):
        tendon = spec.add_tendon(name=f"spring {k}")
        tendon.stiffness, tendon.springlength = [spring["k"], 0.0, 0.0], [spring["L0"]] * 2
        for end in "ab":
            tendon.wrap_site(site(f"spring {k} {end}", spring[end], spring[f"p{end}"]))
    return spec.compile()


def of_mujoco(case: Case, centres: Case) -> tuple[float, float, float, float]:
    model = mujoco_model(case)
    data = mujoco.MjData(model)
    speeds = joint_speeds(case, ball_in_body=True)

    def run(stop_time: float) -> None:
        mujoco.mj_resetData(model, data)
        for name, values in speeds.items():
            first = model.body_dofadr[mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)]
            data.qvel[first : first + len(values)] = values
        mujoco.mj_step(model, data, round(stop_time / model.opt.timestep))

    def gap() -> float:
        mujoco.mj_kinematics(model, data)
        pairs = [(model.eq_obj1id[k], model.eq_obj2id[k]) for k in range(model.neq)]
        return max(
            (float(np.linalg.norm(data.site_xpos[i] - data.site_xpos[j])) for i, j in pairs), default=0.0
        )

    seconds = processor_time(lambda: run(STOP_TIME), repeats=3)
    short = gap()
    error = max(float(np.abs(data.body(name).xpos - p).max()) for name, p in centres.items())
    run(LONG_TIME / 10)
    return 1e3 * seconds / STOP_TIME, error, short, gap()


def of_exudyn(case: Case, centres: Case) -> tuple[float, float, float, float] | None:
    """Time, error and gap, or None if there is no environment with Exudyn."""
    python = os.environ.get("ARMBLOCKS_PEERS")
    if python is None:
        return None
    joints = [(*joint[:4], frame(joint).R.tolist()) for joint in case["joints"]]
    text = json.dumps({**case, "joints": joints, "stop_time": STOP_TIME})
    command = [python, str(FOLDER / "exudyn_mechanism.py")]
    run = subprocess.run(command, input=text, capture_output=True, text=True, check=False)
    if run.returncode:
        print(run.stderr[-400:], file=sys.stderr)
        return None
    answer = json.loads(run.stdout.splitlines()[-1])
    error = max(float(np.abs(np.subtract(answer["centres"][name], p)).max()) for name, p in centres.items())
    return 1e3 * answer["seconds"] / STOP_TIME, error, answer["gap"], float("nan")


def main() -> None:
    cases = json.loads((FOLDER / "mechanism_bodies.json").read_text())
    print(f"load average {os.getloadavg()[0]:.1f}")
    heads = (
        "mechanism",
        "program",
        "ms per simulated second",
        "error, m",
        "gap after 2 s",
        "gap later",
        "speed-up",
    )
    print("| " + " | ".join(heads) + " |")
    print("|" + "---|" * len(heads))
    for name, case in cases.items():
        centres, rows = ours(name, case)
        for (t, *errors), tolerances in zip(rows, ("default tolerances", "rtol 1e-9")):
            print_row(name, f"armblocks, {tolerances}", t, errors)
        for program, answer in (("MuJoCo", of_mujoco(case, centres)), ("Exudyn", of_exudyn(case, centres))):
            if answer is not None:
                t, *errors = answer
                print_row(name, program, t, errors, f"{ratio(t / rows[0][0])}, {ratio(t / rows[1][0])}")


def ratio(value: float) -> str:
    return f"{value:.0f} x" if value >= 1.0 else f"{value:.1g} x"


def print_row(name: str, program: str, t: float, errors: list[float], factor: str = "") -> None:
    cells = ["" if np.isnan(value) else f"{value:.0e}" for value in errors]
    print(f"| {name} | {program} | {t:.2f} | " + " | ".join(cells) + f" | {factor} |", flush=True)


if __name__ == "__main__":
    main()

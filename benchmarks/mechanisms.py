"""Mechanisms with closed loops: time per simulated second, error and gap, beside MuJoCo.

    python benchmarks/mechanisms.py

MuJoCo closes the loops by equality constraints with the stiffest `solimp` of its documentation and integrates
with RK4 in steps of 2 ms. The reference of the errors is a run of armblocks at a relative tolerance of 1e-11,
which agrees with published references (tests/systems/test_mechanisms.py). Compilation is not included.
"""

# pyright: basic
from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np

import armblocks as ab
from armblocks.blocks import Constant, ForwardDynamics
from armblocks.dynamics.mechanism import Mechanism
from armblocks.robot import Prismatic, Robot
from armblocks.robot.constraints import RevoluteClosure

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from mechanisms_for_tests import bricard, four_bar, parallelograms, slider_crank

STOP_TIME = 2.0
CASES: dict[str, tuple[Callable[[], Robot], list[float]]] = {
    "slider-crank": (slider_crank, [5.0, 0.0, 0.0]),
    "four-bar": (four_bar, [4.0, 0.0, 0.0]),
    "three parallelograms": (lambda: parallelograms(3), [-1.0] * 4 + [1.0] * 3),
    "Bricard": (bricard, [0.0] * 5),
}


def diagram(robot: Robot, q: np.ndarray, qd: np.ndarray) -> ab.Diagram:
    builder = ab.DiagramBuilder("mechanism")
    torque = builder.add("torque", Constant(value=np.zeros(robot.n)))
    builder.add("plant", ForwardDynamics(robot=robot, q0=q, qd0=qd), torque)
    return builder.build()


def tips(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Centres of mass of all links, m."""
    poses = ab.Arm(robot).link_poses(q)[1:-1]
    centres = np.array([[*link.centre_of_mass, 1.0] for link in robot.links])
    return np.einsum("lij,lj->li", poses, centres)[:, :3]


def best(function: Callable[[], object], repeats: int = 7) -> float:
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times)


def ours(robot: Robot, q: np.ndarray, qd: np.ndarray) -> tuple[float, float, float]:
    """Milliseconds per simulated second, error and gap at default tolerances, m."""
    compiled = ab.compile_diagram(diagram(robot, q, qd))
    settings = {"stop_time": STOP_TIME, "sample_time": 0.1}
    exact = ab.simulate(compiled, rtol=1e-11, atol=1e-13, **settings)["plant/q"][-1]
    end = ab.simulate(compiled, **settings)["plant/q"][-1]
    seconds = best(lambda: ab.simulate(compiled, **settings))
    error = np.abs(tips(robot, end) - tips(robot, exact)).max()
    gap = np.abs(Mechanism(robot).residuals(end)).max()
    return 1e3 * seconds / STOP_TIME, float(error), float(gap)


def mujoco_model(robot: Robot) -> mujoco.MjModel:
    """Hinges and sliders as bodies, closures as two coincident points on the hinge's axis."""
    spec = mujoco.MjSpec()
    spec.option.gravity = robot.gravity
    spec.option.timestep = 0.002
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    spec.compiler.balanceinertia = True
    bodies = {None: spec.worldbody}
    remaining = list(robot.links)
    while remaining:
        link = next(link for link in remaining if link.parent in bodies)
        remaining.remove(link)
        body = bodies[link.parent].add_body(name=link.name, pos=link.before.p, quat=quaternion(link.before.R))
        kind = (
            mujoco.mjtJoint.mjJNT_SLIDE if isinstance(link.joint, Prismatic) else mujoco.mjtJoint.mjJNT_HINGE
        )
        body.add_joint(name=link.name, type=kind, axis=link.joint.axis)
        body.mass, body.ipos = link.mass, link.r
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = link.inertia
        body.fullinertia = [xx or 1e-6, yy or 1e-6, zz or 1e-6, xy, xz, yz]
        body.explicitinertial = True
        bodies[link.name] = body
    for closure in robot.constraints:
        assert isinstance(closure, RevoluteClosure)
        for k, z in enumerate((0.0, 0.1)):
            sites = []
            for end in (closure.first, closure.second):
                name = f"{closure.name} {end.link} {k}"
                bodies[end.link].add_site(name=name, pos=end.pose.apply((0.0, 0.0, z)))
                sites.append(name)
            equality = spec.add_equality(
                type=mujoco.mjtEq.mjEQ_CONNECT,
                name1=sites[0],
                name2=sites[1],
                objtype=mujoco.mjtObj.mjOBJ_SITE,
            )
            equality.solimp = [0.9999, 0.9999, 0.001, 0.5, 2]
            equality.solref = [0.004, 1]
    return spec.compile()


def quaternion(R: np.ndarray) -> np.ndarray:
    result = np.empty(4)
    mujoco.mju_mat2Quat(result, np.ascontiguousarray(R).ravel())
    return result


def theirs(robot: Robot, q: np.ndarray, qd: np.ndarray) -> tuple[float, float, float]:
    model = mujoco_model(robot)
    data = mujoco.MjData(model)
    names = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, k) for k in range(model.njnt)]
    order = [names.index(name) for name in robot.joint_names]
    steps = round(STOP_TIME / model.opt.timestep)

    def run() -> None:
        mujoco.mj_resetData(model, data)
        data.qpos[order], data.qvel[order] = q, qd
        mujoco.mj_step(model, data, steps)

    seconds = best(run)
    end = np.array(data.qpos[order])
    settings = {"stop_time": STOP_TIME, "sample_time": 0.1, "rtol": 1e-11, "atol": 1e-13}
    exact = ab.simulate(diagram(robot, q, qd), **settings)["plant/q"][-1]
    error = np.abs(tips(robot, end) - tips(robot, exact)).max()
    gap = np.abs(Mechanism(robot).residuals(end)).max()
    return 1e3 * seconds / STOP_TIME, float(error), float(gap)


def main() -> None:
    print("| mechanism | MuJoCo, ms/s | error, m | gap | armblocks, ms/s | error, m | gap | factor |")
    print("|---|---|---|---|---|---|---|---|")
    for name, (build, speeds) in CASES.items():
        robot = build()
        locked = robot.joint_names[:1] if any(speeds) else ()
        start = ab.Arm(robot).assemble(qd=speeds, locked=locked)
        t1, e1, g1 = theirs(robot, start.q, start.qd)
        t2, e2, g2 = ours(robot, start.q, start.qd)
        row = (f"{t1:.2f}", f"{e1:.0e}", f"{g1:.0e}", f"{t2:.3f}", f"{e2:.0e}", f"{g2:.0e}", f"{t1 / t2:.0f}")
        print(f"| {name} | " + " | ".join(row) + " |")


if __name__ == "__main__":
    main()

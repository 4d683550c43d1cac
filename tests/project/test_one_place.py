"""A block, joint type, solver or file format is added in one file, and all parts of the product use it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BLOCK = '''"""Blocks that double."""

from dataclasses import dataclass
from typing import ClassVar

from armblocks.diagram import Block, Port
from armblocks.diagram.signs import FaceSign, Words


@dataclass(frozen=True, kw_only=True)
class Doubled(Block):
    """Twice the input: y = 2 u."""

    title: ClassVar[str] = "Doubled"
    sign: ClassVar[FaceSign] = Words("2 u")

    def input_ports(self):
        return (Port("u", "input"),)

    def output_ports(self):
        return (Port("y", "twice the input"),)

    def output_shapes(self, inputs):
        return {"y": inputs["u"]}

    def outputs(self, t, x, u, p):
        return {"y": 2.0 * u["u"]}
'''
USE = """
import armblocks as ab
from armblocks.blocks import BLOCKS, Clock, Doubled
from armblocks.studio.sheet.drawing_data import library

assert BLOCKS.family_of(Doubled) == "maths"
builder = ab.DiagramBuilder("made")
builder.add("twice", Doubled(), builder.add("clock", Clock()))
diagram = builder.build()
ab.save_diagram(diagram, "made.json")
assert ab.load_diagram("made.json") == diagram
assert "Doubled()" in ab.to_python(diagram)
assert ab.simulate(diagram, stop_time=1.0)["twice/y"][-1] == 2.0
assert "2 u" in ab.draw_diagram(diagram, "made.svg").read_text(encoding="utf-8")
assert "Doubled" in [kind.type for kind in library()]
"""


JOINT = '''"""The telescopic ball joint."""

from dataclasses import dataclass
from typing import ClassVar

from armblocks.robot.joints.joint import Joint
from armblocks.robot.joints.motions import AxisMotion, BallMotion


@dataclass(frozen=True, kw_only=True)
class Telescope(Joint):
    """Any rotation about a point, then a translation along the axis."""

    letter: ClassVar[str] = "T"
    parameters: ClassVar[tuple[str, ...]] = ("axis",)

    @property
    def motions(self):
        return BallMotion(), AxisMotion(axis=self.axis, linear=1.0, name="stroke")
'''
USE_OF_JOINT = """
import numpy as np

import armblocks as ab
from armblocks.robot import JOINT_TYPES
from armblocks.robot.joints.telescope import Telescope

assert Telescope in JOINT_TYPES
body = ab.Link(name="tube", joint=Telescope(axis=(1, 0, 0)), mass=2.0, inertia=(0.1, 0.2, 0.3))
ab.save_robot(ab.Robot(name="made", links=[body]), "made.json")
arm = ab.load_robot("made.json")
assert type(arm.robot.links[0].joint) is Telescope
assert [entry.name for entry in arm.robot.speeds] == ["tube.wx", "tube.wy", "tube.wz", "tube.stroke"]
q = np.array([1.0, 0.0, 0.0, 1.0, 0.5])  # a quarter turn about z, and 0.5 m along the rotated x axis
assert np.allclose(arm.fkine(q)[:3, 3], [0.0, 0.5, 0.0])
# Moments of inertia about the centre of the ball; gravity has a moment about one axis of the ball only.
assert np.allclose(arm.inertia(q), np.diag([0.1, 0.2 + 0.5, 0.3 + 0.5, 2.0]))
assert np.allclose(arm.gravload(q), [0.0, -2.0 * 9.81 * 0.5, 0.0, 0.0])
assert np.allclose(arm.difference(q, arm.integrate(q, np.ones(4), 0.5)), 0.5)
"""
CLOSURE = '''"""Parallel axes."""

from dataclasses import dataclass
from typing import ClassVar

from armblocks.robot.constraints.constraint import Closure
from armblocks.robot.constraints.relations import Z_AXES_PARALLEL


@dataclass(frozen=True, kw_only=True)
class ParallelAxes(Closure):
    """The z axes of the frames are parallel."""

    title: ClassVar[str] = "parallel axes"

    @property
    def relations(self):
        return Z_AXES_PARALLEL
'''
USE_OF_CLOSURE = """
import numpy as np

import armblocks as ab
from armblocks.robot import CONSTRAINT_TYPES
from armblocks.robot.constraints.parallel_axes import ParallelAxes

assert ParallelAxes in CONSTRAINT_TYPES
links = [
    ab.Link(name=name, parent=parent, joint=ab.Revolute(axis=(0, 1, 0)), mass=1.0, inertia=(1, 1, 1))
    for name, parent in (("arm", None), ("hand", "arm"))
]
level = ParallelAxes(name="level", first=ab.Attachment(), second=ab.Attachment(link="hand"))
ab.save_robot(ab.Robot(name="made", links=links, constraints=[level]), "made.json")
arm = ab.load_robot("made.json")
state = arm.assemble([0.3, 0.1], [1.0, 0.0], locked=("arm",))
assert state.degrees_of_freedom == 1 and state.redundant == {"level": 1}
assert np.allclose(state.q, [0.3, -0.3]) and np.allclose(state.qd, [1.0, -1.0])
# The hand does not rotate: only the inertia of the arm remains.
assert np.allclose(arm.accel(state.q, [0, 0], [2.0, 0.0]), [2.0, -2.0])
"""
SOLVER = '''"""Ralston's method."""

from armblocks.integration.butcher_tableau import ButcherTableau, hermite_dense

RALSTON = ButcherTableau(
    name="ralston",
    title="Ralston",
    source="Ralston 1962",
    order=2,
    dense_order=2,
    nodes=(0.0, 2 / 3),
    matrix=((), (2 / 3,)),
    weights=(1 / 4, 3 / 4),
    dense=hermite_dense((1 / 4, 3 / 4)),
)
'''
USE_OF_SOLVER = """
import math

import armblocks as ab
from armblocks.blocks import Gain, Integrator
from armblocks.studio.runs.settings import solver_choices

builder = ab.DiagramBuilder("decay")
x = builder.add("x", Integrator(initial=1.0))
builder.connect(builder.add("rate", Gain(gain=-1.0), x), x["u"])
end = [ab.simulate(builder.build(), stop_time=1.0, solver="Ralston", step=h)["x"][-1] for h in (0.02, 0.01)]
assert 3.9 < (end[0] - math.exp(-1.0)) / (end[1] - math.exp(-1.0)) < 4.1
assert "ralston" in [choice.name for choice in solver_choices()]
"""
FORMAT = '''"""D-H tables as lines ``theta d a alpha``."""

from armblocks.formats.robot_format import RobotFormat
from armblocks.robot import Robot, serial_chain, standard_dh


def _read(data, name):
    rows = [line.split() for line in data.decode().splitlines()]
    links = [
        standard_dh(f"link{k}", d=float(d), a=float(a), alpha=float(alpha))
        for k, (_, d, a, alpha) in enumerate(rows, 1)
    ]
    return {"arm": Robot(name="arm", links=serial_chain(links))}


TABLE = RobotFormat(name="D-H table", suffixes=(".dh",), max_bytes=10_000, read=_read)
'''
USE_OF_FORMAT = """
from pathlib import Path

import armblocks as ab
from armblocks.studio.documents.project_folder import READABLE

Path("made.dh").write_text("0 0.3 0.5 0\\n0 0 0.4 0\\n")
arm = ab.load_robot("made.dh")
assert [round(float(v), 12) for v in arm.fkine([0.0, 0.0])[:3, 3]] == [0.9, 0.0, 0.3]
assert ".dh" in READABLE
"""


@pytest.mark.parametrize(
    ("place", "file", "use"),
    [
        ("blocks/maths/doubled.py", BLOCK, USE),
        ("robot/joints/telescope.py", JOINT, USE_OF_JOINT),
        ("robot/constraints/parallel_axes.py", CLOSURE, USE_OF_CLOSURE),
        ("simulation/methods/ralston.py", SOLVER, USE_OF_SOLVER),
        ("formats/robot_formats/dh_table.py", FORMAT, USE_OF_FORMAT),
    ],
    ids=["a block with a face", "a joint type", "a closure", "a solver", "a file format"],
)
def test_an_addition_in_one_file_is_available_everywhere(
    place: str, file: str, use: str, tmp_path: Path
) -> None:
    copy = tmp_path / "armblocks"
    shutil.copytree(ROOT / "src" / "armblocks", copy, ignore=shutil.ignore_patterns("web"))
    shutil.copytree(ROOT / "robots", copy / "shipped" / "robots")
    (copy / place).write_text(file, encoding="utf-8")
    run = subprocess.run(
        [sys.executable, "-c", use],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
    )
    assert run.returncode == 0, run.stderr

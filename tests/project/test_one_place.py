"""A newcomer adds a thing in one file, and all parts of the product know it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

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
        return (Port("u", "what is doubled"),)

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
from armblocks.studio.sheet.shown import library

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


def test_a_block_with_a_face_is_one_file(tmp_path: Path) -> None:
    copy = tmp_path / "armblocks"
    shutil.copytree(ROOT / "src" / "armblocks", copy, ignore=shutil.ignore_patterns("__pycache__", "web"))
    shutil.copytree(ROOT / "robots", copy / "shipped" / "robots")
    (copy / "blocks" / "maths" / "doubled.py").write_text(BLOCK, encoding="utf-8")
    run = subprocess.run(
        [sys.executable, "-c", USE],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
    )
    assert run.returncode == 0, run.stderr

"""The example of a pick-and-place cell runs, and its results are those of its description."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parents[2] / "examples" / "pick_and_place_cell" / "pick_and_place_cell.py"


def test_the_cell_is_planned_checked_and_sized(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sizing = runpy.run_path(str(EXAMPLE))["main"](tmp_path / "out", film=False)
    text = capsys.readouterr().out
    assert "cell arm: no contact" in text
    assert sizing.cycle_time == pytest.approx(2.357 + 0.3, abs=0.02)
    results = {(load.joint, load.drive.name): load.passes for load in sizing.loads}
    assert not results["upper_arm", "200 W 1:100"]  # the arm needs a larger motor there
    assert all(load is not None for load in sizing.suggested.values())
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {"motion.svg", "workspace.svg", "sizing"}

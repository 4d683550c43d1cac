"""Output, files and exit codes of ``armblocks size``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from typer.testing import Result

import armblocks as ab

Invoke = Callable[..., Result]

HEAD = "name,gear_ratio,stall_torque_nm,max_speed_rpm\n"


def size_arguments(folder: Path, *motors: str) -> tuple[str, ...]:
    """The command with a trajectory of 1 s and a catalogue of these motors, written to a folder."""
    path, catalogue = folder / "path.csv", folder / "motors.csv"
    ab.jtraj([0, 0], [1, -1], np.linspace(0, 1, 20)).save(path)
    catalogue.write_text(HEAD + "".join(f"{motor}\n" for motor in motors))
    return "size", "twolink", "--trajectory", str(path), "--motors", str(catalogue)


def test_size_compares_candidates_and_writes_a_report(invoke: Invoke, tmp_path: Path) -> None:
    arguments = size_arguments(tmp_path, "weak,20,0.01,3000", "strong,20,50,3000")
    result = invoke(*arguments, "--payload", "1", "--pause", "0.5", "--report", str(tmp_path / "out"))
    assert result.exit_code == 0, result.output
    assert "cycle time 1.5 s, 2400 cycles per hour, 4 candidates" in result.stdout
    assert result.stdout.count("FAIL") == 2 and result.stdout.count("pass") >= 2
    assert "report:" in result.stdout and (tmp_path / "out" / "sizing.html").is_file()


def test_size_exits_with_1_if_a_joint_has_no_drive(invoke: Invoke, tmp_path: Path) -> None:
    result = invoke(*size_arguments(tmp_path, "weak,20,0.01,3000"))
    assert result.exit_code == 1
    assert "no candidate passes" in result.stdout

"""Output, files and exit codes of ``armblocks size``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from typer.testing import Result

import armblocks as ab

Invoke = Callable[..., Result]

HEAD = "name,gear_ratio,stall_torque_nm,max_speed_rpm\n"


def test_size_compares_candidates_and_writes_a_report(invoke: Invoke, tmp_path: Path) -> None:
    ab.jtraj([0, 0], [1, -1], np.linspace(0, 1, 20)).save(tmp_path / "path.csv")
    (tmp_path / "motors.csv").write_text(HEAD + "weak,20,0.01,3000\nstrong,20,50,3000\n")
    arguments = (
        "size",
        "twolink",
        "--trajectory",
        tmp_path / "path.csv",
        "--motors",
        tmp_path / "motors.csv",
    )
    result = invoke(
        *map(str, arguments), "--payload", "1", "--pause", "0.5", "--report", str(tmp_path / "out")
    )
    assert result.exit_code == 0, result.output
    assert "cycle time 1.5 s, 2400 cycles per hour, 4 candidates" in result.stdout
    assert result.stdout.count("FAIL") == 2 and result.stdout.count("pass") >= 2
    assert "report:" in result.stdout and (tmp_path / "out" / "sizing.html").is_file()


def test_size_exits_with_1_if_a_joint_has_no_drive(invoke: Invoke, tmp_path: Path) -> None:
    ab.jtraj([0, 0], [1, -1], np.linspace(0, 1, 20)).save(tmp_path / "path.csv")
    (tmp_path / "motors.csv").write_text(HEAD + "weak,20,0.01,3000\n")
    arguments = (
        "size",
        "twolink",
        "--trajectory",
        tmp_path / "path.csv",
        "--motors",
        tmp_path / "motors.csv",
    )
    result = invoke(*map(str, arguments))
    assert result.exit_code == 1
    assert "no candidate passes" in result.stdout

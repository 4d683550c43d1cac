"""Output and files of each command."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import Result

import armblocks as ab
from armblocks.simulation.tableaux import TABLEAUX
from robots_for_tests import LAW_NAMES

Invoke = Callable[..., Result]
Spawn = Callable[..., "subprocess.CompletedProcess[str]"]


def test_help_names_every_command(invoke: Invoke) -> None:
    result = invoke("--help")
    assert result.exit_code == 0
    for command in ("run", "show", "list", "bench"):
        assert command in result.stdout


def test_without_a_command_the_help_is_shown(invoke: Invoke) -> None:
    assert "Usage" in invoke().output


def test_the_version_is_that_of_the_package(spawn: Spawn) -> None:
    from importlib.metadata import version

    completed = spawn("--version")
    assert (completed.returncode, completed.stdout.strip()) == (0, f"armblocks {version('armblocks')}")


@pytest.mark.parametrize("robot", (*LAW_NAMES, "jaco", "kr40_pa", "ur5e"))
def test_show_prints_every_shipped_robot(robot: str, invoke: Invoke) -> None:
    result = invoke("show", robot)
    assert result.exit_code == 0
    described = ab.load_robot(robot).robot
    assert f"{described.n} axis, {described.joint_letters}" in result.stdout
    assert "grav = " in result.stdout
    assert max(len(line) for line in result.stdout.splitlines()) <= 80


def test_show_prints_the_table_of_the_toolbox(invoke: Invoke) -> None:
    text = invoke("show", "kr180").stdout
    assert "KR180 (4 axis, RRRR, stdDH)" in text
    assert " KUKA Robotics; params of 8/95;" in text
    assert "| joint |    theta |        d |        a |    alpha |   offset |" in text
    assert "| link1 |         q|      0.75|      0.35|     1.571|         0|" in text


def test_show_warns_about_links_with_a_physically_impossible_inertia(invoke: Invoke) -> None:
    result = invoke("show", "kr180")
    warned = [line for line in result.stderr.splitlines() if line.startswith("warning:")]
    names = [link.name for link in ab.load_robot("kr180").robot.links]
    assert [name for name in names if any(f"'{name}'" in line for line in warned)] == [names[0], names[2]]


NAMES = {
    "robots": ab.list_robots,
    "blocks": ab.list_blocks,
    "examples": ab.list_examples,
    "libraries": lambda: (*ab.list_libraries(), "JointServo"),
    "solvers": lambda: [tableau.name for tableau in TABLEAUX],
}


@pytest.mark.parametrize("kind", NAMES)
def test_list_prints_all_names_of_a_category(kind: str, invoke: Invoke) -> None:
    result = invoke("list", kind)
    assert result.exit_code == 0
    assert set(NAMES[kind]()) <= set(result.stdout.split())


COMPLETIONS = {
    "run kr180mo": ["kr180model"],
    "show joint_": ["joint_servos"],
    "bench --robot twol": ["twolink"],
    "trim mo": ["models/", "motor.json"],
    "diff falling_pendulum models/a": ["models/arm.json"],
    "studio nowhere/a": [],
    "lin": ["linearize", "lint"],
}
COMPLETION_SCRIPT = """
import contextlib, io, json, os, sys
from armblocks.cli.main import app

found = {}
for typed in json.loads(sys.argv[1]):
    os.environ |= {"COMP_WORDS": f"armblocks {typed}", "COMP_CWORD": str(len(typed.split()))}
    text = io.StringIO()
    with contextlib.redirect_stdout(text), contextlib.suppress(SystemExit):
        app(prog_name="armblocks")
    found[typed] = text.getvalue().split()
print(json.dumps([found, sorted({"numpy", "casadi"} & set(sys.modules))]))
"""


def test_the_shell_completes_names_and_files_without_a_heavy_import(tmp_path: Path) -> None:
    (tmp_path / "models").mkdir()
    for name in ("motor.json", "model.txt", "models/arm.json"):
        (tmp_path / name).touch()
    completed = subprocess.run(
        [sys.executable, "-c", COMPLETION_SCRIPT, json.dumps(list(COMPLETIONS))],
        env={**os.environ, "_ARMBLOCKS_COMPLETE": "complete_bash"},
        cwd=tmp_path,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )
    assert json.loads(completed.stdout or "0") == [COMPLETIONS, []], completed.stderr


def test_bench_prints_a_time_for_every_method(invoke: Invoke) -> None:
    result = invoke("bench", "--robot", "twolink", "--samples", "64", "--threads", "2")
    assert result.exit_code == 0
    for method in ("fkine", "jacob0", "inertia", "rne", "accel"):
        row = next(line.split() for line in result.stdout.splitlines() if line.startswith(method))
        assert all(float(cell.replace(",", "")) >= 0 for cell in row[1:])


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> tuple["subprocess.CompletedProcess[str]", Path]:
    """A report made by ``armblocks run`` in a separate process, as a user runs it."""
    import sys

    folder = tmp_path_factory.mktemp("run")
    completed = subprocess.run(
        [sys.executable, "-m", "armblocks", "run", "kr180model", "--format", "npz", "--format", "mat"],
        cwd=folder,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=300,
    )
    return completed, folder / "kr180model-report"


def test_run_prints_where_the_report_is(
    report: tuple["subprocess.CompletedProcess[str]", Path],
) -> None:
    completed, folder = report
    assert completed.returncode == 0, completed.stderr
    assert "kr180model-report" in completed.stdout
    assert (folder / "report.html").is_file()


def test_run_prints_the_final_tool_position(report: tuple["subprocess.CompletedProcess[str]", Path]) -> None:
    # The paper's last position, to the printed digits.
    assert "-2.94927874" in report[0].stdout
    assert "2.34792904" in report[0].stdout


def test_run_writes_data_that_python_reads_back(
    report: tuple["subprocess.CompletedProcess[str]", Path],
) -> None:
    saved = {path.suffix for path in report[1].iterdir()}
    assert {".csv", ".parquet", ".npz", ".mat"} <= saved
    (archive,) = report[1].glob("*.npz")
    with np.load(archive, allow_pickle=False) as data:
        assert data["time"][-1] == 10.0


def test_a_changed_parameter_changes_the_run(invoke: Invoke, tmp_path: Path) -> None:
    motion = next(
        name for name, block in ab.load_diagram("kr180model").blocks.items() if block.type_name() == "JTraj"
    )
    result = invoke(
        "run", "kr180model", "--no-figures", "--out", "short", "--stop-time", "2", "--set", f"{motion}.tmax=2"
    )
    assert result.exit_code == 0, result.output
    assert "-2.94927874" in result.stdout
    assert (tmp_path / "short" / "report.html").is_file()


def test_a_run_continues_from_a_saved_state_bit_for_bit(invoke: Invoke, tmp_path: Path) -> None:
    first = ("run", "falling_pendulum", "--stop-time", "4", "--sample-time", "0.01", "--no-figures")
    assert invoke(*first, "--save-state", "stopped.npz", "--out", "first").exit_code == 0
    second = ("run", "falling_pendulum", "--stop-time", "6", "--sample-time", "0.01", "--no-figures")
    assert invoke(*second, "--from-state", "stopped.npz", "--out", "second", "--format", "npz").exit_code == 0
    whole = ab.simulate("falling_pendulum", stop_time=6.0, sample_time=0.01)
    (archive,) = (tmp_path / "second").glob("*.npz")
    with np.load(archive, allow_pickle=False) as data:
        assert data["time"][0] == 4.0
        for name in whole.names:
            np.testing.assert_array_equal(data[name][1:], whole[name][whole.time > 4.0])


def test_a_file_that_is_not_a_saved_state_is_refused(invoke: Invoke, tmp_path: Path) -> None:
    (tmp_path / "other.npz").write_bytes(b"not a state")
    result = invoke("run", "falling_pendulum", "--from-state", "other.npz", "--no-figures")
    assert result.exit_code == 2
    assert "other.npz" in result.stderr


def test_a_joint_that_exceeds_a_limit_is_marked(invoke: Invoke) -> None:
    motion = next(
        name for name, block in ab.load_diagram("kr180model").blocks.items() if block.type_name() == "JTraj"
    )
    result = invoke("run", "kr180model", "--no-figures", "--set", f"{motion}.qf=[3.5 0 1.57 0]")
    assert result.exit_code == 0
    assert "! joint 'link1' leaves its range" in result.stdout


def test_a_run_logs_the_chosen_signals_while_it_runs(
    invoke: Invoke, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import pyarrow.parquet as pq

    monkeypatch.chdir(tmp_path)
    arguments = ["run", "van_der_pol_pid", "--stop-time", "5", "--log", "all.parquet", "--no-figures"]
    result = invoke(*arguments, "--log-signals", "x1, x2")
    assert result.exit_code == 0, result.output
    assert pq.read_table("all.parquet").column_names == ["time", "x1/y", "x2/y"]
    assert "all 101 rows: all.parquet" in result.output


def test_run_writes_a_film(invoke: Callable[..., Result], refusal: Callable[..., str]) -> None:
    result = invoke(
        "run", "kr180model", "--stop-time", "0.1", "--no-figures", "--film", "run.gif", "--out", "report"
    )
    assert result.exit_code == 0, result.output
    assert "video: run.gif" in result.output and Path("run.gif").read_bytes().startswith(b"GIF89a")
    assert "no format of videos named '.avi'" in refusal("run", "kr180model", "--film", "run.avi")

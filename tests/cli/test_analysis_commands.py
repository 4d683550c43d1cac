"""Output and files of ``armblocks linearize`` and ``armblocks trim``."""

import json
import shlex
from collections.abc import Callable
from pathlib import Path

from typer.testing import Result

Invoke = Callable[..., Result]


def test_linearize_prints_the_margins_of_a_loop_and_writes_figures(invoke: Invoke, tmp_path: Path) -> None:
    result = invoke(
        "linearize", "van_der_pol_pid", "--input", "PID", "--output", "PID", "--open", "PID",
        "--report", "figures", "--save", "loop.json",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    for words in (
        "van_der_pol_pid at 0 s: continuous, 4 states",
        "phase",
        "16.18 deg",
        "closed loop: stable",
    ):
        assert words in result.stdout
    assert (tmp_path / "figures" / "nyquist.png").is_file()
    saved = json.loads((tmp_path / "loop.json").read_text())
    assert saved["states"] == ["PID/integral", "PID/filter", "x1/x", "x2/x"]


def test_linearize_prints_gain_bandwidth_and_zeros_of_a_channel(invoke: Invoke) -> None:
    result = invoke("linearize", "van_der_pol_pid", "--input", "PID", "--output", "x1", "--hertz", "--trim")
    assert result.exit_code == 0, result.output
    assert "frequency, Hz" in result.stdout
    assert "zeros: 0, -100" in result.stdout


def test_trim_saves_an_operating_point_from_which_a_run_starts(invoke: Invoke, tmp_path: Path) -> None:
    result = invoke("trim", "falling_pendulum", "--guess", "pendulum/q=-1.2", "--save", "rest.npz")
    assert result.exit_code == 0, result.output
    assert "at rest" in result.stdout
    assert "-1.57079633" in result.stdout
    assert (tmp_path / "rest.npz").is_file()
    again = invoke("run", "falling_pendulum", "--from-state", "rest.npz", "--stop-time", "1", "--no-figures")
    assert again.exit_code == 0, again.output


def test_trim_without_options_lists_the_possible_options_when_it_finds_no_point(invoke: Invoke) -> None:
    result = invoke("trim", "falling_pendulum")
    assert result.exit_code == 2
    assert "no operating point was found" in result.stderr
    for words in ("states, for --fix", "pendulum/qd", "parameters, for --free", "signals, for --output"):
        assert words in result.stdout
    lines = [line.strip() for line in result.stdout.splitlines() if line.startswith("  armblocks trim")]
    assert len(lines) == 2
    for line in lines:  # the proposed commands work
        assert "at rest" in invoke(*shlex.split(line)[1:]).stdout
    listed = invoke("trim", "falling_pendulum", "--names")
    assert listed.exit_code == 0
    assert listed.stdout == result.stdout


def test_trim_of_a_diagram_without_states_says_that_there_are_none(invoke: Invoke) -> None:
    result = invoke("trim", "kr180model")
    assert result.exit_code == 0
    assert "There are no states" in result.stdout
    assert "--free jtraj.q0 --output rne/tau=0.5" in result.stdout


def test_unreadable_or_unknown_options_are_refused(refusal: Callable[..., str]) -> None:
    assert "--free is given without --trim" in refusal("linearize", "falling_pendulum", "--free", "a.b")
    assert "is not of the form NAME=VALUE" in refusal("trim", "falling_pendulum", "--fix", "q")
    assert "'up' is not a number" in refusal("trim", "falling_pendulum", "--fix", "pendulum/q=up")
    assert "the bounds of 'pendulum/q' have 1 number" in refusal(
        "trim", "falling_pendulum", "--bound", "pendulum/q=1"
    )
    assert "no operating point was found" in refusal("trim", "falling_pendulum")
    assert "there is no block named 'nothing'" in refusal(
        "linearize", "falling_pendulum", "--input", "nothing"
    )

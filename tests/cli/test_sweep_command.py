"""``armblocks sweep``: the table, the terminal, and messages of invalid options."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import Result

Invoke = Callable[..., Result]
SHORT = ("--stop-time", "2", "--sample-time", "0.1")


def test_a_sweep_writes_a_table_and_prints_its_measures(invoke: Invoke, tmp_path: Path) -> None:
    arguments = ("sweep", "van_der_pol_pid", "--vary", "PID.P=1:3:3", "--vary", "x1.initial=0,0.5")
    arguments += ("--measure", "top=peak(x1/y)", "--measure", "iae({reference/y} - {x1/y})", "--out", "t.csv")
    result = invoke(*arguments, *SHORT, columns=120)
    assert result.exit_code == 0, result.output
    assert "van_der_pol_pid: 6 runs" in result.stdout
    assert "top" in result.stdout and "iae({reference/y} - {x1/y})" in result.stdout
    lines = (tmp_path / "t.csv").read_text().splitlines()
    assert len(lines) == 7 and '"PID.P","x1.initial"' in lines[0]
    again = invoke(*arguments, *SHORT, columns=120)
    assert again.exit_code == 0 and again.stdout == result.stdout
    reported = invoke(*arguments, *SHORT, "--report", "pages", columns=120)
    assert reported.exit_code == 0 and "report: pages/report.html" in reported.stdout
    assert "6 runs" in (tmp_path / "pages" / "report.html").read_text()


def test_distributions_and_runs_that_do_not_complete(invoke: Invoke) -> None:
    arguments = ("sweep", "van_der_pol_pid", "--vary", "PID.P=loguniform(1, 10)", "--runs", "3")
    result = invoke(*arguments, "--design", "halton", "--max-steps", "2", *SHORT)
    assert result.exit_code == 0, result.output
    assert "step limit: 3 runs; run 0: not finished after 2 steps" in result.stdout


def test_each_name_occurs_once(refusal: Callable[..., str]) -> None:
    once = ("sweep", "van_der_pol_pid", "--vary", "PID.P=1,2")
    assert "'PID.P' occurs twice" in refusal(*once, "--vary", "PID.P=3")
    measures = ("--measure", "a=peak(x1/y)", "--measure", "a=rms(x1/y)")
    assert "'a' occurs twice" in refusal(*once, *measures)


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ("PID.P", "'PID.P' is not of the form block.parameter=values"),
        ("PID.P=0:1:1.5", "the number of values is 1.5"),
        ("PID.P=0:1:inf", "the number of values is inf"),
        ("PID.P=geomspace(1,10,2.5)", "the number of values is 2.5"),
        ("PID.P=seeds(1.5)", "the first seed is 1.5"),
        ("PID.P=uniform(a,1)", "'a' is not a number"),
        ("PID.P=1,", "--vary PID.P"),
        ("PID.Z=1,2", "Z"),
    ],
)
def test_messages_of_invalid_options(refusal: Callable[..., str], option: str, message: str) -> None:
    assert message in refusal("sweep", "van_der_pol_pid", "--vary", option)

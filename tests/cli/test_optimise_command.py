"""``armblocks optimise``: tables, files and exit codes."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

import armblocks as ab
from armblocks.cli.main import app
from armblocks.cli.progress import SearchProgress
from armblocks.cli.terminal import messages_console

BASE = ["optimise", "van_der_pol_pid", "--stop-time", "2", "--minimise", "iae({reference/y} - {x1/y})"]


def run(*arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(app, [*BASE, *arguments], env={"COLUMNS": "200"})
    return result.exit_code, result.output


def test_variables_constraints_and_files(tmp_path: Path) -> None:
    saved, figure = tmp_path / "best.json", tmp_path / "history.svg"
    arguments = ["--vary", "PID.P=loguniform(0.5,20)", "--subject-to", "{PID.P} >= 19"]
    code, text = run(*arguments, "--save", str(saved), "--plot", str(figure))
    assert code == 0, text
    for word in ("PID.P", "{PID.P} >= 19", " active ", "multiplier", "method 'gradient'", "diagram:"):
        assert word in text
    found = ab.load_diagram(saved)
    assert ab.simulate(found, stop_time=0.1).parameters["PID.P"] == pytest.approx(19.0, rel=1e-4)
    assert figure.stat().st_size > 1000


def test_scenarios_and_a_search_that_ends_early() -> None:
    arguments = ["--vary", "PID.P=0.5:20", "--over", "damping.gain=0.2,0.8", "--statistic", "0.5"]
    code, text = run(*arguments, "--evaluations", "12")
    assert (
        code == 1 and "the number of evaluations is reached" in text and "quantile 0.5 of 2 scenarios" in text
    )
    code, text = run("--vary", "PID.P=0.5:20", "--over", "damping.gain=0.2,0.8", "--statistic", "worst")
    assert code in (0, 1) and "the largest objective of 2 scenarios" in text


def test_invalid_options_name_the_option() -> None:
    for option, words in (
        (("--vary", "PID.P=3"), "is not of the form block.parameter=low:high"),
        (("--vary", "PID.P=1:2", "--vary", "PID.P=1:3"), "occurs twice"),
        (("--vary", "PID.P=1:2", "--over", "x1.initial"), "--over"),
        (("--vary", "PID.P=1:2", "--method", "newton"), "no method named"),
    ):
        code, text = run(*option)
        assert code == 2 and words in text


def test_progress_names_the_least_objective(capsys: pytest.CaptureFixture[str]) -> None:
    with SearchProgress("model", messages_console()) as progress:
        progress._next_line = 0.0
        progress(3, float("nan"))
        progress._next_line = 0.0
        progress(4, 1.5)
    text = capsys.readouterr().err
    assert "evaluation 3, no valid point" in text and "evaluation 4, smallest objective 1.5" in text

"""Bad input to the command line: messages with error, place, allowed values and a fix; exit code 2."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import Result

from interruptible import killed_at_the_end, start_interruptible

Refusal = Callable[..., str]
Write = Callable[..., str]

SCOPE = {"scope": ("Scope", {"inputs": 1})}


def test_an_unknown_model_is_refused_with_the_nearest_name(refusal: Refusal) -> None:
    assert "did you mean 'kr180model'?" in refusal("run", "kr180modle")


def test_an_unknown_robot_is_refused_with_the_nearest_name(refusal: Refusal) -> None:
    text = refusal("show", "puma650")
    assert "there is no" in text
    assert "did you mean 'puma560'?" in text


def test_a_missing_file_is_named(refusal: Refusal) -> None:
    assert "nowhere.json" in refusal("run", "nowhere.json")


def test_a_file_that_is_not_json_is_named(refusal: Refusal, tmp_path: Path) -> None:
    (tmp_path / "broken.json").write_text("{", encoding="utf-8")
    assert "broken.json" in refusal("run", "broken.json")


def test_an_unknown_command_is_refused(refusal: Refusal) -> None:
    assert "No such command" in refusal("simulate")


def test_an_unknown_solver_is_refused_with_the_nearest_name(refusal: Refusal, write_diagram: Write) -> None:
    path = write_diagram({"i": ("Integrator", {}), "c": ("Constant", {"value": 1.0})}, "c/y -> i/u")
    assert "did you mean 'heun'?" in refusal("run", path, "--solver", "huen")


@pytest.mark.parametrize("time", ["-1", "nan", "inf"])
def test_a_negative_or_infinite_stop_time_is_refused(time: str, refusal: Refusal) -> None:
    text = refusal("run", "kr180model", f"--stop-time={time}")
    assert "stop_time is" in text
    assert "a finite time in s, 0 or more" in text
    assert "give another stop_time" in text


@pytest.mark.parametrize(
    "option", ["--step=0", "--step=-1", "--step=nan", "--rtol=0", "--rtol=nan", "--atol=-1"]
)
def test_bad_settings_of_the_solver_are_refused(option: str, refusal: Refusal, write_diagram: Write) -> None:
    path = write_diagram({"i": ("Integrator", {}), "c": ("Constant", {"value": 1.0})}, "c/y -> i/u")
    assert option[2:].split("=")[0] in refusal("run", path, option)


def test_a_stop_time_that_is_not_a_number_is_refused(refusal: Refusal) -> None:
    assert "stop-time" in refusal("run", "kr180model", "--stop-time", "ten")


def test_an_assignment_without_a_block_is_refused_with_the_required_form(refusal: Refusal) -> None:
    assert "block.parameter=value" in refusal("run", "kr180model", "--set", "tmax=5")


def test_an_assignment_to_an_unknown_block_is_refused_with_the_nearest_name(refusal: Refusal) -> None:
    assert "did you mean 'jtraj'?" in refusal("run", "kr180model", "--set", "jtrja.tmax=5")


def test_an_assignment_to_an_unknown_parameter_is_refused_with_the_nearest_name(refusal: Refusal) -> None:
    assert "did you mean 'tmax'?" in refusal("run", "kr180model", "--set", "jtraj.tmxa=5")


@pytest.mark.parametrize("value", ["nan", "inf", "-1", "0", "[1 2]", "text"])
def test_an_assigned_value_of_the_wrong_kind_is_refused(value: str, refusal: Refusal) -> None:
    assert "tmax" in refusal("run", "kr180model", "--set", f"jtraj.tmax={value}")


def test_an_assigned_vector_of_the_wrong_length_is_refused(refusal: Refusal) -> None:
    assert "q0" in refusal("run", "kr180model", "--set", "jtraj.q0=[1 2 3]")


def test_python_code_as_a_value_is_refused(refusal: Refusal) -> None:
    text = refusal("run", "kr180model", "--set", "jtraj.tmax=__import__('os')")
    assert "no function named '__import__'" in text


def test_a_folder_that_cannot_be_created_is_refused_before_the_run(refusal: Refusal, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    text = refusal("run", "kr180model", "--out", "file/inside")
    assert "the folder cannot be written" in text
    assert "--out" in text


def test_two_drivers_of_an_input_are_refused(refusal: Refusal, write_diagram: Write) -> None:
    blocks = {"a": ("Constant", {"value": 1.0}), "b": ("Constant", {"value": 2.0}), "i": ("Integrator", {})}
    assert "two drivers" in refusal("run", write_diagram(blocks, "a/y -> i/u", "b/y -> i/u"))


def test_an_unconnected_input_is_refused(refusal: Refusal, write_diagram: Write) -> None:
    text = refusal("run", write_diagram({"i": ("Integrator", {})}))
    assert "i/u" in text or "'i'" in text
    assert "connect" in text


def test_mismatched_widths_are_refused(refusal: Refusal, write_diagram: Write) -> None:
    blocks = {
        "a": ("Constant", {"value": [1.0, 2.0]}),
        "b": ("Constant", {"value": [1.0, 2.0, 3.0]}),
        "sum": ("Sum", {"signs": "++"}),
        "end": ("Terminator", {}),
    }
    text = refusal("run", write_diagram(blocks, "a/y -> sum/u1", "b/y -> sum/u2", "sum/y -> end/u"))
    assert "sum" in text
    assert "2" in text
    assert "3" in text


def test_the_message_about_an_algebraic_loop_lists_its_signals(
    refusal: Refusal, write_diagram: Write
) -> None:
    blocks = {"first": ("Gain", {"gain": 2.0}), "second": ("Gain", {"gain": 0.5})}
    text = refusal("run", write_diagram(blocks, "first/y -> second/u", "second/y -> first/u"))
    assert "algebraic loop" in text
    assert "first" in text
    assert "second" in text


def test_an_unknown_block_type_is_refused_with_the_nearest_name(
    refusal: Refusal, write_diagram: Write
) -> None:
    assert "did you mean 'Constant'?" in refusal("run", write_diagram({"c": ("Constnat", {})}))


def test_the_message_about_an_infinite_signal_names_the_block_that_computed_it(
    refusal: Refusal, write_diagram: Write, tmp_path: Path
) -> None:
    # 1 / (t - 1) becomes infinite at t = 1; the blocks after it are not the cause.
    blocks = {
        "clock": ("Clock", {}),
        "one": ("Constant", {"value": 1.0}),
        "shift": ("Sum", {"signs": "+-"}),
        "quotient": ("Product", {"operators": "*/"}),
        "after": ("Gain", {"gain": 2.0}),
        "end": ("Terminator", {}),
    }
    wires = (
        "clock/y -> shift/u1",
        "one/y -> shift/u2",
        "one/y -> quotient/u1",
        "shift/y -> quotient/u2",
        "quotient/y -> after/u",
        "after/y -> end/u",
    )
    path = write_diagram(blocks, *wires, stop_time=2.0, sample_time=0.25)
    text = refusal("run", path, "--out", "kept", "--no-figures")
    assert "quotient" in text
    assert "1 s" in text or "t = 1" in text
    # The report has the samples before that time.
    assert (tmp_path / "kept" / "report.html").is_file()


ROBOT_SCRIPT = """L{{1}} = link([0 1 0 0 0], 'standard');
L{{1}}.m = {mass};
L{{1}}.r = [0 0 0];
L{{1}}.I = [1 1 1 0 0 0];
L{{1}}.Jm = {motor};
L{{1}}.G = {gear};
one = robot(L, 'one');
"""


@pytest.mark.parametrize(
    ("mass", "motor", "gear", "place"),
    [
        ("-1", "0", "1", "bad.m:2"),
        ("0/0", "0", "1", "bad.m:2"),
        ("1", "-1", "1", "bad.m:5"),
        ("1", "0", "0", "bad.m:6"),
    ],
)
def test_an_impossible_robot_is_refused_with_the_line_of_its_script(
    mass: str, motor: str, gear: str, place: str, refusal: Refusal, tmp_path: Path
) -> None:
    (tmp_path / "bad.m").write_text(ROBOT_SCRIPT.format(mass=mass, motor=motor, gear=gear), encoding="utf-8")
    assert f"where {place}" in refusal("show", "bad.m")


def test_unsupported_code_in_a_robot_script_is_refused_with_its_line(
    refusal: Refusal, tmp_path: Path
) -> None:
    (tmp_path / "odd.m").write_text("a = 1;\nsystem('rm -rf x');\n", encoding="utf-8")
    text = refusal("show", "odd.m")
    assert "odd.m:2" in text
    assert "system" in text


def test_debugging_shows_the_traceback(tmp_path: Path) -> None:
    completed = subprocess.run(
        [sys.executable, "-m", "armblocks", "show", "puma650"],
        cwd=tmp_path,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        env={**os.environ, "ARMBLOCKS_DEBUG": "1"},
    )
    assert completed.returncode == 1
    assert "Traceback" in completed.stderr
    assert "UnknownNameError" in completed.stderr


def test_without_debugging_a_process_shows_no_traceback(
    spawn: Callable[..., "subprocess.CompletedProcess[str]"],
) -> None:
    completed = spawn("show", "puma650")
    assert completed.returncode == 2
    assert completed.stdout == ""
    assert completed.stderr.startswith("error: ")
    assert "Traceback" not in completed.stderr


@pytest.mark.skipif(os.name == "nt", reason="a signal cannot be sent to a child alone on Windows")
def test_ctrl_c_keeps_the_computed_results_and_marks_them_as_incomplete(
    write_diagram: Write, tmp_path: Path
) -> None:
    # An oscillator for 10^11 steps: on any machine the signal arrives before the run ends.
    blocks = {"v": ("Integrator", {}), "x": ("Integrator", {"initial": 1.0}), "k": ("Gain", {"gain": -1.0})}
    path = write_diagram(
        blocks, "k/y -> v/u", "v/y -> x/u", "x/y -> k/u", stop_time=1e9, step=1e-2, sample_time=1e5
    )
    process = start_interruptible(
        [sys.executable, "-m", "armblocks", "run", path, "--solver", "rk4", "--out", "kept", "--no-figures"],
        cwd=tmp_path,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    with killed_at_the_end(process):
        assert process.stderr is not None
        assert "x real time" in process.stderr.readline()  # the first line of progress: the run is under way
        process.send_signal(signal.SIGINT)
        stdout, stderr = process.communicate(timeout=120)
    assert process.returncode == 130, stderr
    assert "Traceback" not in stderr
    assert "incomplete: stopped by Ctrl-C" in " ".join(stdout.split())
    assert (tmp_path / "kept" / "report.html").is_file()


def test_the_write_test_of_the_output_folder_leaves_no_file(
    invoke: Callable[..., Result], tmp_path: Path, write_diagram: Write
) -> None:
    path = write_diagram({"c": ("Constant", {"value": 1.0}), **SCOPE}, "c/y -> scope/u")
    assert invoke("run", path, "--out", "here", "--no-figures").exit_code == 0
    assert not [path for path in (tmp_path / "here").iterdir() if path.name.startswith(".")]

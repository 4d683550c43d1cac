"""``armblocks convert``: conversion to other formats; existing files are replaced only with ``--force``."""

import warnings
from collections.abc import Callable
from pathlib import Path

import pytest
from numpy.testing import assert_allclose
from typer.testing import Result

import armblocks as ab
from armblocks.errors import ArmblocksWarning

Invoke = Callable[..., Result]
SCRIPT = "L1 = link([0 1 0 0 0], 'standard');\nL{1} = L1;\narm = robot(L, 'one');\n"


def test_diagrams_robots_and_libraries_are_converted(invoke: Invoke, tmp_path: Path) -> None:
    result = invoke("convert", "van_der_pol_pid", "model.json")
    assert result.exit_code == 0, result.output
    assert result.stdout == "wrote model.json\n"
    diagram = ab.load_diagram(tmp_path / "model.json")
    assert diagram == ab.load_diagram("van_der_pol_pid")
    assert invoke("convert", "model.json", "model.py").exit_code == 0
    assert (tmp_path / "model.py").read_text(encoding="utf-8") == ab.to_python(diagram)
    assert invoke("convert", "joint_servos", "servos.json").exit_code == 0
    assert ab.load_library(tmp_path / "servos.json").keys() == ab.load_library("joint_servos").keys()
    (tmp_path / "arm.m").write_text(SCRIPT, encoding="utf-8")
    result = invoke("convert", "arm.m", "arm.json")
    assert result.exit_code == 0, result.output
    assert ab.load_robot(tmp_path / "arm.json").robot == ab.load_robot(tmp_path / "arm.m").robot


def test_an_existing_file_is_replaced_only_with_force(invoke: Invoke, tmp_path: Path) -> None:
    (tmp_path / "model.py").write_text("mine", encoding="utf-8")
    result = invoke("convert", "kr180model", "model.py")
    assert result.exit_code == 2
    assert "the file already exists" in result.stderr
    assert (tmp_path / "model.py").read_text(encoding="utf-8") == "mine"
    assert invoke("convert", "kr180model", "model.py", "--force").exit_code == 0
    assert "import armblocks" in (tmp_path / "model.py").read_text(encoding="utf-8")


def test_conversions_that_do_not_exist_are_refused(invoke: Invoke, tmp_path: Path) -> None:
    refusals = {
        ("kr180", "arm.py"): "a robot cannot be written as '.py'",
        ("kr180model", "model.txt"): "a diagram cannot be written as '.txt'",
        ("model.py", "model.json"): "a Python program is not converted, because it would have to be run",
        ("falling_pendulum", "model.py"): "neither shipped nor loaded from a file",
        ("kr181", "arm.json"): "no shipped robot, diagram or library named 'kr181'",
    }
    for arguments, words in refusals.items():
        result = invoke("convert", *arguments)
        assert result.exit_code == 2
        assert words in result.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", [".urdf", ".sdf", ".xml", ".mjcf", ".json"])
def test_save_robot_and_convert_write_every_format(invoke: Invoke, tmp_path: Path, suffix: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ArmblocksWarning)
        result = invoke("convert", "twolink", f"two{suffix}")
        assert result.exit_code == 0, result.output
        path = ab.save_robot(ab.load_robot("twolink"), tmp_path / f"again{suffix}")
        assert path.read_bytes() == (tmp_path / f"two{suffix}").read_bytes()
        arm = ab.load_robot(path)
    expected = ab.load_robot("twolink").fkine([0.3, 0.4])
    assert_allclose(arm.fkine([0.3, 0.4]), expected, atol=1e-12)

"""``armblocks lint`` for every format of robots, and the options of robot files."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import Result

from armblocks.formats import lint_robot
from armblocks.formats.file_findings import Rule
from armblocks.formats.mjcf.rules import MJCF_RULES
from armblocks.formats.robot_rules import LINT_RULES
from armblocks.formats.sdf.rules import SDF_RULES
from armblocks.formats.simscape.rules import SIMSCAPE_RULES
from armblocks.formats.urdf.rules import URDF_RULES

Invoke = Callable[..., Result]
DOCS = Path(__file__).resolve().parents[2] / "docs"
CLEAN = """<robot name="r">
<link name="base"/>
<joint name="j" type="revolute"><parent link="base"/><child link="arm"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<link name="arm"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>
</robot>"""


def test_a_file_without_findings_has_exit_code_0(invoke: Invoke, tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(CLEAN, encoding="utf-8")
    result = invoke("lint", "arm.urdf")
    assert result.exit_code == 0, result.output
    assert result.stdout == "arm.urdf: no findings\n"


def test_findings_are_printed_in_the_order_of_lines_with_rule_remedy_and_code(
    invoke: Invoke, tmp_path: Path
) -> None:
    text = CLEAN.replace('izz="1"', 'izz="5"').replace('effort="1"', 'effort="0"')
    (tmp_path / "arm.urdf").write_text(text, encoding="utf-8")
    result = invoke("lint", "arm.urdf")
    assert result.exit_code == 1
    assert "Traceback" not in result.output
    lines = [line for line in result.stdout.splitlines() if not line.startswith("  ")]
    assert lines[0].startswith("arm.urdf:4, joint 'j': the effort limit is 0")
    assert lines[0].endswith("[urdf-limit]")
    assert lines[1].startswith("arm.urdf:5, link 'arm': the greatest principal moment")
    assert lines[1].endswith("[robot-inertia]")
    assert lines[2] == "arm.urdf: 2 findings"
    assert "  allowed  lower < upper, effort and velocity above zero" in result.stdout
    assert "  fix      check the unit and the axes of the inertia" in result.stdout


def test_joints_that_move_no_mass_are_found(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    without_inertia = re.sub(r"<inertial>.*</inertial>", "", CLEAN)
    file.write_text(without_inertia, encoding="utf-8")
    (finding,) = lint_robot(file)
    assert finding.what == "no link that moves has a mass or an inertia: joint torques are zero"
    tail = """<link name="tip"/>
    <joint name="k" type="continuous"><parent link="arm"/><child link="tip"/></joint></robot>"""
    file.write_text(CLEAN.replace("</robot>", tail), encoding="utf-8")
    (finding,) = lint_robot(file)
    assert finding.what == "the joint moves no mass and no inertia: its acceleration is undefined"
    assert finding.element == "link 'tip'" and finding.line == 6


def test_robots_of_every_format_are_checked(invoke: Invoke, tmp_path: Path) -> None:
    result = invoke("lint", "puma560")
    assert result.exit_code == 1
    assert "[robot-inertia]" in result.stdout
    (tmp_path / "arm.m").write_text(
        "L{1} = link([0 1 0 0 0], 'standard');\nL{1}.qlim = [-180 180];\narm = robot(L, 'one');\n",
        encoding="utf-8",
    )
    result = invoke("lint", "arm.m")
    assert result.exit_code == 1
    assert "Is this in degrees?" in result.stdout and "[robot-units]" in result.stdout
    (tmp_path / "arm.m").write_text(
        "L{1} = link([0 1 0 0 0], 'standard');\nL{1}.m = 1;\nL{1}.B = -1;\narm = robot(L, 'one');\n",
        encoding="utf-8",
    )
    result = invoke("lint", "arm.m")
    assert "friction accelerates the joint" in result.stdout and "[robot-warning]" in result.stdout


def test_a_file_that_cannot_be_read_has_exit_code_2(invoke: Invoke, tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text("<robot>", encoding="utf-8")
    result = invoke("lint", "arm.urdf")
    assert result.exit_code == 2
    assert "this is not well-formed XML" in result.stderr


DAMAGED = CLEAN.replace("<limit", '<axis xyz="0 0 2"/><limit').replace('lower="-1"', 'lower="3"')


def test_fix_writes_a_corrected_copy_and_says_what_remains(invoke: Invoke, tmp_path: Path) -> None:
    file, copy = tmp_path / "arm.urdf", tmp_path / "arm.fixed.urdf"
    file.write_text(DAMAGED, encoding="utf-8")
    result = invoke("lint", "arm.urdf", "--fix")
    assert result.exit_code == 0, result.output
    assert result.stdout.splitlines() == [
        "arm.urdf:4, joint 'j': axis divided by its length 2 [urdf-axis]",
        "arm.urdf:4, joint 'j': limits exchanged: from 1 to 3 [urdf-limit]",
        "arm.fixed.urdf: 2 corrections, written",
        "arm.fixed.urdf: no remaining findings",
    ]
    assert file.read_text(encoding="utf-8") == DAMAGED
    assert lint_robot(copy) == ()
    result = invoke("lint", "arm.fixed.urdf", "--fix")
    assert result.exit_code == 0
    assert "arm.fixed.urdf: nothing to correct, no file written" in result.stdout
    file.write_text(DAMAGED.replace('izz="1"', 'izz="5"'), encoding="utf-8")
    result = invoke("lint", "arm.urdf", "--fix", "--force")
    assert result.exit_code == 1
    assert "arm.fixed.urdf:5, link 'arm': the greatest" in result.stdout
    assert "arm.fixed.urdf: 1 remaining finding\n" in result.stdout


def test_the_file_itself_is_replaced_only_in_place(invoke: Invoke, tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(DAMAGED, encoding="utf-8")
    refusals = {
        ("--fix", "--output", "arm.urdf"): "the copy would replace the file itself",
        ("--fix", "--output", "arm.json"): "the copy has the suffix '.json'",
        ("--fix", "--output", "b.urdf", "--in-place"): "both --output and --in-place are given",
        ("--output", "b.urdf"): "nothing is written without --fix",
    }
    for options, message in refusals.items():
        result = invoke("lint", "arm.urdf", *options)
        assert result.exit_code == 2 and message in result.stderr
    assert invoke("lint", "arm.urdf", "--fix", "--output", "b.urdf").exit_code == 0
    result = invoke("lint", "arm.urdf", "--fix", "--output", "b.urdf")
    assert result.exit_code == 2 and "the file already exists" in result.stderr
    assert file.read_text(encoding="utf-8") == DAMAGED
    assert invoke("lint", "arm.urdf", "--fix", "--in-place").exit_code == 0
    assert lint_robot(file) == ()


def test_show_and_convert_take_tip_packages_and_arguments(invoke: Invoke, tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(CLEAN, encoding="utf-8")
    result = invoke("show", "arm.urdf", "--tip", "base")
    assert result.exit_code == 0, result.output
    assert "r (1 axis, R)" in result.stdout
    assert invoke("convert", "arm.urdf", "arm.json", "--package", "a=/tmp").exit_code == 0
    assert (tmp_path / "arm.json").exists()
    result = invoke("show", "arm.urdf", "--argument", "prefix")
    assert result.exit_code == 2
    assert "'prefix' is not of the form NAME=VALUE" in result.stderr


@pytest.mark.parametrize(
    "rule", [*LINT_RULES, *URDF_RULES, *MJCF_RULES, *SDF_RULES, *SIMSCAPE_RULES], ids=lambda rule: rule.code
)
def test_every_code_is_documented(rule: Rule) -> None:
    assert f"`{rule.code}`" in (DOCS / "files.md").read_text(encoding="utf-8")

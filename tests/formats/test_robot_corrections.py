"""Corrected robot files load, have none of the corrected findings, and the same poses."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from urdf_trees import random_urdf

from armblocks.errors import FormatError
from armblocks.formats import CorrectedFile, correct_robot, lint_robot
from armblocks.formats.file_corrections import are_degrees
from armblocks.formats.file_findings import FileContext
from armblocks.formats.robot_files import load_robot_in
from armblocks.robot import Robot
from robots_for_tests import evaluate


def robot_of(path: Path) -> Robot:
    return load_robot_in(path, FileContext())


def corrected(path: Path) -> tuple[CorrectedFile, Path]:
    """The correction, and the file with it, which is again corrected without a change."""
    result = correct_robot(path)
    copy = path.with_name(f"copy{path.suffix}")
    copy.write_bytes(result.data)
    assert not correct_robot(copy).changes
    assert [finding.rule for finding in lint_robot(copy)] == [finding.rule for finding in result.remaining]
    return result, copy


def codes(result: CorrectedFile) -> list[str]:
    return [change.finding.rule.code for change in result.changes]


def damaged_urdf(seed: int) -> str:
    """A random tree with defects whose correction does not change its poses."""
    random = np.random.default_rng(seed)

    def axis(match: re.Match[str]) -> str:
        vector = np.array([float(word) for word in match[1].split()])
        return (
            f"<axis xyz = '{' '.join(map(repr, (vector * random.uniform(2, 9)).tolist()))}'/> <!-- axis -->"
        )

    text = re.sub(r'<axis xyz="([^"]*)"/>', axis, random_urdf(seed))
    limits = (
        '<limit lower="5" upper="-5" effort="100" velocity="0"/>',
        '<limit lower="180" upper="-180" effort="0" velocity="10"/>',
        '<limit lower="-90" upper="90.5" effort="100" velocity="10"/>',
        "",
    )
    text = re.sub(r"<limit [^>]*>", lambda _: str(random.choice(limits)), text)
    text = re.sub(r"(<inertial>.*?)<inertia [^>]*>", r"\1", text, count=int(random.integers(1, 4)))
    return text.replace('name="j5"', 'name="j6"')


@pytest.mark.parametrize("seed", range(6))
def test_a_corrected_urdf_file_has_no_corrected_finding_and_the_same_poses(seed: int, tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(damaged_urdf(seed), encoding="utf-8")
    before = lint_robot(path)
    result, copy = corrected(path)
    assert {"urdf-axis", "urdf-limit", "urdf-name"} <= {finding.rule.code for finding in before}
    changed = {(change.finding.rule.code, change.finding.element) for change in result.changes}
    assert changed
    assert not changed & {(finding.rule.code, finding.element) for finding in result.remaining}
    assert {finding.rule.code for finding in result.remaining} <= {
        "robot-inertia",
        "robot-mass-missing",
        "robot-units",
    }
    robot, again = robot_of(path), robot_of(copy)
    assert again.joint_names == robot.joint_names
    q = np.random.default_rng(seed).uniform(-2, 2, robot.n)
    assert_allclose(evaluate(again, "fkine", q), evaluate(robot, "fkine", q), rtol=0, atol=1e-12)
    assert_allclose(evaluate(again, "inertia", q), evaluate(robot, "inertia", q), rtol=1e-12, atol=1e-12)
    turning = np.array([entry.unit == "rad" for entry in again.positions])
    assert (np.nan_to_num(again.qlim[turning], posinf=0) <= 7).all()
    # Everything else is unchanged: comments, and the order of the elements.
    text = copy.read_text(encoding="utf-8")
    assert text.count("<!-- axis -->") == path.read_text(encoding="utf-8").count("<!-- axis -->") > 0
    assert re.findall(r"<link name=\"(\w+)", text) == re.findall(
        r"<link name=\"(\w+)", path.read_text("utf-8")
    )


URDF = """<?xml version="1.0" encoding="{encoding}"?>
<!-- <joint name="é"/> "quotes' and > signs -->
<robot name="é">
  <link name="base" note='a > b'/>
  <joint name="j" type="prismatic"><parent link="base"/><child link="arm"/>
    <axis xyz="0 0 2"/><origin xyz="0 0 1" rpy="90 0 -180"/></joint>
  <link name="arm"/>
  <link name="arm"/>
</robot>
"""


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "iso-8859-1"])
def test_angles_in_degrees_and_copies_of_links_are_corrected_in_every_encoding(
    encoding: str, tmp_path: Path
) -> None:
    path = tmp_path / "arm.urdf"
    path.write_bytes(URDF.format(encoding=encoding).encode(encoding))
    result, copy = corrected(path)
    assert codes(result) == ["urdf-limit-missing", "urdf-angle", "urdf-axis", "urdf-name"]
    text = copy.read_bytes().decode(encoding)
    assert text.startswith(f'<?xml version="1.0" encoding="{encoding}"?>\n<!-- <joint name="é"/>')
    assert text.count('<link name="arm"/>') == 1 and "<link name=\"base\" note='a > b'/>" in text
    assert f'rpy="{np.pi / 2!r} 0.0 {-np.pi!r}"' in text
    assert [finding.rule.code for finding in result.remaining] == ["robot-mass-missing"]
    assert_array_equal(robot_of(copy).links[1].joint.axis, (0.0, 0.0, 1.0))


SDF = """<sdf version="1.7"><model name="m">
  <link name="base"><inertial><mass>1</mass></inertial></link>
  <link name="arm"><pose>0 0 1 0 45 0</pose></link>
  <link name="hand"><inertial><mass>2</mass></inertial></link>
  <joint name="j" type="revolute"><parent>base</parent><child>arm</child>
    <axis><xyz>0 3 4</xyz><limit><lower>90</lower><upper>-90</upper><effort>0</effort></limit></axis></joint>
  <joint name="k" type="revolute"><parent>arm</parent><child>hand</child><axis><xyz>0 0 1</xyz></axis></joint>
</model></sdf>"""


def test_sdf_files_are_corrected(tmp_path: Path) -> None:
    path = tmp_path / "arm.sdf"
    path.write_text(SDF, encoding="utf-8")
    result, copy = corrected(path)
    assert codes(result) == [
        *("sdf-angle", "sdf-inertia-default"),
        *("sdf-axis", "sdf-limit", "sdf-limit", "sdf-limit", "robot-units", "robot-units"),
    ]
    assert not result.remaining
    text = copy.read_text(encoding="utf-8")
    assert "<xyz>0.0 0.6 0.8</xyz>" in text and "<effort>" not in text
    arm = robot_of(copy)
    assert_allclose(arm.qlim[0], (-np.pi / 2, np.pi / 2), rtol=1e-15)
    assert_allclose(arm.links[1].before.rpy, (0, np.pi / 4, 0), atol=1e-15)
    assert (arm.links[1].mass, arm.links[1].inertia[0][0]) == (1.0, 1.0)


MJCF = """<mujoco><compiler angle="radian" autolimits="true"/>
  <default><default class="d"><joint range="2 1"/></default></default>
  <worldbody><body name="a"><joint name="j" range="1 -2"/><geom size="0.1"/>
    <body name="b"><joint range="-90 90"/><geom size="0.1"/></body>
    <body name="c"><joint class="d"/><geom size="0.1"/></body></body></worldbody></mujoco>"""


def test_mjcf_files_are_corrected_but_not_their_default_classes(tmp_path: Path) -> None:
    path = tmp_path / "arm.xml"
    path.write_text(MJCF, encoding="utf-8")
    result, copy = corrected(path)
    assert codes(result) == ["mjcf-limit", "robot-units"]
    assert [finding.rule.code for finding in result.remaining] == ["mjcf-limit"]
    qlim = robot_of(copy).qlim
    assert_allclose(qlim[0], (-2, 1))
    assert (np.abs(qlim[1:3]).min(axis=1) == np.pi / 2).sum() == 1


def test_limits_in_degrees_of_a_json_file_are_marked(tmp_path: Path) -> None:
    path = tmp_path / "arm.json"
    link = '{"name": "a", "mass": 1, "inertia": {"zz": 0.1, "xx": 0.1}, "limits": {"position": [-180, 90]}}'
    text = f'{{"format": 1, "name": "r", "notes": "kept", "links": [{link}]}}'
    path.write_text(text, encoding="utf-8")
    result, copy = corrected(path)
    assert codes(result) == ["robot-units"]
    assert '"position": ["-180 deg", "90 deg"]' in copy.read_text() and '"notes": "kept"' in copy.read_text()
    assert_allclose(robot_of(copy).qlim, [[-np.pi, np.pi / 2]])


def test_files_of_other_formats_and_shipped_robots_are_not_corrected(tmp_path: Path) -> None:
    path = tmp_path / "arm.m"
    path.write_text(
        "L{1} = link([0 1 0 0 0], 'standard');\nL{1}.qlim = [-180 180];\narm = robot(L, 'one');\n"
    )
    result = correct_robot(path)
    assert not result.changes and len(result.remaining) == 2 and result.data == path.read_bytes()
    with pytest.raises(FormatError, match="'puma560' is a shipped robot"):
        correct_robot("puma560")


def test_findings_in_included_files_remain(tmp_path: Path) -> None:
    (tmp_path / "part.xml").write_text('<mujocoinclude><body><joint range="3 -2"/></body></mujocoinclude>')
    path = tmp_path / "arm.xml"
    path.write_text('<mujoco><worldbody><include file="part.xml"/></worldbody></mujoco>')
    result = correct_robot(path)
    assert not result.changes and "mjcf-limit" in [finding.rule.code for finding in result.remaining]


def test_multiples_of_half_a_degree_above_30_are_degrees() -> None:
    assert are_degrees((-180.0, 180.0)) and are_degrees((0.0, 92.5, -45.0))
    assert not are_degrees((-10.0, 10.0))  # a joint that turns three times
    assert not are_degrees((-31.4159, 31.4159)) and not are_degrees((-1.57, 180.0)) and not are_degrees(())
    assert not are_degrees((0.0, 3600.0))


def test_repeated_names_of_mjcf_bodies_are_corrected(tmp_path: Path) -> None:
    path = tmp_path / "arm.xml"
    inner = "<geom size='0.1'/><joint/>"
    path.write_text(
        f"<mujoco><worldbody><body name='a'>{inner}<body name='a 2'>{inner}</body>"
        f"<body name='a'>{inner}</body></body></worldbody></mujoco>",
        encoding="utf-8",
    )
    result, copy = corrected(path)
    assert codes(result) == ["mjcf-name"] and not result.remaining
    names = [link.name for link in robot_of(copy).links]
    assert sorted(names) == sorted(link.name for link in robot_of(path).links) == ["a", "a 2", "a 3"]

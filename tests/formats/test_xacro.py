"""Robots from xacro: macros, arguments and includes, and refused expressions."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from armblocks.errors import FormatError
from armblocks.formats import load_robot
from armblocks.formats.urdf import xacro_expansion
from armblocks.formats.urdf.xacro_process import RefusalError, check_expression

HEAD = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'
MACRO = """
<xacro:macro name="segment" params="name parent length">
  <link name="${name}"/>
  <joint name="${name}_joint" type="revolute">
    <parent link="${parent}"/><child link="${name}"/><axis xyz="0 0 1"/>
    <origin xyz="${length} 0 0" rpy="0 0 ${pi / 2}"/><limit lower="0" upper="1" effort="1" velocity="1"/>
  </joint>
</xacro:macro>
"""


def written(folder: Path, content: str, name: str = "arm.xacro") -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"{HEAD}{content}</robot>", encoding="utf-8")
    return path


def test_macros_arguments_packages_and_files_of_values_are_expanded(tmp_path: Path) -> None:
    written(tmp_path / "ws" / "parts", MACRO, "urdf/segment.xacro")
    (tmp_path / "ws" / "parts" / "sizes.yaml").write_text("arm: {length: 0.25}\n", encoding="utf-8")
    content = """
      <xacro:arg name="count" default="1"/>
      <xacro:property name="sizes" value="${xacro.load_yaml('$(find parts)/sizes.yaml')}"/>
      <xacro:include filename="$(find parts)/urdf/segment.xacro"/>
      <link name="base"/>
      <xacro:segment name="a" parent="base" length="${sizes['arm']['length'] * 2}"/>
      <xacro:if value="${int('$(arg count)') > 1}">
        <xacro:segment name="b" parent="a" length="$(eval 0.5 + 0.25)"/>
      </xacro:if>
    """
    path = written(tmp_path / "ws" / "arm", content)
    robot = load_robot(path)
    assert robot.joint_names == ("a",)
    assert robot.link("a").before.translation == (0.5, 0.0, 0.0)
    robot = load_robot(path, arguments={"count": 2})
    assert robot.joint_names == ("a", "b")
    assert robot.link("b").before.translation == (0.75, 0.0, 0.0)
    (tmp_path / "ws" / "parts").rename(tmp_path / "moved")
    with pytest.raises(
        FormatError, match=r"the package 'parts' of \$\(find …\) is not found; give its folder"
    ):
        load_robot(path)
    assert load_robot(path, packages={"parts": tmp_path / "moved"}).n == 1


def test_a_urdf_file_with_expressions_is_expanded_too(tmp_path: Path) -> None:
    path = written(
        tmp_path, f'{MACRO}<link name="base"/><xacro:segment name="a" parent="base" length="1"/>', "a.urdf"
    )
    assert load_robot(path).joint_names == ("a",)


REFUSED = [
    ('<link name="${x}"/>', "name 'x' is not defined"),
    ("<xacro:unknown/>", "unknown macro name: xacro:unknown"),
    ('<xacro:include filename="missing.xacro"/>', "'missing.xacro' is not included: there is no such file"),
    ('<xacro:include filename="https://example.com/a"/>', "files with 'https://' are not read"),
    ('<link name="$(env HOME)"/>', "environment variables are not read; use $(arg …)"),
    ('<link name="${(lambda: 1)()}"/>', "Lambda is not allowed in expressions"),
    ('<link name="$(eval open)"/>', "name 'open' is not defined"),
    (
        "<xacro:macro name='m' params=''><xacro:m/></xacro:macro><xacro:m/>",
        "macros call each other without end",
    ),
]


@pytest.mark.parametrize(("content", "words"), REFUSED, ids=[words for _, words in REFUSED])
def test_files_that_cannot_be_expanded_are_refused(content: str, words: str, tmp_path: Path) -> None:
    path = written(tmp_path, content)
    with pytest.raises(FormatError) as refused:
        load_robot(path)
    message = str(refused.value)
    assert words in message
    assert message.startswith(f"{path}: xacro cannot expand the file: ")
    assert "Allowed: xacro macros whose files and arguments are known" in message


def test_an_expansion_without_an_end_is_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(xacro_expansion, "SECONDS", 1.5)
    began = time.perf_counter()
    with pytest.raises(FormatError, match=r"the expansion takes more than|ended without a result"):
        load_robot(written(tmp_path, '<link name="${9**9**9**9}"/>'))
    assert time.perf_counter() - began < 60  # without the limit it would take years


def test_document_types_are_refused_in_included_files_too(tmp_path: Path) -> None:
    (tmp_path / "bomb.xacro").write_text('<!DOCTYPE r [<!ENTITY a "b">]><robot/>', encoding="utf-8")
    with pytest.raises(FormatError, match=r"bomb\.xacro:1: the file has a document type or entities"):
        load_robot(tmp_path / "bomb.xacro")
    with pytest.raises(FormatError, match="the file has a document type or entities"):
        load_robot(written(tmp_path, '<xacro:include filename="bomb.xacro"/>'))


@pytest.mark.parametrize(
    "text",
    [
        "().__class__",
        "__import__('os')",
        "[x for x in ()].__len__()",
        "(lambda: ().__class__)()",
        "(x for x in ()).gi_frame",
        "python.type(1).mro()",
        "python.vars(math)",
        "'{0.__class__}'.format(1)",
        "f.__globals__",
        "x := 1",
        "1" * 2001,
    ],
)
def test_expressions_that_do_more_than_compute_are_refused(text: str) -> None:
    with pytest.raises((RefusalError, SyntaxError)):
        check_expression(text)


@pytest.mark.parametrize(
    "text",
    [
        "pi / 2",
        "radians(90)",
        "xacro.load_yaml('a.yaml')['x'][0]",
        "[2 * x for x in range(3)]",
        "dict(a=1)['a'] if prefix == '' else -0.5e-3",
        "name.split('_')[0] + f'_{index}'",
        "not (a and b) or c in [1, 2]",
    ],
)
def test_expressions_that_robots_use_are_allowed(text: str) -> None:
    check_expression(text)

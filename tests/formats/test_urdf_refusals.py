"""Hostile and invalid URDF files: an error with file and line, in bounded time."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from urdf_trees import random_urdf

from armblocks.errors import ArmblocksError, FormatError
from armblocks.formats import load_robot
from armblocks.formats.file_findings import FileContext
from armblocks.formats.urdf.reader import read_urdf

TWO = '<link name="a"/><link name="b"/>'


def tree(*joints: str, links: str = TWO) -> str:
    return f'<robot name="r">\n{links}\n{"".join(joints)}</robot>'


def jointed(parent: str, child: str, body: str = "", name: str = "j", kind: str = "revolute") -> str:
    limit = '<limit lower="0" upper="1" effort="1" velocity="1"/>'
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{limit}{body}</joint>'


def inertial(mass: str, moments: str = "") -> str:
    content = f'<inertial><mass value="{mass}"/><inertia {moments}/></inertial>'
    return f'<robot name="r"><link name="a">{content}</link></robot>'


CHAIN = "".join(jointed(f"l{k}", f"l{k + 1}", name=f"j{k}") for k in range(4999))
BOMB = '<!DOCTYPE r [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;">]><robot name="&b;"/>'

INVALID_FILES = [
    ("", "this is not well-formed XML: no element found"),
    ("not XML", "this is not well-formed XML"),
    ("<robot>", "this is not well-formed XML"),
    ('<robot name="r"><link></robot>', "this is not well-formed XML: mismatched tag"),
    (BOMB, "the file has a document type or entities"),
    ('<!DOCTYPE r SYSTEM "file:///etc/hostname"><robot/>', "the file has a document type or entities"),
    ("<a>" * 100_000, "too many elements, or they are nested too deeply"),
    (f"<robot>{'<a/>' * 200_001}</robot>", "too many elements, or they are nested too deeply"),
    ("<sdf/>", "the root element is <sdf>"),
    ('<robot name="r"/>', "the robot has no links"),
    (tree(links="<link/>"), "the attribute 'name' is missing or empty"),
    (
        tree(links='<link name="a"/><link name="a"><visual/></link>'),
        "there is another link of this name in line 2",
    ),
    (tree(links="".join(f'<link name="l{k}"/>' for k in range(5000))), "the robot has 5000 links"),
    (tree(CHAIN, links="".join(f'<link name="l{k}"/>' for k in range(5000))), "at most 1000"),
    (tree(), "2 links have no parent: a, b. Allowed: one tree of links"),
    (tree(jointed("a", "b"), jointed("b", "a", name="k")), "links are each other's parents: a -> b -> a"),
    (tree(jointed("a", "a")), "links are each other's parents: a -> a"),
    (
        tree(jointed("a", "b"), jointed("a", "b", name="k")),
        "link 'b' is also the child of joint 'j' in line 3",
    ),
    (tree(jointed("a", "c")), "there is no link named 'c'"),
    (tree('<joint name="j" type="fixed"><child link="b"/></joint>'), "the joint has no <parent>"),
    (tree(jointed("a", "b", kind="")), "the attribute 'type' is missing or empty"),
    (tree(jointed("a", "b", kind="hinge")), "of type 'hinge', which is not a type of URDF"),
    (tree(jointed("a", "b", '<axis xyz="0 0 0"/>', kind="planar")), "the axis of joint 'j' is 0 0 0"),
    (tree(jointed("a", "b", '<axis xyz="0 0 0"/>')), "the axis of joint 'j' is 0 0 0"),
    (tree(jointed("a", "b", '<axis xyz="nan 0 1"/>')), "contains 'nan', which is not a number"),
    (tree(jointed("a", "b", '<origin xyz="1e400 0 0"/>')), "contains '1e400', which is not a number"),
    (
        tree(jointed("a", "b", '<origin xyz="0 0"/>')),
        "the attribute 'xyz' has 2 values: '0 0'. Allowed: 3 numbers, separated by spaces. "
        "Fix: correct this line",
    ),
    (tree(jointed("a", "b", '<origin rpy=""/>')), "the attribute 'rpy' has"),
    (tree(jointed("a", "b", '<origin xyz="${x} 0 0"/>')), "name 'x' is not defined"),
    (tree("<xacro:arm/>"), "unbound prefix: line 3"),
    (inertial("nan"), "contains 'nan', which is not a number"),
    (inertial("1,5"), "contains '1,5', which is not a number. Allowed: finite decimal numbers"),
    (inertial("1_000"), "contains '1_000', which is not a number"),
    (inertial("\u0663"), "which is not a number"),
    (inertial("-1"), "the mass of link 'a' is -1 kg"),
    (inertial("1", 'ixx="inf"'), "contains 'inf', which is not a number"),
    (
        tree(jointed("a", "b", kind="revolute").replace('upper="1"', 'upper="x"')),
        "contains 'x', which is not a number",
    ),
]


@pytest.mark.parametrize(("text", "words"), INVALID_FILES, ids=[words[:50] for _, words in INVALID_FILES])
def test_invalid_files_are_refused_with_file_line_and_reason(text: str, words: str) -> None:
    began = time.process_time()
    with pytest.raises(ArmblocksError) as refused:
        read_urdf(text.encode(), "r.urdf", FileContext())
    assert words in str(refused.value)
    assert str(refused.value).startswith("r.urdf")
    assert len(str(refused.value)) < 400
    assert "Fix: " in str(refused.value)
    assert time.process_time() - began < 5


def test_a_hint_names_the_decimal_point() -> None:
    with pytest.raises(FormatError, match="write a decimal point"):
        read_urdf(inertial("1,5").encode(), "r.urdf", FileContext())


def test_the_file_has_a_maximum_size(tmp_path: Path) -> None:
    file = tmp_path / "r.urdf"
    file.write_bytes(b" " * (16 * 2**20 + 1))
    with pytest.raises(FormatError, match="the file is too large"):
        load_robot(file)


def test_one_attribute_of_many_megabytes_is_read_in_bounded_time() -> None:
    began = time.process_time()
    with pytest.raises(FormatError, match="is not a number"):
        read_urdf(inertial("1" * (4 * 2**20)).encode(), "r.urdf", FileContext())
    assert time.process_time() - began < 5


def test_a_chain_of_1000_links_is_read(tmp_path: Path) -> None:
    links = "".join(f'<link name="l{k}"/>' for k in range(1000))
    joints = "".join(jointed(f"l{k}", f"l{k + 1}", name=f"j{k}") for k in range(999))
    began = time.process_time()
    robot = read_urdf(tree(joints, links=links).encode(), "r.urdf", FileContext())
    assert robot.n == 999
    assert robot.links[-1].name == "l999"
    assert time.process_time() - began < 5


BASE = random_urdf(0, links=4)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, len(BASE) - 1), st.integers(0, 30), st.text(max_size=8))
def test_damaged_files_are_read_or_refused(start: int, length: int, inserted: str) -> None:
    damaged = BASE[:start] + inserted + BASE[start + length :]
    try:
        read_urdf(damaged.encode("utf-8", "surrogatepass"), "r.urdf", FileContext())
    except ArmblocksError as error:
        assert str(error)


@settings(max_examples=50, deadline=None)
@given(st.binary(max_size=60))
def test_arbitrary_bytes_are_refused(data: bytes) -> None:
    with pytest.raises(ArmblocksError):
        read_urdf(b"<robot>" + data, "r.urdf", FileContext())

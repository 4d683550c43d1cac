"""Hostile and invalid SDF files: an error with file and line, in bounded time."""

from __future__ import annotations

import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sdf_trees import Conversion
from test_sdf_semantics import INERTIAL, two
from urdf_trees import random_urdf

from armblocks.errors import ArmblocksError, FormatError
from armblocks.formats.file_findings import FileContext
from armblocks.formats.sdf.reader import read_sdf

Z = "<axis><xyz>0 0 1</xyz></axis>"
BOMB = '<!DOCTYPE r [<!ENTITY a "aa"><!ENTITY b "&a;&a;">]><sdf version="1.9"/>'


def model(content: str, version: str = "1.9") -> str:
    return f'<sdf version="{version}"><model name="r">\n{content}</model></sdf>'


def frame(name: str, attributes: str = "", pose: str = "") -> str:
    return f'<frame name="{name}"{attributes}>{pose}</frame>'


def chain(count: int) -> str:
    links = "".join(f'<link name="l{k}">{INERTIAL}</link>' for k in range(count))
    joints = "".join(
        f'<joint name="j{k}" type="revolute"><parent>l{k}</parent><child>l{k + 1}</child>{Z}</joint>'
        for k in range(count - 1)
    )
    return model(links + joints)


NESTED = '<model name="m">' * 20 + "</model>" * 20
LINK = '<link name="a"/>'
INVALID = [
    ("", "this is not well-formed XML: no element found"),
    (BOMB, "the file has a document type or entities"),
    ("<a>" * 100_000, "too many elements, or they are nested too deeply"),
    (f"<sdf version='1.9'>{'<a/>' * 200_001}</sdf>", "too many elements, or they are nested too deeply"),
    ("<robot/>", "the root element is <robot>. Allowed: <sdf version=…>: an SDF file"),
    ("<sdf version='x'/>", "the version is 'x'"),
    ("<sdf version='1.9'/>", "the file has no models"),
    (model(""), "the model has no links"),
    (model("<link/>"), "the attribute 'name' is missing or empty"),
    (model(LINK * 2), "there is another element of this name in line 2"),
    (model('<link name="world"/>'), "there is another element of this name"),
    (model('<link name="__model__"/>'), "there is another element of this name"),
    (model(NESTED), "models are nested too deeply"),
    (chain(1001), "the model has 1001 links. Allowed: at most 1000"),
    (model(LINK + "".join(frame(f"f{k}") for k in range(6000))), "too many links, joints and frames"),
    (
        two("<screw_thread_pitch>0</screw_thread_pitch>" + Z, kind="screw"),
        "the pitch of the thread is 0. Allowed: m per turn, other than 0",
    ),
    (two(Z, kind="wobble"), "the joint is of type 'wobble', which is not supported. Allowed: revolute"),
    (two(Z, kind=""), "the attribute 'type' is missing or empty"),
    (two("<axis><xyz>0 0 0</xyz></axis>"), "the axis of joint 'j' is 0 0 0"),
    (two("<axis><xyz>0 0</xyz></axis>"), "the element <xyz> has 2 values: '0 0'"),
    (two("<axis><xyz>0 0 nan</xyz></axis>"), "the element <xyz> contains 'nan', which is not a number"),
    (two('<axis><xyz expressed_in="f">0 0 1</xyz></axis>'), "there is no frame named 'f'"),
    (two(Z).replace("<parent>base</parent>", ""), "the joint has no <parent>"),
    (two(Z).replace("<parent>base", "<parent>hand"), "there is no frame named 'hand'"),
    (two(Z).replace("<parent>base", "<parent>arm"), "the joint connects a link with itself"),
    (two(Z).replace("<mass>2", "<mass>-2"), "the mass of link 'base' is -2 kg"),
    (two(Z).replace("<mass>2", "<mass>1e999"), "contains '1e999', which is not a number"),
    (two(Z).replace("<pose>1 0", "<pose>1"), "the element <pose> has 5 values"),
    (two(Z).replace("<pose>", "<pose degrees='maybe'>"), "'maybe' is neither true nor false"),
    (two(Z).replace("<pose>", "<pose rotation_format='abc'>"), "the rotation format is 'abc'"),
    (
        model('<link name="a"><pose rotation_format="quat_xyzw">0 0 0 0 0 0 0</pose></link>'),
        "the quaternion is zero",
    ),
    (model('<link name="a"><pose relative_to="b"/></link>'), "there is no frame named 'b'"),
    (
        model('<link name="a"><pose relative_to="f"/></link>' + frame("f", "", '<pose relative_to="a"/>')),
        "frames are relative to each other: a -> f -> a",
    ),
    (
        two(Z, more=frame("f", ' attached_to="g"') + frame("g", ' attached_to="f"')).replace(
            "<child>arm", "<child>f"
        ),
        "frames are attached to each other: f -> g -> f",
    ),
    (
        model('<model name="m" placement_frame="f"><link name="a"/><frame name="f"/></model>').replace(
            '<model name="r">', '<model name="r" placement_frame="x">'
        ),
        "there is no frame named 'x'",
    ),
    (model("<include><uri>model://x</uri></include>"), "the included model 'model://x' is not read"),
    (model("<include/>"), "the <uri> is empty"),
    (model("<include><uri>a.urdf</uri></include>"), "'.urdf' files are not included"),
]


@pytest.mark.parametrize(("text", "words"), INVALID, ids=range(len(INVALID)))
def test_invalid_files_are_refused_with_file_line_and_reason(text: str, words: str) -> None:
    began = time.process_time()
    with pytest.raises(ArmblocksError) as refused:
        read_sdf(text.encode(), "r.sdf", FileContext())
    assert words in str(refused.value)
    assert str(refused.value).startswith("r.sdf")
    assert len(str(refused.value)) < 700
    assert time.process_time() - began < 20


def test_long_chains_of_links_and_frames_are_read_in_bounded_time() -> None:
    began = time.process_time()
    (robot,) = read_sdf(chain(1000).encode(), "r.sdf", FileContext()).values()
    assert robot.n == 999
    links = f'<link name="l0">{INERTIAL}</link>' + "".join(
        f'<link name="l{k}"><pose relative_to="l{k - 1}">1 0 0 0 0 0</pose>{INERTIAL}</link>'
        for k in range(1, 1000)
    )
    joints = chain(1000)[chain(1000).index("<joint") :]
    text = f'<sdf version="1.9"><model name="r">{links}{joints}'
    (robot,) = read_sdf(text.encode(), "r.sdf", FileContext()).values()
    assert robot.links[-1].before.translation == (1.0, 0.0, 0.0)
    assert time.process_time() - began < 30


BASE = Conversion(random_urdf(0, links=4), 0).sdf


@settings(max_examples=50, deadline=None)
@given(st.integers(0, len(BASE) - 1), st.integers(0, 30), st.text(max_size=8))
def test_damaged_files_are_read_or_refused(start: int, length: int, inserted: str) -> None:
    damaged = BASE[:start] + inserted + BASE[start + length :]
    try:
        read_sdf(damaged.encode("utf-8", "surrogatepass"), "r.sdf", FileContext())
    except ArmblocksError as error:
        assert str(error)


@settings(max_examples=50, deadline=None)
@given(st.binary(max_size=60))
def test_arbitrary_bytes_are_refused(data: bytes) -> None:
    with pytest.raises(FormatError):
        read_sdf(b"<sdf>" + data, "r.sdf", FileContext())

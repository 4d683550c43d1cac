"""Hostile robot files of every format: an error with a message, or a robot; never a crash or a hang.

Each format has an example, whose numbers, names and elements are replaced. Processor time is measured, not
the time of a clock.
"""

from __future__ import annotations

import dataclasses
import re
import time
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from armblocks.errors import ArmblocksError, ArmblocksWarning, FormatError
from armblocks.formats import ROBOT_FORMATS, RobotFormat, robot_bytes
from armblocks.formats.file_findings import FileContext
from armblocks.formats.robot_lint import findings_of
from armblocks.robot import Link, Motor, Robot, standard_dh
from armblocks.robot.robot import STANDARD_GRAVITY
from robots_for_tests import build_random_tree, evaluate, random_states

SECONDS = 20.0
"""A bound for the processor time of one file: a hang takes longer on every machine."""

ARM = build_random_tree(3, chain=True)
FILES = Path(__file__).parent / "robot_files"
EXAMPLES = {
    "armblocks robot": robot_bytes(ARM, "arm.json").decode(),
    **{
        name: (FILES / file).read_text(encoding="utf-8")
        for name, file in {
            "MATLAB robot script": "arm.m",
            "MJCF": "arm.xml",
            "SDF": "arm.sdf",
            "URDF": "arm.urdf",
            "xacro": "arm.xacro",
            "Simscape Multibody XML": "export.xml",
            "Simscape Multibody data file": "export_DataFile.m",
        }.items()
    },
}
"""One file of each format; a new format adds its own."""

FORMATS = pytest.mark.parametrize("format", ROBOT_FORMATS, ids=lambda format: format.name)
IN_PROCESS = [format for format in ROBOT_FORMATS if format.name != "xacro"]
"""The readers that start no process for a file."""
NUMBERS = (
    *(
        "nan",
        "inf",
        "-inf",
        "1e308",
        "-1e308",
        "1e-320",
        "1e400",
        "0",
        "-1",
        "",
        "1,5",
        "1_0",
        "٣",
        "0x10",
        "1e9",
    ),
    *("x" * 100, "--", "${x}", "%s", "\\u0000", "]]>", "<", "&amp;", "'", '"', "1 2 3 4 5 6 7", "true"),
)


def read(format: RobotFormat, data: bytes) -> Robot | ArmblocksError:
    """The robot with its findings, or the error; checks that its text can be displayed."""
    name = f"file{format.suffixes[0]}"
    context = FileContext()
    began = time.process_time()

    robots: list[Robot] = []

    def first_robot() -> Robot:
        robots.extend(format.robots(data, name, context).values())
        if not robots:
            raise FormatError("the file has no robot", where=name, fix="choose another file")
        return robots[0]

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", ArmblocksWarning)
            warnings.simplefilter("ignore", RuntimeWarning)
            found = findings_of(first_robot, name, context)
            assert all(len(str(finding)) < 1000 for finding in found)
            return robots[0]
    except ArmblocksError as error:
        assert error.what and (error.fix or error.allowed) and len(str(error)) < 1200
        return error
    finally:
        assert time.process_time() - began < SECONDS


def test_every_format_has_an_example_that_is_read() -> None:
    for format in ROBOT_FORMATS:
        data = EXAMPLES[format.name].encode()
        assert format.recognises is None or format.recognises(data)
        robot = read(format, data)
        assert isinstance(robot, Robot), robot


@pytest.mark.parametrize("format", IN_PROCESS, ids=lambda format: format.name)
def test_any_value_in_the_place_of_a_number_or_name_is_an_error_or_a_robot(format: RobotFormat) -> None:
    text = EXAMPLES[format.name]
    places = [match.span() for match in re.finditer(r"-?\b\d[\d.e-]*|(?<=[\"'>])\w+(?=[\"'<])", text)]
    random = np.random.default_rng(len(text))
    for start, end in [places[k] for k in random.permutation(len(places))[:50]]:
        for value in random.choice(NUMBERS, 2, replace=False):
            read(format, (text[:start] + str(value) + text[end:]).encode())
    for value in ("1e308", "-1e308", "1e200", "1e155", "1e-320", "0"):  # products overflow or vanish
        read(format, re.sub(r"-?\b\d[\d.]*(?:e-?\d+)?\b", value, text).encode())


def mutations(text: str, random: np.random.Generator) -> Iterator[str]:
    """Texts with parts removed, repeated and exchanged."""
    words = re.findall(r"<[^>]*>|[^<\s]+|\s+", text)
    for _ in range(40):
        a, b = sorted(int(k) for k in random.integers(len(words), size=2))
        changed = (
            words[:a] + words[b:],
            words[:a] + words[a:b] * 2 + words[b:],
            words[:a] + words[b : b + 3] + words[a:],
            [*words[:a], words[b], *words[a + 1 : b], words[a], *words[b + 1 :]],
        )
        yield "".join(changed[int(random.integers(len(changed)))])
    for _ in range(20):
        yield text[: int(random.integers(len(text)))]


@pytest.mark.parametrize("format", IN_PROCESS, ids=lambda format: format.name)
def test_damaged_files_are_an_error_or_a_robot(format: RobotFormat) -> None:
    for text in mutations(EXAMPLES[format.name], np.random.default_rng(1)):
        read(format, text.encode())


GARBAGE = (
    b"",
    b"\0" * 1000,
    b"\xff\xfe\x00\xd8",
    b"\xef\xbb\xbf",
    bytes(range(256)) * 4,
    b"<" * 20_000,
    b"{" * 20_000,
    b"[" * 20_000,
    b"(" * 20_000,
    b"<a>" * 20_000,
    b"<!--" * 20_000,
    b"<a " + b"b='c' " * 20_000 + b"/>",
    b"<a b='" + b"x" * 500_000 + b"'/>",
    b"<?xml version='1.0' encoding='utf-7'?><a/>",
    b"<?xml version='1.0' encoding='none'?><a/>",
    b'<!DOCTYPE a [<!ENTITY b "' + b"c" * 1000 + b'">]><a>' + b"&b;" * 1000 + b"</a>",
    b'<!DOCTYPE a SYSTEM "file:///etc/hostname"><a/>',
    b"%" * 200_000,
    b"a = " + b"1+" * 20_000 + b"1;",
)


@FORMATS
def test_garbage_is_refused(format: RobotFormat) -> None:
    for data in GARBAGE[:: 3 if format.name == "xacro" else 1]:
        assert isinstance(read(format, data), ArmblocksError)


@pytest.mark.parametrize("format", IN_PROCESS, ids=lambda format: format.name)
def test_document_types_and_entities_are_refused_in_every_xml_format(format: RobotFormat) -> None:
    text = EXAMPLES[format.name]
    if not text.lstrip().startswith("<"):
        pytest.skip("not XML")
    body = re.sub(r"^<\?xml[^>]*\?>", "", text)
    for declaration in (
        '<!DOCTYPE a [<!ENTITY x "1"><!ENTITY y "&x;&x;&x;&x;&x;&x;&x;&x;">]>',
        '<!DOCTYPE a SYSTEM "http://example.com/a.dtd">',
        '<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/hostname">]>',
    ):
        error = read(format, (declaration + body).encode())
        assert isinstance(error, ArmblocksError) and "document type or entities" in str(error)


WRITERS = [format for format in ROBOT_FORMATS if format.write is not None]


@pytest.mark.parametrize("format", WRITERS, ids=lambda format: format.name)
def test_every_written_format_keeps_the_poses_and_torques(format: RobotFormat) -> None:
    assert format.write is not None
    robot = dataclasses.replace(ARM, gravity=STANDARD_GRAVITY)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ArmblocksWarning)
        again = read(format, format.write(robot))
    assert isinstance(again, Robot) and again.joint_names == robot.joint_names
    q, qd, qdd = random_states(robot, 1)[0]
    for name, arguments in (("fkine", (q,)), ("rne", (q, qd, qdd))):
        expected = evaluate(robot.nofriction(), name, *arguments)
        actual = evaluate(again.nofriction(), name, *arguments)
        np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-12 * max(1.0, np.abs(expected).max()))


@pytest.mark.parametrize("format", WRITERS, ids=lambda format: format.name)
def test_extreme_robots_are_written_and_read_or_refused(format: RobotFormat) -> None:
    assert format.write is not None
    names = (
        "a b",
        "<x>",
        "a&b",
        '"',
        "'",
        "é",
        "\N{GRINNING FACE}",
        "a" * 500,
        "]]>",
        "a\tb",
        "world",
        "x::y",
        "\x01",
    )
    robots = [Robot(name=name, links=(Link(name=name, mass=1.0, inertia=np.eye(3)),)) for name in names] + [
        Robot(name="huge", links=(standard_dh("a", a=1e150, mass=1e150, inertia=np.eye(3) * 1e150),)),
        Robot(name="tiny", links=(standard_dh("a", a=1e-300, mass=5e-324),)),
        Robot(name="geared", links=(Link(name="a", motor=Motor(inertia=1e-300, gear_ratio=1e150)),)),
        Robot(
            name="many",
            links=tuple(Link(name=f"l{k}", parent=f"l{k - 1}" if k else None) for k in range(400)),
        ),
    ]
    for robot in robots:
        began = time.process_time()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ArmblocksWarning)
            try:
                data = format.write(robot)
            except ArmblocksError as error:
                assert error.what and len(str(error)) < 800
                continue
        again = read(format, data)
        assert isinstance(again, Robot) and again.n == robot.n
        assert time.process_time() - began < SECONDS

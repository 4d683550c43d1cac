"""Diagram files: round trip, small textual differences, unknown keys, located errors."""

from __future__ import annotations

import dataclasses
import difflib
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from referencing import Registry, Resource

from armblocks import formats
from armblocks.blocks import (
    BLOCKS,
    Clock,
    Constant,
    Fkine,
    Gain,
    Integrator,
    JTraj,
    Rne,
    Saturation,
    Scope,
    Subsystem,
    Sum,
)
from armblocks.diagram import Diagram, DiagramBuilder, Placement, with_parameters
from armblocks.equations import SimulationOptions
from armblocks.errors import AlgebraicLoopError, ArmblocksError, DiagramError, FormatError, UnknownNameError
from armblocks.formats import (
    diagram_from_bytes,
    diagram_to_bytes,
    list_examples,
    load_diagram,
    load_robot,
    read_diagram,
    write_diagram,
    write_robot,
)
from armblocks.formats.shipped import shipped_folder
from armblocks.robot import FrictionModel, Robot

SCHEMAS = Path(formats.__file__).parent / "schema"


def read(data: bytes, folder: Path | None = None) -> Diagram:
    return diagram_from_bytes(data, "model.json", BLOCKS, load_robot, folder=folder)


def write(diagram: Diagram, folder: Path | None = None) -> bytes:
    return diagram_to_bytes(diagram, load_robot, folder=folder)


@pytest.fixture(scope="module")
def schema() -> jsonschema.Draft202012Validator:
    robot, diagram = (
        json.loads((SCHEMAS / f"{kind}.schema.json").read_text()) for kind in ("robot", "diagram")
    )
    jsonschema.Draft202012Validator.check_schema(diagram)
    registry = Registry().with_resource(robot["$id"], Resource.from_contents(robot))
    return jsonschema.Draft202012Validator(diagram, registry=registry)


def small(**settings: Any) -> Diagram:
    """clock -> gain -> limit -> integrator -> scope, placed."""
    builder = DiagramBuilder("small", settings=SimulationOptions(**settings))
    clock = builder.add("clock", Clock())
    gain = builder.add("gain", Gain(gain=2.0), clock)
    limit = builder.add("limit", Saturation(lower=-math.inf, upper=0.5), gain)
    speed = builder.add("speed", Integrator(initial=0.1), limit)
    builder.add("scope", Scope(inputs=2), speed, clock)
    for i, name in enumerate(("clock", "gain", "limit", "speed", "scope")):
        builder.place(name, 40 + 120 * i, 40)
    return builder.build()


def arms(*robots: Robot) -> Diagram:
    """One fkine for each robot."""
    builder = DiagramBuilder("arms")
    for i, robot in enumerate(robots):
        q = builder.add(f"q{i}", Constant(value=(0.0,) * robot.n))
        builder.add(f"fkine{i}", Fkine(robot=robot), q)
    return builder.build()


# -- laws --------------------------------------------------------------------------------------------------


@st.composite
def diagrams(draw: st.DrawFn) -> Diagram:
    """Chains of maths blocks with random names, numbers, positions and unknown keys."""
    texts = st.text(st.characters(exclude_categories=["C"], exclude_characters="/."), min_size=1, max_size=6)
    names = draw(st.lists(texts, min_size=2, max_size=6, unique_by=lambda name: name.casefold()))
    numbers = st.floats(-1e6, 1e6)
    extras = st.sampled_from([{}, {"vendor:a": 1}, {"vendor:a": [None, "x"], "vendor:b": {"c": 0.5}}])
    document, block = draw(extras), draw(extras)
    blocks = {names[0]: block} if block else {}
    options = SimulationOptions(
        stop_time=draw(st.floats(0, 1e4)),
        sample_time=draw(st.none() | st.floats(1e-6, 1)),
        rtol=draw(st.floats(0, 1)),
    )
    builder = DiagramBuilder(
        draw(texts),
        settings=options,
        extras={key: value for key, value in {"": document, "blocks": blocks}.items() if value},
    )
    last = builder.add(names[0], Constant(value=draw(numbers | st.tuples(numbers, numbers))))
    for name in names[1:]:
        last = builder.add(name, draw(st.sampled_from([Gain(gain=draw(numbers)), Integrator()])), last)
        match draw(st.sampled_from(["", "out", "through"])):
            case "out":
                builder.comment_out(last)
            case "through" if isinstance(last.block, Integrator):
                builder.comment_through(last)
            case _:
                pass
    for name in draw(st.sets(st.sampled_from(names))):
        builder.place(
            name, draw(numbers), draw(numbers), width=draw(st.none() | numbers), flipped=draw(st.booleans())
        )
    return builder.build()


@settings(max_examples=60, deadline=None, derandomize=True)
@given(diagrams())
def test_reading_a_written_diagram_gives_the_same_diagram(diagram: Diagram) -> None:
    data = write(diagram)
    reread = read(data)
    assert reread == diagram
    assert write(reread) == data


@pytest.mark.parametrize("name", list_examples())
def test_shipped_examples_are_canonical_and_follow_the_schema(
    name: str, schema: jsonschema.Draft202012Validator, tmp_path: Path
) -> None:
    diagram = load_diagram(name, BLOCKS)
    path = shipped_folder("examples") / f"{name}.json"
    copy = write_diagram(tmp_path / "copy.json", diagram)
    assert copy.read_bytes() == path.read_bytes()
    assert read_diagram(copy, BLOCKS) == diagram
    assert load_diagram(name, BLOCKS, draft=True) == diagram
    schema.validate(json.loads(path.read_text()))


def test_order_in_the_file_does_not_matter() -> None:
    document = json.loads(write(small()))
    document["connections"].reverse()
    document["blocks"] = dict(reversed(document["blocks"].items()))
    assert write(read(json.dumps(document).encode())) == write(small())


def test_infinities_are_written_as_text_and_numbers_keep_their_bits() -> None:
    diagram = with_parameters(small(), {"gain.gain": 0.1 + 0.2, "speed.initial": -0.0})
    reread = read(write(diagram))
    assert reread.blocks["limit"] == Saturation(lower=-math.inf, upper=0.5)
    assert reread.blocks["gain"] == Gain(gain=0.30000000000000004)
    assert math.copysign(1, reread.blocks["speed"].initial) == -1  # type: ignore[attr-defined]
    assert '"lower": "-inf"' in write(diagram).decode()


# -- differences -------------------------------------------------------------------------------------------


def differing(before: Diagram, after: Diagram) -> list[str]:
    lines = difflib.unified_diff(write(before).decode().splitlines(), write(after).decode().splitlines(), n=0)
    return [line for line in lines if line[0] in "+-" and line[:3] not in ("+++", "---")]


def test_changing_one_parameter_changes_one_line() -> None:
    lines = differing(small(), with_parameters(small(), {"gain.gain": 3.0}))
    assert [line.split() for line in lines] == [["-", '"gain":', "2"], ["+", '"gain":', "3"]]


def test_changing_a_vector_changes_one_line() -> None:
    builder = DiagramBuilder("d")
    builder.add("jtraj", JTraj(q0=(0.0, 0.0), qf=(1.0, 2.0)))
    diagram = builder.build()
    assert len(differing(diagram, with_parameters(diagram, {"jtraj.qf": (1.0, 3.0)}))) == 2


def test_moving_a_block_changes_one_line_of_the_layout() -> None:
    layout = {**small().layout, "gain": Placement(x=0.0, y=1.5)}
    lines = differing(small(), dataclasses.replace(small(), layout=layout))
    assert lines == ['-    "gain": {"x": 160, "y": 40},', '+    "gain": {"x": 0, "y": 1.5},']


def test_adding_a_block_only_adds_lines() -> None:
    larger = DiagramBuilder("small")
    clock = larger.add("clock", Clock())
    gain = larger.add("gain", Gain(gain=2.0), clock)
    smaller = larger.build()
    larger.add("delta", Gain(gain=1.0), gain)
    lines = differing(smaller, larger.build())
    # A comma may be added to the line before the last of the connections.
    assert len([line for line in lines if line.startswith("-")]) <= 1
    assert len(lines) <= 10


# -- unknown keys ------------------------------------------------------------------------------------------


def test_unknown_keys_are_kept_at_every_level() -> None:
    document = json.loads(write(small()))
    document["vendor"] = {"a": [1, {"b": None}]}
    document["blocks"]["gain"]["colour"] = "red"
    document["layout"]["gain"]["shadow"] = 90
    document["layout"]["a note"] = {"text": "hello"}
    document["settings"]["vendor"] = True
    diagram = read(json.dumps(document).encode())
    assert json.loads(write(diagram)) == document
    assert read(write(diagram)) == diagram
    assert diagram.extras["blocks"] == {"gain": {"colour": "red"}}


def test_unknown_keys_of_a_removed_block_are_removed() -> None:
    extras: Mapping[str, object] = {"blocks": {"gone": {"colour": "red"}}}
    text = write(dataclasses.replace(small(), extras=extras)).decode()
    assert "gone" not in text


# -- robots ------------------------------------------------------------------------------------------------


def robots_of(diagram: Diagram) -> dict[str, object]:
    document = json.loads(write(diagram))
    return {
        "named": [
            block["parameters"]["robot"] for block in document["blocks"].values() if block["type"] == "Fkine"
        ],
        "table": document.get("robots", {}),
    }


def test_a_shipped_robot_is_written_as_its_name() -> None:
    assert robots_of(arms(load_robot("kr180"))) == {"named": ["kr180"], "table": {}}


@pytest.mark.parametrize(
    ("changed", "entry"),
    [
        (load_robot("kr180").nofriction(), {"friction": "none"}),
        (load_robot("kr180").nofriction(viscous=False), {"friction": "viscous"}),
        (load_robot("kr180").nofriction(coulomb=False), {"friction": "coulomb"}),
        (load_robot("kr180", friction_model=FrictionModel.RELEASE_6), {"friction_model": "release-6"}),
        (
            load_robot("kr180", friction_model=FrictionModel.SIGNED_GEAR).nofriction(viscous=False),
            {"friction": "viscous", "friction_model": "signed-gear"},
        ),
    ],
)
def test_a_variant_of_a_shipped_robot_is_written_as_a_variant(changed: Robot, entry: dict[str, str]) -> None:
    diagram = arms(changed, changed)
    assert robots_of(diagram) == {
        "named": ["KR180", "KR180"],
        "table": {"KR180": {"robot": "kr180", **entry}},
    }
    assert read(write(diagram)) == diagram


def test_other_robots_are_written_completely_and_once_under_unique_names(
    schema: jsonschema.Draft202012Validator,
) -> None:
    one = dataclasses.replace(load_robot("twolink"), name="arm")
    other = dataclasses.replace(one, comment="another")
    odd = dataclasses.replace(one, name="a/b")
    diagram = arms(one, other, one, odd)
    robots = robots_of(diagram)
    assert robots["named"] == ["arm", "arm 2", "arm", "robot"]
    schema.validate(json.loads(write(diagram)))
    assert read(write(diagram)) == diagram


def test_names_in_the_robot_table_are_kept() -> None:
    document = json.loads(write(arms(load_robot("kr180").nofriction())))
    document["robots"] = {"my arm": document["robots"]["KR180"]}
    document["blocks"]["fkine0"]["parameters"]["robot"] = "my arm"
    assert json.loads(write(read(json.dumps(document).encode()))) == document


def test_robot_files_are_written_as_paths_relative_to_the_diagram(tmp_path: Path) -> None:
    (tmp_path / "arms").mkdir()
    (tmp_path / "arms" / "mine.json").write_bytes(
        write_robot(load_robot("twolink").with_link("link1", mass=2.0))
    )
    robot = load_robot(tmp_path / "arms" / "mine.json")
    path = write_diagram(tmp_path / "model.json", arms(robot))
    assert json.loads(path.read_bytes())["blocks"]["fkine0"]["parameters"]["robot"] == "arms/mine.json"
    assert read_diagram(path, BLOCKS) == arms(robot)
    elsewhere = write_diagram(tmp_path / "arms" / "model.json", arms(robot))
    assert json.loads(elsewhere.read_bytes())["blocks"]["fkine0"]["parameters"]["robot"] == "mine.json"
    far = diagram_to_bytes(arms(robot), load_robot, folder=tmp_path / "other")
    assert json.loads(far)["blocks"]["fkine0"]["parameters"]["robot"].endswith("/arms/mine.json")


def test_a_robot_that_differs_from_its_file_is_written_completely(tmp_path: Path) -> None:
    path = tmp_path / "mine.json"
    path.write_bytes(write_robot(load_robot("planar3r").with_link("link1", mass=9.0)))
    diagram = arms(load_robot(path))
    path.write_bytes(b"{")
    assert robots_of(diagram)["named"] == ["Planar 3R"]
    path.write_bytes(write_robot(load_robot("planar3r")))
    assert robots_of(diagram)["named"] == ["Planar 3R"]
    assert read(write(diagram)) == diagram


def test_an_error_in_a_robot_file_names_both_files(tmp_path: Path) -> None:
    (tmp_path / "arm.m").write_text("x = 1;\nfor i = 1:3\n")
    data = write(arms(load_robot("kr180"))).replace(b'"kr180"', b'"arm.m"')
    with pytest.raises(FormatError, match=r"model\.json:6, blocks\.fkine0.*arm\.m:2: 'for' is not supported"):
        read(data, tmp_path)


# -- errors ------------------------------------------------------------------------------------------------

DOCUMENT = json.loads(write(small()))


def with_change(*path: str | int, value: object) -> bytes:
    document = json.loads(json.dumps(DOCUMENT))
    node = document
    for step in path[:-1]:
        node = node[step]
    node[path[-1]] = value
    return json.dumps(document, indent=1).encode()


GAIN = ("blocks", "gain")
FAULTS: list[tuple[bytes, type[ArmblocksError], str]] = [
    (b"{}", FormatError, "the key 'format' is missing"),
    (b"[]", FormatError, "the value is an array of 0 elements. Allowed: an object"),
    (with_change("format", value=7), FormatError, "the format version is 7.*update armblocks"),
    (
        with_change(*GAIN, "type", value="Gian"),
        UnknownNameError,
        "no block type named 'Gian'.*did you mean 'Gain'",
    ),
    (with_change(*GAIN, "type", value=3), FormatError, "the value is the number 3"),
    (with_change(*GAIN, value={}), FormatError, "the key 'type' is missing"),
    (with_change(*GAIN, "parameters", value={"gian": 1}), UnknownNameError, "parameter of Gain named 'gian'"),
    (
        with_change(*GAIN, "parameters", "gain", value="high"),
        FormatError,
        "parameters.gain: the value is 'high'",
    ),
    (with_change(*GAIN, "parameters", "gain", value=[[1], [1, 2]]), FormatError, "the value is"),
    (with_change(*GAIN, "parameters", "gain", value="inf"), FormatError, "the value is inf"),
    (with_change(*GAIN, "parameters", "gain", value={"a": 1}), FormatError, "the value is"),
    (with_change("blocks", "scope", "parameters", "inputs", value=1.5), FormatError, "the value is 1.5"),
    (with_change(*GAIN, value={"type": "Fkine"}), FormatError, "a Fkine needs the parameter 'robot'"),
    (
        with_change(*GAIN, value={"type": "Fkine", "parameters": {"robot": "kr18"}}),
        UnknownNameError,
        "no shipped robot named 'kr18'.*did you mean 'kr180'",
    ),
    (
        with_change(*GAIN, value={"type": "Fkine", "parameters": {"robot": 3}}),
        FormatError,
        "the value is the number 3",
    ),
    (with_change("robots", value={"a": {"robot": "x"}}), UnknownNameError, "no shipped robot named 'x'"),
    (
        with_change("robots", value={"a": {"name": "x"}}),
        FormatError,
        r"robots\.a: the key 'format' is missing",
    ),
    (
        with_change("robots", value={"a": {"robot": "kr180", "friction": "some"}}),
        FormatError,
        "'some' is not known",
    ),
    (
        with_change("robots", value={"a": {"robot": "kr180", "color": 1}}),
        FormatError,
        "the key 'color' is not known",
    ),
    (
        with_change(*GAIN, value={"type": "JTraj", "parameters": {"q0": [0], "qf": [0, 1]}}),
        FormatError,
        "q0 has 1 joint and qf has 2",
    ),
    (
        with_change("blocks", "a/b", value={"type": "Clock"}),
        DiagramError,
        "the block name 'a/b' contains '/'",
    ),
    (with_change("blocks", "GAIN", value={"type": "Clock"}), DiagramError, "differs only in case"),
    (with_change("connections", value=["clock -> gain"]), FormatError, "'clock -> gain' is not a connection"),
    (with_change("connections", value=["clock/y -> gane/u"]), UnknownNameError, "no block named 'gane'"),
    (with_change("connections", value=["clock/y -> gain/v"]), UnknownNameError, "no input port named 'v'"),
    (
        with_change("connections", value=[*DOCUMENT["connections"], "clock/y -> gain/u"]),
        DiagramError,
        "input 'gain/u' has two drivers",
    ),
    (with_change("connections", value=DOCUMENT["connections"][1:]), DiagramError, "unconnected input"),
    (with_change("layout", "gain", value={"x": 1}), FormatError, "block 'gain' is placed without x or y"),
    (with_change("layout", "gain", value={"x": 1, "y": "a"}), FormatError, "the value is the text 'a'"),
    (with_change("settings", "stop_time", value=None), FormatError, "the value is null"),
    (with_change("settings", "solver", value=3), FormatError, "the value is the number 3"),
    (with_change("name", value=3), FormatError, "the value is the number 3"),
]


@pytest.mark.parametrize(("data", "kind", "message"), FAULTS, ids=[str(i) for i in range(len(FAULTS))])
def test_errors_name_file_and_line(data: bytes, kind: type[ArmblocksError], message: str) -> None:
    with pytest.raises(kind, match=message) as caught:
        read(data)
    assert caught.value.where.startswith("model.json")


def test_a_misspelt_optional_key_is_refused() -> None:
    document = json.loads(write(small()))
    document["setings"] = document.pop("settings")
    with pytest.raises(FormatError, match=r"the key 'setings' is not known here.*did you mean 'settings'"):
        read(json.dumps(document).encode())


def test_an_algebraic_loop_in_a_file_raises_its_own_error_class() -> None:
    document = {
        "format": 1,
        "blocks": {"a": {"type": "ZeroOrderHold", "parameters": {"sample_time": 0.1}}, "b": {"type": "Gain"}},
        "connections": ["a/y -> b/u", "b/y -> a/u"],
    }
    with pytest.raises(AlgebraicLoopError, match="algebraic loop") as caught:
        read(json.dumps(document).encode())
    assert set(caught.value.loop) == {"a/y", "b/y"}
    assert caught.value.where.startswith("model.json")


def test_a_diagram_file_needs_only_the_format_number() -> None:
    diagram = read(b'{"format": 1}')
    assert (diagram.name, len(diagram.blocks), diagram.settings) == ("model", 0, SimulationOptions())


def test_nan_is_never_written() -> None:
    diagram = dataclasses.replace(small(), settings=SimulationOptions(stop_time=math.nan))
    with pytest.raises(FormatError, match=r"settings\.stop_time: the number nan cannot be written"):
        write(diagram)


def test_failed_save_leaves_the_old_file(tmp_path: Path) -> None:
    path = write_diagram(tmp_path / "a.json", small())
    before = path.read_bytes()
    broken = dataclasses.replace(small(), extras={"": {"x": object()}})
    with pytest.raises(FormatError, match="a object cannot be written"):
        write_diagram(path, broken)
    assert path.read_bytes() == before


def test_unknown_and_missing_diagrams_raise_errors_with_their_name(tmp_path: Path) -> None:
    with pytest.raises(
        UnknownNameError, match=r"there is no shipped diagram named 'kr180'.*mean 'kr180model'"
    ):
        load_diagram("kr180", BLOCKS)
    with pytest.raises(FormatError, match="there is no such file"):
        load_diagram(tmp_path / "x.json", BLOCKS)
    with pytest.raises(FormatError, match="this is a folder"):
        load_diagram(tmp_path, BLOCKS)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(st.data())
def test_a_mutated_document_is_read_or_refused_with_a_package_error(data: st.DataObject) -> None:
    document = json.loads(write(EXAMPLE))
    for _ in range(data.draw(st.integers(1, 3))):
        node: Any = document
        while isinstance(node, dict | list) and node:
            key = data.draw(st.sampled_from(list(node) if isinstance(node, dict) else list(range(len(node)))))
            if isinstance(node[key], dict | list) and data.draw(st.booleans()):
                node = node[key]
                continue
            invalid_values = [
                None,
                True,
                -1,
                1e300,
                "",
                "x",
                [],
                {},
                [1, [2]],
                "inf",
                "a/b -> c/d",
                {"robot": []},
            ]
            node[key] = data.draw(st.sampled_from(invalid_values))
            break
    try:
        read(json.dumps(document).encode())
    except (FormatError, UnknownNameError, DiagramError) as error:
        assert error.where.startswith("model.json"), str(error)


def _example() -> Diagram:
    builder = DiagramBuilder("mixed", extras={"": {"vendor": [1]}})
    robot = load_robot("twolink").nofriction()
    q = builder.add("q", Constant(value=(0.0, 1.0)))
    total = builder.add("sum", Sum(signs="+-"), q, q)
    rne = builder.add("rne", Rne(robot=dataclasses.replace(robot, name="mine")), q, total, total)
    builder.add("scope", Scope(), rne)
    builder.place("q", 0, 0)
    return builder.build()


EXAMPLE = _example()


def test_a_description_is_kept_and_may_be_absent() -> None:
    described = dataclasses.replace(small(), description="two blocks <and> a wire")
    assert read(write(described)) == described
    assert "description" not in json.loads(write(small()))


# -- diagrams inside blocks --------------------------------------------------------------------------------


def _nested(depth: int) -> Diagram:
    builder = DiagramBuilder("inner", extras={"": {"colour": "red"}})
    builder.output("y", builder.add("gain", Gain(gain=2.0), builder.input("u", unit="m")))
    builder.comment_through("gain")
    builder.place("gain", 10.0, 20.0)
    diagram = builder.build()
    for level in range(depth):
        builder = DiagramBuilder(f"level {level}")
        builder.output("y", builder.add("sub", Subsystem(diagram=diagram), builder.input("u")))
        diagram = builder.build()
    return diagram


def test_diagrams_inside_blocks_are_written_and_read_again(schema: jsonschema.Draft202012Validator) -> None:
    for depth in (1, 2, 99):
        diagram = _nested(depth)
        data = diagram_to_bytes(diagram, load_robot)
        reread = diagram_from_bytes(data, "model.json", BLOCKS, load_robot)
        assert reread == diagram
        assert diagram_to_bytes(reread, load_robot) == data
        assert data.count(b'"format"') == 1
        assert b'"gain": {"x": 10, "y": 20}' in data
        assert b'"colour": "red"' in data
        if depth < 10:  # the validator recurses
            assert b'"commented": "through"' in data
            schema.validate(json.loads(data))


def test_errors_inside_a_block_have_line_and_path() -> None:
    text = diagram_to_bytes(_nested(1), load_robot).decode()
    invalid = text.replace('"gain": 2', '"gain": "two"')
    line = invalid[: invalid.index('"two"')].count("\n") + 1
    with pytest.raises(FormatError) as caught:
        diagram_from_bytes(invalid.encode(), "model.json", BLOCKS, load_robot)
    assert f"model.json:{line}, blocks.sub.diagram.blocks.gain.parameters.gain" in str(caught.value)
    with pytest.raises(UnknownNameError, match="there is no parameter of Subsystem named 'diagram'"):
        diagram_from_bytes(
            text.replace('"parameters": {}', '"parameters": {"diagram": {}}').encode(),
            "m",
            BLOCKS,
            load_robot,
        )


def test_too_deeply_nested_diagrams_are_refused() -> None:
    start = '{"format": 1, "blocks": {' + '"s": {"type": "Subsystem", "diagram": {"blocks": {' * 110
    with pytest.raises(FormatError, match="objects and arrays are nested too deeply"):
        diagram_from_bytes((start + "}" * 332).encode(), "model.json", BLOCKS, load_robot)

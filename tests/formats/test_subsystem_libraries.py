"""Libraries of subsystems: resolving links, confinement to a folder, nesting limits, breaking links."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import BLOCKS, Constant, Gain, Scope, SineWave, Subsystem
from armblocks.diagram import Diagram, DiagramBuilder, block_count, formula, structure, with_parameters
from armblocks.errors import ArmblocksError, DiagramError, FormatError, UnknownNameError
from armblocks.formats import diagram_from_bytes, diagram_to_bytes, load_robot
from armblocks.formats.subsystem_libraries import MAX_LIBRARY_DEPTH


def amplifier(inside: Subsystem | None = None) -> Diagram:
    builder = DiagramBuilder("Amplifier")
    builder.parameter("k", 2.0, doc="how much", unit="V/V")
    u = builder.input("u")
    if inside is None:
        builder.output("y", builder.add("gain", Gain(gain=formula("k^2")), u))
    else:
        builder.output("y", builder.add("first", inside.with_parameters(k=formula("k+1")), u))
    return builder.build()


def model(block: Subsystem) -> Diagram:
    builder = DiagramBuilder("model")
    builder.parameter("K", 5.0)
    wave = builder.add("wave", SineWave())
    builder.add("scope", Scope(), builder.add("amp", block.with_parameters(k=formula("2*K")), wave))
    return builder.build()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Two libraries, the second of which uses the first, and a model with a block of each."""
    (tmp_path / "parts").mkdir()
    ab.save_library({"Amplifier": amplifier()}, tmp_path / "parts" / "base.json")
    base = ab.load_library(tmp_path / "parts" / "base.json")["Amplifier"]
    ab.save_library({"Double": amplifier(base)}, tmp_path / "more.json")
    ab.save_diagram(model(ab.load_library(tmp_path / "more.json")["Double"]), tmp_path / "model.json")
    return tmp_path


def write_library(path: Path, library: Mapping[str, object]) -> None:
    path.write_text(json.dumps({"format": 1, "library": library}))


def linked_diagram(reference: str) -> dict[str, object]:
    """A diagram with one linked block."""
    return {"blocks": {"part": {"type": "Subsystem", "library": reference}}}


def load(folder: Path, reference: str) -> Diagram:
    data = json.dumps({"format": 1, **linked_diagram(reference)}).encode()
    return diagram_from_bytes(data, "model.json", BLOCKS, load_robot, folder=folder)


def test_a_linked_block_is_the_library_block_with_its_own_parameter_values(folder: Path) -> None:
    diagram = ab.load_diagram(folder / "model.json")
    text = (folder / "model.json").read_text()
    assert '"library": "more.json#Double"' in text
    assert '"gain"' not in text
    assert '"library": "parts/base.json#Amplifier"' in (folder / "more.json").read_text()
    inner = diagram.blocks["amp"].parameter_value("diagram")
    assert isinstance(inner, Diagram)
    assert inner.link == f"{folder.resolve() / 'more.json'}#Double"
    result = ab.simulate(diagram, stop_time=1.0)
    assert np.array_equal(result["amp"], 121.0 * result["wave"])
    assert ab.simulate(diagram, stop_time=1.0, parameters={"K": 1.0})["amp"][-1] == 9 * np.sin(1.0)
    assert block_count(diagram) == 3 + 3 + 3


def test_reading_a_link_uses_the_present_content_of_the_library(folder: Path) -> None:
    diagram = ab.load_diagram(folder / "model.json")
    data = diagram_to_bytes(diagram, load_robot, folder=folder)
    assert data == (folder / "model.json").read_bytes()
    assert diagram_from_bytes(data, "model.json", BLOCKS, load_robot, folder=folder) == diagram
    better = DiagramBuilder("Amplifier")
    k = better.parameter("k", 1.0)
    better.output("y", better.add("gain", Gain(gain=k), better.input("u")))
    ab.save_library({"Amplifier": better.build()}, folder / "parts" / "base.json")
    assert ab.simulate(ab.load_diagram(folder / "model.json"), stop_time=1.0)["amp"][-1] == 11 * np.sin(1.0)


def test_an_unlinked_copy_can_be_changed_inside(folder: Path) -> None:
    diagram = ab.load_diagram(folder / "model.json")
    with pytest.raises(
        DiagramError, match=r"'amp/first.k' is inside the library block.*more.json#Double'.*Allowed: amp.k"
    ):
        with_parameters(diagram, {"amp/first.k": 3.0})
    block = diagram.blocks["amp"]
    assert isinstance(block, Subsystem)
    own = dataclasses.replace(block, diagram=dataclasses.replace(block.diagram, link=""))
    free = dataclasses.replace(diagram, blocks={**diagram.blocks, "amp": own})
    difference = ab.diagram_difference(diagram, free)
    assert [(entry.path, entry.name, entry.after) for entry in difference.parameters] == [
        ("amp", "library", None)
    ]
    written_out = diagram_to_bytes(free, load_robot, folder=folder)
    assert b'"first"' in written_out
    reread = diagram_from_bytes(written_out, "model.json", BLOCKS, load_robot, folder=folder)
    assert reread == free


def test_the_shipped_servo_is_used_six_times() -> None:
    diagram = ab.load_diagram("puma560_servos")
    servos = [block for name, block in diagram.blocks.items() if name.startswith("servo")]
    assert len(servos) == 6
    for block in servos:
        assert isinstance(block, Subsystem)
        assert block.diagram.link == "joint_servos#JointServo"
    assert set(ab.load_library("joint_servos")) == {"JointServo"}
    assert ab.list_libraries() == ("joint_servos",)
    model = ab.compile_diagram(diagram)
    slow, quick = (ab.simulate(model, parameters={"w": w}) for w in (10.0, 40.0))
    errors = [float(np.abs(run["error"]).max()) for run in (slow, quick)]
    # Gravity acts as a disturbance torque; the position error that it causes is proportional to w**-3.
    assert errors[1] < errors[0] / 8
    assert np.abs(quick["q"][-1] - [0.8, 0.6, -1.0, 0.5, 0.4, -0.6]).max() < 1e-4


def cases(folder: Path) -> list[tuple[str, type[ArmblocksError], str]]:
    write_library(folder / "empty.json", {})
    write_library(folder / "circle.json", {"A": linked_diagram("ring.json#B")})
    write_library(
        folder / "ring.json", {"B": linked_diagram("circle.json#A"), "Self": linked_diagram("ring.json#Self")}
    )
    chain = {f"n{k}": linked_diagram(f"deep.json#n{k + 1}") for k in range(MAX_LIBRARY_DEPTH + 5)}
    write_library(folder / "deep.json", {**chain, f"n{MAX_LIBRARY_DEPTH + 5}": {"blocks": {}}})
    pair = {
        f"n{k}": {"blocks": {name: {"type": "Subsystem", "library": f"wide.json#n{k + 1}"} for name in "ab"}}
        for k in range(30)
    }
    write_library(folder / "wide.json", {**pair, "n30": {"blocks": {}}})
    write_library(
        folder / "code.json",
        {"A": {"blocks": {"c": {"type": "Constant", "formulas": {"value": "__import__('os').getcwd()"}}}}},
    )
    write_library(folder / "value.json", {"A": {"mask": [{"name": "k", "kind": "number"}]}})
    write_library(folder / "kind.json", {"A": {"mask": [{"name": "k", "kind": "numbre", "default": 1}]}})
    return [
        ("none.json#A", FormatError, r"model.json.*none.json: there is no such file"),
        ("../outside.json#A", FormatError, "there is no such file"),
        ("empty.json#Amplifier", UnknownNameError, "there is no library block named 'Amplifier'"),
        ("parts/base.json#Amplifire", UnknownNameError, "named 'Amplifire'.*did you mean 'Amplifier'"),
        ("circle.json#A", FormatError, r"in a cycle: circle.json#A -> ring.json#B -> circle.json#A"),
        ("ring.json#Self", FormatError, r"contain each other in a cycle: ring.json#Self -> ring.json#Self"),
        ("deep.json#n0", FormatError, f"nested more than {MAX_LIBRARY_DEPTH} levels deep: deep.json#n0 -> "),
        ("wide.json#n0", FormatError, r"the diagram has \d+ blocks.*at most 1000"),
        ("model.json#A", FormatError, "the key 'library' is missing.*not of a diagram"),
        (
            "joint_servo#A",
            UnknownNameError,
            "no shipped library named 'joint_servo'.*did you mean 'joint_servos'",
        ),
        ("parts/base.txt#A", FormatError, "'parts/base.txt' is not the path of a library"),
        ("base.json", FormatError, "'base.json' is not an entry of a library"),
        ("parts#", FormatError, "'parts#' is not an entry of a library"),
        ("parts\x01/a.json#A", FormatError, "there is no such file"),
        (
            "code.json#A",
            UnknownNameError,
            "parameter 'value'.*no function or mask parameter named '__import__'",
        ),
        ("value.json#A", FormatError, "the key 'default' is missing"),
        ("kind.json#A", FormatError, "'numbre'.*number, array, integer"),
    ]


@pytest.mark.parametrize("number", range(17))
def test_errors_name_file_and_line(folder: Path, number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(structure, "MAX_BLOCKS", 1_000)  # test_named_cases.py covers the actual limit
    reference, kind, message = cases(folder)[number]
    with pytest.raises(kind, match=f"(?s){message}"):
        load(folder, reference)


def test_linked_blocks_accept_only_mask_parameters_of_the_library_block(folder: Path) -> None:
    def read(block: dict[str, object]) -> Diagram:
        data = json.dumps({"format": 1, "blocks": {"part": {"type": "Subsystem", **block}}}).encode()
        return diagram_from_bytes(data, "model.json", BLOCKS, load_robot, folder=folder, draft=True)

    base = {"library": "parts/base.json#Amplifier"}
    assert read({**base, "parameters": {"k": 3}}).blocks["part"].parameter_value("k") == 3.0
    with pytest.raises(
        UnknownNameError, match=r"model.json.*parameter of Subsystem named 'kk'.*did you mean 'k'"
    ):
        read({**base, "parameters": {"kk": 3}})
    with pytest.raises(FormatError, match="'k' has a value and a formula"):
        read({**base, "parameters": {"k": 3}, "formulas": {"k": "2"}})
    with pytest.raises(FormatError, match="the block has a diagram and a library"):
        read({**base, "diagram": {"blocks": {}}})
    with pytest.raises(FormatError, match=r"the formula ends where a value is expected, in column 3: 2\*»"):
        read({**base, "formulas": {"k": "2*"}})
    with pytest.raises(UnknownNameError, match="there is no mask parameter named 'K'"):
        read({**base, "formulas": {"k": "2*K"}})
    top = b'{"format": 1, "mask": [{"name": "K", "kind": "number", "default": 1}], "parameters": {"k": 2}}'
    with pytest.raises(UnknownNameError, match=r"there is no mask parameter named 'k'.*did you mean 'K'"):
        diagram_from_bytes(top, "model.json", BLOCKS, load_robot)


def test_subsystems_may_be_nested_100_levels_deep_and_not_deeper() -> None:
    diagram = Diagram(name="innermost", blocks={"one": Constant()})
    for _ in range(101):
        diagram = Diagram(name="around", blocks={"inside": Subsystem(diagram=diagram)})
    with pytest.raises(DiagramError, match="subsystems are nested more than 100 levels deep"):
        ab.simulate(diagram)

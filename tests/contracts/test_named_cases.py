"""Messages about invalid or implausible diagrams and robots, one per case.

``test_run_input`` covers the settings of runs and sample times.
"""

from __future__ import annotations

import json
import math
import unicodedata
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import armblocks as ab
from armblocks import blocks as bl
from armblocks.diagram import PortRef, structure
from armblocks.diagram.structure import MAX_BLOCKS
from armblocks.errors import AlgebraicLoopError, ArmblocksError, ArmblocksWarning, RobotError
from armblocks.formats import list_robots, load_robot, write_robot
from armblocks.robot import JointLimits, Link, Motor, Prismatic, Revolute, Robot, plausibility_findings
from armblocks.spatial import transl

MAX_CHARACTERS = 400


def message(error: ArmblocksError, folder: Path | None = None) -> str:
    """Return the text of an error, which must name the place and a fix and be short apart from ``folder``."""
    assert error.where
    assert error.fix
    text = str(error) if folder is None else str(error).replace(f"{folder}/", "")
    assert len(text) < MAX_CHARACTERS
    assert text.isprintable()
    return text


# -- diagrams ------------------------------------------------------------------------------------------------


def open_input(builder: ab.DiagramBuilder) -> None:
    builder.add("x", bl.Integrator())


def two_drivers(builder: ab.DiagramBuilder) -> None:
    x = builder.add("x", bl.Integrator(), builder.add("a", bl.Constant()))
    builder.connect(builder.add("b", bl.Constant()), x["u"])


def dangling_connection(builder: ab.DiagramBuilder) -> None:
    x = builder.add("x", bl.Gain(gain=2.0))
    builder.connect(PortRef("nowhere", "y"), x["u"])


def different_widths(builder: ab.DiagramBuilder) -> None:
    two = builder.add("two", bl.Constant(value=[1.0, 2.0]))
    three = builder.add("three", bl.Constant(value=[1.0, 2.0, 3.0]))
    builder.add("sum", bl.Sum(signs="++"), two, three)


def loop_without_state(builder: ab.DiagramBuilder) -> None:
    first = builder.add("first", bl.Gain(gain=2.0))
    second = builder.add("second", bl.Gain(gain=0.5), first)
    builder.connect(second, first["u"])


def blocks_named(*names: str) -> Callable[[ab.DiagramBuilder], None]:
    def build(builder: ab.DiagramBuilder) -> None:
        for name in names:
            builder.add(name, bl.Constant())

    return build


def code_in_formula(builder: ab.DiagramBuilder) -> None:
    builder.add("f", bl.Expression(formula="__import__('os').system('true')"), builder.add("c", bl.Clock()))


def deep_nesting(builder: ab.DiagramBuilder) -> None:
    inner = ab.DiagramBuilder("max_depth")
    inner.add("c", bl.Constant())
    diagram = inner.build()
    for _ in range(101):
        outer = ab.DiagramBuilder("level")
        outer.add("s", bl.Subsystem(diagram=diagram))
        diagram = outer.draft()
    builder.add("s", bl.Subsystem(diagram=diagram))


def exponential_nesting(builder: ab.DiagramBuilder) -> None:
    """A diagram of 2^60 blocks, built from 60 nested subsystems that occur twice each."""
    inner = ab.DiagramBuilder("leaf")
    inner.add("c", bl.Constant())
    diagram = inner.draft()
    for _ in range(60):
        outer = ab.DiagramBuilder("level")
        outer.add("a", bl.Subsystem(diagram=diagram))
        outer.add("b", bl.Subsystem(diagram=diagram))
        diagram = outer.draft()
    builder.add("s", bl.Subsystem(diagram=diagram))


INVALID_DIAGRAMS: list[tuple[str, Callable[[ab.DiagramBuilder], None], str]] = [
    ("an unconnected input", open_input, "1 unconnected input: x/u"),
    ("two drivers", two_drivers, "input 'x/u' has two drivers, 'a/y' and 'b/y'"),
    ("a connection from a missing block", dangling_connection, "there is no block named 'nowhere'"),
    ("widths that differ", different_widths, "'u1' has shape (2,) and 'u2' has shape (3,)"),
    ("a loop without state", loop_without_state, "first/y -> second/y -> first/y"),
    ("a name that differs by case", blocks_named("Motor", "motor"), "'motor': a block is named 'Motor'"),
    (
        "a name that differs by accents",
        blocks_named("Gr\u00f6\u00dfe", unicodedata.normalize("NFD", "Gr\u00f6\u00dfe")),
        "differs only in case or Unicode encoding",
    ),
    ("a name with a slash", blocks_named("a/b"), "the block name 'a/b' contains '/'"),
    ("a name with a line break", blocks_named("a\nb"), r"the block name 'a\nb' contains '\n'"),
    ("a name with a right-to-left mark", blocks_named("a\u202eb"), r"contains '\u202e'"),
    ("a name of 10 000 characters", blocks_named("a" * 10_000), "has 10000 characters"),
    ("an empty name", blocks_named(" "), "a block has an empty name"),
    ("a formula that is code", code_in_formula, "no function named '__import__'"),
    ("101 nested subsystems", deep_nesting, "subsystems are nested more than 100 levels deep"),
    ("2^60 blocks", exponential_nesting, f"Allowed: at most {MAX_BLOCKS}"),
]


@pytest.mark.parametrize(
    ("build", "words"), [case[1:] for case in INVALID_DIAGRAMS], ids=[c[0] for c in INVALID_DIAGRAMS]
)
def test_an_invalid_diagram_is_refused_with_one_message(
    build: Callable[[ab.DiagramBuilder], None], words: str
) -> None:
    builder = ab.DiagramBuilder("case")
    with pytest.raises(ArmblocksError) as caught:
        build(builder)
        ab.simulate(builder.build(), stop_time=1.0)
    assert words in message(caught.value)


def test_the_error_about_an_algebraic_loop_lists_its_signals() -> None:
    builder = ab.DiagramBuilder("case")
    loop_without_state(builder)
    with pytest.raises(AlgebraicLoopError) as caught:
        ab.simulate(builder.build(), stop_time=1.0)
    assert sorted(caught.value.loop) == ["first/y", "second/y"]


@pytest.mark.parametrize("name", ['"quoted"', "<script>alert(1)", "it's", "\u0645\u062d\u0631\u0643", "a b"])
def test_unusual_block_names_are_allowed_and_kept_in_files(name: str, tmp_path: Path) -> None:
    builder = ab.DiagramBuilder("case")
    builder.add("x", bl.Integrator(), builder.add(name, bl.Constant(value=2.0)))
    path = tmp_path / "case.json"
    ab.save_diagram(builder.build(), path)
    assert ab.simulate(ab.load_diagram(path), stop_time=1.0)[name] == pytest.approx(2.0)


def test_a_million_blocks_are_refused_while_they_are_built() -> None:
    builder = ab.DiagramBuilder("case")
    block = bl.Constant()
    with pytest.raises(ArmblocksError) as caught:
        for k in range(1_000_000):
            builder.add(f"c{k}", block)
    text = message(caught.value)
    assert f"case': the diagram has {MAX_BLOCKS + 1} blocks" in text
    assert "use vectors" in text


def test_a_file_with_too_many_blocks_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(structure, "MAX_BLOCKS", 1_000)  # the test above covers the actual limit
    blocks: dict[str, Any] = {f"c{k}": {"type": "Ground"} for k in range(1_001)}
    path = tmp_path / "case.json"
    path.write_text(json.dumps({"format": 1, "name": "case", "blocks": blocks}), encoding="utf-8")
    with pytest.raises(ArmblocksError) as caught:
        ab.load_diagram(path)
    assert "at most 1000" in message(caught.value)


def test_a_library_block_that_contains_itself_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    linked = {"s": {"type": "Subsystem", "library": "circle.json#a"}}
    (tmp_path / "circle.json").write_text(
        json.dumps({"format": 1, "library": {"a": {"blocks": linked}}}), encoding="utf-8"
    )
    (tmp_path / "case.json").write_text(
        json.dumps({"format": 1, "name": "case", "blocks": linked}), encoding="utf-8"
    )
    with pytest.raises(ArmblocksError) as caught:
        ab.load_diagram("case.json")
    assert "library blocks that do not contain themselves" in message(caught.value, tmp_path)


# -- robots --------------------------------------------------------------------------------------------------


def arm(*, joint: Any = None, length: float = 1.0, motor: Motor | None = None, **fields: Any) -> Robot:
    """A bar of 1 kg with one joint."""
    inertia = fields.pop("inertia", (0.0, 0.1, 0.1))
    link = Link(
        name="bar",
        joint=joint or Revolute(),
        after=transl(length, 0, 0),
        mass=1.0,
        inertia=inertia,
        motor=motor,
    )
    return Robot(name="arm", links=(link,), **fields)


def joint_with_limits(low: float, high: float, kind: Any = Revolute) -> Any:
    return kind(limits=JointLimits(position=(low, high)))


INVALID_ROBOTS: list[tuple[dict[str, Any], str]] = [
    ({"motor": Motor(gear_ratio=0.0)}, "the gear ratio is 0, so the motor cannot move the joint"),
    ({"joint": joint_with_limits(1.0, -1.0)}, "the position limits are reversed: from 1 to -1 rad"),
    ({"gravity": (0.0, 0.0, math.nan)}, "gravity is nan"),
]


@pytest.mark.parametrize(("fields", "words"), INVALID_ROBOTS, ids=["gear 0", "qlim reversed", "gravity nan"])
def test_an_invalid_robot_is_refused_with_one_message(fields: dict[str, Any], words: str) -> None:
    with pytest.raises(RobotError) as caught:
        arm(**fields)
    assert words in message(caught.value)


def test_a_motor_without_a_gear_has_the_ratio_1() -> None:
    assert Motor(inertia=0.5).gear_ratio == 1.0
    assert arm().gear_ratios.tolist() == [1.0]


def test_negative_viscous_friction_raises_a_warning() -> None:
    with pytest.warns(ArmblocksWarning, match="friction accelerates the joint instead of braking"):
        arm(motor=Motor(viscous_friction=-0.1))


IMPLAUSIBLE_ROBOTS: list[tuple[dict[str, Any], str]] = [
    ({"joint": joint_with_limits(-180.0, 180.0)}, "link 'bar': the joint turns from -180 to 180 rad"),
    ({"length": 450.0}, "the reach is 450 m. Are its lengths in millimetres?"),
    ({"joint": joint_with_limits(0.0, 800.0, Prismatic)}, "Are its lengths in millimetres?"),
    ({"inertia": (0.0, 1e5, 1e5)}, "belongs to 1 kg at a distance of 316.228 m, while the robot reaches 1 m"),
    (
        {"gravity": (0.0, 0.0, 9.81)},
        "so that bodies fall upwards. Does it have the sign of the Robotics Toolbox?",
    ),
]


@pytest.mark.parametrize(
    ("fields", "words"),
    IMPLAUSIBLE_ROBOTS,
    ids=["degrees", "millimetres", "millimetres of travel", "kg mm2", "gravity up"],
)
def test_a_probable_error_of_unit_or_sign_raises_a_warning(
    fields: dict[str, Any], words: str, tmp_path: Path
) -> None:
    (text,) = map(str, plausibility_findings(arm(**fields)))
    assert words in text
    assert len(text) < MAX_CHARACTERS
    (tmp_path / "arm.json").write_bytes(write_robot(arm(**fields)))
    with pytest.warns(ArmblocksWarning) as caught:
        load_robot(str(tmp_path / "arm.json"))
    assert text in [str(warning.message) for warning in caught]


def test_plausible_robots_raise_no_warnings() -> None:
    assert plausibility_findings(arm(joint=joint_with_limits(-2 * math.pi, 2 * math.pi))) == ()
    assert plausibility_findings(arm(length=5.0, gravity=(0.0, 0.0, -1.62))) == ()
    assert plausibility_findings(arm(gravity=np.zeros(3))) == ()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for name in list_robots():
            findings = plausibility_findings(load_robot(name))
            # The ranges of industrial arms exceed a full turn; tests compare them with their sources.
            assert [finding for finding in findings if "more than a full turn" not in finding.what] == []

"""Subsystems, masks and links in generated Python code."""

from __future__ import annotations

from pathlib import Path

import pytest

import armblocks as ab
from armblocks.blocks import EnabledSubsystem, Gain, Integrator, RobotPlot, Scope, SineWave, Step, Subsystem
from armblocks.diagram import Diagram, DiagramBuilder, formula
from armblocks.formats import diagram_to_python


def inner(robot: object = None) -> Diagram:
    builder = DiagramBuilder("inner")
    a = builder.parameter("a", 1.0, unit="1/s", doc='how "fast"', above=0.0, maximum=9.0)
    builder.parameter("way", "up", choices=("up", "down"))
    if robot is not None:
        builder.parameter("arm", robot, kind="robot")
        builder.add("arm", RobotPlot(robot=formula("arm")), builder.input("q"))
    builder.output("y", builder.add("builder", Integrator(initial=formula("2*a")), builder.input("u")))
    builder.add("gain", Gain(gain=a), builder["u"])
    return builder.build()


def whole(folder: Path) -> Diagram:
    ab.save_library({"Inner": inner()}, folder / "parts.json")
    linked = ab.load_library(folder / "parts.json")["Inner"]
    arm = ab.load_robot("twolink").robot
    builder = DiagramBuilder("whole")
    builder.parameter("K", 3.0, value=4.0)
    wave, on = builder.add("wave", SineWave()), builder.add("on", Step())
    builder.add("linked", linked.with_parameters(a=formula("K/2")), wave)
    enabled = EnabledSubsystem(diagram=linked.diagram, states_when_enabling="reset")
    builder.add("enabled", enabled, wave, on)
    own = Subsystem(diagram=inner(arm)).with_parameters(a=2.0, way="down")
    q = builder.add("q", SineWave(amplitude=[0.1, 0.2]))
    builder.add("own", own, q=q, u=wave)
    builder.add("scope", Scope(inputs=2), builder["own"], builder["linked"])
    return builder.build()


def test_the_generated_code_builds_the_same_diagram(tmp_path: Path) -> None:
    diagram = whole(tmp_path)
    text = diagram_to_python(diagram)
    assert 'builder.parameter("K", 3.0, value=4.0)' in text
    assert "inner_inside" not in text
    assert '.with_parameters(a=ab.formula("K/2"))' in text
    assert f'ab.load_library("{tmp_path.resolve() / "parts.json"}")["Inner"]' in text
    # The code is generated from the diagram above.
    scope: dict[str, object] = {}
    exec(compile(text, "listing", "exec"), scope)  # noqa: S102
    difference = ab.diagram_difference(diagram, scope["diagram"])  # pyright: ignore
    assert not difference, difference


def test_show_prints_the_tree(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from armblocks.cli.show import show

    ab.save_diagram(whole(tmp_path), tmp_path / "whole.json")
    show(str(tmp_path / "whole.json"))
    text = capsys.readouterr().out.replace("\u00a0", " ")
    assert text.startswith("whole  7 blocks (21 including inner blocks), 7 wires")
    assert "K = 4" in text
    assert "enabled  enabled subsystem  from parts.json#Inner  4 blocks, 3 wires" in text
    assert "a = 2 1/s (from K/2), way" in text
    show(str(tmp_path / "whole.json"), flat=True)
    text = capsys.readouterr().out
    assert "own/builder" in text
    assert "initial=4" in text
    show(str(tmp_path / "parts.json"))
    assert capsys.readouterr().out.startswith("inner  4 blocks, 3 wires")
    show("joint_servos")
    assert "bandwidth: the triple pole of the position loop" in capsys.readouterr().out

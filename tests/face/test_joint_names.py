"""Entries of joint signals have the names of the links in data columns, views and the studio."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import pytest

import armblocks as ab
from armblocks.blocks import Constant, CumulativeSum, Gain, JTraj, Mux, Rne, RobotPlot, Scope
from armblocks.diagram import diagram_views
from armblocks.diagram.entry_names import entry_names
from armblocks.pictures.picture import text_marks
from armblocks.report.figures import view_figures
from armblocks.studio.notebook import _record
from armblocks.studio.runs.worker import _Run

JOINTS = ("shoulder", "elbow")


def robot(*names: str) -> ab.Robot:
    plain = ab.load_robot("twolink").robot
    parents = (None, *names)
    links = zip(plain.links, names, parents)
    return replace(plain, links=tuple(replace(link, name=n, parent=p) for link, n, p in links))


@pytest.fixture(scope="module")
def diagram() -> ab.Diagram:
    arm, builder = robot(*JOINTS), ab.DiagramBuilder("named")
    motion = builder.add("motion", JTraj(q0=[0, 0], qf=[1, -1], tmax=1.0))
    builder.add("plot", RobotPlot(robot=arm), motion["q"])
    torque = builder.add("rne", Rne(robot=arm), motion["q"], motion["qd"], motion["qdd"])
    builder.add("scope", Scope(), torque)
    builder.add("half", Gain(gain=0.5), motion["q"])
    builder.add("halves", Scope(), builder["half"])
    builder.add("other", Scope(), builder.add("pair", Constant(value=[1.0, 2.0])))
    return builder.build()


@pytest.fixture(scope="module")
def result(diagram: ab.Diagram) -> ab.SimulationResult:
    return ab.simulate(diagram, stop_time=1.0)


def test_data_columns_have_the_names_of_the_joints(
    diagram: ab.Diagram, result: ab.SimulationResult, tmp_path: Path
) -> None:
    expected = [f"{path}[{joint}]" for path in ("motion/q", "rne/tau", "half/y") for joint in JOINTS]
    assert {*expected, "pair/y[0]", "pair/y[1]"} <= set(result.columns())
    assert list(result.to_dataframe().columns) == list(result.columns())
    result.save(tmp_path / "data.csv")
    ab.simulate(diagram, stop_time=1.0, log=tmp_path / "log.csv", log_signals=["motion/q", "rne/tau"])
    for file in ("data.csv", "log.csv"):
        with (tmp_path / file).open(encoding="utf-8", newline="") as stream:
            heading = next(csv.reader(stream))
        assert set(expected[:4]) <= set(heading)


def test_views_have_the_names_of_the_joints(diagram: ab.Diagram, result: ab.SimulationResult) -> None:
    assert "rad      shoulder, elbow" in repr(result)
    assert ">shoulder</i>" in result._repr_html_()
    figures = {figure.name: figure for figure in view_figures(diagram, result)}
    for name in ("scope-scope", "scope-halves"):
        assert set(JOINTS) <= {mark.text for mark in text_marks(figures[name].picture)}


def test_messages_to_the_studio_and_its_widgets_have_the_joint_names(
    diagram: ab.Diagram, result: ab.SimulationResult
) -> None:
    class Pipe:
        def send_bytes(self, data: bytes) -> None:
            self.message = json.loads(data[1:])

    pipe = Pipe()
    run = _Run(pipe, {"run": "r", "document": "d", "speed": None, "tuned": {}})
    run._notify_start(ab.begin(diagram))
    _, shown, _ = _record(diagram_views(diagram), result)
    for channels in (pipe.message["channels"], shown["channels"]):
        entries = {channel["name"]: tuple(channel["entries"]) for channel in channels}
        assert entries["rne/tau"] == entries["half/y"] == JOINTS
        assert entries["pair/y"] == ()


def test_only_signals_of_a_single_robot_have_joint_names() -> None:
    builder = ab.DiagramBuilder("two")
    q = builder.add("q", Constant(value=[1.0, 2.0]))
    builder.add("one", RobotPlot(robot=robot(*JOINTS)), q)
    builder.add("other", RobotPlot(robot=robot("left", "right")), q)
    both = builder.add("both", Mux(inputs=2), builder.add("a", Constant()), builder.add("b", Constant()))
    builder.add("third", RobotPlot(robot=robot(*JOINTS)), both)
    shapes = {"q/y": (2,), "both/y": (2,), "a/y": (), "b/y": (), "one/poses": (4, 4, 4)}
    builder.add("sums", CumulativeSum(), both)  # the entries are not those of single joints
    shapes["sums/y"] = (2,)
    assert entry_names(builder.build(), shapes) == {"both/y": JOINTS}
    assert entry_names(ab.load_diagram("van_der_pol_pid"), {}) == {}

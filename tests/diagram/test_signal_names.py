"""Names of signals: unique on their sheet, and used by results, data files, legends and drawings."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.io import loadmat

import armblocks as ab
from armblocks.blocks import BLOCKS, BusCreator, EnabledSubsystem, Gain, Scope, SineWave
from armblocks.diagram import (
    Diagram,
    DiagramBuilder,
    PortRef,
    content_key,
    diagram_difference,
    diagram_views,
    with_comments,
)
from armblocks.drawing.diagram_drawing import diagram_svg
from armblocks.errors import DiagramError, UnknownNameError
from armblocks.formats import diagram_from_bytes, diagram_to_bytes, load_robot
from armblocks.studio.protocol.messages.sheet_edits import (
    AddBlocks,
    GroupBlocks,
    NameSignal,
    NewBlock,
    PasteBlocks,
    Place,
    RemoveBlocks,
    Rename,
)
from armblocks.studio.sheet.clipping import clipped
from armblocks.studio.sheet.document import Document
from armblocks.studio.sheet.nesting import inside
from armblocks.studio.sheet.placing import placed


def model() -> Diagram:
    builder = DiagramBuilder("named")
    sine = builder.add("sine", SineWave(amplitude=[1.0, 2.0]))
    gain = builder.add("gain", Gain(gain=2.0), sine)
    builder.name_signal(gain, "speed")
    with builder.subsystem("sub", gain) as sub:
        k = sub.add("k", Gain(gain=3.0), sub.input("u"))
        sub.name_signal(k, "inner w")
        sub.output("y", k)
        sub.log(k)
    builder.name_signal(builder["sub"], "torque")
    bus = builder.add("bus", BusCreator(names="a, b"), gain, sine)
    builder.name_signal(bus, "both")
    builder.add("scope", Scope(inputs=3), gain, builder["sub"], bus)
    builder.log(gain)
    return builder.build()


def test_results_are_found_by_the_names_of_signals() -> None:
    result = ab.simulate(model(), stop_time=1.0, sample_time=0.1)
    for name, path in (("speed", "gain/y"), ("torque", "sub/k/y"), ("sub/inner w", "sub/k/y")):
        assert np.array_equal(result[name], result[path])
        assert name in result
    assert np.array_equal(result["both.a"], result["gain/y"])
    with pytest.raises(UnknownNameError, match=r"'sped'.*'speed'"):
        _ = result["sped"]


def test_columns_files_views_and_drawings_have_the_names(tmp_path: Path) -> None:
    """A signal with several names is stored under its name on the outermost sheet."""
    diagram = model()
    result = ab.simulate(diagram, stop_time=1.0, sample_time=0.1)
    assert sorted(result.columns()) == [
        f"{name}[{entry}]" for name in ("both.b", "speed", "torque") for entry in (0, 1)
    ]
    for suffix in ("csv", "npz", "mat"):
        result.save(tmp_path / f"run.{suffix}")
    assert (tmp_path / "run.csv").read_text().splitlines()[0].count("torque[") == 2
    with np.load(tmp_path / "run.npz") as arrays:
        assert np.array_equal(arrays["torque"], result.with_jumps()["torque"])
    assert np.array_equal(loadmat(tmp_path / "run.mat")["torque"], result.with_jumps()["torque"])
    assert [view.title for _, view in diagram_views(diagram)][-2:] == ["speed", "sub/inner w"]
    svg = diagram_svg(diagram)
    assert all(f">{name}</text>" in svg for name in ("speed", "torque", "both"))


def test_files_contain_every_legal_name(tmp_path: Path) -> None:
    """Signal names may equal parameter names of ``numpy.savez`` or contain separators of CSV files."""
    builder = DiagramBuilder("names")
    names = ("file", "allow_pickle", "kwds", "args", "self", "arr_0", 'a, "b"', "time 2")
    for number, name in enumerate(names):
        sine = builder.add(f"sine {number}", SineWave(amplitude=number + 1.0))
        builder.name_signal(sine, name)
        builder.log(sine)
    result = ab.simulate(builder.build(), stop_time=1.0, sample_time=0.1)
    for suffix in ("csv", "npz", "parquet"):
        path = tmp_path / f"run.{suffix}"
        result.save(path)
        if suffix == "npz":
            with np.load(path) as archive:
                columns = dict(archive)
        else:
            columns = pd.read_csv(path) if suffix == "csv" else pd.read_parquet(path)
        for number, name in enumerate(names):
            assert np.array_equal(columns[name], result[f"sine {number}/y"]), (suffix, name)


def test_names_follow_comments() -> None:
    result = ab.simulate(with_comments(model(), {"sub": "out", "gain": "through"}), stop_time=1.0)
    assert np.array_equal(result["speed"], result["sine"])
    assert not result["torque"].any()
    assert "sub/inner w" not in result


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("speed", "named 'speed', like the signal 'gain/y'"),
        ("SPEED", "named 'SPEED', like the signal 'gain/y'"),
        ("sub", "named 'sub', like the block 'sub'"),
        ("a/b", "the signal name 'a/b' contains '/'"),
        (" ", "a signal has an empty name"),
        *((name, "a name that data files use for other columns") for name in ("Time", "run", "v[0]")),
    ],
)
def test_a_name_that_is_not_unique_or_not_legal_is_refused(name: str, message: str) -> None:
    diagram = model()
    names = {**diagram.signal_names, PortRef("sine", "y"): name}
    with pytest.raises(DiagramError, match=message):
        dataclasses.replace(diagram, signal_names=names)
    builder = DiagramBuilder("x")
    gain = builder.add("sub", Gain(), builder.add("gain", SineWave()))
    builder.name_signal(builder["gain"], "speed")
    with pytest.raises(DiagramError, match=message):
        builder.name_signal(gain, name)


def test_a_signal_cannot_have_the_name_of_a_control_input() -> None:
    inner = DiagramBuilder("inner")
    k = inner.add("k", Gain(), inner.input("u"))
    inner.name_signal(k, "enable")
    inner.output("y", k)
    with pytest.raises(DiagramError, match="an inner block or signal is named 'enable'"):
        EnabledSubsystem(diagram=inner.build())


def test_files_programs_keys_and_differences_contain_the_names() -> None:
    diagram = model()
    reread = diagram_from_bytes(diagram_to_bytes(diagram, load_robot), "m", BLOCKS, load_robot)
    assert reread == diagram
    program = ab.to_python(diagram)
    namespace: dict[str, Any] = {}
    exec(program.rpartition("result = ")[0], namespace)  # noqa: S102 - the generated program
    assert not diagram_difference(namespace["diagram"], diagram)
    plain = dataclasses.replace(diagram, signal_names={})
    assert content_key(plain) != content_key(diagram)
    names = diagram_difference(plain, diagram).signal_names
    assert [(entry.path, entry.after) for entry in names] == [
        ("bus/bus", "both"),
        ("gain/y", "speed"),
        ("sub/y", "torque"),
    ]
    invalid = diagram_to_bytes(diagram, load_robot).replace(b'"gain/y": "speed"', b'"gain/y": "sub"')
    with pytest.raises(DiagramError, match=r"signal_names.*like the block 'sub'"):
        diagram_from_bytes(invalid, "wrong", BLOCKS, load_robot)


def test_edits_keep_names_with_their_signals() -> None:
    document = Document(placed(model()), load_robot)
    document.edit(NameSignal(port="sine/y", name=" reference "))
    assert document.undo_title == "name sine/y"
    document.edit(Rename(block="gain", name="amplifier"))
    assert document.diagram.signal_names[PortRef("amplifier", "y")] == "speed"
    with pytest.raises(DiagramError, match="like the block 'torque'"):
        document.edit(AddBlocks(blocks=[NewBlock(name="torque", type="Clock", place=Place(x=0.0, y=0.0))]))
    text = clipped(document.diagram, ["amplifier", "sine"], [], load_robot)
    document.edit(PasteBlocks(text=text, names={"amplifier": "second", "sine": "speed 2"}))
    assert document.diagram.signal_names[PortRef("second", "y")] == "speed 3"
    assert document.diagram.signal_names[PortRef("speed 2", "y")] == "reference 2"
    document.edit(RemoveBlocks(blocks=["second", "speed 2"]))
    before = document.diagram
    document.edit(GroupBlocks(blocks=["amplifier"], name="group"))
    grouped, inner = document.diagram, inside(document.diagram, ["group"])
    assert inner.signal_names == {PortRef("amplifier", "y"): "speed"}
    assert "speed" in grouped.signal_names.values()
    one, other = (ab.simulate(diagram, stop_time=1.0) for diagram in (before, grouped))
    assert np.array_equal(one["speed"], other["speed"])
    document.edit(NameSignal(port="sine/y", name=""))
    assert document.undo_title == "remove the name of sine/y"
    assert PortRef("sine", "y") not in document.diagram.signal_names

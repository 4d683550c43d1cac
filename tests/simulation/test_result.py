"""Results: access by name, tables, files, and the notebook representation."""

from __future__ import annotations

import dataclasses
import io
import json
import os
import re
import stat
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import casadi as ca
import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from scipy.io import loadmat
from small_systems import NOTHING, system

from armblocks.equations import Signature, SimulationOptions, Slot, signature
from armblocks.errors import FormatError, UnknownNameError
from armblocks.integration.system import compile_system
from armblocks.simulation import RunReport, SimulationResult, simulate

SIGNALS = signature(
    ("clock/y", (), "s"), ("rne/tau", (2,), "N m"), ("fkine/T", (2, 2)), ("poses/T", (2, 1, 2), "m")
)


@pytest.fixture(scope="module")
def result() -> SimulationResult:
    arm = system(
        "arm",
        signals=SIGNALS,
        outputs=lambda t, x, p: ca.vertcat(t, ca.sin(t), p[0] * t, t, t + 1, t + 2, t + 3, 4, 5, 6, 7),
        parameters=signature(("rne.load", (), "kg")),
        values=(1 / 3,),
        aliases={"clock": "clock/y", "rne": "rne/tau", "scope/u": "rne/tau"},
    )
    return simulate(compile_system(arm), SimulationOptions(stop_time=2.0, sample_time=0.1))


def test_signals_have_their_shapes_and_share_the_memory_of_the_result(result: SimulationResult) -> None:
    t = result.time
    assert result["clock/y"].shape == (21,)
    assert result["rne/tau"].shape == (21, 2)
    np.testing.assert_array_equal(result["rne/tau"][:, 1], (1 / 3) * t)
    assert result["fkine/T"].shape == (21, 2, 2)
    np.testing.assert_array_equal(result["fkine/T"][:, 1, 0], t + 2)
    assert result["poses/T"].shape == (21, 2, 1, 2)
    assert result["poses/T"][3].tolist() == [[[4, 5]], [[6, 7]]]
    for name in result.names:
        assert np.shares_memory(result[name], result.signals)


def test_signals_are_found_by_block_name_and_by_input_port(result: SimulationResult) -> None:
    np.testing.assert_array_equal(result["clock"], result.time)
    np.testing.assert_array_equal(result["scope/u"], result["rne/tau"])
    assert "scope/u" in result
    assert "clock/y" in result
    assert "nothing" not in result
    assert result.resolve("rne") == "rne/tau"


def test_an_unknown_signal_is_refused_with_the_nearest_name(result: SimulationResult) -> None:
    with pytest.raises(
        UnknownNameError, match=r"arm: there is no signal named 'rne/tua'.*did you mean 'rne/tau'"
    ):
        result["rne/tua"]


def test_a_result_has_names_units_and_parameters(result: SimulationResult) -> None:
    assert result.names == ("clock/y", "rne/tau", "fkine/T", "poses/T")
    assert result.units["rne/tau"] == "N m"
    assert result.parameters["rne.load"] == 1 / 3


def test_results_and_reports_are_immutable(result: SimulationResult) -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        result.name = "other"  # pyright: ignore
    with pytest.raises(dataclasses.FrozenInstanceError):
        result.run.complete = False  # pyright: ignore


def test_a_dataframe_has_one_column_per_scalar(result: SimulationResult) -> None:
    frame = result.to_dataframe()
    assert frame.index.name == "time"
    assert list(frame.columns[:5]) == ["clock/y", "rne/tau[0]", "rne/tau[1]", "fkine/T[0,0]", "fkine/T[0,1]"]
    assert "poses/T[1,0,1]" in frame.columns
    np.testing.assert_array_equal(frame["rne/tau[1]"].to_numpy(), result["rne/tau"][:, 1])
    assert frame.attrs["units"]["clock/y"] == "s"
    assert frame.attrs["run"]["complete"] is True


def incomplete(result: SimulationResult) -> SimulationResult:
    run = dataclasses.replace(result.run, complete=False, message="stopped by Ctrl-C at 2 s of 10 s")
    return dataclasses.replace(result, run=run)


def test_a_csv_file_keeps_every_bit(result: SimulationResult, tmp_path: Path) -> None:
    result.save(tmp_path / "run.csv")
    frame = pd.read_csv(tmp_path / "run.csv", index_col="time")
    assert frame.index.to_numpy().tobytes() == result.time.tobytes()
    assert np.ascontiguousarray(frame.to_numpy().T).tobytes() == result.signals.tobytes()


def test_a_parquet_file_keeps_every_bit_and_the_run_report(result: SimulationResult, tmp_path: Path) -> None:
    incomplete(result).save(tmp_path / "run.parquet")
    table = pq.read_table(str(tmp_path / "run.parquet"))
    assert table.column_names[0] == "time"
    frame = pd.read_parquet(tmp_path / "run.parquet").set_index("time")
    assert list(frame.columns) == list(result.columns())
    assert np.ascontiguousarray(frame.to_numpy().T).tobytes() == result.signals.tobytes()
    assert table.schema.metadata is not None
    description = json.loads(table.schema.metadata[b"armblocks"])
    assert description["run"]["complete"] is False
    assert description["units"]["rne/tau"] == "N m"
    assert description["parameters"] == {"rne.load": 1 / 3}


def test_an_npz_file_keeps_every_signal_with_its_shape(result: SimulationResult, tmp_path: Path) -> None:
    incomplete(result).save(str(tmp_path / "run.npz"))
    with np.load(tmp_path / "run.npz", allow_pickle=False) as data:
        assert data["time"].tobytes() == result.time.tobytes()
        for name in result.names:
            np.testing.assert_array_equal(data[name], result[name], strict=True)
        assert json.loads(str(data["run"]))["run"]["complete"] is False


def test_a_mat_file_has_one_structure_per_block(result: SimulationResult, tmp_path: Path) -> None:
    incomplete(result).save(tmp_path / "run.mat")
    data = loadmat(tmp_path / "run.mat", squeeze_me=True, struct_as_record=False)
    np.testing.assert_array_equal(data["time"], result.time)
    np.testing.assert_array_equal(data["rne"].tau, result["rne/tau"])
    np.testing.assert_array_equal(data["fkine"].T, result["fkine/T"])
    assert not data["run"].complete
    assert [row[1] for row in data["paths"]] == ["clock.y", "rne.tau", "fkine.T", "poses.T"]


def result_with_signals(*names: str) -> SimulationResult:
    layout = Signature(tuple(Slot(name) for name in names))
    return SimulationResult(
        name="named",
        time=np.arange(3.0),
        signals_layout=layout,
        signals=np.arange(3.0 * len(names)).reshape(len(names), 3),
        states_layout=NOTHING,
        states=np.empty((3, 0)),
        parameters_layout=NOTHING,
        parameter_values=np.empty(0),
        aliases={},
        run=RunReport(solver="none", reason=""),
    )


def test_names_that_are_invalid_in_matlab_are_changed_and_listed(tmp_path: Path) -> None:
    result = result_with_signals("my block/out 1", "my_block/out_1", "1st/y", "time/y", "arm/ü")
    result.save(tmp_path / "run.mat")
    data = loadmat(tmp_path / "run.mat", squeeze_me=True, struct_as_record=False)
    places = {row[0]: row[1] for row in data["paths"]}
    assert len(set(places.values())) == 5
    for name, place in places.items():
        block, field = place.split(".")
        assert re.fullmatch(r"[A-Za-z]\w*", block)
        np.testing.assert_array_equal(getattr(data[block], field), result[name])
    np.testing.assert_array_equal(data["time"], result.time)


def test_an_unknown_suffix_is_refused(result: SimulationResult, tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match=r"no file type named '\.parq'.*did you mean '\.parquet'"):
        result.save(tmp_path / "run.parq")
    with pytest.raises(UnknownNameError, match=r"no file type named 'run'.*\.csv, \.mat, \.npz, \.parquet"):
        result.save(tmp_path / "run")


def test_a_failed_save_is_reported_and_leaves_no_new_file(
    result: SimulationResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(FormatError, match=r"the folder .*missing' does not exist.*create the folder"):
        result.save(tmp_path / "missing" / "run.csv")
    old = tmp_path / "run.csv"
    old.write_text("old")

    def full(handle: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(FormatError, match=r"No space left on device.*free space"):
        result.save(old)
    assert old.read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["run.csv"]


@pytest.mark.skipif(os.name == "nt", reason="POSIX permissions")
def test_files_have_ordinary_permissions(result: SimulationResult, tmp_path: Path) -> None:
    previous = os.umask(0o022)
    try:
        result.save(tmp_path / "run.csv")
    finally:
        os.umask(previous)
    assert stat.S_IMODE((tmp_path / "run.csv").stat().st_mode) == 0o644


def test_the_text_representation_lists_run_and_signals(result: SimulationResult) -> None:
    text = repr(result)
    assert "arm: 21 samples to 2 s, 4 signals, no solver needed" in text
    assert re.search(r"rne/tau +2 +N m", text)
    assert "INCOMPLETE" not in text
    assert "INCOMPLETE" in repr(incomplete(result))
    assert "Ctrl-C" in repr(incomplete(result))


def drawings(html: str) -> list[ElementTree.Element]:
    return [ElementTree.parse(io.StringIO(svg)).getroot() for svg in re.findall(r"<svg.*?</svg>", html, re.S)]


def test_the_notebook_view_draws_every_signal_with_a_text_description(result: SimulationResult) -> None:
    html = result._repr_html_()
    pictures = drawings(html)
    assert [picture.attrib["aria-label"].split(":")[0] for picture in pictures] == [
        "clock/y in s",
        "rne/tau in N m",
        "fkine/T",
        "poses/T in m",
    ]
    assert pictures[0].attrib["role"] == "img"
    assert len(pictures[1].findall("polyline")) == 2
    assert re.search(r"<i [^>]*>0</i> <i [^>]*>1</i>", html)  # the legend of the components
    assert "Incomplete" not in html
    assert "http" not in html  # no external resources
    assert "Incomplete" in incomplete(result)._repr_html_()


def test_the_notebook_view_escapes_names_and_is_limited_in_size() -> None:
    hostile = "<script>alert(1)</script>/\"y'"
    result = dataclasses.replace(result_with_signals(hostile), name="<b>&")
    html = result._repr_html_()
    assert "<script" not in html
    assert "&lt;b&gt;&amp;" in html
    assert drawings(html)[0].attrib["aria-label"].startswith(hostile)
    many = result_with_signals(*(f"block{k}/y" for k in range(40)))
    assert "Not drawn: block30/y" in many._repr_html_()
    long = dataclasses.replace(
        result_with_signals("a/y"),
        time=np.arange(100_000.0),
        signals=np.sin(np.arange(100_000.0))[np.newaxis],
    )
    assert len(long._repr_html_()) < 10_000


def test_the_notebook_view_shows_constant_wide_and_empty_signals() -> None:
    ticks = dataclasses.replace(result_with_signals("a/y"), signals=np.array([[-1e-7, 0.0, 12_345.0]]))
    assert drawings(ticks._repr_html_())[0].attrib["aria-label"] == "a/y: from −1e−7 to 12300"
    flat = dataclasses.replace(result_with_signals("a/y"), signals=np.zeros((1, 3)))
    assert "−" not in drawings(flat._repr_html_())[0].attrib["aria-label"]
    wide = dataclasses.replace(
        result_with_signals("a/y"),
        signals_layout=signature(("a/y", (12,))),
        signals=np.arange(36.0).reshape(12, 3),
    )
    assert "8 of 12 drawn" in wide._repr_html_()
    empty = dataclasses.replace(result_with_signals("a/y"), time=np.empty(0), signals=np.empty((1, 0)))
    assert drawings(empty._repr_html_())
    assert "0 samples" in repr(empty)

"""To File blocks: file formats, rows, confinement to the folder; spectra in reports."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import Clock, SineWave, Spectrum, Subsystem, ToFile
from armblocks.diagram import Diagram, DiagramBuilder, Inport
from armblocks.errors import DiagramError, FormatError, InputError
from armblocks.pictures.picture import text_marks
from armblocks.report.figures import view_figures


def diagram(**files: ToFile) -> Diagram:
    builder = DiagramBuilder("kept", settings=ab.SimulationOptions(stop_time=1.0, sample_time=0.1))
    wave = builder.add("wave", SineWave(phase=(0.0, 1.0)))
    for name, block in files.items():
        builder.add(name, block, wave)
    return builder.build()


@pytest.mark.parametrize("end", ["csv", "npz", "mat", "parquet"])
@pytest.mark.parametrize("settings", [{"solver": "rk4", "step": 0.01}, {"solver": "rk45"}])
def test_each_format_contains_the_recorded_signal_and_can_be_read(
    tmp_path: Path, end: str, settings: dict[str, Any]
) -> None:
    model = diagram(sink=ToFile(file=f"deep/er/kept.{end}", variable="wave"))
    result = ab.simulate(model, **settings)
    (path,) = ab.write_files(tmp_path, model, result)
    assert path == tmp_path / f"deep/er/kept.{end}"
    rows = np.asarray(ab.load_table(path))
    assert np.array_equal(rows, np.column_stack([result.time, result["sink/u"]]))
    table = ab.load_table(path)
    assert table.names == ("wave[0]", "wave[1]")


def test_decimation_3_and_a_limit_of_2_rows_write_the_last_two_of_every_third_row(tmp_path: Path) -> None:
    model = diagram(sink=ToFile(decimation=3, limit=2))
    result = ab.simulate(model)
    (path,) = ab.write_files(tmp_path, model, result)
    saved = np.asarray(ab.load_table(path))
    assert np.array_equal(saved[:, 0], result.time[[6, 9]])
    assert np.array_equal(saved[:, 1:], result["wave/y"][[6, 9]])


def test_a_report_contains_and_lists_the_files(tmp_path: Path) -> None:
    model = diagram(sink=ToFile(file="kept.npz"))
    files = ab.write_report(tmp_path, model, ab.simulate(model), formats=())
    assert tmp_path / "kept.npz" in files.data
    assert "kept.npz" in files.page.read_text()


def test_a_run_without_a_report_writes_no_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    ab.simulate(diagram(sink=ToFile()))
    assert list(tmp_path.iterdir()) == []


def test_to_file_blocks_in_subsystems_write_their_files(tmp_path: Path) -> None:
    inner = DiagramBuilder("inner")
    inner.add("sink", ToFile(file="inside.csv"), inner.add("in", Inport()))
    builder = DiagramBuilder("outer", settings=ab.SimulationOptions(stop_time=1.0))
    builder.add("part", Subsystem(diagram=inner.build()), builder.add("clock", Clock()))
    model = builder.build()
    (path,) = ab.write_files(tmp_path, model, ab.simulate(model))
    rows = np.asarray(ab.load_table(path))
    assert np.array_equal(rows[:, 0], rows[:, 1])


@pytest.mark.parametrize(
    "file",
    [
        "../up.csv",
        "/tmp/up.csv",
        "a/../../up.csv",
        "C:up.csv",
        "a\\b.csv",
        "",
        "a.txt",
        "a//b.csv",
        "./a.csv",
        "~.\n.csv",
    ],
)
def test_paths_outside_the_folder_are_refused_by_the_block(file: str) -> None:
    with pytest.raises(
        InputError, match=r"ToFile\.file: the file is '[^']*'\. Allowed: a path inside a folder"
    ):
        ToFile(file=file)


def test_a_symbolic_link_out_of_the_folder_is_refused(tmp_path: Path) -> None:
    folder, outside = tmp_path / "folder", tmp_path / "outside"
    folder.mkdir()
    outside.mkdir()
    (folder / "link").symlink_to(outside)
    model = diagram(sink=ToFile(file="link/kept.csv"))
    with pytest.raises(
        FormatError, match=r"'link/kept\.csv' of 'sink' leads out of the folder through a link"
    ):
        ab.write_files(folder, model, ab.simulate(model))
    assert list(outside.iterdir()) == []


def test_the_error_for_a_folder_that_cannot_be_created_names_it(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("a file")
    model = diagram(sink=ToFile(file="taken/kept.csv"))
    with pytest.raises(FormatError, match=r"the folder of 'taken/kept\.csv' cannot be created"):
        ab.write_files(tmp_path, model, ab.simulate(model))


def test_a_file_name_used_twice_is_refused(tmp_path: Path) -> None:
    model = diagram(one=ToFile(), two=ToFile(file="Simout.csv"))
    result = ab.simulate(model)
    with pytest.raises(DiagramError, match=r"'one' and 'two' write the same file 'Simout\.csv'"):
        ab.write_files(tmp_path, model, result)
    model = diagram(one=ToFile(file="data.mat"))
    with pytest.raises(DiagramError, match=r"the report and 'one' write the same file 'data\.mat'"):
        ab.write_report(tmp_path / "report", model, result)
    assert list(tmp_path.iterdir()) == []


def spectra(spectrum: Spectrum) -> Diagram:
    builder = DiagramBuilder("spectra", settings=ab.SimulationOptions(stop_time=4.0, sample_time=1 / 64))
    wave = builder.add("wave", SineWave(amplitude=(2.0, 0.1), frequency=(10 * np.pi, 20 * np.pi)))
    builder.add("spectrum", spectrum, wave)
    return builder.build()


@pytest.mark.parametrize("quantity", ["amplitude", "power density"])
@pytest.mark.parametrize("decibels", [True, False])
@pytest.mark.parametrize("logarithmic", [True, False])
def test_the_figure_of_a_spectrum_is_in_hertz(quantity: str, decibels: bool, logarithmic: bool) -> None:
    model = spectra(Spectrum(quantity=quantity, decibels=decibels, logarithmic=logarithmic))
    (figure,) = view_figures(model, ab.simulate(model), 600.0)
    texts = [mark.text for mark in text_marks(figure.picture)]
    assert "Frequency, Hz" in texts
    assert any(text.startswith("Amplitude" if quantity == "amplitude" else "Power density") for text in texts)
    assert any(", dB" in text for text in texts) == decibels
    assert {"wave/y[0]", "wave/y[1]"} <= set(texts)


def test_a_too_short_run_shows_a_message_instead_of_its_spectrum(tmp_path: Path) -> None:
    model = spectra(Spectrum(averages=200))
    result = ab.simulate(model)
    (figure,) = view_figures(model, result)
    assert "200 segments of 256 samples in all" in figure.picture.description
    assert ab.write_report(tmp_path, model, result, formats=("svg",), data=()).page.exists()

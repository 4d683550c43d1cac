"""``result.plot``: signals of a run as a figure."""

from __future__ import annotations

from pathlib import Path

import pytest

import armblocks as ab
from armblocks.errors import ArmblocksError


@pytest.fixture(scope="module")
def result() -> ab.SimulationResult:
    return ab.simulate("kr180model", stop_time=0.5)


def test_signals_are_drawn_in_panels_with_their_names_and_units(
    result: ab.SimulationResult, tmp_path: Path
) -> None:
    figure = result.plot("rne/tau", "jtraj/q", save=tmp_path / "run.svg")
    svg = (tmp_path / "run.svg").read_text()
    assert svg == figure._repr_svg_()  # type: ignore[attr-defined]
    assert "rne/tau" in svg and "jtraj/q, deg" in svg and "Time, s" in svg
    assert svg.count("<path") > 12


def test_figures_are_written_in_all_formats_and_themes(result: ab.SimulationResult, tmp_path: Path) -> None:
    figure = result.plot("jtraj/q")
    assert figure.save(tmp_path / "a.PNG").read_bytes().startswith(b"\x89PNG")
    assert figure.save(tmp_path / "a.pdf").read_bytes().startswith(b"%PDF")
    light, dark = (figure.save(tmp_path / f"{t}.svg", theme=t).read_text() for t in ("light", "dark"))  # type: ignore[arg-type]
    assert light != dark


def test_without_names_the_first_signals_are_drawn(result: ab.SimulationResult) -> None:
    svg = result.plot()._repr_svg_()  # type: ignore[attr-defined]
    assert svg.count('font-weight="600"') == min(12, len(result.names))


def test_unknown_names_and_too_many_signals_are_refused(result: ab.SimulationResult, tmp_path: Path) -> None:
    with pytest.raises(ArmblocksError, match="jtraj/qq"):
        result.plot("jtraj/qq")
    with pytest.raises(ArmblocksError, match=r"there is no format of figures named '\.bmp'"):
        result.plot("jtraj/q", save=tmp_path / "a.bmp")
    with pytest.raises(ArmblocksError, match="there is no theme named 'blue'"):
        result.plot("jtraj/q", theme="blue")  # type: ignore[arg-type]
    many = ab.simulate("puma560_multirate", stop_time=0.05)
    assert len(many.names) > 12
    with pytest.raises(ArmblocksError, match=r"samples cannot be drawn.*1 to 12 signals"):
        many.plot(*many.names)

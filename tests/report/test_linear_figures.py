"""Figures of linear systems: content, clipping, and files."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from armblocks.analysis.linear_system import LinearSystem
from armblocks.errors import UnknownNameError
from armblocks.pictures.numbers import log_ticks
from armblocks.pictures.picture import Picture, Polyline, text_marks
from armblocks.pictures.png import picture_png
from armblocks.pictures.svg import svg_file
from armblocks.pictures.text_width import text_width
from armblocks.report import (
    bode_picture,
    impulse_picture,
    nyquist_picture,
    pole_zero_picture,
    root_locus_picture,
    step_picture,
    write_linear_report,
)
from armblocks.report.charts.axes import clip_line, linear_area
from armblocks.report.charts.scale import LogScale


def servo(dt: float = 0.0) -> LinearSystem:
    """8 / (s + 1)^3, or a sampled second-order lag."""
    if dt:
        A = np.array([[1.2, -0.5], [1.0, 0.0]])
        return LinearSystem(A, [[1.0], [0.0]], [[0.1, 0.2]], [[0.0]], dt=dt, name="sampled")  # type: ignore[arg-type]
    A = np.array([[-1.0, 1.0, 0.0], [0.0, -1.0, 1.0], [0.0, 0.0, -1.0]])
    return LinearSystem(A, [[0.0], [0.0], [4.0]], [[1.0, 0.0, 0.0]], [[0.0]], name="servo")  # type: ignore[arg-type]


DRAWINGS: dict[str, Callable[[LinearSystem], Picture]] = {
    "bode": lambda system: bode_picture(system, margins=True),
    "narrow bode in Hz": lambda system: bode_picture(system, hertz=True, width=480.0),
    "nyquist": nyquist_picture,
    "poles": pole_zero_picture,
    "locus": root_locus_picture,
    "step": step_picture,
    "narrow step": lambda system: step_picture(system, width=460.0),
    "impulse": impulse_picture,
}


@pytest.mark.parametrize("dt", [0.0, 0.1])
@pytest.mark.parametrize("drawing", DRAWINGS)
def test_everything_is_inside_the_picture(drawing: str, dt: float) -> None:
    picture = DRAWINGS[drawing](servo(dt))
    for text in text_marks(picture):
        width = text_width(text.text, text.size, bold=text.bold)
        left = text.x - {"start": 0.0, "middle": width / 2, "end": width}[text.anchor]
        assert -1.0 <= left <= left + width <= picture.width + 1.0, text
        assert text.size * 0.7 <= text.y <= picture.height, text
    for mark in picture.marks:
        if isinstance(mark, Polyline):
            points = np.asarray(mark.points, dtype=np.float64).reshape(-1, 2)
            points = points[np.isfinite(points).all(axis=1)]
            assert (points >= -6.0).all()
            assert (points <= [picture.width + 6.0, picture.height + 6.0]).all()
    assert "<svg" in svg_file(picture)


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_figures_are_painted_in_both_themes(theme: str) -> None:
    assert picture_png(bode_picture(servo()), theme=theme)[:4] == b"\x89PNG"  # type: ignore[arg-type]


def test_a_bode_diagram_shows_the_margins() -> None:
    words = [text.text for text in text_marks(bode_picture(servo(), margins=True))]
    assert "gain margin 6.02 dB" in words
    assert "phase margin 27.1 deg" in words
    assert {"Gain, dB", "Phase, deg", "Frequency, rad/s"} <= set(words)
    assert "Frequency, Hz" in [text.text for text in text_marks(bode_picture(servo(), hertz=True))]


def test_a_root_locus_shows_the_gain_at_which_the_loop_becomes_unstable() -> None:
    assert "gain 2" in [text.text for text in text_marks(root_locus_picture(servo()))]


def test_several_channels_have_a_legend() -> None:
    system = LinearSystem(-np.eye(2), np.eye(2), np.eye(2), np.zeros((2, 2)), outputs=("a", "b"))
    words = [text.text for text in text_marks(step_picture(system))]
    assert {"a from u1", "a from u2", "b from u1", "b from u2"} <= set(words)


def test_lines_are_clipped_exactly_at_the_edge() -> None:
    field = linear_area((0.0, 1.0), (0.0, 1.0), (0.0, 0.0, 100.0, 100.0))
    points = clip_line(field.points(np.array([-1.0, 0.5, 2.0]), np.array([0.5, 0.5, 0.5])), field.box)
    assert points.tolist() == [[0.0, 50.0], [50.0, 50.0], [100.0, 50.0]]


def test_a_logarithmic_scale_puts_decades_at_equal_distances() -> None:
    scale = LogScale(0.01, 100.0, 0.0, 400.0)
    assert [scale(10.0**k) for k in range(-2, 3)] == pytest.approx([0.0, 100.0, 200.0, 300.0, 400.0])
    assert np.allclose(scale.array(np.array([0.1, 1.0])), [100.0, 200.0])
    named, finer = log_ticks(0.01, 100.0)
    assert np.allclose(named, [0.01, 0.1, 1.0, 10.0, 100.0])
    assert len(finer) == 4 * 8


def test_a_report_contains_every_figure_and_the_system(tmp_path: Path) -> None:
    files = write_linear_report(tmp_path / "out", servo(), loop=True, formats=("svg",))
    names = {path.name for path in files}
    figures = {"bode", "nyquist", "step", "impulse", "poles-and-zeros", "root-locus"}
    assert names == {f"{name}.svg" for name in figures} | {"linear-system.json"}
    assert json.loads(files[-1].read_text())["A"] == servo().A.tolist()
    with pytest.raises(UnknownNameError, match="there is no figure format named 'gif'"):
        write_linear_report(tmp_path, servo(), formats=("gif",))

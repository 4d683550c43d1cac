"""Charts: labels do not overlap, peaks remain, limits are visible."""

import itertools
import re

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from armblocks.pictures.numbers import axis_number, axis_numbers, nice_ticks
from armblocks.pictures.picture import Picture, Polyline, Text, text_marks
from armblocks.pictures.style import Tone
from armblocks.pictures.text_width import text_width
from armblocks.pictures.thinning import thin_out
from armblocks.report.charts.path_chart import path_chart
from armblocks.report.charts.scale import Scale, padded_range
from armblocks.report.charts.time_chart import Panel, Trace, separated_positions, time_chart


def boxes(picture: Picture) -> list[tuple[float, float, float, float]]:
    """The bounding rectangle of every text: left, top, right, bottom."""
    rectangles: list[tuple[float, float, float, float]] = []
    for mark in text_marks(picture):
        width = text_width(mark.text, mark.size, bold=mark.bold, mono=mark.mono)
        left = mark.x - {"start": 0.0, "middle": 0.5, "end": 1.0}[mark.anchor] * width
        rectangles.append((left, mark.y - 0.75 * mark.size, left + width, mark.y + 0.2 * mark.size))
    return rectangles


def overlapping(picture: Picture) -> list[tuple[str, str]]:
    texts, rectangles = text_marks(picture), boxes(picture)
    return [
        (texts[i].text, texts[j].text)
        for i, a in enumerate(rectangles)
        for j, b in enumerate(rectangles[:i])
        if a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
    ]


def chart(values: np.ndarray, limits: tuple[float, float] | None = None) -> Picture:
    time = np.linspace(0, 10, len(values))
    traces = tuple(
        Trace(label=f"joint {k}", values=values[:, k], index=k, limits=limits) for k in range(values.shape[1])
    )
    panel = Panel(quantity="Joint angle", unit="deg", traces=traces)
    return time_chart(time, [panel, panel], title="t", description="d")


@pytest.mark.parametrize("scale", [0.0, 1e-9, 1.0, 1e7])
def test_texts_do_not_overlap_and_are_inside_the_picture(scale: float) -> None:
    values = scale * np.random.default_rng(2).normal(size=(200, 7)).cumsum(axis=0)
    picture = chart(values)
    assert overlapping(picture) == []
    for left, top, right, bottom in boxes(picture):
        assert left >= 0 and top >= 0 and right <= picture.width and bottom <= picture.height


@given(st.integers(0, 2**32 - 1), st.lists(st.integers(1, 30), min_size=1, max_size=2), st.booleans())
@settings(max_examples=12, deadline=None)
def test_texts_of_any_number_of_lines_do_not_overlap(seed: int, counts: list[int], resting: bool) -> None:
    """Panels grow with their labels; lines that end at one value are named in their own order."""
    rng = np.random.default_rng(seed)
    time = np.linspace(0, 10, 50)
    panels: list[Panel] = []
    for count in counts:
        values = rng.normal(size=(50, count)).cumsum(axis=0) * 10.0 ** rng.integers(-9, 9)
        if resting:
            values -= values[-1] * (1 + 1e-13 * rng.normal(size=count))
        limits = (float(values.min()) / 2, float(values.max()) / 2)
        traces = tuple(
            Trace(
                label=f"line {k}" + ", a longer name" * (k % 3), values=values[:, k], index=k, limits=limits
            )
            for k in range(count)
        )
        panels.append(Panel(quantity=", ".join(t.label for t in traces), unit="deg", traces=traces))
    picture = time_chart(time, panels, title="t", description="d", height=128.0)
    assert overlapping(picture) == []
    for left, top, right, bottom in boxes(picture):
        assert left >= 0 and top >= 0 and right <= picture.width and bottom <= picture.height
    labels = [mark.text for mark in text_marks(picture) if mark.x > picture.width / 2]
    order = [int(match[1]) for label in labels if (match := re.match(r"line (\d+)", label))]
    expected = [k for count in counts for k in range(count)]
    assert order == expected if resting else sorted(order) == sorted(expected)


@given(st.floats(-1e6, 1e6), st.floats(-8, 3), st.integers(2, 6))
def test_tick_numbers_of_an_axis_are_different(low: float, exponent: float, count: int) -> None:
    ticks = nice_ticks(low, low + max(abs(low), 1.0) * 10.0**exponent, count)
    texts = axis_numbers(ticks)
    assert len(set(texts)) == len(ticks)
    assert texts == [axis_number(tick) for tick in ticks] or any(len(text) > 7 for text in texts)


@given(st.lists(st.floats(0, 150), min_size=1, max_size=9))
def test_labels_are_spread_within_their_panel(preferred: list[float]) -> None:
    positions = separated_positions(sorted(preferred), 15.0, 0.0, 150.0)
    assert all(b - a >= 15.0 - 1e-9 for a, b in itertools.pairwise(positions))
    assert positions[0] >= 0.0 and positions[-1] <= 150.0 + 1e-9


def test_labels_that_do_not_overlap_are_not_moved() -> None:
    assert separated_positions([10.0, 60.0, 120.0], 15.0, 0.0, 150.0) == [10.0, 60.0, 120.0]


def test_thinning_keeps_the_ends_and_every_peak() -> None:
    time = np.linspace(0, 1, 100_000)
    values = np.zeros_like(time)
    values[54_321], values[7] = 5.0, -3.0
    t, v = thin_out(time, values, 800)
    assert len(t) <= 4 * 800 + 1
    assert (v.max(), v.min()) == (5.0, -3.0)
    assert (t[0], t[-1]) == (0.0, 1.0)


def test_a_limit_is_drawn_when_near_and_highlighted_when_exceeded() -> None:
    ramp = np.linspace(0, 80, 50)[:, None]
    far = chart(ramp, (-500.0, 500.0))
    near = chart(ramp, (-500.0, 90.0))
    broken = chart(ramp, (-500.0, 70.0))

    def dashed_lines(picture: Picture) -> int:
        return sum(isinstance(mark, Polyline) and mark.dash == (7.0, 4.0) for mark in picture.marks)

    assert (dashed_lines(far), dashed_lines(near)) == (0, 2)
    assert not any(isinstance(m, Polyline) and m.stroke is Tone.ERROR for m in near.marks)
    assert any(isinstance(m, Polyline) and m.stroke is Tone.ERROR for m in broken.marks)
    assert any("over limit" in mark.text for mark in text_marks(broken))


@pytest.mark.parametrize("limits", [(0.1, 1.0), (-2.0, -0.5), (0.0, 1.0), (-1.0, 0.0), (-3.0, 2.0)])
def test_the_label_and_the_line_agree_on_a_limit_of_any_sign(limits: tuple[float, float]) -> None:
    low, high = limits
    for reached, beyond in (
        ((low, high), False),
        ((low - 1e-12, high + 1e-12), False),
        ((low - 0.01, high), True),
        ((low, high + 0.01), True),
    ):
        picture = chart(np.linspace(*reached, 50)[:, None], limits)
        red = any(isinstance(mark, Polyline) and mark.stroke is Tone.ERROR for mark in picture.marks)
        labelled = any("over limit" in mark.text for mark in text_marks(picture))
        assert (red, labelled) == (beyond, beyond), reached


def test_nan_values_leave_a_gap_in_the_line() -> None:
    values = np.ones((100, 1))
    values[40:60] = np.nan
    line = max((m for m in chart(values).marks if isinstance(m, Polyline)), key=lambda m: len(m.points))
    assert np.isnan(np.asarray(line.points)[:, 1]).sum() == 20


def test_equal_axes_have_the_same_scale() -> None:
    angle = np.linspace(0, 2 * np.pi, 400)
    picture = path_chart(
        3 * np.cos(angle), np.sin(angle), x_label="x, m", y_label="y, m", width=320, height=340, equal=True
    )
    path = max((m for m in picture.marks if isinstance(m, Polyline)), key=lambda m: len(m.points))
    width, height = np.ptp(np.asarray(path.points), axis=0)
    assert width / height == pytest.approx(3.0, rel=1e-3)


def test_start_and_end_have_different_marks() -> None:
    x = np.linspace(0, 1, 50)
    picture = path_chart(x, x**2, x_label="x", y_label="y", width=320, height=340, equal=False)
    assert {"start", "end"} <= {mark.text for mark in text_marks(picture) if isinstance(mark, Text)}


@pytest.mark.parametrize("values", [[1.0, 1.0], [0.0, 0.0], [np.nan, np.nan], [1.0, 1.0 + 1e-15]])
def test_the_axis_range_of_a_constant_is_not_empty(values: list[float]) -> None:
    low, high = padded_range(np.array(values), 0.1)
    assert high - low > 0.1


@given(st.lists(st.floats(allow_nan=False), min_size=1, max_size=4), st.integers(1, 8))
@example([-1e308, 1e308], 4)
@example([0.0, 5e-324], 4)
def test_all_finite_values_are_within_their_axis(values: list[float], count: int) -> None:
    low, high = padded_range(np.array(values), 0.08)
    scale = Scale(low, high, 300.0, 0.0)
    positions = scale.array(np.array([value for value in values if np.isfinite(value)]))
    assert ((positions >= -1e-9) & (positions <= 300.0 + 1e-9)).all()
    ticks = nice_ticks(low, high, count)
    assert 1 <= len(ticks) <= 6 * count
    assert all(low - 1e-9 * (high - low) <= tick <= high + 1e-9 * (high - low) for tick in ticks)

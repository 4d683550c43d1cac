"""Contrast of the colours, and distinct styles of the channels of a plot."""

import math
from itertools import combinations

import pytest

from armblocks.pictures.style import PALETTE, TRACES, Theme, Tone, contrast, rgb, trace_dash, trace_tone

TEXT = (Tone.INK, Tone.MUTED, Tone.ACCENT, Tone.ERROR, Tone.WARNING)
BACKGROUNDS = {
    Tone.INK: (Tone.PAGE, Tone.SURFACE, Tone.SUNKEN),
    Tone.MUTED: (Tone.PAGE, Tone.SURFACE, Tone.SUNKEN),
    Tone.ACCENT: (Tone.PAGE, Tone.SURFACE),
    Tone.ERROR: (Tone.SURFACE, Tone.ERROR_WASH),
    Tone.WARNING: (Tone.SURFACE, Tone.WARNING_WASH),
}


def test_known_pairs_of_colours_have_their_contrast() -> None:
    assert contrast("#000000", "#ffffff") == pytest.approx(21.0)
    assert contrast("#777777", "#777777") == pytest.approx(1.0)


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("tone", TEXT)
def test_text_has_a_contrast_of_at_least_4_5(theme: Theme, tone: Tone) -> None:
    for background in BACKGROUNDS[tone]:
        assert contrast(PALETTE[tone].of(theme), PALETTE[background].of(theme)) >= 4.5, background


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("tone", [*TRACES, Tone.WIRE])
def test_lines_have_a_contrast_of_at_least_3(theme: Theme, tone: Tone) -> None:
    assert contrast(PALETTE[tone].of(theme), PALETTE[Tone.SURFACE].of(theme)) >= 3.0


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_the_colours_of_six_joints_are_far_apart(theme: Theme) -> None:
    """Euclidean distance in CIE L*a*b*; colours at a distance of 9 are hard to distinguish."""
    colours = [_lab(PALETTE[tone].of(theme)) for tone in TRACES[:6]]
    assert min(math.dist(*pair) for pair in combinations(colours, 2)) > 40


def _lab(colour: str) -> tuple[float, float, float]:
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in rgb(colour)]
    rows = (
        (0.4124564, 0.3575761, 0.1804375),
        (0.2126729, 0.7151522, 0.072175),
        (0.0193339, 0.119192, 0.9503041),
    )
    x, y, z = (
        sum(a * b for a, b in zip(row, linear)) / white for row, white in zip(rows, (0.95047, 1.0, 1.08883))
    )
    fx, fy, fz = (c ** (1 / 3) if c > 0.008856 else 7.787 * c + 16 / 116 for c in (x, y, z))
    return 116 * fy - 16, 500 * (fx - fy), 200 * (fy - fz)


def test_sixteen_channels_differ_by_colour_or_dash() -> None:
    assert len({(trace_tone(k), trace_dash(k)) for k in range(16)}) == 16

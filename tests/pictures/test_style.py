"""Contrast of the colours, and distinct styles of the channels of a plot."""

import pytest

from armblocks.pictures.style import PALETTE, TRACES, Theme, Tone, contrast, trace_dash, trace_tone

TEXT = (Tone.INK, Tone.MUTED, Tone.ACCENT, Tone.ERROR, Tone.WARNING)
GROUNDS = {
    Tone.INK: (Tone.PAGE, Tone.SURFACE, Tone.SUNKEN),
    Tone.MUTED: (Tone.PAGE, Tone.SURFACE, Tone.SUNKEN),
    Tone.ACCENT: (Tone.PAGE, Tone.SURFACE),
    Tone.ERROR: (Tone.SURFACE, Tone.ERROR_WASH),
    Tone.WARNING: (Tone.SURFACE, Tone.WARNING_WASH),
}


def test_contrast_of_known_pairs() -> None:
    assert contrast("#000000", "#ffffff") == pytest.approx(21.0)
    assert contrast("#777777", "#777777") == pytest.approx(1.0)


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("tone", TEXT)
def test_text_has_a_contrast_of_at_least_4_5(theme: Theme, tone: Tone) -> None:
    for ground in GROUNDS[tone]:
        assert contrast(PALETTE[tone].of(theme), PALETTE[ground].of(theme)) >= 4.5, ground


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("tone", [*TRACES, Tone.WIRE])
def test_lines_have_a_contrast_of_at_least_3(theme: Theme, tone: Tone) -> None:
    assert contrast(PALETTE[tone].of(theme), PALETTE[Tone.SURFACE].of(theme)) >= 3.0


def test_sixteen_channels_differ_by_colour_or_dash() -> None:
    assert len({(trace_tone(k), trace_dash(k)) for k in range(16)}) == 16

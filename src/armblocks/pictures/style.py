"""Colours, fonts and sizes of all figures.

Figures use tones (:class:`Tone`) instead of colours; each tone has a light and a dark value. Text tones have
a contrast of at least 4.5:1 on page and surface, trace tones of at least 3:1 (WCAG 2.2, 1.4.3 and 1.4.11).
Trace colours are the set of Okabe and Ito (2008). As far as this contrast requires, light colours are darker
on white and blue is lighter on black, with the same hue. Their sky blue would then be near the blue; violet
replaces it, which differs from the other colours in lightness as well, also for colour-blind readers. The
order keeps the colours of the first six channels, the joints of most arms, far apart. Every joint has the
same colour in all views.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Literal, TypeAlias

Theme: TypeAlias = Literal["light", "dark"]

FONT_STACK = (
    'system-ui,-apple-system,"Segoe UI",Roboto,"Helvetica Neue",Arial,"DejaVu Sans",Verdana,sans-serif'
)
MONO_STACK = 'ui-monospace,"SF Mono",Menlo,Consolas,"DejaVu Sans Mono",monospace'

TEXT_SIZE = 12.0
"""Font size of axis labels and direct labels, px."""
SMALL_SIZE = 10.5
"""Font size of tick labels and of captions of details, px."""
TITLE_SIZE = 13.5
"""Font size of titles inside figures, px."""
FIGURE_WIDTH = 960.0
"""Width of every full-width figure, px."""


class Tone(Enum):
    """A colour by its role."""

    PAGE = "page"
    SURFACE = "surface"
    SUNKEN = "sunken"
    INK = "ink"
    MUTED = "muted"
    HAIRLINE = "hairline"
    GRID = "grid"
    ACCENT = "accent"
    ERROR = "error"
    ERROR_WASH = "error-wash"
    WARNING = "warning"
    WARNING_WASH = "warning-wash"
    WIRE = "wire"
    PAINT = "paint"
    GRAPHITE = "graphite"
    TRACE_0 = "trace-0"
    TRACE_1 = "trace-1"
    TRACE_2 = "trace-2"
    TRACE_3 = "trace-3"
    TRACE_4 = "trace-4"
    TRACE_5 = "trace-5"
    TRACE_6 = "trace-6"
    TRACE_7 = "trace-7"
    TINT_RED = "tint-red"
    TINT_ORANGE = "tint-orange"
    TINT_YELLOW = "tint-yellow"
    TINT_GREEN = "tint-green"
    TINT_CYAN = "tint-cyan"
    TINT_BLUE = "tint-blue"
    TINT_PURPLE = "tint-purple"
    TINT_GREY = "tint-grey"


@dataclass(frozen=True)
class Shade:
    """One tone as ``#rrggbb`` on a light and on a dark background."""

    light: str
    dark: str

    def of(self, theme: Theme) -> str:
        """The colour in one theme."""
        return self.light if theme == "light" else self.dark


PALETTE: dict[Tone, Shade] = {
    Tone.PAGE: Shade("#f6f4f1", "#12151a"),
    Tone.SURFACE: Shade("#ffffff", "#1b2028"),
    Tone.SUNKEN: Shade("#f1eeea", "#151a20"),
    Tone.INK: Shade("#23211e", "#e8ebf0"),
    Tone.MUTED: Shade("#635d55", "#a3adba"),
    Tone.HAIRLINE: Shade("#cfc9c1", "#3d4652"),
    Tone.GRID: Shade("#e9e5e0", "#2a313b"),
    Tone.ACCENT: Shade("#b04a00", "#ff9a4d"),
    Tone.ERROR: Shade("#b3261e", "#ff9d8f"),
    Tone.ERROR_WASH: Shade("#fbe9e7", "#3a2220"),
    Tone.WARNING: Shade("#7d5200", "#f0b94d"),
    Tone.WARNING_WASH: Shade("#fbf1dc", "#352b17"),
    Tone.WIRE: Shade("#4a463f", "#b4bdc9"),
    Tone.PAINT: Shade("#e8711a", "#e8711a"),
    Tone.GRAPHITE: Shade("#454a52", "#7d8794"),
    Tone.TRACE_0: Shade("#0072b2", "#3d9fdc"),
    Tone.TRACE_1: Shade("#d55e00", "#e8732a"),
    Tone.TRACE_2: Shade("#00916a", "#1fb98c"),
    Tone.TRACE_3: Shade("#b85f96", "#d58fb9"),
    Tone.TRACE_4: Shade("#9a8f00", "#f0e442"),
    Tone.TRACE_5: Shade("#23211e", "#e8ebf0"),
    Tone.TRACE_6: Shade("#581579", "#bac3f3"),
    Tone.TRACE_7: Shade("#b67c00", "#e69f00"),
    Tone.TINT_RED: Shade("#f8d9d5", "#4a2624"),
    Tone.TINT_ORANGE: Shade("#fbe0c8", "#4a3018"),
    Tone.TINT_YELLOW: Shade("#faf0bf", "#423b14"),
    Tone.TINT_GREEN: Shade("#d8efd3", "#1f3d25"),
    Tone.TINT_CYAN: Shade("#d0eef0", "#173c42"),
    Tone.TINT_BLUE: Shade("#d6e5f8", "#1f3352"),
    Tone.TINT_PURPLE: Shade("#e8dcf5", "#37284c"),
    Tone.TINT_GREY: Shade("#e3e0dc", "#343b45"),
}

TRACES: tuple[Tone, ...] = tuple(tone for tone in Tone if tone.value.startswith("trace-"))
"""The tones of joints and channels, in order; from the ninth on they repeat, dashed (see
:func:`trace_dash`)."""


def trace_tone(index: int) -> Tone:
    """Tone of the channel or joint with this index, from 0."""
    return TRACES[index % len(TRACES)]


def trace_dash(index: int) -> tuple[float, ...]:
    """Dash pattern (px) that distinguishes the channels after the eighth."""
    return ((), (6.0, 3.0), (2.0, 2.5), (8.0, 3.0, 2.0, 3.0))[(index // len(TRACES)) % 4]


def rgb(colour: str) -> tuple[float, float, float]:
    """``#rrggbb`` as red, green, blue in 0..1."""
    return int(colour[1:3], 16) / 255, int(colour[3:5], 16) / 255, int(colour[5:7], 16) / 255


def contrast(first: str, second: str) -> float:
    """Contrast ratio of two ``#rrggbb`` colours, 1..21 (WCAG 2.2, relative luminance)."""

    def luminance(colour: str) -> float:
        linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in rgb(colour)]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    low, high = sorted((luminance(first), luminance(second)))
    return (high + 0.05) / (low + 0.05)


def theme_variables(theme: Theme) -> str:
    """CSS custom properties of one theme, for the report's page."""
    return "".join(f"--{tone.value}:{shade.of(theme)};" for tone, shade in PALETTE.items())

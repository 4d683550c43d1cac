"""Widths of texts, without a font library.

The advance widths of DejaVu Sans (Bitstream Vera licence), in thousandths of the font size. The font is one
of the widest sans-serif fonts, so texts in the fonts of other systems do not overlap either.
"""

from __future__ import annotations

# Characters 32 (space) to 126 (tilde).
_NORMAL = (
    318, 401, 460, 838, 636, 950, 780, 275, 390, 390, 500, 838, 318, 361, 318, 337, 636, 636, 636, 636,
    636, 636, 636, 636, 636, 636, 337, 337, 838, 838, 838, 531, 1000, 684, 686, 698, 770, 632, 575, 775,
    752, 295, 295, 656, 557, 863, 748, 787, 603, 787, 695, 635, 611, 732, 684, 989, 685, 611, 685, 390,
    337, 390, 838, 500, 500, 613, 635, 550, 635, 615, 352, 635, 634, 278, 278, 579, 278, 974, 634, 612,
    635, 635, 411, 521, 392, 634, 592, 818, 592, 592, 525, 636, 337, 636, 838,
)  # fmt: skip
_BOLD = (
    348, 456, 521, 838, 696, 1002, 872, 306, 457, 457, 523, 838, 380, 415, 380, 365, 696, 696, 696, 696,
    696, 696, 696, 696, 696, 696, 400, 400, 838, 838, 838, 580, 1000, 774, 762, 734, 830, 683, 683, 821,
    837, 372, 372, 775, 637, 995, 837, 850, 733, 850, 770, 720, 682, 812, 774, 1103, 771, 724, 725, 457,
    365, 457, 838, 500, 500, 675, 716, 593, 716, 678, 435, 716, 712, 343, 343, 665, 343, 1042, 712, 687,
    716, 716, 493, 595, 478, 712, 652, 924, 645, 652, 582, 712, 365, 712, 838,
)  # fmt: skip
_OTHERS = {"°": 500, "·": 380, "–": 500, "²": 438, "³": 438, "µ": 736, "∫": 610, "…": 1000}
_MAX_CHARACTER_WIDTH = 1000


def text_width(text: str, size: float, *, bold: bool = False, mono: bool = False) -> float:
    """Width of one line of text at the type size ``size``, in the unit of ``size``."""
    if mono:
        return 0.602 * size * len(text)
    table = _BOLD if bold else _NORMAL
    total = 0
    for character in text:
        code = ord(character) - 32
        if 0 <= code < len(table):
            total += table[code]
        else:
            # East Asian and other wide characters have the width of an em; other Latin and Greek characters
            # less.
            total += _OTHERS.get(character, 838 if ord(character) < 0x2E80 else _MAX_CHARACTER_WIDTH)
    return total * size / 1000


def shorten(text: str, size: float, max_width: float, *, bold: bool = False) -> str:
    """The text, shortened with an ellipsis if it would be wider than ``max_width``."""
    if text_width(text, size, bold=bold) <= max_width:
        return text
    shortened = text
    while shortened and text_width(shortened + "…", size, bold=bold) > max_width:
        shortened = shortened[:-1]
    return shortened.rstrip() + "…"


def printable(text: str) -> str:
    """The text without characters that XML 1.0 (section 2.2) and fonts do not have: controls, surrogates."""
    return "".join(c for c in text if _allowed(ord(c)))


def _allowed(code: int) -> bool:
    return code in (9, 10) or 0x20 <= code < 0xD800 or 0xE000 <= code <= 0xFFFD or code >= 0x10000

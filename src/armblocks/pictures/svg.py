"""Pictures as SVG text.

An SVG file contains its colours. A media query selects the dark ones, if the viewer supports it. Inline SVG
takes its colours from the CSS custom properties of the page. The classes of the marks are ``f-TONE`` (fill),
``s-TONE`` (stroke) and ``m`` (monospaced text).
"""

from __future__ import annotations

import base64
import math
from collections.abc import Iterable, Sequence

import numpy as np

from armblocks.pictures.picture import (
    Curve,
    Disc,
    Group,
    Mark,
    Picture,
    Points,
    Polyline,
    Raster,
    Rectangle,
    Text,
)
from armblocks.pictures.png_file import png_bytes
from armblocks.pictures.style import FONT_STACK, MONO_STACK, PALETTE, Theme, Tone
from armblocks.pictures.text_width import printable

_MAX_EXACT_POINTS = 24
"""Lines with more points are written with one decimal instead of two."""


def escape(text: str) -> str:
    """Text for XML content and attributes: markup is escaped, characters that XML forbids are removed."""
    return (
        printable(text)
        .replace("&", "&amp;")
        .replace("<", "&lt;")
        .replace(">", "&gt;")
        .replace('"', "&quot;")
        .replace("'", "&#39;")
    )


def number(value: float) -> str:
    """A coordinate with at most two decimals and no trailing zeros."""
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def svg_marks(picture: Picture) -> str:
    """The marks without the ``svg`` element, for both :func:`svg_file` and :func:`svg_inline`."""
    return _marks(picture.marks)


def svg_file(picture: Picture, *, theme: Theme | None = None, marks: str | None = None) -> str:
    """A complete SVG document. ``theme`` fixes light or dark; ``None`` follows the viewer's preference."""
    base = theme or "light"
    rules = _tone_rules(base)
    if theme is None:
        rules += f"@media (prefers-color-scheme:dark){{{_tone_rules('dark')}}}"
    background = f'<rect class="f-{Tone.SURFACE.value}" width="100%" height="100%"/>'
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        + _open_tag(picture, identifier="p", has_size=True)
        + f"<style>{rules}</style>{background}"
        + (svg_marks(picture) if marks is None else marks)
        + "</svg>\n"
    )


def svg_inline(picture: Picture, identifier: str, *, marks: str | None = None) -> str:
    """The SVG element for a page that has :func:`page_rules`; ``identifier`` is unique within the page."""
    inside = svg_marks(picture) if marks is None else marks
    return f"{_open_tag(picture, identifier=identifier, has_size=False)}{inside}</svg>"


def page_rules() -> str:
    """CSS for a page with inline SVG: classes whose colours are the custom properties of the page."""
    rules = [f"svg text{{font-family:{FONT_STACK};font-variant-numeric:tabular-nums}}"]
    rules.append(f"svg .m{{font-family:{MONO_STACK}}}")
    rules += [
        f".f-{tone.value}{{fill:var(--{tone.value})}}.s-{tone.value}{{stroke:var(--{tone.value})}}"
        for tone in PALETTE
    ]
    return "".join(rules)


def _tone_rules(theme: Theme) -> str:
    rules = [
        f"text{{font-family:{FONT_STACK};font-variant-numeric:tabular-nums}}.m{{font-family:{MONO_STACK}}}"
    ]
    for tone, shade in PALETTE.items():
        colour = shade.of(theme)
        rules.append(f".f-{tone.value}{{fill:{colour}}}.s-{tone.value}{{stroke:{colour}}}")
    return "".join(rules)


def _open_tag(picture: Picture, *, identifier: str, has_size: bool) -> str:
    size = f'width="{number(picture.width)}" height="{number(picture.height)}" ' if has_size else ""
    described = f' aria-describedby="{identifier}-d"' if picture.description else ""
    labels = f'<title id="{identifier}-t">{escape(picture.title)}</title>'
    if picture.description:
        labels += f'<desc id="{identifier}-d">{escape(picture.description)}</desc>'
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" {size}'
        f'viewBox="0 0 {number(picture.width)} {number(picture.height)}" role="img" '
        f'aria-labelledby="{identifier}-t"{described}>{labels}'
    )


def _paint(fill: Tone | None, stroke: Tone | None, width: float, opacity: float) -> str:
    classes = [f"f-{fill.value}"] if fill else []
    if stroke:
        classes.append(f"s-{stroke.value}")
    text = f' class="{" ".join(classes)}"' if classes else ""
    if fill is None:
        text += ' fill="none"'
    if stroke is not None and width != 1:
        text += f' stroke-width="{number(width)}"'
    if opacity != 1:
        text += f' opacity="{number(opacity)}"'
    return text


def _dash(dash: Sequence[float]) -> str:
    return f' stroke-dasharray="{" ".join(number(d) for d in dash)}"' if dash else ""


def _path_data(points: Points, closed: bool) -> str:
    array = np.asarray(points, dtype=np.float64)
    if len(array) > _MAX_EXACT_POINTS and np.isfinite(array).all():
        # One format call for the whole line is faster than one per point. Errors of 0.05 px are not visible.
        data = ("M%.1f %.1f" + "L%.1f %.1f" * (len(array) - 1)) % tuple(array.ravel().tolist())
        return data.replace(".0", "") + ("Z" if closed else "")
    commands: list[str] = []
    command = "M"
    for x, y in array.tolist():
        if not (math.isfinite(x) and math.isfinite(y)):
            command = "M"
            continue
        commands.append(f"{command}{number(x)} {number(y)}")
        command = "L"
    return "".join(commands) + ("Z" if closed and commands else "")


def _marks(marks: Iterable[Mark]) -> str:
    return "".join(_mark(mark) for mark in marks)


def _mark(mark: Mark) -> str:
    match mark:
        case Polyline():
            joins = "" if mark.sharp else ' stroke-linejoin="round" stroke-linecap="round"'
            return (
                f'<path d="{_path_data(mark.points, mark.closed)}"'
                f"{_paint(mark.fill, mark.stroke, mark.width, mark.opacity)}{_dash(mark.dash)}{joins}/>"
            )
        case Curve():
            data = "".join(
                str(c[0]) + " ".join(number(float(value)) for value in c[1:]) for c in mark.commands
            )
            paint = _paint(mark.fill, mark.stroke, mark.width, mark.opacity) + _dash(mark.dash)
            return f'<path d="{data}"{paint} stroke-linejoin="round" stroke-linecap="round"/>'
        case Rectangle():
            radius = f' rx="{number(mark.radius)}"' if mark.radius else ""
            return (
                f'<rect x="{number(mark.x)}" y="{number(mark.y)}" width="{number(mark.width)}" '
                f'height="{number(mark.height)}"{radius}'
                f"{_paint(mark.fill, mark.stroke, mark.stroke_width, mark.opacity)}/>"
            )
        case Disc():
            return (
                f'<circle cx="{number(mark.x)}" cy="{number(mark.y)}" r="{number(mark.radius)}"'
                f"{_paint(mark.fill, mark.stroke, mark.stroke_width, mark.opacity)}/>"
            )
        case Text():
            return _text(mark)
        case Raster():
            data = base64.b64encode(png_bytes(mark.pixels)).decode("ascii")
            return (
                f'<image x="{number(mark.x)}" y="{number(mark.y)}" width="{number(mark.width)}" '
                f'height="{number(mark.height)}" preserveAspectRatio="none" '
                f'href="data:image/png;base64,{data}"/>'
            )
        case Group():
            title = f"<title>{escape(mark.title)}</title>" if mark.title else ""
            return f"<g>{title}{_marks(mark.marks)}</g>"


def _text(mark: Text) -> str:
    classes = f"f-{mark.tone.value}" + (" m" if mark.mono else "")
    extra = f' text-anchor="{mark.anchor}"' if mark.anchor != "start" else ""
    if mark.bold:
        extra += ' font-weight="600"'
    if mark.italic:
        extra += ' font-style="italic"'
    if mark.rotation:
        extra += f' transform="rotate(-90 {number(mark.x)} {number(mark.y)})"'
    return (
        f'<text x="{number(mark.x)}" y="{number(mark.y)}" font-size="{number(mark.size)}" '
        f'class="{classes}"{extra}>{escape(mark.text)}</text>'
    )

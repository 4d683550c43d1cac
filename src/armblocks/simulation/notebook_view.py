"""The notebook view of a result: one small figure for each signal, in self-contained HTML and SVG.

Text has the colour and font of the page, so that the view suits light and dark notebooks. Traces have colours
of Okabe and Ito (2008) with sufficient contrast on both.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import counted

if TYPE_CHECKING:
    from armblocks.equations import Slot
    from armblocks.simulation.run_data import RunData

Array = NDArray[np.float64]

TRACES = ("#1f83c0", "#e06a12", "#0f9d74", "#c06d9f", "#b98300", "#5aa9dd", "#8a8f98", "#a39a10")
"""The colours of the traces, in order."""
MAX_PANELS = 30
"""Maximum number of drawn signals."""
MAX_TRACES = 8
"""Maximum number of traces of one panel."""
WIDTH, HEIGHT = 264, 132
"""Size of a panel, px."""
LEFT, RIGHT, TOP, BOTTOM = 54, 10, 8, 20
"""Margins of a panel, px."""

STYLE = """
.ab-result{font:13px/1.45 system-ui,-apple-system,"Segoe UI",Roboto,sans-serif;color:inherit;max-width:1120px}
.ab-result h3{font-size:15px;margin:0 0 2px;font-weight:600}
.ab-result p{margin:0 0 8px;opacity:.78;font-variant-numeric:tabular-nums}
.ab-result .ab-note{opacity:1;border-left:3px solid #d55e00;padding:2px 8px}
.ab-result .ab-panels{display:grid;grid-template-columns:repeat(auto-fill,minmax(264px,1fr));gap:10px 16px}
.ab-result figure{margin:0}
.ab-result figcaption{font-weight:600;overflow-wrap:anywhere}
.ab-result figcaption span{font-weight:400;opacity:.7}
.ab-result figcaption b{float:right;font-size:11px}
.ab-result figcaption i{font-style:normal;margin-left:3px}
.ab-result svg{width:100%;height:auto;display:block}
.ab-result svg text{font-size:10px;fill:currentColor;opacity:.75;font-variant-numeric:tabular-nums}
"""


def result_html(result: RunData) -> str:
    """Title, statistics of the run, and a panel for each signal, as self-contained HTML."""
    report = result.run
    end = float(result.time[-1]) if result.time.size else 0.0
    solver = (
        "no solver needed" if report.solver == "none" else f"{report.solver}, {counted(report.steps, 'step')}"
    )
    facts = (
        f"{counted(result.time.size, 'sample')} to {end:g} s · {solver} · "
        f"{_seconds(report.wall_time)} · {report.real_time_factor:,.0f} × real time"
    )
    parts = [f'<div class="ab-result"><style>{STYLE}</style><h3>{escape(result.name)}</h3><p>{facts}</p>']
    note = escape(report.message)
    if not report.complete:
        note = f"<strong>Incomplete.</strong> {note or 'The run did not reach its stop time.'}"
    if note:
        parts.append(f'<p class="ab-note">{note}</p>')
    rows = result.with_jumps()
    parts.append(panels_html(rows.time, [(slot, rows[slot.name]) for slot in rows.signals_layout]))
    parts.append("</div>")
    return "".join(parts)


def panels_html(time: Array, quantities: Sequence[tuple[Slot, Array]]) -> str:
    """A panel for each quantity, ``(N, *shape)`` over ``time`` (N,) s; angles in degrees."""
    panels = "".join(_panel(time, values, slot) for slot, values in quantities[:MAX_PANELS])
    rest = ", ".join(escape(slot.name) for slot, _ in quantities[MAX_PANELS:])
    more = f"<p>Not drawn: {rest}</p>" if rest else ""
    return f'<div class="ab-panels">{panels}</div>{more}'


def _panel(time: Array, values: Array, slot: Slot) -> str:
    columns = values.reshape(time.size, slot.size)
    drawn = _drawn_components(columns)
    angle = slot.unit == "rad" or slot.unit.startswith("rad/")
    unit = slot.unit.replace("rad", "deg", 1) if angle else slot.unit
    drawn_values = columns[:, drawn] * (180.0 / np.pi if angle else 1.0)
    low, high = (float(drawn_values.min()), float(drawn_values.max())) if drawn_values.size else (0.0, 0.0)
    details = " · ".join(part for part in (unit, "×".join(map(str, slot.shape))) if part)
    if len(drawn) < slot.size:
        details += f" · {len(drawn)} of {slot.size} drawn"
    title = slot.title or slot.name
    label = f"{title}{f' in {unit}' if unit else ''}: from {_tick(low)} to {_tick(high)}"
    caption = f"<figcaption>{escape(title)} <span>{escape(details)}</span>{_legend(slot, drawn)}</figcaption>"
    return f"<figure>{caption}{_svg(time, drawn_values, low, high, label)}</figure>"


def _legend(slot: Slot, drawn_columns: list[int]) -> str:
    """The name or index of each component in the colour of its trace; nothing for a scalar."""
    if not slot.shape:
        return ""
    names = slot.entry_names
    labels = (
        f'<i style="color:{TRACES[k % len(TRACES)]}">{escape(names[component])}</i>'
        for k, component in enumerate(drawn_columns)
    )
    return f" <b>{' '.join(labels)}</b>"


def _drawn_components(columns: Array) -> list[int]:
    """The components to draw: all, or only those that change, and at most ``MAX_TRACES``."""
    count = columns.shape[1]
    if count <= MAX_TRACES or columns.shape[0] == 0:
        return list(range(min(count, MAX_TRACES)))
    moving = [k for k in range(count) if columns[:, k].max() > columns[:, k].min()]
    return (moving or list(range(count)))[:MAX_TRACES]


def _svg(time: Array, columns: Array, low: float, high: float, label: str) -> str:
    # A constant is in the middle of its panel, with a range of half its value, or 1, on either side.
    margin = 0.06 * (high - low) if high > low else (0.5 * abs(high) or 1.0)
    bottom, top = low - margin, high + margin
    start, end = (float(time[0]), float(time[-1])) if time.size else (0.0, 0.0)
    across = (WIDTH - LEFT - RIGHT) / ((end - start) or 1.0)
    down = (HEIGHT - TOP - BOTTOM) / (top - bottom)

    def y(value: float) -> float:
        return HEIGHT - BOTTOM - (value - bottom) * down

    floor, right = HEIGHT - BOTTOM, WIDTH - RIGHT
    lines = [
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{escape(label, quote=True)}">',
        f'<path d="M{LEFT} {TOP}V{floor}H{right}" fill="none" stroke="currentColor" stroke-opacity=".3"/>',
    ]
    if bottom < 0.0 < top:
        lines.append(f'<path d="M{LEFT} {y(0.0):.1f}H{right}" stroke="currentColor" stroke-opacity=".15"/>')
    lines += [
        f'<text x="{LEFT - 5}" y="{y(value) + 3.5:.1f}" text-anchor="end">{_tick(value)}</text>'
        for value in dict.fromkeys((low, high))
    ]
    lines.append(f'<text x="{LEFT}" y="{HEIGHT - 6}">{start:g}</text>')
    lines.append(f'<text x="{right}" y="{HEIGHT - 6}" text-anchor="end">{end:g} s</text>')
    for k in range(columns.shape[1]):
        instants, values = _envelope(time, columns[:, k])
        points = " ".join(
            f"{LEFT + (t - start) * across:.1f},{y(v):.1f}"
            for t, v in zip(instants.tolist(), values.tolist())
        )
        lines.append(
            f'<polyline points="{points}" fill="none" stroke="{TRACES[k % len(TRACES)]}" stroke-width="1.6" '
            'stroke-linejoin="round"/>'
        )
    lines.append("</svg>")
    return "".join(lines)


def _envelope(time: Array, values: Array, intervals: int = 110) -> tuple[Array, Array]:
    """The lowest and highest point of each interval, in order of time: the same figure with less text."""
    if time.size <= 2 * intervals:
        return time, values
    edges = np.searchsorted(time, np.linspace(float(time[0]), float(time[-1]), intervals + 1)).tolist()
    edges[-1] = time.size
    drawn_samples = {0, time.size - 1}
    for a, b in itertools.pairwise(edges):
        if a < b:
            drawn_samples |= {a + int(np.argmin(values[a:b])), a + int(np.argmax(values[a:b]))}
    places = np.array(sorted(drawn_samples))
    return time[places], values[places]


def _tick(value: float) -> str:
    """Three significant digits, without exponent from 0.001 to 100 000, with a typographic minus sign."""
    rounded = float(f"{0.0 if abs(value) < 1e-300 else value:.3g}")
    if rounded == 0.0 or 1e-3 <= abs(rounded) < 1e5:
        text = np.format_float_positional(rounded, trim="-")
    else:
        mantissa, _, exponent = f"{rounded:e}".partition("e")
        text = f"{float(mantissa):g}e{int(exponent)}"
    return text.replace("-", "−")


def _seconds(value: float) -> str:
    """A wall time with a suitable unit prefix."""
    for limit, factor, unit in ((1e-3, 1e6, "µs"), (1.0, 1e3, "ms")):
        if value < limit:
            return f"{value * factor:.3g} {unit}"
    return f"{value:.3g} s"

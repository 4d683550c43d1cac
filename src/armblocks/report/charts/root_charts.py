"""Poles and zeros in the complex plane, and root loci."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from armblocks.analysis.linear_system import LinearSystem
from armblocks.analysis.root_locus import extent, root_locus
from armblocks.analysis.shown_values import shown_poles, shown_zeros
from armblocks.errors import counted
from armblocks.pictures.numbers import axis_number
from armblocks.pictures.picture import Disc, Mark, Picture, Polyline, Text
from armblocks.pictures.style import SMALL_SIZE, Tone, trace_tone
from armblocks.report.charts.axes import (
    BOTTOM,
    LEFT,
    RIGHT,
    TOP,
    PlotArea,
    clip_line,
    equal_scale_ranges,
    linear_area,
)
from armblocks.report.charts.scale import padded_range

_Array = NDArray[np.float64]
_Complex = NDArray[np.complex128]

_DAMPINGS = (0.2, 0.4, 0.6, 0.8)


def pole_zero_picture(system: LinearSystem, *, width: float = 560.0) -> Picture:
    """Poles as crosses and zeros as rings, with lines of constant damping and constant frequency."""
    poles, zeros = shown_poles(system), shown_zeros(system)
    area, box = _plane(np.concatenate([poles, zeros]), system, width)
    picture = _plane_picture(system, area, box, width, "Poles and zeros")
    picture.description = (
        f"{counted(len(poles), 'pole')} (crosses) and {counted(len(zeros), 'zero')} (rings)."
    )
    picture.extend(_roots(area, poles, zeros))
    return picture


def root_locus_picture(system: LinearSystem, *, gains: _Array | None = None, width: float = 620.0) -> Picture:
    """The poles of the loop ``1 + gain L`` from gain 0 on; each branch has a colour and an arrow to higher
    gains."""
    locus = root_locus(system, gains)
    loop, poles = locus.system, locus.roots[0]
    reach = extent(loop, locus.zeros)
    visible = locus.roots[np.abs(locus.roots) < reach]
    area, box = _plane(np.concatenate([visible, poles, locus.zeros]), loop, width)
    picture = _plane_picture(loop, area, box, width, "Root locus")
    picture.description = (
        f"{locus.roots.shape[1]} branches for gains up to {axis_number(float(locus.gains[-1]), 3)}; crosses "
        "are poles of the open loop, rings its zeros."
    )
    for branch in range(locus.roots.shape[1]):
        values = locus.roots[:, branch]
        points = area.points(values.real, values.imag)
        picture.add(Polyline(clip_line(points, box), trace_tone(branch), 1.8))
        picture.extend(_arrow_head(points, box, branch))
    picture.extend(_roots(area, poles, locus.zeros))
    picture.extend(_crossings(locus.gains, locus.roots, loop, area, box))
    return picture


def _plane(
    roots: _Complex, system: LinearSystem, width: float
) -> tuple[PlotArea, tuple[float, float, float, float]]:
    height = width * 0.86
    box = (LEFT, TOP, width - RIGHT, height - BOTTOM)
    if system.is_discrete:
        reach = max(1.12, 1.12 * float(np.abs(roots).max(initial=0.0)))
        x, y = (-reach, reach), (-reach, reach)
    else:
        size = max(float(np.abs(roots).max(initial=0.0)), 1e-12)
        x = padded_range(np.concatenate([roots.real, [0.0, -0.3 * size, 0.12 * size]]), 0.1)
        y_max = max(1.12 * float(np.abs(roots.imag).max(initial=0.0)), 0.3 * size)
        y = (-y_max, y_max)
    return linear_area(*equal_scale_ranges(x, y, box), box), box


def _plane_picture(
    system: LinearSystem,
    area: PlotArea,
    box: tuple[float, float, float, float],
    width: float,
    what: str,
) -> Picture:
    picture = Picture(width=width, height=width * 0.86, title=f"{what} of {system.name or 'a linear system'}")
    unit = "" if system.is_discrete else ", rad/s"
    picture.extend(area.frame(x_label=f"Real part{unit}", y_label=f"Imaginary part{unit}"))
    picture.extend(_stability_boundary(system, area, box))
    picture.extend(_damping_grid(system, area, box))
    return picture


def _stability_boundary(
    system: LinearSystem, area: PlotArea, box: tuple[float, float, float, float]
) -> list[Mark]:
    """Draw the stability boundary: the imaginary axis, or the unit circle."""
    if system.is_discrete:
        angle = np.linspace(0.0, 2.0 * math.pi, 361, dtype=np.float64)
        return [Polyline(clip_line(area.points(np.cos(angle), np.sin(angle)), box), Tone.MUTED, 1.2)]
    x = area.x_scale(0.0)
    return [Polyline([(x, box[1]), (x, box[3])], Tone.MUTED, 1.2, sharp=True)]


def _damping_grid(system: LinearSystem, area: PlotArea, box: tuple[float, float, float, float]) -> list[Mark]:
    """Draw dotted lines of constant damping ratio, with their numbers at the edge of the figure."""
    marks: list[Mark] = []
    for damping in _DAMPINGS:
        if system.is_discrete:
            # s dt from 0 to the Nyquist frequency.
            angle = np.linspace(0.0, math.pi, 121)
            line: _Complex = np.exp(angle * complex(-damping / math.sqrt(1.0 - damping**2), 1.0))
        else:
            radius = 4.0 * max(abs(area.x_scale.low), abs(area.y_scale.high))
            line = np.array([0.0, radius * complex(-damping, math.sqrt(1.0 - damping**2))])
        for sign in (1.0, -1.0):
            points = clip_line(area.points(line.real, sign * line.imag), box)
            marks.append(Polyline(points, Tone.HAIRLINE, 1.0, (2.0, 3.0)))
        ends = clip_line(area.points(line.real, line.imag), box)
        if len(ends) > 1 and (not system.is_discrete or abs(area.x_scale.factor) > 120.0):
            x, y = ends[len(ends) // 2 if system.is_discrete else -1].tolist()
            x = min(max(x, box[0] + 14), box[2] - 14)
            baseline = y + 12 if y < box[1] + 12 else y - 4
            marks.append(Text(x, baseline, f"ζ {damping:g}", SMALL_SIZE, Tone.MUTED, "middle"))
    return marks


def _roots(area: PlotArea, poles: _Complex, zeros: _Complex) -> list[Mark]:
    marks: list[Mark] = []
    size = 4.6
    left, top, right, bottom = area.box
    for root in zeros.tolist():
        x, y = area.x_scale(root.real), area.y_scale(root.imag)
        if left <= x <= right and top <= y <= bottom:
            marks.append(Disc(x, y, size, fill=Tone.SURFACE, stroke=Tone.INK, stroke_width=1.8))
    for root in poles.tolist():
        x, y = area.x_scale(root.real), area.y_scale(root.imag)
        marks.append(Polyline([(x - size, y - size), (x + size, y + size)], Tone.INK, 2.0))
        marks.append(Polyline([(x - size, y + size), (x + size, y - size)], Tone.INK, 2.0))
    return marks


def _arrow_head(points: _Array, box: tuple[float, float, float, float], branch: int) -> list[Mark]:
    """Draw an arrow in the middle of the visible part of a branch."""
    left, top, right, bottom = box
    x, y = points[:, 0], points[:, 1]
    inside = (x > left) & (x < right) & (y > top) & (y < bottom)
    steps = np.where(inside[1:] & inside[:-1], np.hypot(np.diff(x), np.diff(y)), 0.0)
    length_so_far: _Array = np.concatenate([[0.0], np.cumsum(steps)])
    if length_so_far[-1] < 24:
        return []
    k = min(max(int(np.searchsorted(length_so_far, 0.5 * float(length_so_far[-1]))), 1), len(points) - 1)
    heading = points[k] - points[k - 1]
    length = float(np.hypot(*heading))
    if length == 0.0:
        return []
    direction = heading / length
    side = np.array([-direction[1], direction[0]])
    tip = points[k] + 4 * direction
    wings = np.stack([tip, tip - 9 * direction + 4 * side, tip - 9 * direction - 4 * side])
    return [Polyline(wings, stroke=None, fill=trace_tone(branch), closed=True)]


def _crossings(
    gains: _Array,
    roots: _Complex,
    loop: LinearSystem,
    area: PlotArea,
    box: tuple[float, float, float, float],
) -> list[Mark]:
    """Mark the points at which branches cross the stability boundary, with the gain."""
    excess = np.abs(roots) - 1.0 if loop.is_discrete else roots.real
    marks: list[Mark] = []
    labelled: list[tuple[float, float]] = []
    for k, branch in np.argwhere((excess[1:] > 0.0) != (excess[:-1] > 0.0)).tolist():
        if k == 0:
            continue
        fraction = excess[k, branch] / (excess[k, branch] - excess[k + 1, branch])
        crossing = roots[k, branch] + fraction * (roots[k + 1, branch] - roots[k, branch])
        gain = float(gains[k] + fraction * (gains[k + 1] - gains[k]))
        x, y = area.x_scale(crossing.real), area.y_scale(crossing.imag)
        if not (box[0] < x < box[2] and box[1] < y < box[3]):
            continue
        marks.append(Disc(x, y, 3.6, fill=Tone.ACCENT))
        if crossing.imag >= 0.0 and all(math.hypot(x - u, y - v) > 18.0 for u, v in labelled):
            labelled.append((x, y))
            word = f"gain {axis_number(gain, 3)}"
            fits = x + 80 < box[2]
            side = "start" if fits else "end"
            marks.append(Text(x + (9 if fits else -9), y - 5, word, SMALL_SIZE, Tone.ACCENT, side, bold=True))
    return marks

"""Spectra of signals: amplitudes or power densities over frequency in Hz."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from armblocks.analysis.spectrum import SignalSpectrum
from armblocks.pictures.picture import Picture, Polyline
from armblocks.pictures.style import FIGURE_WIDTH, trace_dash, trace_tone
from armblocks.pictures.thinning import thin_out
from armblocks.report.charts.axes import (
    BOTTOM,
    LEFT,
    RIGHT,
    TOP,
    clip_line,
    linear_area,
    log_area,
    with_legend,
)
from armblocks.report.charts.scale import padded_range

_Array = NDArray[np.float64]

_PANEL_HEIGHT = 230.0
_DECIBEL_RANGE = 140.0
"""Displayed range below the largest value of all spectra, dB. Lower values are rounding errors."""


def spectrum_chart(
    spectra: Sequence[tuple[str, str, SignalSpectrum]],
    *,
    title: str,
    decibels: bool = True,
    logarithmic: bool = False,
    width: float = FIGURE_WIDTH,
) -> Picture:
    """One line for each (label, unit, spectrum of one signal), with a legend if there are several.

    With ``decibels`` 0 dB is an amplitude of 1, or a density of 1, in the signal's SI unit.
    """
    units = {unit for _, unit, _ in spectra}
    density = spectra[0][2].quantity == "power density"
    lines = [(spectrum.frequency, _display_values(spectrum, decibels, density)) for _, _, spectrum in spectra]
    names = [label for label, _, _ in spectra]
    low = min(float(frequency[1]) for frequency, _ in lines) if logarithmic else 0.0
    high = max(float(frequency[-1]) for frequency, _ in lines)
    visible = np.concatenate([values[frequency >= low] for frequency, values in lines])
    box = (LEFT, TOP, width - RIGHT, TOP + _PANEL_HEIGHT)
    span = _range(visible, decibels)
    quantity = "Power density" if density else "Amplitude"
    picture = Picture(
        width=width,
        height=TOP + _PANEL_HEIGHT + BOTTOM,
        title=title,
        description=f"{quantity} of {', '.join(names)} over frequency.",
    )
    x = (low, high)
    area = log_area(x, span, box, degrees=False) if logarithmic else linear_area(x, span, box)
    label = _label(units.pop() if len(units) == 1 else "", decibels, density)
    picture.extend(area.frame(x_label="Frequency, Hz", y_label=label))
    for index, (frequency, values) in enumerate(lines):
        is_shown = frequency >= low
        positions = area.points(
            frequency[is_shown], np.where(np.isfinite(values[is_shown]), values[is_shown], span[0] - 1e3)
        )
        x_px, y_px = thin_out(positions[:, 0], positions[:, 1], round(box[2] - box[0]))
        points = clip_line(np.column_stack([x_px, y_px]), area.box)
        picture.add(Polyline(points, trace_tone(index), 1.6, trace_dash(index)))
    return with_legend(picture, names)


def _display_values(spectrum: SignalSpectrum, decibels: bool, density: bool) -> _Array:
    values = spectrum.values[:, 0]
    if not decibels:
        return values
    with np.errstate(divide="ignore"):
        return (10.0 if density else 20.0) * np.log10(values)


def _range(values: _Array, decibels: bool) -> tuple[float, float]:
    finite = values[np.isfinite(values)]
    if decibels:
        return padded_range(np.maximum(finite, finite.max(initial=-_DECIBEL_RANGE) - _DECIBEL_RANGE), 0.06)
    return 0.0, padded_range(finite, 0.06)[1]


def _label(unit: str, decibels: bool, density: bool) -> str:
    square = f"({unit})²" if " " in unit or "/" in unit else f"{unit}²"
    density_unit = (f"{square}/Hz" if unit else "1/Hz") if density else unit
    quantity = "Power density" if density else "Amplitude"
    if decibels:
        return f"{quantity}, dB" + (f" of 1 {density_unit}" if unit else "")
    return f"{quantity}, {density_unit}" if density_unit else quantity

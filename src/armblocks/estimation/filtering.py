"""Zero-phase low-pass filters, derivatives and decimation of uniformly sampled signals."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ORDER = 4
"""Order of the Butterworth filter, which is applied forwards and backwards."""


def low_passed(values: Array, step: float, cutoff: float) -> Array:
    """``values`` (N, …) sampled every ``step`` s, without the frequencies above ``cutoff`` Hz.

    The gain of a Butterworth filter of fourth order applied forwards and backwards is ``1 / (1 + (f /
    cutoff)^8)``, without phase shift. At both ends the signal is continued by its reflection through the end
    point, so that values and derivatives are continuous.
    """
    count = len(values)
    if count < 4 or cutoff * step >= 0.5:
        return values.copy()
    margin = min(count - 1, int(np.ceil(4.0 / (cutoff * step))))
    before = 2.0 * values[0] - values[margin:0:-1]
    after = 2.0 * values[-1] - values[-2 : -margin - 2 : -1]
    extended = np.concatenate([before, values, after])
    # A straight line is removed so that the periodic continuation of the transform has no jump.
    share = np.linspace(0.0, 1.0, len(extended)).reshape(-1, *[1] * (values.ndim - 1))
    line = extended[0] + (extended[-1] - extended[0]) * share
    spectrum = np.fft.rfft(extended - line, axis=0)
    gain = 1.0 / (1.0 + (np.fft.rfftfreq(len(extended), step) / cutoff) ** (2 * ORDER))
    spectrum *= gain.reshape(-1, *[1] * (values.ndim - 1))
    filtered = np.fft.irfft(spectrum, len(extended), axis=0) + line
    return filtered[margin : margin + count]


def central_derivative(values: Array, step: float) -> Array:
    """The derivative (N, …) of values sampled every ``step`` s, of fourth order inside, of second order at
    the two samples of each end."""
    derivative: Array = np.gradient(values, step, axis=0, edge_order=2)
    if len(values) >= 5:
        inner = 8.0 * (values[3:-1] - values[1:-3]) - (values[4:] - values[:-4])
        derivative[2:-2] = inner / (12.0 * step)
    return derivative


def advised_cutoff(values: Array, step: float) -> float:
    """A cut-off frequency (Hz) for positions (N, n): five times the highest frequency of the motion.

    Above the highest frequency, less than 1e-4 of the energy of the speed of each joint remains. White noise,
    estimated from the upper half of the spectrum, is first subtracted. The result is at most a fifth of the
    sample rate. Source of the factor: Gautier, *Dynamic identification of robots with power model*, ICRA
    1997.
    """
    count = len(values)
    window = np.hanning(count).reshape(-1, 1)
    share = np.linspace(0.0, 1.0, count).reshape(-1, 1)
    detrended = values - (values[0] + (values[-1] - values[0]) * share)
    power = np.abs(np.fft.rfft(window * detrended, axis=0)) ** 2
    frequency = np.fft.rfftfreq(count, step)
    noise = np.median(power[len(power) // 2 :], axis=0) / np.log(2.0)
    signal = np.where(power > 20.0 * noise, power - noise, 0.0) * frequency[:, None] ** 2
    energy = np.cumsum(signal, axis=0)
    highest = 1.0 / (count * step)
    for column in range(values.shape[1]):
        if energy[-1, column] > 0.0:
            below = int(np.sum(energy[:, column] < (1.0 - 1e-4) * energy[-1, column]))
            highest = max(highest, float(frequency[min(below, len(frequency) - 1)]))
    return min(5.0 * highest, 0.2 / step)

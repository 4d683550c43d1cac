"""Spectra of recorded signals: amplitudes of lines, and power densities by Welch's method.

Harris, "On the Use of Windows for Harmonic Analysis with the Discrete Fourier Transform", Proc. IEEE 66,
1978; Welch, IEEE Trans. Audio Electroacoustics 15, 1967; the flat top of D'Antona and Ferrero, 2006.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.errors import InputError, UnknownNameError, counted

Array = NDArray[np.float64]

WINDOWS: Mapping[str, tuple[float, ...]] = {
    "hann": (0.5, -0.5),
    "hamming": (0.54, -0.46),
    "blackman": (0.42, -0.5, 0.08),
    "flat top": (0.21557895, -0.41663158, 0.277263158, -0.083578947, 0.006947368),
    "rectangular": (1.0,),
}
"""Windows as sums of cosines: w[n] = sum over k of a[k] cos(2 pi k n / N)."""

QUANTITIES = ("amplitude", "power density")


@dataclass(frozen=True, kw_only=True, eq=False)
class SignalSpectrum:
    """``values`` (m, k) of k signals at ``frequency`` (m,) Hz, from 0 to half of ``sample_rate`` Hz.

    The ``quantity`` ``"amplitude"`` has the unit of the signal, ``"power density"`` its square per Hz. The
    values are averages over ``segments`` segments of ``length`` samples.
    """

    quantity: str
    frequency: Array
    values: Array
    sample_rate: float
    segments: int
    length: int


def signal_spectrum(
    time: ArrayLike,
    signals: ArrayLike,
    *,
    quantity: str = "amplitude",
    window: str = "hann",
    averages: int = 1,
    sample_rate: float = 0.0,
    begin: float = 0.0,
    remove_mean: bool = True,
) -> SignalSpectrum:
    """The spectrum of ``signals`` (N,) or (N, k) at the non-decreasing times ``time`` (N,) s.

    An amplitude is A = 2 |X| / sum(w), exact for a sine at the frequency of a line. A power density is
    one-sided: 2 |X|^2 / (rate sum(w^2)). The powers of ``averages`` segments that overlap by half are
    averaged. ``sample_rate`` in Hz; 0 is the rate of the median recorded step. Between samples signals are
    interpolated linearly; at a jump, where a time occurs twice, the later value counts. Samples before
    ``begin`` (s) are ignored.

    Raises ``UnknownNameError`` for an unknown quantity or window, ``InputError`` for too few samples.
    """
    if quantity not in QUANTITIES:
        raise UnknownNameError("quantity", quantity, QUANTITIES, where="spectrum")
    if window not in WINDOWS:
        raise UnknownNameError("window", window, list(WINDOWS), where="spectrum")
    samples, rate = _evenly_sampled(np.asarray(time, dtype=np.float64), signals, sample_rate, begin)
    length = 2 * len(samples) // (averages + 1)
    length -= length % 2
    if length < 4:
        raise InputError(
            f"{counted(averages, 'segment')} of {counted(len(samples), 'sample')} in all: fewer than 4 "
            "samples in each",
            where="spectrum",
            allowed="4 samples or more in each segment",
            fix="simulate longer, decrease the sample time, or decrease averages",
        )
    angle = 2.0 * math.pi * np.arange(length) / length
    weights = np.asarray(sum(a * np.cos(k * angle) for k, a in enumerate(WINDOWS[window])))
    segments = np.stack([samples[k * length // 2 :][:length] for k in range(averages)])
    if remove_mean:
        segments = segments - segments.mean(axis=1, keepdims=True)
    power = (np.abs(np.fft.rfft(segments * weights[:, None], axis=1)) ** 2).mean(axis=0)
    if quantity == "amplitude":
        values = 2.0 * np.sqrt(power) / weights.sum()
        values[[0, -1]] /= 2.0  # 0 and half the rate have no negative counterpart
    else:
        values = 2.0 * power / (rate * (weights**2).sum())
        values[[0, -1]] /= 2.0
    return SignalSpectrum(
        quantity=quantity,
        frequency=np.asarray(np.arange(length // 2 + 1) * (rate / length), dtype=np.float64),
        values=values,
        sample_rate=rate,
        segments=averages,
        length=length,
    )


def _evenly_sampled(time: Array, signals: ArrayLike, sample_rate: float, begin: float) -> tuple[Array, float]:
    """Evenly spaced samples (n, k) and their rate (Hz).

    The last sample is omitted, because after an integer number of periods it equals the first.
    """
    values = np.asarray(signals, dtype=np.float64).reshape(time.size, -1)
    steps = np.diff(time)
    steps = steps[steps > 0.0]
    if not steps.size or not np.isfinite(values).all():
        raise InputError(
            "there are fewer than two recorded times" if not steps.size else "a signal is not finite",
            where="spectrum",
            allowed="finite numbers at the recorded times of a run",
            fix="run longer" if not steps.size else "look at the signal in a Scope",
        )
    last = np.append(np.diff(time) > 0.0, True)
    time, values = time[last], values[last]
    start = max(begin, float(time[0]))
    span = float(time[-1]) - start
    count = math.floor(span * sample_rate + 1e-6) if sample_rate else round(span / float(np.median(steps)))
    if count < 1:
        raise InputError(
            f"there are no samples after {begin:g} s",
            where="spectrum",
            allowed=f"a begin before {time[-1]:g} s",
            fix="set an earlier begin, or run longer",
        )
    rate = sample_rate or count / span
    sample_times = start + np.arange(count) / rate
    columns: list[Array] = [np.interp(sample_times, time, values[:, k]) for k in range(values.shape[1])]
    return np.column_stack(columns), rate

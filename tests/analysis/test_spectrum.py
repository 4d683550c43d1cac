"""Spectra: amplitudes of sines, densities that integrate to the mean square, agreement with SciPy."""

from typing import Any

import numpy as np
import pytest
import scipy.signal

from armblocks.analysis.spectrum import QUANTITIES, WINDOWS, signal_spectrum
from armblocks.errors import InputError, UnknownNameError

SIGNAL: Any = scipy.signal
RATE, COUNT = 256.0, 1024
TIME = np.arange(COUNT + 1) / RATE
NOISE = np.random.default_rng(3).normal(size=COUNT + 1)
SCIPY_NAMES = {"flat top": "flattop", "rectangular": "boxcar"}


@pytest.mark.parametrize("window", WINDOWS)
def test_a_spectral_line_has_the_amplitude_of_its_sine_for_every_window(window: str) -> None:
    wave = 3.0 * np.sin(2 * np.pi * 10.0 * TIME + 0.3)
    spectrum = signal_spectrum(TIME, wave, window=window)
    line = np.argmin(abs(spectrum.frequency - 10.0))
    assert spectrum.values[line, 0] == pytest.approx(3.0, rel=1e-12)
    assert np.argmax(spectrum.values[:, 0]) == line


def test_a_constant_and_a_wave_at_the_nyquist_frequency_have_their_amplitudes() -> None:
    wave = 2.0 + 0.5 * np.cos(np.pi * RATE * TIME)
    spectrum = signal_spectrum(TIME, wave, window="rectangular", remove_mean=False)
    assert spectrum.values[[0, -1], 0] == pytest.approx([2.0, 0.5], rel=1e-12)
    assert np.max(spectrum.values[1:-1]) < 1e-12


def test_a_power_density_integrates_to_the_mean_square() -> None:
    spectrum = signal_spectrum(TIME, NOISE, quantity="power density", window="rectangular", remove_mean=False)
    width = spectrum.frequency[1]
    assert spectrum.values.sum() * width == pytest.approx(np.mean(NOISE[:-1] ** 2), rel=1e-12)


@pytest.mark.parametrize("quantity", QUANTITIES)
@pytest.mark.parametrize("window", WINDOWS)
@pytest.mark.parametrize("averages", [1, 7])
def test_spectra_agree_with_scipy(quantity: str, window: str, averages: int) -> None:
    # SciPy's flat-top window has the same published coefficients: both agree to rounding errors.
    actual = signal_spectrum(TIME, NOISE, quantity=quantity, window=window, averages=averages)
    assert actual.length == 2 * COUNT // (averages + 1)
    frequency, expected = SIGNAL.welch(
        NOISE[:-1],
        RATE,
        SCIPY_NAMES.get(window, window),
        nperseg=actual.length,
        detrend="constant",
        scaling="density" if quantity == "power density" else "spectrum",
    )
    assert actual.frequency == pytest.approx(frequency)
    values = actual.values[:, 0]
    if quantity == "amplitude":  # SciPy's "spectrum" is the mean square of each line
        values = values**2 * np.where((frequency == 0) | (frequency == RATE / 2), 1.0, 0.5)
    assert values == pytest.approx(expected, rel=1e-9, abs=1e-25)


def test_event_times_and_repeated_times_do_not_change_the_spectrum() -> None:
    jump = (TIME >= 2.0).astype(float)
    time = np.sort(np.concatenate([TIME, [2.0, 1.00001]]))
    values = np.where(time >= 2.0, 1.0, 0.0)
    values[np.searchsorted(time, 2.0)] = 0.0  # before the jump, at the same instant
    plain, uneven = (signal_spectrum(t, v, sample_rate=RATE) for t, v in ((TIME, jump), (time, values)))
    assert uneven.values == pytest.approx(plain.values, rel=1e-12, abs=1e-15)


def test_samples_before_begin_are_ignored_and_several_signals_are_columns() -> None:
    waves = np.column_stack([np.sin(2 * np.pi * 16 * TIME), np.where(TIME < 2.0, 9.0, 0.0)])
    spectrum = signal_spectrum(TIME, waves, begin=2.0, remove_mean=False)
    assert spectrum.sample_rate == pytest.approx(RATE)
    assert np.max(spectrum.values[:, 0]) == pytest.approx(1.0)
    assert np.max(spectrum.values[:, 1]) < 1e-12


def test_unsuitable_signals_and_unknown_options_are_refused() -> None:
    with pytest.raises(InputError, match=r"3 segments of 6 samples in all: fewer than 4 samples in each"):
        signal_spectrum(np.arange(7.0), np.arange(7.0), averages=3)
    with pytest.raises(InputError, match=r"there are fewer than two recorded times"):
        signal_spectrum([1.0], [1.0])
    with pytest.raises(InputError, match=r"a signal is not finite"):
        signal_spectrum([0.0, 1.0, 2.0], [1.0, np.nan, 2.0])
    with pytest.raises(InputError, match=r"there are no samples after 9 s"):
        signal_spectrum([0.0, 1.0, 2.0], [1.0, 1.0, 2.0], begin=9.0)
    with pytest.raises(UnknownNameError, match=r"no quantity named 'power'"):
        signal_spectrum(TIME, TIME, quantity="power")
    with pytest.raises(UnknownNameError, match=r"no window named 'han'"):
        signal_spectrum(TIME, TIME, window="han")

"""Samples of a run as a binary frame: a short header, then numbers that a front end uses without conversion.

::

    bytes 0-3    length of the header, little-endian
    header       JSON, padded with spaces so that the numbers begin at a multiple of 8
                 {"run": …, "first": index of the first sample, "count": N}
    time         N float64, little-endian
    columns      N float64 each, one after the other: channels in order, entries of a matrix row by row
"""

from __future__ import annotations

import json

import numpy as np
from numpy.typing import NDArray


def sample_frame(run: str, first: int, time: NDArray[np.float64], signals: NDArray[np.float64]) -> bytes:
    """Encode the samples from number ``first`` on: ``time`` (N,) s, ``signals`` (ny, N) in column layout."""
    header = json.dumps({"run": run, "first": first, "count": int(time.size)}).encode()
    header += b" " * (-(4 + len(header)) % 8)
    numbers = np.ascontiguousarray(np.concatenate([time[None, :], signals]), dtype="<f8")
    return len(header).to_bytes(4, "little") + header + numbers.tobytes()


def thinned(
    time: NDArray[np.float64], signals: NDArray[np.float64], stride: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Replace every ``stride`` samples by two: minimum and maximum of each signal, in their order of time.

    ``time`` is (N,) s, ``signals`` (ny, N). The times of the two are those of the first and the middle sample
    of the stride, for all signals. A plot of the result looks the same if one pixel covers more than a
    stride. An incomplete stride at the end is reduced in the same way.
    """
    whole = time.size - time.size % stride
    if whole == 0:
        return (time, signals) if time.size <= 2 else _extremes(time, signals, time.size)
    first = _extremes(time[:whole], signals[:, :whole], stride)
    if whole == time.size:
        return first
    remaining = thinned(time[whole:], signals[:, whole:], stride)
    return np.concatenate([first[0], remaining[0]]), np.concatenate([first[1], remaining[1]], axis=1)


def _extremes(
    time: NDArray[np.float64], signals: NDArray[np.float64], stride: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    groups = signals.reshape(signals.shape[0], -1, stride)
    indices = np.sort(np.stack([groups.argmin(axis=2), groups.argmax(axis=2)], axis=2), axis=2)
    values = np.take_along_axis(groups, indices, axis=2)
    times = time.reshape(-1, stride)[:, [0, stride // 2]]
    return times.reshape(-1), values.reshape(signals.shape[0], -1)

"""Samples of a run as a binary frame: small header, then plain numbers that a page may use as they lie.

::

    bytes 0-3    length of the header, little-endian
    header       JSON, padded with spaces so that the numbers begin at a multiple of 8
                 {"run": …, "first": index of the first sample, "count": N}
    time         N float64, little-endian
    columns      one after the other, N float64 each: the channels in order, each row by row
"""

from __future__ import annotations

import json

import numpy as np
from numpy.typing import NDArray


def sample_frame(run: str, first: int, time: NDArray[np.float64], signals: NDArray[np.float64]) -> bytes:
    """The frame of samples ``first`` and after: ``time`` (N,) s, ``signals`` (ny, N) in column layout."""
    header = json.dumps({"run": run, "first": first, "count": int(time.size)}).encode()
    header += b" " * (-(4 + len(header)) % 8)
    numbers = np.ascontiguousarray(np.concatenate([time[None, :], signals]), dtype="<f8")
    return len(header).to_bytes(4, "little") + header + numbers.tobytes()


def thinned(
    time: NDArray[np.float64], signals: NDArray[np.float64], stride: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Two samples in the place of every ``stride``: of each signal the least and the greatest, as they came.

    ``time`` (N,) s and ``signals`` (ny, N) give rows that draw the same picture where a pixel is wider than a
    stride. What does not fill a stride at the end is one too.
    """
    whole = time.size - time.size % stride
    if whole == 0:
        return (time, signals) if time.size <= 2 else _extremes(time, signals, time.size)
    first = _extremes(time[:whole], signals[:, :whole], stride)
    if whole == time.size:
        return first
    rest = thinned(time[whole:], signals[:, whole:], stride)
    return np.concatenate([first[0], rest[0]]), np.concatenate([first[1], rest[1]], axis=1)


def _extremes(
    time: NDArray[np.float64], signals: NDArray[np.float64], stride: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    groups = signals.reshape(signals.shape[0], -1, stride)
    places = np.sort(np.stack([groups.argmin(axis=2), groups.argmax(axis=2)], axis=2), axis=2)
    values = np.take_along_axis(groups, places, axis=2)
    times = time.reshape(-1, stride)[:, [0, stride // 2]]
    return times.reshape(-1), values.reshape(signals.shape[0], -1)

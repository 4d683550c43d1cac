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

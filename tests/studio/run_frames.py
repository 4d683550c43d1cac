"""Decoding of sample frames as in the front end."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def read_frame(data: bytes) -> tuple[dict[str, Any], Array, Array]:
    """Return header, times ``(m,)`` and columns ``(n, m)`` of a frame."""
    length = struct.unpack("<I", data[:4])[0]
    header = json.loads(data[4 : 4 + length])
    assert (4 + length) % 8 == 0
    numbers = np.frombuffer(data, "<f8", offset=4 + length).reshape(-1, header["count"])
    return header, numbers[0], numbers[1:]

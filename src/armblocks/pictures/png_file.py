"""PNG bytes from pixels: eight bits a channel, no metadata, the same bytes for the same pixels."""

from __future__ import annotations

import struct
import zlib

import numpy as np
from numpy.typing import NDArray

_SIGNATURE = b"\x89PNG\r\n\x1a\n"


def png_bytes(pixels: NDArray[np.uint8]) -> bytes:
    """Encode (rows, columns, 3 or 4) pixels, straight alpha (PNG specification, ISO/IEC 15948).

    Rows are not filtered, because line drawings on a plain background compress better without filters.
    Level 4 takes two thirds of the time of level 6 for 2 % more bytes (figures of kr180model).
    """
    rows, columns, channels = pixels.shape
    lines = np.zeros((rows, columns * channels + 1), dtype=np.uint8)
    lines[:, 1:].reshape(rows, columns, channels)[:] = pixels  # a view: its rows have equal distances
    header = struct.pack(">IIBBBBB", columns, rows, 8, 6 if channels == 4 else 2, 0, 0, 0)
    return b"".join(
        (
            _SIGNATURE,
            _chunk(b"IHDR", header),
            _chunk(b"IDAT", zlib.compress(lines.tobytes(), 4)),
            _chunk(b"IEND", b""),
        )
    )


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

"""STL meshes, binary and ASCII."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import FormatError

_HEADER = 84
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_VERTEX = re.compile(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)")


def stl_corners(data: bytes, name: str) -> NDArray[np.float64]:
    """The corners of all triangles, (F, 3, 3). Raises ``FormatError``; ``name`` is the file in messages."""
    count = int.from_bytes(data[80:_HEADER], "little") if len(data) >= _HEADER else -1
    if count >= 0 and len(data) >= _HEADER + count * _RECORD.itemsize and count > 0:
        return np.frombuffer(data, _RECORD, count, _HEADER)["corners"].astype(np.float64)
    if data.lstrip()[:5].lower() == b"solid":
        try:
            numbers = np.array([[float(word) for word in row] for row in _VERTEX.findall(data)])
            return numbers.reshape(-1, 3, 3)
        except ValueError:
            pass
    raise FormatError(
        "this is not an STL mesh", where=name, allowed="binary or ASCII STL", fix="export the mesh as STL"
    )

"""Texts and bytes of small mesh files: a box of 1 x 2 x 3 m with one corner at the origin, and GLB files."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np

POINTS = np.array([[x, y, z] for x in (0, 1) for y in (0, 2) for z in (0, 3)], dtype=float)
QUADS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
"""The sides of the box, counter-clockwise seen from outside."""
TRIANGLES = np.array([t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))])


def obj_box() -> str:
    vertices = "".join(f"v {x} {y} {z}\n" for x, y, z in POINTS)
    return vertices + "".join("f " + " ".join(f"{k + 1}//1" for k in quad) + "\n" for quad in QUADS)


def dae(nodes: str, polygons: str = "", unit: str = "", libraries: str = "") -> str:
    """A COLLADA file with the box as geometry ``box``, and a scene with these nodes."""
    polygons = polygons or (
        '<polylist count="6"><input semantic="NORMAL" source="#n" offset="1"/>'
        '<input semantic="VERTEX" source="#v" offset="0"/>'
        f"<vcount>{'4 ' * 6}</vcount><p>{' '.join(f'{k} 0' for quad in QUADS for k in quad)}</p></polylist>"
    )
    numbers = " ".join(str(x) for x in POINTS.ravel())
    return f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset>{unit}<up_axis>Y_UP</up_axis></asset>
<library_geometries><geometry id="box"><mesh>
<source id="p"><float_array id="a" count="24">{numbers}</float_array><technique_common>
<accessor source="#a" count="8" stride="3"><param name="X"/><param name="Y"/><param name="Z"/></accessor>
</technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
{polygons}</mesh></geometry></library_geometries>
{libraries}
<library_visual_scenes><visual_scene id="s">{nodes}</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"""


def glb(document: dict[str, Any], binary: bytes = b"") -> bytes:
    """A GLB file of a JSON document and its buffer."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    if binary:
        chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def glb_box(nodes: list[dict[str, Any]], **changes: Any) -> bytes:
    """A GLB file with the box as mesh 0; node 0 is the root of the scene."""
    points, indices = POINTS.astype("<f4").tobytes(), TRIANGLES.astype("<u2").tobytes()
    document: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": nodes,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": len(points)},
            {"buffer": 0, "byteOffset": len(points), "byteLength": len(indices)},
        ],
        "buffers": [{"byteLength": len(points) + len(indices)}],
    }
    return glb(document | changes, points + indices)

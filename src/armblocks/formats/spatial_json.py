"""Angles, vectors and transforms of robot documents, in SI units or, for angles, as strings in degrees."""

from __future__ import annotations

import math
import re

import numpy as np

from armblocks.errors import ArmblocksError, counted
from armblocks.formats.json_document import Node, closed_members
from armblocks.spatial import Matrix3, Transform, Vector3

_DEGREES = re.compile(r"(-?[0-9]+(?:\.[0-9]+)?) deg(/s)?")


def vector_from_json(node: Node) -> Vector3:
    """A vector (3,) of a list of three numbers."""
    x, y, z = node.numbers(3)
    return x, y, z


def transform_from_json(node: Node) -> Transform:
    """A transform of its ``rotation`` (3, 3) and ``translation`` (3,), m."""
    members = closed_members(node, ("rotation", "translation"))
    identity = Transform()
    rotation: Matrix3 = identity.rotation
    if "rotation" in members:
        rows = members["rotation"].elements()
        if len(rows) != 3:
            raise members["rotation"].error(
                f"{counted(len(rows), 'row is', 'rows are')} given", allowed="3 rows of 3 numbers"
            )
        rotation = (vector_from_json(rows[0]), vector_from_json(rows[1]), vector_from_json(rows[2]))
    translation = (
        vector_from_json(members["translation"]) if "translation" in members else identity.translation
    )
    try:
        with np.errstate(all="ignore"):  # numbers whose products overflow are not a rotation
            return Transform(rotation=rotation, translation=translation)
    except ArmblocksError as error:
        raise node.error(error.what, allowed=error.allowed, fix=error.fix) from error


def angle_from_json(node: Node, *, per_second: bool = False) -> float:
    """An angle in rad or an angular speed in rad/s, from a number or from text in degrees."""
    if not isinstance(node.value, str):
        return node.number()
    match = _DEGREES.fullmatch(node.value)
    unit = "deg/s" if per_second else "deg"
    if match is None or (match.group(2) is not None) != per_second or len(node.value) > 40:
        raise node.error(
            f"'{node.value[:40]}' is not an angle", allowed=f'rad as a number, or text such as "90 {unit}"'
        )
    return math.radians(float(match.group(1)))


def transform_to_json(transform: Transform) -> dict[str, object]:
    """The JSON object of a transform."""
    return {"rotation": transform.rotation, "translation": transform.translation}


def angle_to_json(angle: float, unit: str = "deg") -> float | str:
    """An angle as text in degrees if these have few digits and read back exactly, else in rad."""
    degrees = round(math.degrees(angle), 6)
    text = f"{degrees:.6f}".rstrip("0").rstrip(".")
    if angle == 0 or len(text) > 8 or math.radians(float(text)) != angle:
        return angle
    return f"{text} {unit}"

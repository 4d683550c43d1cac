"""Poses of MJCF elements: ``pos``, and one of ``quat``, ``axisangle``, ``euler``, ``xyaxes``, ``zaxis``."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from armblocks.formats.mjcf.settings import Settings
from armblocks.formats.xml_elements import Element
from armblocks.spatial import Transform, matrix3, rotation_about, rotation_x, rotation_y, rotation_z

_ABOUT = {"x": rotation_x, "y": rotation_y, "z": rotation_z}


def pose_of(element: Element, settings: Settings) -> Transform:
    """The pose of an element in the frame around it; identity without attributes."""
    translation = element.vector("pos", (0.0, 0.0, 0.0))
    return Transform(rotation=matrix3(rotation_of(element, settings)), translation=translation)


def rotation_of(element: Element, settings: Settings) -> NDArray[np.float64]:
    """The rotation of an element, (3, 3)."""
    attributes = element.attributes
    if "axisangle" in attributes:
        *axis, angle = element.numbers("axisangle", (4,))
        return _about(element, np.array(axis), angle * settings.angle_unit)
    if "xyaxes" in attributes:
        numbers = np.array(element.numbers("xyaxes", (6,)))
        x = _direction(element, numbers[:3])
        y = _direction(element, numbers[3:] - (numbers[3:] @ x) * x)
        return np.column_stack((x, y, np.cross(x, y)))
    if "zaxis" in attributes:
        return towards(_direction(element, np.array(element.numbers("zaxis", (3,)))))
    if "euler" in attributes:
        result = np.eye(3)
        for axis, angle in zip(settings.euler_order, element.numbers("euler", (3,))):
            turn = np.array(_ABOUT[axis.lower()](angle * settings.angle_unit))
            result = result @ turn if axis.islower() else turn @ result
        return result
    if "quat" in attributes:
        return of_quaternion(element, element.numbers("quat", (4,)))
    return np.eye(3)


def of_quaternion(element: Element, quaternion: list[float]) -> NDArray[np.float64]:
    """The rotation of a quaternion ``w x y z``, which is normalised."""
    length = math.hypot(*quaternion)
    if not 1e-10 < length < math.inf:
        raise element.error("the quaternion is zero", allowed="a quaternion such as 1 0 0 0")
    w, x, y, z = (value / length for value in quaternion)
    return np.array(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    )


def towards(z: NDArray[np.float64]) -> NDArray[np.float64]:
    """The smallest rotation that turns the z axis to a unit vector; about x if it is opposite."""
    axis = np.cross((0.0, 0.0, 1.0), z)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-10:
        return np.eye(3) if z[2] > 0 else np.diag([1.0, -1.0, -1.0])
    x, y, w = (axis / sine).tolist()
    return np.array(rotation_about((x, y, w), math.atan2(sine, float(z[2]))))


def _about(element: Element, axis: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    x, y, z = _direction(element, axis).tolist()
    return np.array(rotation_about((x, y, z), angle))


def _direction(element: Element, vector: NDArray[np.float64]) -> NDArray[np.float64]:
    length = float(np.linalg.norm(vector))
    if not 1e-10 < length < math.inf:
        raise element.error(
            f"a direction of {element.label} is zero", allowed="a direction such as 0 0 1", fix="set the axis"
        )
    return vector / length

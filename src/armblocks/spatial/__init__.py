"""Rotations and rigid transforms: the geometry that descriptions and algorithms share."""

from armblocks.spatial.rotation import (
    IDENTITY3,
    Matrix3,
    Vector3,
    cos_exact,
    matrix3,
    rotation_about,
    rotation_x,
    rotation_y,
    rotation_z,
    sin_exact,
    vector3,
)
from armblocks.spatial.transform import Transform, transl, trotx, troty, trotz

__all__ = [
    "IDENTITY3",
    "Matrix3",
    "Transform",
    "Vector3",
    "cos_exact",
    "matrix3",
    "rotation_about",
    "rotation_x",
    "rotation_y",
    "rotation_z",
    "sin_exact",
    "transl",
    "trotx",
    "troty",
    "trotz",
    "vector3",
]

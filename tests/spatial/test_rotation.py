"""Rotations: exact at quarter turns, proper at all angles."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from armblocks.errors import InputError
from armblocks.spatial import (
    cos_exact,
    matrix3,
    rotation_about,
    rotation_x,
    rotation_y,
    rotation_z,
    sin_exact,
    vector3,
)

ANGLES = st.floats(-100, 100)


@pytest.mark.parametrize("quarters", range(-9, 10))
def test_quarter_turns_are_exact(quarters: int):
    angle = quarters * math.pi / 2
    assert cos_exact(angle) == round(math.cos(angle))
    assert sin_exact(angle) == round(math.sin(angle))


@given(ANGLES)
def test_other_angles_use_the_library_functions(angle: float):
    # Near a quarter turn the exact value differs by the rounding error of the angle.
    assert cos_exact(angle) == pytest.approx(math.cos(angle), rel=0, abs=1e-13)
    assert sin_exact(angle) == pytest.approx(math.sin(angle), rel=0, abs=1e-13)


def test_tiny_angles_are_not_rounded_to_zero():
    assert sin_exact(1e-17) == 1e-17


@given(ANGLES)
def test_rotations_about_coordinate_axes_equal_rotations_about_general_axes(angle: float):
    axes = {(1.0, 0.0, 0.0): rotation_x, (0.0, 1.0, 0.0): rotation_y, (0.0, 0.0, 1.0): rotation_z}
    for axis, rotation in axes.items():
        assert_allclose(rotation(angle), rotation_about(axis, angle), rtol=0, atol=1e-15)


@given(ANGLES, st.tuples(*[st.floats(-1, 1)] * 3))
def test_rotation_keeps_lengths_and_its_axis(angle: float, direction: tuple[float, float, float]):
    length = math.hypot(*direction)
    if length < 1e-3:
        return
    axis = tuple(x / length for x in direction)
    R = np.array(rotation_about(axis, angle))
    assert_allclose(R.T @ R, np.eye(3), rtol=0, atol=1e-14)
    assert_allclose(R @ axis, axis, rtol=0, atol=1e-15)
    assert np.trace(R) == pytest.approx(1 + 2 * math.cos(angle), abs=1e-13)


def test_arrays_become_tuples_and_invalid_values_are_refused():
    assert vector3(np.array([[1], [2], [3]])) == (1.0, 2.0, 3.0)
    assert matrix3(np.eye(3)) == ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    with pytest.raises(InputError, match=r"there: 2 numbers are given\. Allowed: 3 numbers x y z"):
        vector3([1, 2], where="there")
    with pytest.raises(InputError, match=r"there: the shape is \(2, 2\)\. Allowed: shape \(3, 3\)"):
        matrix3(np.eye(2), where="there")
    with pytest.raises(InputError, match="there: 'abc' is not an array of numbers"):
        vector3("abc", where="there")

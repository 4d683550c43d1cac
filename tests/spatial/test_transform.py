"""Transforms form a group, are immutable values, and name the error of an invalid matrix."""

import numpy as np
import pytest
from casadi import SX
from numpy.testing import assert_allclose

from armblocks.errors import InputError
from armblocks.spatial import Transform, transl, trotx, troty, trotz
from armblocks.spatial.orientation import to_rpy
from robots_for_tests import random_transform

RANDOM = np.random.default_rng(0)
A, B, C = (random_transform(RANDOM) for _ in range(3))


def test_composition_is_the_matrix_product():
    assert_allclose((A @ B).matrix, A.matrix @ B.matrix, rtol=0, atol=1e-15)
    assert_allclose(((A @ B) @ C).matrix, (A @ (B @ C)).matrix, rtol=0, atol=1e-15)
    assert_allclose(A.apply((1.0, 2.0, 3.0)), (A.matrix @ (1, 2, 3, 1))[:3], rtol=0, atol=1e-15)


def test_a_transform_times_its_inverse_is_the_identity():
    assert_allclose((A @ A.inverse()).matrix, np.eye(4), rtol=0, atol=1e-15)
    assert Transform().is_identity
    assert not A.is_identity


def test_transforms_are_equal_and_hashable_by_content():
    copy = Transform.from_matrix(A.matrix)
    assert copy == A
    assert hash(copy) == hash(A)
    assert A != B
    assert_allclose(copy.R, A.rotation)
    assert_allclose(copy.p, A.translation)


def test_quarter_turns_stay_exact_through_products():
    turn = trotx(np.pi / 2) @ trotz(-np.pi / 2) @ troty(np.pi)
    assert set(turn.R.ravel()) <= {0.0, 1.0, -1.0}
    assert turn @ turn.inverse() == Transform()
    assert transl(1, 2, 3).p.tolist() == [1, 2, 3]


def test_a_matrix_that_is_not_a_pose_is_refused():
    with pytest.raises(InputError, match=r"a transform has shape \(3, 3\)\. Allowed: shape \(4, 4\)"):
        Transform.from_matrix(np.eye(3))
    with pytest.raises(InputError, match=r"the last row of a transform is \[0.0, 0.0, 0.0, 2.0\]"):
        Transform.from_matrix(np.diag((1, 1, 1, 2)))
    with pytest.raises(
        InputError, match=r"rotation matrix is not orthonormal: R'R differs from the identity by 0\.21"
    ):
        Transform(rotation=np.diag((1.1, 1, 1)))
    with pytest.raises(InputError, match="the rotation matrix is a reflection"):
        Transform(rotation=np.diag((1, 1, -1)))


def test_roll_pitch_yaw_reproduce_the_rotation_and_equal_the_symbolic_angles():
    turns = [random_transform(RANDOM) for _ in range(40)]
    turns += [
        trotz(yaw) @ troty(pitch) @ trotx(0.3) for yaw in (-2.0, 0.4) for pitch in (np.pi / 2, -np.pi / 2)
    ]
    turns += [troty(np.pi / 2 - 1e-9) @ trotx(0.7), Transform()]
    for turn in turns:
        roll, pitch, yaw = turn.rpy
        product = trotz(yaw) @ troty(pitch) @ trotx(roll)
        assert_allclose(product.R, turn.R, rtol=0, atol=4e-15)
        assert_allclose(turn.rpy, [float(angle) for angle in to_rpy(SX(turn.R), "zyx")], rtol=0, atol=4e-15)
    assert (trotz(0.5) @ troty(np.pi / 2)).rpy[0] == 0.0

"""Angles, quaternions, exponential, logarithm and interpolation of arrays: laws, SciPy, and edge cases."""

from __future__ import annotations

import sys
from types import ModuleType

import numpy as np
import pytest
from casadi import DM
from scipy.linalg import expm
from scipy.spatial.transform import Rotation, Slerp

from armblocks import spatial
from armblocks.errors import ArmblocksError, InputError
from armblocks.spatial import Transform, orientation
from armblocks.spatial.rotation import RPY_CONVENTIONS

RANDOM = np.random.default_rng(5)
ROTATIONS = Rotation.random(200, rng=RANDOM).as_matrix()
POSES = spatial.rt2tr(ROTATIONS, RANDOM.normal(size=(200, 3)))
SCIPY_ORDERS = {"zyx": "ZYX", "xyz": "XYZ", "yxz": "YXZ", "release 9": "XYZ", "release 7": "ZYX"}


def edge_rotations() -> np.ndarray:
    """Rotations by small angles, half turns, and angles beside them, about several axes."""
    angles = [0.0, 1e-300, 1e-16, 1e-9, 1e-8, 1e-5, 0.0999, 0.1001, 3.0, np.pi - 1e-5, np.pi - 1e-9, np.pi]
    axes = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (-1, 2, 3), (1, -1e-9, 0)]
    vectors = [a * np.array(x) / np.linalg.norm(x) for a in angles for x in axes]
    return np.stack(vectors)


@pytest.mark.parametrize("order", RPY_CONVENTIONS)
def test_roll_pitch_yaw_agree_with_scipy_and_invert(order: str) -> None:
    rpy = spatial.tr2rpy(ROTATIONS, order)
    assert np.allclose(spatial.rpy2r(rpy, order), ROTATIONS, atol=1e-14)
    angles = rpy[:, ::-1] if RPY_CONVENTIONS[order][1] else rpy
    assert np.allclose(Rotation.from_euler(SCIPY_ORDERS[order], angles).as_matrix(), ROTATIONS, atol=1e-14)
    assert (np.abs(rpy[:, 1]) <= np.pi / 2).all()
    for k in range(3):  # the functions of blocks, which share no code
        traced = orientation.to_rpy(DM(ROTATIONS[k]), order)
        assert np.allclose([float(angle) for angle in traced], rpy[k], atol=1e-14)


def test_the_orders_of_the_releases_differ() -> None:
    rpy = [0.1, 0.2, 0.3]
    new, old, oldest = (spatial.rpy2r(rpy, order) for order in ("zyx", "release 9", "release 7"))
    x, y, z = (spatial.rpy2r(np.eye(3)[k] * rpy) for k in range(3))  # single angles are the same in zyx
    assert np.allclose(new, z @ y @ x)
    assert np.allclose(spatial.rpy2r(rpy, "xyz"), _x(0.3) @ _y(0.2) @ _z(0.1))
    assert np.allclose(old, _x(0.1) @ _y(0.2) @ _z(0.3))
    assert np.allclose(oldest, _z(0.1) @ _y(0.2) @ _x(0.3))


def _x(angle: float) -> np.ndarray:
    return Rotation.from_euler("x", angle).as_matrix()


def _y(angle: float) -> np.ndarray:
    return Rotation.from_euler("y", angle).as_matrix()


def _z(angle: float) -> np.ndarray:
    return Rotation.from_euler("z", angle).as_matrix()


@pytest.mark.parametrize("order", RPY_CONVENTIONS)
@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2])
def test_singular_orientations_have_no_roll_and_are_reproduced(order: str, pitch: float) -> None:
    R = spatial.rpy2r([0.3, pitch, 0.5], order)
    rpy = spatial.tr2rpy(R, order)
    assert rpy[0] == 0.0 and np.allclose(spatial.rpy2r(rpy, order), R, atol=1e-15)


def test_euler_angles_agree_with_scipy_and_invert() -> None:
    angles = spatial.tr2eul(ROTATIONS)
    assert np.allclose(spatial.eul2r(angles), ROTATIONS, atol=1e-14)
    assert np.allclose(Rotation.from_euler("ZYZ", angles).as_matrix(), ROTATIONS, atol=1e-14)
    assert (angles[:, 1] >= 0).all()
    assert spatial.tr2eul(_z(0.4)) == pytest.approx([0, 0, 0.4])
    assert np.allclose(spatial.tr2eul(spatial.eul2tr([10, 20, 30], unit="deg"), unit="deg"), [10, 20, 30])


def test_quaternions_agree_with_scipy_and_invert() -> None:
    q = spatial.r2q(ROTATIONS)
    expected = Rotation.from_matrix(ROTATIONS).as_quat(canonical=True, scalar_first=True)
    assert np.allclose(q, expected, atol=1e-14) and (q[:, 0] >= 0).all()
    assert np.allclose(spatial.q2r(3.0 * q), ROTATIONS, atol=1e-14)
    product = spatial.q2r(spatial.qmul(q[:-1], q[1:]))
    assert np.allclose(product, ROTATIONS[:-1] @ ROTATIONS[1:], atol=1e-14)


def test_angle_and_axis_agree_with_scipy_and_invert() -> None:
    angle, axis = spatial.tr2angvec(ROTATIONS)
    vectors = Rotation.from_matrix(ROTATIONS).as_rotvec()
    assert np.allclose(angle[:, None] * axis, vectors, atol=1e-13)
    assert np.allclose(spatial.angvec2r(angle, 2.0 * axis), ROTATIONS, atol=1e-14)
    angle, axis = spatial.tr2angvec(np.eye(3), unit="deg")
    assert angle == 0.0 and axis.tolist() == [0.0, 0.0, 0.0]
    assert np.allclose(spatial.angvec2r(90, (0, 0, 1), unit="deg"), _z(np.pi / 2))
    assert spatial.angvec2r([0.1, 0.2], (0, 0, 1)).shape == (2, 3, 3)
    assert spatial.angvec2r(0.1, np.eye(3)).shape == (3, 3, 3)


def test_exponential_and_logarithm_invert_each_other_near_zero_and_half_a_turn() -> None:
    w = edge_rotations()
    R = spatial.trexp(w)
    assert np.allclose(R, np.stack([expm(spatial.skew(row)) for row in w]), atol=1e-14)
    back = spatial.trlog(R)
    half = np.isclose(np.linalg.norm(w, axis=1), np.pi, atol=1e-12)
    assert np.allclose(back[~half], w[~half], rtol=1e-9, atol=1e-15)
    assert np.allclose(spatial.trexp(back), R, atol=1e-14)  # half a turn has two logarithms
    small = np.array([1e-12, -2e-12, 3e-12])
    assert np.allclose(spatial.trlog(spatial.trexp(small)), small, rtol=1e-12, atol=0)


def test_twists_agree_with_the_matrix_exponential() -> None:
    w = edge_rotations()
    twists = np.concatenate([RANDOM.normal(size=w.shape), w], axis=1)
    T = spatial.trexp(twists)
    matrices = np.zeros((len(w), 4, 4))
    matrices[:, :3, :3], matrices[:, :3, 3] = spatial.skew(w), twists[:, :3]
    assert np.allclose(T, np.stack([expm(M) for M in matrices]), atol=1e-13)
    assert np.allclose(spatial.trexp(spatial.trlog(T)), T, atol=1e-9)
    assert np.allclose(spatial.trexp(spatial.trlog(POSES)), POSES, atol=1e-12)
    assert np.allclose(spatial.trexp(twists[0], 0.5) @ spatial.trexp(twists[0], 0.5), T[0])
    A = spatial.tr2adjoint(POSES[0])
    moved = POSES[0] @ spatial.trexp(twists[-1]) @ np.linalg.inv(POSES[0])
    assert np.allclose(spatial.trexp(A @ twists[-1]), moved, atol=1e-12)


def test_interpolation_is_slerp_with_linear_positions() -> None:
    s = np.linspace(0, 1, 7)
    T = spatial.trinterp(POSES[0], POSES[1], s)
    slerp = Slerp([0, 1], Rotation.from_matrix(ROTATIONS[:2]))(s).as_matrix()
    assert np.allclose(T[:, :3, :3], slerp, atol=1e-14)
    assert np.allclose(T[:, :3, 3], (1 - s[:, None]) * POSES[0, :3, 3] + s[:, None] * POSES[1, :3, 3])
    assert np.allclose(T[[0, -1]], POSES[:2], atol=1e-14)
    assert spatial.trinterp(ROTATIONS[0], ROTATIONS[1], 0.5).shape == (3, 3)
    q = spatial.qinterp(spatial.r2q(ROTATIONS[0]), -spatial.r2q(ROTATIONS[1]), s)
    assert np.allclose(spatial.q2r(q), slerp, atol=1e-14)
    assert np.allclose(spatial.trinterp(POSES[0], POSES[0], 0.3), POSES[0], atol=1e-15)


def test_small_motions_and_skew_matrices() -> None:
    d = 1e-6 * RANDOM.normal(size=(5, 6))
    T = POSES[:5] @ spatial.trexp(d)
    assert np.allclose(spatial.tr2delta(POSES[:5], T), d, atol=1e-11)
    assert np.allclose(spatial.delta2tr(d), spatial.trexp(d), atol=1e-11)
    a, b = RANDOM.normal(size=(2, 4, 3))
    assert np.allclose((spatial.skew(a) @ b[..., None])[..., 0], np.cross(a, b))
    assert np.array_equal(spatial.vex(spatial.skew(a)), a)


def test_batches_equal_single_values() -> None:
    single = [spatial.tr2rpy(T) for T in POSES[:4]]
    assert np.array_equal(spatial.tr2rpy(POSES[:4]), single)
    assert np.array_equal(spatial.trlog(POSES[:4]), [spatial.trlog(T) for T in POSES[:4]])
    assert spatial.tr2rpy(POSES[:0]).shape == (0, 3) and spatial.trexp(np.zeros((0, 6))).shape == (0, 4, 4)


def test_transforms_are_accepted_and_nan_stays_nan() -> None:
    T = Transform(rotation=ROTATIONS[0], translation=(1, 2, 3))
    assert np.allclose(spatial.tr2rpy(T), T.rpy)
    assert np.isnan(spatial.tr2rpy(np.full((3, 3), np.nan))).all()
    assert np.isnan(spatial.trexp([np.nan, 0, 0])).all()


def test_objects_of_spatialmath_are_accepted_and_returned(monkeypatch: pytest.MonkeyPatch) -> None:
    class SE3:
        """The part of spatialmath's class that is used: ``A`` is one array, or a list."""

        def __init__(self, value: object, check: bool = True) -> None:
            self.A = value

    SE3.__module__ = "spatialmath.pose3d"
    module = ModuleType("spatialmath")
    module.SE3 = SE3  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "spatialmath", module)
    first, last = SE3(POSES[0]), SE3(POSES[1])
    assert np.array_equal(spatial.tr2rpy(first), spatial.tr2rpy(POSES[0]))
    assert np.array_equal(spatial.tr2rpy(SE3(list(POSES[:3]))), spatial.tr2rpy(POSES[:3]))
    one, several = spatial.trinterp(first, last, 0.5), spatial.trinterp(first, last, [0.0, 0.5])
    assert isinstance(one, SE3) and np.array_equal(one.A, spatial.trinterp(POSES[0], POSES[1], 0.5))
    assert isinstance(several, SE3) and len(several.A) == 2  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: spatial.rpy2r([0, 0, 0], "zxy"), "there is no order of roll, pitch and yaw named 'zxy'"),
        (lambda: spatial.rpy2r([0, 0, 0], unit="grad"), "there is no unit of angles named 'grad'"),
        (lambda: spatial.tr2eul(np.eye(3), unit="grad"), "there is no unit of angles named 'grad'"),
        (lambda: spatial.rpy2r([0, 0]), r"the shape is \(2,\)"),
        (lambda: spatial.tr2rpy(np.eye(2)), r"the shape is \(2, 2\).*\(3, 3\) or \(4, 4\)"),
        (lambda: spatial.tr2rpy(2 * np.eye(3)), "a matrix is not a rotation: R'R differs"),
        (lambda: spatial.tr2rpy(-np.eye(3)), "not a rotation but a reflection"),
        (lambda: spatial.q2r([0, 0, 0, 0]), "a quaternion is 0 0 0 0"),
        (lambda: spatial.angvec2r(1.0, (0, 0, 0)), "the axis of a rotation is 0 0 0"),
        (lambda: spatial.trexp([1, 2, 3, 4]), r"rotation vectors or \(6,\) twists"),
        (lambda: spatial.trinterp(np.eye(3), np.eye(4), 0.5), r"the shape is \(4, 4\)"),
        (lambda: spatial.tr2delta(np.eye(3), np.eye(4)), r"the shape is \(3, 3\)"),
        (lambda: spatial.tr2adjoint(np.eye(3)), r"\(4, 4\) or \(N, 4, 4\)"),
        (lambda: spatial.vex(np.eye(2)), r"\(3, 3\) or \(N, 3, 3\)"),
        (lambda: spatial.tr2rpy("pose"), "str is not an array of numbers"),
    ],
)
def test_refusals(call: object, message: str) -> None:
    with pytest.raises(ArmblocksError, match=message):
        call()  # type: ignore[operator]
    assert issubclass(InputError, ArmblocksError)

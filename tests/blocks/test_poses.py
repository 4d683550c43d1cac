"""Orientation and pose blocks compared with SciPy's rotations and the toolbox's formulas; inverse pairs."""

from __future__ import annotations

import numpy as np
import pytest
from block_evaluation import evaluate
from scipy.spatial.transform import Rotation

from armblocks.blocks import (
    AngleAxis2T,
    Delta2Tr,
    Eul2T,
    PoseInverse,
    PoseProduct,
    Quaternion2T,
    QuaternionInverse,
    QuaternionNormalize,
    QuaternionProduct,
    QuaternionRate,
    Rp2T,
    Rpy2T,
    Skew,
    T2AngleAxis,
    T2eul,
    T2Quaternion,
    T2Rp,
    T2rpy,
    Tr2Delta,
    TransformPoint,
    TransformTwist,
)

RANDOM = np.random.default_rng(23)
ROTATIONS = {
    "zyx": lambda r, p, y: Rotation.from_euler("ZYX", [y, p, r]),
    "xyz": lambda r, p, y: Rotation.from_euler("XYZ", [y, p, r]),
    "yxz": lambda r, p, y: Rotation.from_euler("YXZ", [y, p, r]),
    "release 9": lambda r, p, y: Rotation.from_euler("XYZ", [r, p, y]),
    "release 7": lambda r, p, y: Rotation.from_euler("ZYX", [r, p, y]),
}
"""SciPy's capital letters are intrinsic rotations (about the rotated axes), from left to right."""


def random_pose(size: float = 3.0) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(RANDOM.normal(size=3) * size).as_matrix()
    T[:3, 3] = RANDOM.normal(size=3)
    return T


@pytest.mark.parametrize("convention", ROTATIONS)
def test_roll_pitch_yaw_angles_agree_with_scipy(convention: str) -> None:
    for _ in range(8):
        angles = RANDOM.uniform([-3, -1.5, -3], [3, 1.5, 3])
        T = evaluate(Rpy2T(convention=convention), *angles)["T"]
        assert T[:3, :3] == pytest.approx(ROTATIONS[convention](*angles).as_matrix(), abs=1e-15)
        assert T[3].tolist() == [0, 0, 0, 1]
        assert np.array_equal(T[:3, 3], np.zeros(3))
        recovered = evaluate(T2rpy(convention=convention), T)
        assert [recovered["roll"], recovered["pitch"], recovered["yaw"]] == pytest.approx(angles, abs=1e-13)


@pytest.mark.parametrize("convention", ROTATIONS)
@pytest.mark.parametrize("pitch_offset", [0.0, 1e-15, 1e-12, 1e-7, 1e-4])
def test_angles_at_the_singular_pitch_reproduce_the_pose(convention: str, pitch_offset: float) -> None:
    for sign in (1, -1):
        T = evaluate(Rpy2T(convention=convention), 0.7, sign * (np.pi / 2 - pitch_offset), -1.2)["T"]
        recovered = evaluate(T2rpy(convention=convention), T)
        recomputed = evaluate(
            Rpy2T(convention=convention), recovered["roll"], recovered["pitch"], recovered["yaw"]
        )["T"]
        assert recomputed == pytest.approx(T, abs=5e-15)
        if pitch_offset < 1e-15:
            assert recovered["roll"] == 0.0


def test_euler_angles_agree_with_scipy() -> None:
    for theta in (0.0, 1e-9, 0.3, 2.0, np.pi - 1e-9, np.pi):
        phi, psi = RANDOM.uniform(-3, 3, 2)
        T = evaluate(Eul2T(), phi, theta, psi)["T"]
        assert T[:3, :3] == pytest.approx(
            Rotation.from_euler("ZYZ", [phi, theta, psi]).as_matrix(), abs=1e-15
        )
        recovered = evaluate(T2eul(), T)
        recomputed = evaluate(Eul2T(), recovered["phi"], recovered["theta"], recovered["psi"])["T"]
        assert recomputed == pytest.approx(T, abs=5e-15)
        if 0.1 < theta < 3:
            assert [recovered["phi"], recovered["theta"], recovered["psi"]] == pytest.approx(
                [phi, theta, psi], abs=1e-14
            )
    assert evaluate(T2eul(), np.eye(4))["phi"] == 0.0


def test_quaternions_agree_with_scipy() -> None:
    half_turns = [Rotation.from_rotvec(np.pi * np.array(axis)) for axis in np.eye(3)]
    for turn in [*half_turns, Rotation.identity(), *Rotation.random(12, rng=RANDOM)]:
        T = np.eye(4)
        T[:3, :3] = turn.as_matrix()
        actual = evaluate(T2Quaternion(), T)["y"]
        expected = turn.as_quat(canonical=True, scalar_first=True)
        assert actual == pytest.approx(expected if actual @ expected > 0 else -expected, abs=1e-15)
        assert actual[0] >= 0
        assert evaluate(Quaternion2T(), 3.0 * actual)["T"] == pytest.approx(T, abs=1e-15)


def test_products_of_quaternions_are_products_of_rotations() -> None:
    a, b = RANDOM.normal(size=(2, 4))
    product = evaluate(QuaternionProduct(), a, b)["y"]
    Ta, Tb, Tab = (evaluate(Quaternion2T(), q)["T"] for q in (a, b, product))
    assert Tab == pytest.approx(Ta @ Tb, abs=1e-14)
    one = evaluate(QuaternionProduct(), a, evaluate(QuaternionInverse(), a)["y"])["y"]
    assert one == pytest.approx([1, 0, 0, 0], abs=1e-15)
    unit = evaluate(QuaternionNormalize(), a)["y"]
    assert unit == pytest.approx(a / np.linalg.norm(a), rel=1e-15)


@pytest.mark.parametrize("axes", ["body", "world"])
def test_the_quaternion_rate_is_the_time_derivative(axes: str) -> None:
    turn, w, h = Rotation.random(rng=RANDOM), RANDOM.normal(size=3), 1e-5
    step = {s: Rotation.from_rotvec(s * h * w) for s in (1, -1)}
    moved = {s: turn * step[s] if axes == "body" else step[s] * turn for s in step}
    q = turn.as_quat(scalar_first=True)
    near = {s: moved[s].as_quat(scalar_first=True) for s in moved}
    near = {s: value if value @ q > 0 else -value for s, value in near.items()}
    expected = (near[1] - near[-1]) / (2 * h)
    # error of the central difference: h^2 and rounding / h
    assert evaluate(QuaternionRate(axes=axes), q, w)["y"] == pytest.approx(expected, abs=1e-9)


def test_angle_and_axis_agree_with_scipy() -> None:
    for angle in (1e-9, 0.3, 2.0, np.pi - 1e-9):
        axis = RANDOM.normal(size=3)
        T = evaluate(AngleAxis2T(), angle, axis)["T"]
        unit = axis / np.linalg.norm(axis)
        assert T[:3, :3] == pytest.approx(Rotation.from_rotvec(angle * unit).as_matrix(), abs=1e-15)
        recovered = evaluate(T2AngleAxis(), T)
        assert recovered["angle"] == pytest.approx(angle, abs=1e-15)
        assert recovered["axis"] == pytest.approx(unit, abs=1e-7 if angle < 1e-6 else 1e-14)
    result = evaluate(T2AngleAxis(), np.eye(4))
    assert (float(result["angle"]), result["axis"].tolist()) == (0.0, [0, 0, 0])


def test_products_and_inverses_of_poses_are_those_of_matrices() -> None:
    A, B, C = (random_pose() for _ in range(3))
    assert evaluate(PoseProduct(inputs=3), A, B, C)["T"] == pytest.approx(A @ B @ C, abs=1e-14)
    assert evaluate(PoseInverse(), A)["Ti"] == pytest.approx(np.linalg.inv(A), abs=1e-14)
    parts = evaluate(T2Rp(), A)
    assert np.array_equal(evaluate(Rp2T(), parts["R"], parts["p"])["T"], A)
    point = RANDOM.normal(size=3)
    assert evaluate(TransformPoint(), A, point)["y"] == pytest.approx((A @ [*point, 1])[:3], rel=1e-13)
    a, b = RANDOM.normal(size=(2, 3))
    assert evaluate(Skew(), a)["S"] @ b == pytest.approx(np.cross(a, b), rel=1e-13)


def test_twists_are_transformed_by_the_adjoint() -> None:
    T, V = random_pose(), RANDOM.normal(size=6)

    def twist_matrix(V: np.ndarray) -> np.ndarray:
        skew = evaluate(Skew(), V[3:])["S"]
        return np.vstack([np.column_stack([skew, V[:3]]), np.zeros(4)])

    result = evaluate(TransformTwist(), T, V)["y"]
    assert twist_matrix(result) == pytest.approx(T @ twist_matrix(V) @ np.linalg.inv(T), abs=1e-13)


def test_differential_motion_agrees_with_both_toolbox_releases() -> None:
    T1 = random_pose()
    d = RANDOM.normal(size=6) * 1e-6
    step = evaluate(Delta2Tr(), d)["T"]
    # release 10: along the axes of the first pose
    assert evaluate(Tr2Delta(), T1, T1 @ step)["dx"] == pytest.approx(d, abs=1e-15)
    # up to release 9: along the world axes; vex(R2 R1' - I) from the cross products of the axes
    T2 = T1.copy()
    T2[:3, :3] = step[:3, :3] @ T1[:3, :3]
    T2[:3, 3] += d[:3]
    assert evaluate(Tr2Delta(frame="world"), T1, T2)["dx"] == pytest.approx(d, abs=1e-15)
    M = T2[:3, :3] @ T1[:3, :3].T - np.eye(3)
    vex = np.array([M[2, 1] - M[1, 2], M[0, 2] - M[2, 0], M[1, 0] - M[0, 1]]) / 2
    assert evaluate(Tr2Delta(frame="world"), T1, T2)["dx"][3:] == pytest.approx(vex, abs=1e-15)

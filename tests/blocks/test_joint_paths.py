"""Paths: end points, limits, and speeds that are the derivatives of the positions."""

from __future__ import annotations

import numpy as np
import pytest
from block_evaluation import evaluate
from scipy.spatial.transform import Rotation, Slerp

import armblocks as ab
from armblocks.blocks import CirclePath, Constant, CTraj, JTraj, MultiSegment, Trapezoidal
from armblocks.diagram import Block
from armblocks.errors import InputError

RANDOM = np.random.default_rng(24)


def rate(block: Block, port: str, t: float) -> np.ndarray:
    """Central difference; exact for the parabolas of these paths."""
    h = 1e-4
    return (evaluate(block, t=t + h)[port] - evaluate(block, t=t - h)[port]) / (2 * h)


@pytest.mark.parametrize("cruise", [1.01, 1.5, 2.0])
def test_a_trapezoidal_profile_has_exact_ends_and_consistent_derivatives(cruise: float) -> None:
    q0, qf, tmax = np.array([0.0, 1.0]), np.array([2.0, -3.0]), 4.0
    block = Trapezoidal(q0=q0, qf=qf, tmax=tmax, cruise=cruise)
    ramp = tmax * (1 - 1 / cruise)
    for t in (-1.0, 0.0):
        assert evaluate(block, t=t)["q"].tolist() == q0.tolist()
    for t in (4.0, 5.0):
        assert evaluate(block, t=t)["q"] == pytest.approx(qf, rel=1e-15)
        assert evaluate(block, t=t)["qd"].tolist() == [0, 0]
        assert evaluate(block, t=t)["qdd"].tolist() == [0, 0]
    for t in (0.3 * ramp, 2.0, tmax - 0.6 * ramp):
        result = evaluate(block, t=t)
        if abs(t - ramp) > 1e-3 and abs(t - tmax + ramp) > 1e-3:
            assert result["qd"] == pytest.approx(rate(block, "q", t), rel=1e-8)
            assert result["qdd"] == pytest.approx(rate(block, "qd", t), rel=1e-7, abs=1e-9)
    assert evaluate(block, t=2.0)["qd"] == pytest.approx(cruise * (qf - q0) / tmax, rel=1e-14)


def test_the_default_trapezoidal_profile_has_three_equal_phases() -> None:
    # lspb(0, 1, 0:3): V = 1.5 / 3, a = V, so 1/4 after one second, 3/4 after two
    block = Trapezoidal(tmax=3.0)
    assert [float(evaluate(block, t=t)["q"]) for t in (1.0, 2.0)] == pytest.approx([0.25, 0.75], rel=1e-14)


def test_a_path_of_many_segments_blends_at_its_points() -> None:
    points = RANDOM.normal(size=(4, 2))
    block = MultiSegment(points=points, durations=[1.0, 2.0, 1.5], blend=0.4)
    assert evaluate(block, t=0.0)["q"].tolist() == points[0].tolist()
    for t in (4.9, 7.0):
        assert evaluate(block, t=t)["q"] == pytest.approx(points[-1], abs=1e-14)
        assert evaluate(block, t=t)["qd"] == pytest.approx([0, 0], abs=1e-15)
    assert evaluate(block, t=9.0)["qd"].tolist() == [0, 0]
    middle = evaluate(block, t=0.2 + 1.0 + 1.0)
    assert middle["qd"] == pytest.approx((points[2] - points[1]) / 2.0, rel=1e-13)
    assert middle["q"] == pytest.approx((points[1] + points[2]) / 2, rel=1e-13)
    corner = evaluate(block, t=1.2)
    change = (points[2] - points[1]) / 2.0 - (points[1] - points[0])
    assert corner["q"] == pytest.approx(points[1] + change * 0.4 / 8, rel=1e-13)  # blend / 8 of the change
    assert corner["qdd"] == pytest.approx(change / 0.4, rel=1e-13)
    for t in (0.1, 0.7, 1.15, 2.0, 3.3, 4.8):
        assert evaluate(block, t=t)["qd"] == pytest.approx(rate(block, "q", t), rel=1e-7, abs=1e-10)
        assert evaluate(block, t=t)["qdd"] == pytest.approx(rate(block, "qd", t), rel=1e-7, abs=1e-10)


@pytest.mark.parametrize("profile", ["lspb", "quintic"])
def test_a_straight_line_path_interpolates_position_and_rotation(profile: str) -> None:
    turns = Rotation.random(2, rng=RANDOM)
    T0, T1 = np.eye(4), np.eye(4)
    T0[:3, :3], T1[:3, :3] = turns.as_matrix()
    T0[:3, 3], T1[:3, 3] = RANDOM.normal(size=(2, 3))
    block = CTraj(tmax=6.0, profile=profile)
    for t in (0.0, 1.0, 2.5, 5.0, 6.0, 8.0):
        actual = evaluate(block, T0, T1, t=t)
        s = actual["s"]
        alone = Trapezoidal(tmax=6.0) if profile == "lspb" else JTraj(q0=[0.0], qf=[1.0], tmax=6.0)
        assert s == pytest.approx(np.ravel(evaluate(alone, t=t)["q"])[0], rel=1e-14)
        expected = Slerp([0, 1], turns)(float(np.clip(s, 0, 1))).as_matrix()
        assert actual["T"][:3, :3] == pytest.approx(expected, abs=1e-14)
        assert actual["T"][:3, 3] == pytest.approx(T0[:3, 3] + s * (T1[:3, 3] - T0[:3, 3]), rel=1e-14)
    assert evaluate(block, T0, T0, t=2.0)["T"] == pytest.approx(T0, abs=1e-14)


def test_a_circular_path_agrees_with_its_closed_form() -> None:
    block = CirclePath(radius=2.0, centre=[1.0, 2.0, 3.0], frequency=0.25, phase=0.1)
    a = 2 * np.pi * 0.25 * 0.7 + 0.1
    expected = [1 + 2 * np.cos(a), 2 + 2 * np.sin(a), 3]
    assert evaluate(block, t=0.7)["y"] == pytest.approx(expected, rel=1e-15)


def test_invalid_path_parameters_are_refused() -> None:
    with pytest.raises(InputError, match=r"there are 3 points and 1 duration"):
        MultiSegment(durations=[1.0])
    with pytest.raises(InputError, match=r"blends of 2 s do not fit into a segment of 1 s"):
        MultiSegment(blend=2.0)
    with pytest.raises(InputError, match=r"CirclePath.centre: the centre has 2 numbers"):
        CirclePath(centre=[0, 0])
    with pytest.raises(InputError, match=r"'q0' has shape \(2,\) and 'qf' has shape \(3,\)"):
        Trapezoidal(q0=[0, 0], qf=[1, 2, 3])


def test_derivatives_of_a_path_with_constant_orientation_agree_with_closed_forms() -> None:
    """With constant orientation T = T0 + s (T1 - T0); a small rotation of the end is scaled by s."""
    start, end = np.eye(4), np.eye(4)
    end[:3, 3] = (0.5, 0.2, 0.1)
    builder = ab.DiagramBuilder("straight")
    poses = [builder.add(name, Constant(value=value)) for name, value in (("T0", start), ("T1", end))]
    builder.add("path", CTraj(tmax=2.0), *poses)
    for time, s in ((0.0, 0.0), (1.0, 0.5), (2.0, 1.0)):
        system = ab.linearize(builder.build(), "T1", "path/T", at=time)
        gain = system.D.reshape(4, 4, 4, 4)
        for row in range(3):
            np.testing.assert_allclose(gain[row, 3, row, 3], s, atol=1e-12)
        # a rotation dR = skew(a) of the end rotates the path by s a
        turn = np.zeros((4, 4))
        turn[0, 1], turn[1, 0] = -1.0, 1.0
        np.testing.assert_allclose(np.einsum("ijkl,kl->ij", gain, turn), s * turn, atol=1e-12)

"""Inverse kinematics by iteration: laws over random poses, reasons of failures, checks of arguments."""

from __future__ import annotations

import pickle
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

import armblocks as ab
from armblocks.errors import InputError, RobotError, UnknownNameError
from armblocks.face.ikine_coordinates import dependent_excess, random_coordinates
from robots_for_tests import MOVING_TYPES, build_mixed_tree

TOLERANCE = 1e-9


@cache
def arm_of(name: str) -> ab.Arm:
    return ab.load_robot(name)


def configurations(arm: ab.Arm, count: int, seed: int = 3) -> np.ndarray:
    return random_coordinates(arm.robot, count, np.random.default_rng(seed), limited=True)


def errors(T: np.ndarray, S: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances (m) and angles (rad) between poses, by SciPy."""
    R = Rotation.from_matrix(T[..., :3, :3]) * Rotation.from_matrix(S[..., :3, :3]).inv()
    return np.linalg.norm(T[..., :3, 3] - S[..., :3, 3], axis=-1), R.magnitude()


@pytest.mark.parametrize(
    "name", ["panda", "ur5", "puma560", "stanford", "kr180_cell", "cobra600", "planar3r"]
)
def test_solutions_have_the_pose_and_are_within_the_limits(name: str) -> None:
    arm = arm_of(name)
    T = arm.fkine(configurations(arm, 100))
    result = arm.ikine(T)
    assert result.success.all(), str(result)
    distance, angle = errors(arm.fkine(result.q), T)
    assert distance.max() <= 2 * TOLERANCE and angle.max() <= 2 * TOLERANCE
    low, high = arm.robot.qlim.T
    assert ((result.q >= low) & (result.q <= high)).all()
    assert (result.position_error <= TOLERANCE).all() and (result.rotation_error <= TOLERANCE).all()


def test_results_do_not_depend_on_the_other_poses_nor_on_threads() -> None:
    arm = arm_of("panda")
    T = arm.fkine(configurations(arm, 150))
    T[7, :3, 3] += 3.0  # out of reach
    together = arm.ikine(T)
    for other, order in ((arm.ikine(T, threads=2), 1), (arm.ikine(T[::-1]), -1)):
        assert np.array_equal(other.q[::order], together.q)
        assert np.array_equal(other.iterations[::order], together.iterations)
    for k in (0, 7, 20, 149):
        alone = arm.ikine(T[k])
        assert np.array_equal(alone.q, together.q[k]) and alone.iterations == together.iterations[k]
        assert alone.reason == together.reason[k] and alone.success == together.success[k]


@pytest.mark.parametrize("kind", MOVING_TYPES, ids=lambda kind: kind.__name__)
def test_every_joint_type_and_trees_with_frames(kind: type[ab.Revolute]) -> None:
    robot = build_mixed_tree(5, (kind, *MOVING_TYPES[:3], ab.Revolute, ab.Revolute, ab.Revolute))
    arm = ab.Arm(robot)
    q = configurations(arm, 8)
    for frame in (None, robot.links[-2].name):
        T = arm.fkine(q, frame=frame)
        result = arm.ikine(T, frame=frame)
        distance, angle = errors(arm.fkine(result.q, frame=frame), T)
        assert result.success.all(), str(result)
        assert distance.max() <= 2 * TOLERANCE and angle.max() <= 2 * TOLERANCE
        assert np.allclose(arm.normalised(result.q), result.q, atol=1e-12)


def test_couplings_are_respected() -> None:
    arm = arm_of("kr40_pa")
    q = configurations(arm, 60)
    q = q[(dependent_excess(arm.robot, q) <= 0.0).all(axis=1)]
    assert len(q) > 5
    T = arm.fkine(q)
    result = arm.ikine(T)
    assert result.success.all(), str(result)
    assert np.allclose(arm.fkine(result.q), T, atol=1e-8)
    assert (dependent_excess(arm.robot, result.q) <= 0.0).all()


def test_start_selects_the_branch_and_the_whole_turns() -> None:
    arm = arm_of("ur5")
    q = configurations(arm, 40)
    q[:, 5] = np.linspace(-6.0, 6.0, 40)
    near = q + 0.02 * np.random.default_rng(1).standard_normal(q.shape)
    result = arm.ikine(arm.fkine(q), near)
    regular = arm.manipulability(q) > 0.01
    assert np.abs(result.q - q)[regular].max() < 1e-6


def test_masks_free_directions_of_the_tool_or_of_the_world() -> None:
    arm = arm_of("puma560")
    T = arm.fkine(configurations(arm, 30))
    for axes in ("tool", "world"):
        free = arm.ikine(T, mask=[1, 1, 1, 1, 1, 0], axes=axes)
        assert free.success.all()
        S = arm.fkine(free.q)
        assert np.abs(S[:, :3, 3] - T[:, :3, 3]).max() < 2 * TOLERANCE
        z = S[:, :3, 2] - T[:, :3, 2] if axes == "tool" else S[:, 2, :3] - T[:, 2, :3]
        assert np.abs(z).max() < 2 * TOLERANCE
    position = arm.ikine(T, mask=[1, 1, 1, 0, 0, 0])
    assert position.success.all() and np.abs(arm.fkine(position.q)[:, :3, 3] - T[:, :3, 3]).max() < 2e-9
    plane = arm_of("planar3r").ikine(ab.Transform(translation=(0.4, 0.3, 5.0)), mask=[1, 1, 0, 0, 0, 1])
    assert plane.success


def test_poses_beyond_the_arm_are_out_of_reach() -> None:
    arm = arm_of("panda")
    T = arm.fkine(configurations(arm, 60))
    direction = T[:, :3, 3] / np.linalg.norm(T[:, :3, 3], axis=1, keepdims=True)
    T[:, :3, 3] = direction * np.linspace(1.4, 4.0, 60)[:, np.newaxis]
    result = arm.ikine(T)
    assert not result.success.any() and np.mean(result.reason == "out of reach") >= 0.98
    assert np.allclose(np.linalg.norm(result.lost_direction[result.reason == "out of reach"], axis=1), 1.0)
    assert "out of reach: the nearest pose is" in str(result)


def test_the_nearest_position_of_a_planar_arm_is_that_of_scipy() -> None:
    arm = arm_of("planar3r")
    mask, p = [1, 1, 0, 0, 0, 0], np.array([5.0, 2.0, 0.0])
    result = arm.ikine(ab.Transform(translation=tuple(p)), mask=mask)
    best = min(
        least_squares(lambda q: (arm.fkine(q)[:3, 3] - p)[:2], start, xtol=1e-15, gtol=1e-14).cost
        for start in configurations(arm, 5)
    )
    assert result.reason == "out of reach"
    assert abs(result.position_error - np.sqrt(2 * best)) < 1e-6


def test_limits_are_the_reason_where_only_they_prevent_a_solution() -> None:
    robot = arm_of("planar3r").robot
    joint = replace(robot.links[1].joint, limits=ab.JointLimits(position=(-0.2, 0.2)))
    limited = ab.Arm(robot.with_link(robot.links[1].name, joint=joint))
    first, last = limited.robot.links[0], limited.robot.links[2]
    for link in (first, last):
        narrow = replace(link.joint, limits=ab.JointLimits(position=(-0.3, 0.3)))
        limited = ab.Arm(limited.robot.with_link(link.name, joint=narrow))
    T = limited.fkine([0.1, 1.5, 0.2])
    result = limited.ikine(T)
    assert result.reason == "limits" and not result.success
    assert result.excess.max() > 1.0 and "solutions exist only beyond joint limits" in result.explain()
    free = limited.ikine(T, limits=False)
    assert free.success and np.allclose(limited.fkine(free.q), T, atol=1e-8)


def test_singular_poses_are_solved() -> None:
    arm = arm_of("puma560")
    q = configurations(arm, 100)
    q[:, 4] = 0.0
    q[50:, 2] = -np.pi / 2 + np.arctan2(0.0203, 0.4318)  # the elbow is straight
    q[50:, 4] = 0.5
    assert arm.manipulability(q).max() < 1e-4
    result = arm.ikine(arm.fkine(q))
    assert result.success.mean() >= 0.99, str(result)


def test_targets_may_have_any_form() -> None:
    arm = arm_of("ur5")
    T = arm.fkine(configurations(arm, 3))
    first = arm.ikine(T[0]).q
    for same in (ab.Transform.from_matrix(T[0]), T[0].tolist(), np.asfortranarray(T[0])):
        assert np.allclose(arm.ikine(same).q, first, atol=1e-8)
    several = arm.ikine([ab.Transform.from_matrix(t) for t in T])
    assert several.q.shape == (3, 6) and len(several) == 3 and several[1].success
    assert arm.ikine(np.empty((0, 4, 4))).q.shape == (0, 6)
    assert arm.ikine(T[0], T[0, 0, 0] * np.ones(6), limits=False).success


def test_single_calls_keep_their_memory_and_share_none() -> None:
    arm = arm_of("ur5")
    T = arm.fkine(configurations(arm, 200))
    first = arm.ikine(T[0])
    kept = first.q.copy()
    junk = [np.full(k, np.nan) for k in range(1, 200)]  # occupies memory that was freed
    results = [arm.ikine(t) for t in T]
    assert len(junk) == 199 and all(result.success for result in results)
    results[0].q[:] = 0.0
    assert np.array_equal(first.q, kept) and np.array_equal(arm.ikine(T[0]).q, kept)
    frozen = T[0].copy()
    frozen.flags.writeable = False
    unaligned = np.zeros(129, dtype=np.uint8)[1:].view(np.float64).reshape(4, 4)
    unaligned[...] = T[0]
    for same in (frozen, unaligned, T[0].astype(">f8"), arm_of("ur5").fkine(kept)):
        assert np.allclose(arm.ikine(same).q, kept, atol=1e-8)
    assert arm.ikine(np.stack([unaligned, unaligned])).success.all()


def test_a_restart_finds_what_the_first_start_does_not() -> None:
    arm = arm_of("panda")
    T = arm.fkine(configurations(arm, 100))
    without = arm.ikine(T, restarts=0)
    assert 0.3 < without.success.mean() < 1.0
    assert (without.restarts[without.success] == 0).all()
    other = arm.ikine(T, seed=5)
    assert other.success.all() and not np.allclose(other.q, arm.ikine(T).q)


def test_results_are_pickled_and_described() -> None:
    arm = arm_of("planar3r")
    far = arm.ikine(ab.Transform(translation=(9.0, 0.0, 0.0)))
    copy = pickle.loads(pickle.dumps(far))
    assert np.array_equal(copy.q, far.q) and copy.explain() == far.explain() == str(far)
    batch = arm.ikine(np.stack([np.eye(4)] * 2))
    with pytest.raises(TypeError, match="explain\\(\\) is for the result of one pose"):
        batch.explain()
    with pytest.raises(TypeError, match="this is the result of one pose, without len"):
        len(far)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda T: T * np.nan, "the target is not finite"),
        (lambda T: np.where(np.eye(4) > 2, T, T) + np.diag([0, 0, 0, 1]), "the last row of the target is"),
        (lambda T: T @ np.diag([1, 1, -1, 1]), "is not a rotation but a reflection"),
        (lambda T: T + 1e-5 * np.eye(4, k=1) * [[1], [1], [0], [0]], "is not orthonormal: R'R differs from"),
        (lambda T: T + 1e160 * np.eye(4, k=3), "the target is 1e\\+160 m away.*up to 1e\\+100 m"),
        (lambda T: T[:3], r"the target poses have the shape \(3, 4\)"),
        (lambda T: "here", "a target pose is not an array of real numbers but str"),
        (lambda T: [[1, 2], [3]], "a target pose is not an array of real numbers but list"),
    ],
)
def test_targets_that_are_no_poses_are_refused(change: object, message: str) -> None:
    arm = arm_of("ur5")
    T = arm.fkine(np.full(6, 0.3))
    with pytest.raises(InputError, match=message):
        arm.ikine(change(T))


def test_the_invalid_target_of_a_batch_is_named() -> None:
    arm = arm_of("ur5")
    T = arm.fkine(np.full((4, 6), 0.3))
    T[2, 0, 0] = np.inf
    with pytest.raises(InputError, match="target 2 is not finite"):
        arm.ikine(T)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"q0": [0.0] * 5}, r"q0 has the shape \(5,\)"),
        ({"q0": [np.nan] * 6}, "q0 is not finite"),
        ({"q0": "zero"}, "q0 is not finite"),
        ({"mask": [1, 1, 1]}, "six numbers 0 or 1"),
        ({"mask": [0.5] * 6}, "six numbers 0 or 1"),
        ({"mask": [0] * 6}, "six numbers 0 or 1"),
        ({"limits": 1}, "write limits=False to allow solutions beyond the joint limits"),
        ({"tolerance": 0.0}, "a number from 1e-14 to 1"),
        ({"restarts": -1}, "an integer, zero or more"),
        ({"seed": 0.5}, "an integer, zero or more"),
        ({"threads": 0}, "threads=0"),
    ],
)
def test_wrong_options_are_refused(arguments: dict[str, object], message: str) -> None:
    arm = arm_of("ur5")
    with pytest.raises(InputError, match=message):
        arm.ikine(np.eye(4), **arguments)


def test_names_of_frames_and_axes_are_checked() -> None:
    with pytest.raises(UnknownNameError, match="there is no frame named 'nose'"):
        arm_of("ur5").ikine(np.eye(4), frame="nose")
    with pytest.raises(UnknownNameError, match="there is no choice of axes named 'joint'"):
        arm_of("ur5").ikine(np.eye(4), mask=[1] * 6, axes="joint")


def test_robots_without_inverse_kinematics_are_refused() -> None:
    fixed = ab.Robot(name="post", links=(ab.Link(name="post", joint=ab.Fixed()),))
    with pytest.raises(RobotError, match="no joint moves, so there is no inverse kinematics"):
        ab.Arm(fixed).ikine(np.eye(4))

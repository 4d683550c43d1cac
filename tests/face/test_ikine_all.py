"""Closed inverse kinematics: every branch has the pose, and every configuration is among the branches."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import armblocks as ab
from armblocks.errors import InputError, RobotError
from armblocks.face.ikine_coordinates import random_coordinates
from robots_for_tests import random_transform

CLOSED = (
    *("puma560", "irb6640", "tx60", "stanford", "nao_left_leg"),
    *("ur5", "ur20", "cobra600", "planar3r", "twolink", "kr40_pa", "irb460", "xarm5", "phantomx"),
)
WRIST = "a spherical wrist after two parallel axes"


@cache
def arm_of(name: str) -> ab.Arm:
    return ab.load_robot(name)


def turns_apart(q: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Differences of coordinates, without whole turns."""
    return np.abs((q - other + np.pi) % (2 * np.pi) - np.pi)


def check_laws(arm: ab.Arm, q: np.ndarray) -> ab.IkineBranches:
    """Check that each branch has the pose, that q is among them, and that they are different."""
    T = arm.fkine(q)
    result = arm.ikine_all(T, limits=False)
    k, b = np.nonzero(result.exists)
    assert np.abs(arm.fkine(result.q[k, b]) - T[k]).max() < 2e-9
    assert np.isnan(result.q[~result.exists]).all()
    apart = turns_apart(result.q, q[:, np.newaxis]).max(axis=2)
    assert (np.where(result.exists, apart, np.inf).min(axis=1) < 1e-6).all()
    for row, exists in zip(result.q[:20], result.exists[:20]):
        found = row[exists]
        for i in range(len(found)):
            for j in range(i):
                assert turns_apart(found[i], found[j]).max() > 1e-7
    return result


@pytest.mark.parametrize("name", CLOSED)
def test_every_configuration_is_among_the_branches(name: str) -> None:
    arm = arm_of(name)
    q = random_coordinates(arm.robot, 200, np.random.default_rng(3), limited=True)
    result = check_laws(arm, q)
    limited = arm.ikine_all(arm.fkine(q))
    low, high = arm.robot.qlim.T
    found = limited.q[limited.exists]
    assert limited.exists.any(axis=1).mean() > 0.5
    assert (found >= low - 1e-8).all() and (found <= high + 1e-8).all()
    assert (limited.exists | limited.beyond_limits == result.exists).all()


def random_arm(seed: int, *, parallel: bool, prismatic: bool = False) -> ab.Arm:
    """An arm with axes in any directions and a spherical wrist."""
    random = np.random.default_rng(seed)
    moves = [random_transform(random) for _ in range(6)]
    for k in (4, 5):
        moves[k] = ab.Transform(rotation=moves[k].rotation)
    if parallel:
        moves[2] = ab.Transform(translation=moves[2].translation)
    else:
        moves[1] = ab.Transform(rotation=moves[1].rotation)
    base, tool = random_transform(random), random_transform(random)
    links = [
        ab.Link(
            name=f"link{k + 1}",
            parent=f"link{k}" if k else None,
            joint=ab.Prismatic(axis=(0, 0, 1), offset=0.1)
            if prismatic and k == 2
            else ab.Revolute(axis=(0, 0, 1), offset=0.2 * k),
            before=move,
            mass=1.0,
        )
        for k, move in enumerate(moves)
    ]
    return ab.Arm(ab.Robot(name="any axes", links=tuple(links), base=base, tool=tool))


@pytest.mark.parametrize(("kind", "seed"), [("parallel", 1), ("intersecting", 2), ("prismatic", 3)])
def test_axes_may_have_any_directions(kind: str, seed: int) -> None:
    arm = random_arm(seed, parallel=kind == "parallel", prismatic=kind == "prismatic")
    q = np.random.default_rng(seed).uniform(-3, 3, (60, 6))
    assert check_laws(arm, q).geometry.startswith("a spherical wrist")


@pytest.mark.parametrize("name", ["puma560", "ur5"])
def test_axes_may_be_parallel_and_intersect_up_to_rounding(name: str) -> None:
    exact = arm_of(name).robot
    random = np.random.default_rng(6)
    links = []
    for link in exact.links:
        turn = ab.Transform(rotation=Rotation.from_rotvec(random.uniform(-1e-6, 1e-6, 3)).as_matrix())
        links.append(replace(link, after=link.after @ turn, dh=None))
    arm = ab.Arm(replace(exact, links=tuple(links)))
    q = random.uniform(-2, 2, (40, 6))
    result = arm.ikine_all(arm.fkine(q), limits=False)
    assert np.nanmax(result.position_error) <= 1e-9 and result.exists.any(axis=1).all()
    assert (np.abs(result.nearest(q) - q).max(axis=1) < 1e-6).mean() > 0.95


@pytest.mark.parametrize("name", ["puma560", "ur5"])
def test_the_branches_are_all_that_an_iteration_finds(name: str) -> None:
    arm = arm_of(name)
    q = random_coordinates(arm.robot, 4, np.random.default_rng(8), limited=True)
    for T in arm.fkine(q):
        branches = arm.ikine_all(T, limits=False).solutions
        starts = random_coordinates(arm.robot, 300, np.random.default_rng(2), limited=False)
        numeric = arm.ikine(np.broadcast_to(T, (300, 4, 4)), starts, limits=False)
        apart = turns_apart(numeric.q[:, np.newaxis], branches).max(axis=2)
        assert apart.min(axis=1).max() < 1e-6
        assert set(apart.argmin(axis=1)) == set(range(len(branches)))


LETTERS = {
    "lun": (
        2.521388903182,
        2.406632945533,
        -0.859026476064,
        -0.460025473772,
        -1.581332274367,
        -2.206603434294,
    ),
    "ldn": (
        2.521388903182,
        3.071805939826,
        -2.18861034483,
        -0.557602116966,
        -0.995397249128,
        -1.874225785805,
    ),
    "run": (
        -0.226076625357,
        0.734959708056,
        -2.18861034483,
        2.691303578047,
        -1.323005858443,
        -2.520447033353,
    ),
    "rdn": (
        -0.226076625357,
        0.069786713764,
        -0.859026476064,
        2.474647924647,
        -0.75061619136,
        -2.116081499034,
    ),
    "luf": (2.521388903182, 2.406632945533, -0.859026476064, 2.681567179818, 1.581332274367, 0.934989219296),
    "ldf": (2.521388903182, 3.071805939826, -2.18861034483, 2.583990536623, 0.995397249128, 1.267366867785),
    "ruf": (-0.226076625357, 0.734959708056, -2.18861034483, -0.450289075543, 1.323005858443, 0.621145620237),
    "rdf": (-0.226076625357, 0.069786713764, -0.859026476064, -0.666944728943, 0.75061619136, 1.025511154555),
}
"""``ikine_a`` of the Robotics Toolbox for Python 1.4.4 for one pose, by configuration."""


def test_configuration_letters_are_those_of_the_toolbox() -> None:
    arm = arm_of("puma560")
    T = arm.fkine(LETTERS["lun"])
    for letters, q in LETTERS.items():
        result = arm.ikine6s(T, letters)
        assert result.success and turns_apart(result.q, np.array(q)).max() < 1e-9
    assert np.array_equal(arm.ikine6s(T).q, arm.ikine6s(T, "").q)
    batch = arm.ikine6s(np.stack([T, T]), "rdf")
    assert batch.success.all() and batch.q.shape == (2, 6) and batch.reason[0] == "converged"


def test_singular_configurations_are_solved_and_named() -> None:
    arm = arm_of("puma560")
    q = np.random.default_rng(4).uniform(-1, 1, (50, 6))
    q[:, 4] = 0.0
    result = arm.ikine_all(arm.fkine(q), limits=False)
    assert result.choices == ("shoulder", "elbow", "wrist") and (result.count >= 4).all()
    assert result.singular[..., 2].any(axis=1).all()
    straight = np.array([0.3, 0.2, -np.pi / 2 + np.arctan2(0.0203, 0.4318), 0.4, 0.5, 0.6])
    one = arm.ikine_all(arm.fkine(straight), limits=False)
    assert one.singular[one.exists, 1].any() and "singular: elbow" in str(one)
    assert turns_apart(one.solutions, straight).max(axis=1).min() < 1e-6
    ur = arm_of("ur5")
    q = np.random.default_rng(5).uniform(-1, 1, (50, 6))
    q[:, 4] = 0.0
    result = ur.ikine_all(ur.fkine(q), limits=False)
    assert result.exists.any(axis=1).all() and result.singular[..., 1].any(axis=1).all()


def test_poses_that_an_arm_does_not_reach_have_no_branches() -> None:
    far = np.eye(4)
    far[:3, 3] = 5.0, 0.0, 0.0
    for name in CLOSED:
        result = arm_of(name).ikine_all(far)
        assert not result.exists.any() and result.solutions.shape == (0, arm_of(name).nq)
    assert arm_of("puma560").ikine6s(far).reason == "out of reach"
    tilted = (
        arm_of("irb460").fkine(np.array([0.1, 0.2, 0.3, 0.4]))
        @ ab.Transform(rotation=[[1, 0, 0], [0, 0.8, -0.6], [0, 0.6, 0.8]]).matrix
    )
    assert not arm_of("irb460").ikine_all(tilted).exists.any()


def test_the_nearest_solution_and_the_text() -> None:
    arm = arm_of("ur5")
    q = random_coordinates(arm.robot, 5, np.random.default_rng(3), limited=True)
    q = (q + np.pi) % (2 * np.pi) - np.pi
    result = arm.ikine_all(arm.fkine(q))
    assert np.abs(result.nearest(q) - q).max() < 1e-6
    assert np.isnan(arm.ikine_all(np.diag([1.0, 1, 1, 1]) + 9 * np.eye(4, k=3)).nearest(q[0])).all()
    assert "5 poses, " in str(result) and "three parallel axes" in str(result)
    with pytest.raises(InputError, match="the poses of a batch have different numbers of solutions"):
        _ = result.solutions
    with pytest.raises(InputError, match=r"q0 has the shape \(4,\)"):
        result.nearest([0.0] * 4)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("panda", "with 7 joints a pose has infinitely many solutions"),
        ("xarm6", "do not intersect in one point, and the axes"),
        ("nao_left_arm", "5 joints whose axes are not parallel"),
        ("kr180", "coincide, so a pose has infinitely many solutions"),
    ],
)
def test_arms_without_closed_form_are_refused_with_the_reason(name: str, message: str) -> None:
    with pytest.raises(RobotError, match=message):
        arm_of(name).ikine_all(np.eye(4))


def test_joints_without_one_axis_and_idle_joints_are_refused() -> None:
    ball = ab.Link(name="ball", joint=ab.Spherical(), mass=1.0)
    with pytest.raises(RobotError, match="have no closed form with the joint 'ball'"):
        ab.Arm(ab.Robot(name="ball", links=(ball,))).ikine_all(np.eye(4))
    side = ab.Link(name="side", joint=ab.Revolute(axis=(0, 0, 1)), mass=1.0)
    end = ab.Link(name="end", joint=ab.Revolute(axis=(0, 0, 1)), mass=1.0)
    with pytest.raises(RobotError, match="1 joint does not move the tool: 'side'"):
        ab.Arm(ab.Robot(name="tree", links=(side, end))).ikine_all(np.eye(4))


def test_wrong_letters_and_targets_are_refused() -> None:
    for letters in ("lr", "x", 3, "lunn"):
        with pytest.raises(InputError, match="l or r \\(left, right\\), u or d"):
            arm_of("puma560").ikine6s(np.eye(4), letters)
    with pytest.raises(InputError, match="the configuration letters do not describe this arm"):
        arm_of("ur5").ikine6s(np.eye(4))
    for change in (np.nan * np.eye(4), np.diag([1.0, 1, -1, 1]), np.diag([1.0, 1, 1.1, 1]), np.eye(4)[::-1]):
        with pytest.raises(InputError, match=r"the (last|target|rotation)"):
            arm_of("puma560").ikine_all(change)
    T = arm_of("puma560").fkine([0.1, 0.2, -0.4, 0.4, 0.5, 0.6])
    rounded = np.round(T, 9)
    assert arm_of("puma560").ikine_all(rounded).exists.any()

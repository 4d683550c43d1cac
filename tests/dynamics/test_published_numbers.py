"""The Puma 560 compared with all digits that the Robotics Toolbox prints, and the arm of the paper."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from armblocks.robot import FrictionModel, Link, Motor, Revolute, Robot
from robots_for_tests import evaluate

QN = np.array([0, np.pi / 4, -np.pi, 0, np.pi / 4, 0])
QZ = np.zeros(6)
QR = np.array([0, np.pi / 2, -np.pi / 2, 0, 0, 0])
ONES, ZEROS = np.ones(6), np.zeros(6)
TEN_DIGITS = {"rtol": 0, "atol": 0.51e-10}


def test_forward_kinematics_agrees_with_the_toolbox(puma560: Robot):
    T = evaluate(puma560, "fkine", QN)
    assert_allclose(T[:3, :3], [[0, 0, 1], [0, 1, 0], [-1, 0, 0]], rtol=0, atol=1e-15)
    assert_allclose(T[:3, 3], (0.5963031486, -0.15005, 0.6574757323), **TEN_DIGITS)
    assert_allclose(evaluate(puma560, "fkine", QZ)[:3, 3], (0.4521, -0.15005, 1.10363), **TEN_DIGITS)
    assert_allclose(evaluate(puma560, "fkine", QR)[:3, 3], (0.0203, -0.15005, 1.53543), **TEN_DIGITS)


@pytest.mark.parametrize(
    ("q", "expected"),
    [
        (QN, (0, 31.6398803784, 6.035138023, 0, 0.0282528, 0)),
        (QZ, (0, 37.48366665, 0.24892875, 0, 0, 0)),
        (QR, (0, -0.77523525, 0.24892875, 0, 0, 0)),
    ],
)
def test_gravity_load_agrees_with_the_toolbox(puma560: Robot, q: np.ndarray, expected: tuple[float, ...]):
    assert_allclose(evaluate(puma560, "gravload", q), expected, **TEN_DIGITS)
    assert_allclose(evaluate(puma560, "rne", q, ZEROS, ZEROS), expected, **TEN_DIGITS)


def test_inverse_dynamics_agrees_with_the_toolbox(puma560: Robot):
    accelerated = (3.3531108581, 36.002511244, 7.4259640774, 0.1900430346, 0.2034409311, 0.1941327899)
    both = (32.4952427549, 60.8669884751, 17.7435949128, 1.4545190261, 1.2991104105, 0.7137808875)
    moving = (29.1421318969, 56.5043576095, 16.3527688584, 1.2644759915, 1.1239222794, 0.5196480975)
    smooth = (1.962036487, 37.7854298333, 6.6739373224, 0.1912661164, 0.2058204096, 0.1942810742)
    assert_allclose(evaluate(puma560, "rne", QN, ZEROS, ONES), accelerated, **TEN_DIGITS)
    assert_allclose(evaluate(puma560, "rne", QN, ONES, ONES), both, **TEN_DIGITS)
    assert_allclose(evaluate(puma560, "rne", QN, ONES, ZEROS), moving, **TEN_DIGITS)
    assert_allclose(evaluate(puma560.nofriction(), "rne", QN, ONES, ONES), smooth, **TEN_DIGITS)


def test_friction_agrees_with_the_toolbox(puma560: Robot):
    expected = (30.533206268, 23.0815586418, 11.0696575904, 1.2632529097, 1.0932900009, 0.5194998133)
    assert_allclose(evaluate(puma560, "friction", ONES), expected, **TEN_DIGITS)


def test_torques_of_a_tip_wrench_agree_with_the_toolbox(puma560: Robot):
    tau = evaluate(puma560.nofriction(), "rne_loaded", QN, ZEROS, ZEROS, (1, 2, 3, 1, 2, 3), np.zeros(10))
    # The source has six significant digits.
    assert_allclose(tau, (0.642756, 29.0866, 4.70321, 2.82843, -1.97175, 3), rtol=5e-6)


def test_the_inertia_matrix_agrees_with_the_toolbox(puma560: Robot):
    upper = (
        (3.6593754122, -0.404361246, 0.1006136478, -0.0025169558, 0, 0),
        (4.4137419336, 0.350890665, 0, 0.0023595131, 0),
        (0.9378415752, 0, 0.0014801664, 0),
        (0.1925317061, 0, 0.0000282843),
        (0.1713484517, 0),
        (0.1941045057,),
    )
    M = evaluate(puma560, "inertia", QN)
    for i, row in enumerate(upper):
        # One published entry is truncated instead of rounded.
        assert_allclose(M[i, i:], row, rtol=0, atol=1e-10)
        assert_allclose(M[i:, i], row, rtol=0, atol=1e-10)


def test_jacobian_and_manipulability_agree_with_the_toolbox(puma560: Robot):
    half = np.sqrt(0.5)
    expected = (
        (0.15005, 0.0143542677, 0.3196829758, 0, 0, 0),
        (0.5963031486, 0, 0, 0, 0, 0),
        (0, 0.5963031486, 0.2909744405, 0, 0, 0),
        (0, 0, 0, half, 0, 1),
        (0, -1, -1, 0, -1, 0),
        (1, 0, 0, -half, 0, 0),
    )
    assert_allclose(evaluate(puma560, "jacob0", QN), expected, **TEN_DIGITS)
    assert evaluate(puma560, "manipulability", QN) == pytest.approx(0.0786171653, abs=0.51e-10)


def test_forward_dynamics_agrees_with_the_toolbox(puma560: Robot):
    qd, tau = (0.1, 0.2, 0.8, 0.2, 0.5, 1), (1, 3.2, 1.8, 0.1, 0.7, 4.6)
    expected = (-7.4102, -9.8432, -10.9694, -4.4314, -0.9881, 21.0228)
    assert_allclose(evaluate(puma560, "accel", QN, qd, tau), expected, rtol=0, atol=0.51e-4)
    falling = (-0.6619970387, -6.9292906973, -3.771483542, -0.0086542491, -0.0368875517, 1.2611e-6)
    accel = evaluate(puma560.nofriction(), "accel", QN, ZEROS, ZEROS)
    assert_allclose(accel, falling, rtol=0, atol=1e-10)


def test_the_arm_of_the_paper_has_the_published_positions_and_torques(kr180: Robot):
    qf = np.array([3.14, 0, 1.57, 0])
    positions = {
        0: (1.95, -1.25, -1.85),
        2: (2.36963237462, -0.835183999087, -1.693963015984),
        5: (1.252643063297, 3.318570240624, 0.041710789934),
        10: (-2.949278739196, 1.254698768685, 2.347929043243),
    }
    for t, position in positions.items():
        s = t / 10
        q = qf * (10 * s**3 - 15 * s**4 + 6 * s**5)
        assert_allclose(evaluate(kr180, "fkine", q)[:3, 3], position, rtol=0, atol=1e-11)
    assert_allclose(evaluate(kr180, "gravload", np.zeros(4)), (0, 2305.35, 2452.5, 0), rtol=0, atol=1e-9)


G, B, TC = -50.0, 2e-3, (0.3, -0.2)


@pytest.mark.parametrize(
    ("model", "forward", "backward"),
    [
        (FrictionModel.SQUARED_GEAR, G * G * B * 2 + abs(G) * 0.3, -G * G * B * 2 - abs(G) * 0.2),
        (FrictionModel.ABSOLUTE_GEAR, abs(G) * (B * 2 + 0.3), abs(G) * (-B * 2 - 0.2)),
        (FrictionModel.SIGNED_GEAR, G * (B * 2 + 0.3), G * (-B * 2 - 0.2)),
        (FrictionModel.RELEASE_6, G * G * (B * 2 + 0.3), G * G * (-B * 2 - 0.2)),
    ],
)
def test_each_friction_model_agrees_with_its_toolbox_release(
    model: FrictionModel, forward: float, backward: float
):
    arm = Robot(
        name="arm",
        links=(
            Link(
                name="l",
                joint=Revolute(),
                mass=1.0,
                inertia=(1.0, 1.0, 1.0),
                motor=Motor(inertia=1e-3, gear_ratio=G, viscous_friction=B, coulomb_friction=TC),
            ),
        ),
    ).with_friction_model(model)
    assert evaluate(arm, "friction", [2.0]) == pytest.approx([forward], rel=1e-15)
    assert evaluate(arm, "friction", [-2.0]) == pytest.approx([backward], rel=1e-15)
    assert evaluate(arm, "friction", [0.0]) == [0.0]
    # Inverse and forward dynamics have the same inertia: 1 + G^2 Jm = 3.5 kg m2.
    assert evaluate(arm, "rne", [0.1], [2.0], [3.0]) == pytest.approx([3.5 * 3 + forward])
    assert evaluate(arm, "accel", [0.1], [2.0], [1.0]) == pytest.approx([(1 - forward) / 3.5])

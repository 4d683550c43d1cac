"""The quintic, compared with the formula of the toolbox, and numbers compared with symbols."""

import numpy as np
import pytest
from casadi import SX, Function, jacobian
from numpy.testing import assert_allclose, assert_array_equal

from armblocks.trajectories import Quintic

Q0 = np.array([0.1, -1.0, 2.0])
QF = np.array([3.14, 0.5, -1.57])
QD0 = np.array([0.3, -0.2, 0.0])
QD1 = np.array([-0.1, 0.4, 0.7])
T = np.array(4.0)


def toolbox_jtraj(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """jtraj according to its manual: powers of normalised time."""
    s = (t / T)[:, None]
    rise = QF - Q0
    A = 6 * rise - 3 * (QD1 + QD0) * T
    B = -15 * rise + (8 * QD0 + 7 * QD1) * T
    C = 10 * rise - (6 * QD0 + 4 * QD1) * T
    E = QD0 * T
    q = A * s**5 + B * s**4 + C * s**3 + E * s + Q0
    qd = (5 * A * s**4 + 4 * B * s**3 + 3 * C * s**2 + E) / T
    qdd = (20 * A * s**3 + 12 * B * s**2 + 6 * C * s) / T**2
    return q, qd, qdd


def test_the_quintic_equals_the_toolbox_formula():
    t = np.linspace(0, 4, 41)
    motion = Quintic(q0=Q0, qf=QF, tmax=T, qd0=QD0, qd1=QD1).at(t)
    for ours, theirs in zip(motion, toolbox_jtraj(t)):
        assert ours.shape == (41, 3)
        # Sums of terms up to 60 in two orders: a few hundred rounding errors.
        assert_allclose(ours, theirs, rtol=0, atol=1e-13)


def test_rates_at_both_ends_are_exact():
    rest = Quintic(q0=Q0, qf=QF, tmax=T)
    for t in (0.0, 4.0):
        motion = rest.at(np.array(t))
        assert_array_equal(motion.qd, np.zeros(3))
        assert_array_equal(motion.qdd, np.zeros(3))
    moving = Quintic(q0=Q0, qf=QF, tmax=T, qd0=QD0, qd1=QD1)
    assert_array_equal(moving.at(np.array(0.0)).qd, QD0)
    assert_array_equal(moving.at(np.array(4.0)).qd, QD1)


@pytest.mark.parametrize(("t", "position"), [(-1.0, Q0), (5.0, QF)])
def test_the_trajectory_is_at_rest_outside_the_interval(t: float, position: np.ndarray):
    motion = Quintic(q0=Q0, qf=QF, tmax=T, qd0=QD0, qd1=QD1).at(np.array(t))
    assert_allclose(motion.q, position, rtol=1e-15)
    assert_array_equal(motion.qd, np.zeros(3))
    assert_array_equal(motion.qdd, np.zeros(3))


def test_symbolic_evaluation_equals_numbers_and_rates_are_derivatives():
    t = SX.sym("t")
    motion = Quintic(q0=SX(Q0), qf=SX(QF), tmax=SX(T), qd0=SX(QD0), qd1=SX(QD1)).at(t)
    f = Function("f", [t], [*motion, jacobian(motion.q, t), jacobian(motion.qd, t)])
    for time in (-0.5, 0.0, 0.7, 2.0, 3.9, 4.0, 4.5):
        q, qd, qdd, dq, dqd = (np.asarray(value).ravel() for value in f(time))
        numbers = Quintic(q0=Q0, qf=QF, tmax=T, qd0=QD0, qd1=QD1).at(np.array(time))
        for symbolic, number in zip((q, qd, qdd), numbers):
            assert_allclose(symbolic, number, rtol=0, atol=1e-14)
        if 0 < time < 4:
            assert_allclose(dq, qd, rtol=0, atol=1e-13)
            assert_allclose(dqd, qdd, rtol=0, atol=1e-13)

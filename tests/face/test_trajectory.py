"""Joint trajectories of ``ab.jtraj``, its errors, and the warnings about angles in degrees."""

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import Constant, JTraj, RobotPlot
from armblocks.errors import ArmblocksWarning, InputError


def test_jtraj_has_the_given_positions_and_speeds_at_both_ends() -> None:
    t = np.linspace(0, 4, 401)
    path = ab.jtraj([0, 1], [2, -1], t, qd0=[0.1, 0.0], qd1=[0.0, -0.2])
    assert len(path) == 401
    np.testing.assert_allclose(path.q[[0, -1]], [[0, 1], [2, -1]], atol=1e-15)
    np.testing.assert_allclose(path.qd[[0, -1]], [[0.1, 0.0], [0.0, -0.2]], atol=1e-15)
    np.testing.assert_allclose(path.qdd[[0, -1]], 0.0, atol=1e-14)
    np.testing.assert_allclose(np.gradient(path.q, t, axis=0)[1:-1], path.qd[1:-1], atol=2e-4)


def test_jtraj_with_a_number_of_samples_uses_normalised_time() -> None:
    path = ab.jtraj([0.0], [1.0], 5)
    np.testing.assert_array_equal(path.t, [0, 0.25, 0.5, 0.75, 1])
    s = path.t
    np.testing.assert_allclose(path.q[:, 0], 10 * s**3 - 15 * s**4 + 6 * s**5, atol=1e-15)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([0, np.nan], [1, 1], 10), r"q0 = .*nan.*a vector of finite joint values"),
        (([0, 0], [1, 1, 1], 10), "qf has 3 joints.*Allowed: 2, the number of joints of q0"),
        (([0], [1], 1), "t = 1 sample.*2 or more"),
        (([0], [1], [0.0, 0.0]), "finite ascending times that start at 0"),
        (([0], [1], [1.0, 2.0]), "finite ascending times that start at 0"),
    ],
)
def test_jtraj_refuses_invalid_arguments(arguments: tuple, message: str) -> None:
    with pytest.raises(InputError, match=message):
        ab.jtraj(*arguments)


def test_a_trajectory_unpacks_as_in_the_toolbox() -> None:
    path = ab.jtraj([0, 1], [2, -1], 5)
    q, qd, qdd = path
    assert q is path.q and qd is path.qd and qdd is path.qdd


def test_angles_that_are_probably_in_degrees_raise_a_warning() -> None:
    with pytest.warns(ArmblocksWarning, match=r"jtraj, qf: an angle of 90 rad is more than two full turns"):
        ab.jtraj([0, 0], [90, 0], 5)
    builder = ab.DiagramBuilder("degrees")
    motion = builder.add("motion", JTraj(q0=[0, 0], qf=[-90, 0]))
    builder.add("plot", RobotPlot(robot=ab.load_robot("twolink")), motion["q"])
    with pytest.warns(
        ArmblocksWarning, match=r"block 'motion' \(jtraj\), qf: an angle of 90 rad.*np.radians"
    ):
        ab.simulate(builder.build())
    builder = ab.DiagramBuilder("degrees")
    angles = builder.add("angles", Constant(value=[0, 45]))
    builder.add("plot", RobotPlot(robot=ab.load_robot("twolink")), angles)
    with pytest.warns(ArmblocksWarning, match=r"angles/y at the start: an angle of 45 rad"):
        ab.simulate(builder.build())


def test_a_trajectory_is_shown_as_a_summary() -> None:
    assert repr(ab.jtraj([0, 0], [1, 2], 50)) == "<JointTrajectory: 2 joints, 50 samples from 0 s to 1 s>"

"""The shipped diagrams compared with closed forms and other integrators."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import armblocks as ab
from armblocks.blocks import BLOCKS
from armblocks.diagram import Diagram, diagram_views
from armblocks.formats import example_descriptions, list_examples, load_diagram

DOCUMENTED = {
    "bouncing_ball",
    "dc_motor_sampled_pid",
    "falling_pendulum",
    "four_bar_spring",
    "kr180_pick_and_place",
    "kr180model",
    "palletiser_cycle",
    "puma560_computed_torque",
    "puma560_multirate",
    "puma560_payload_drop",
    "robertson_kinetics",
    "slider_crank",
    "stick_slip",
    "van_der_pol_pid",
}


@pytest.fixture(params=list_examples())
def example(request: pytest.FixtureRequest) -> Diagram:
    return load_diagram(request.param, BLOCKS)


def test_the_documented_examples_are_shipped() -> None:
    assert set(list_examples()) >= DOCUMENTED


def test_examples_have_the_name_of_their_file_and_all_blocks_are_placed(example: Diagram) -> None:
    assert example.name in list_examples()
    assert set(example.layout) == set(example.blocks)
    assert diagram_views(example), "no view"


def test_the_description_of_an_example_is_read_without_building_it(example: Diagram) -> None:
    assert example_descriptions()[example.name] == example.description


def test_blocks_do_not_overlap(example: Diagram) -> None:
    corners = sorted((place.x, place.y) for place in example.layout.values())
    for i, (x, y) in enumerate(corners):
        for other_x, other_y in corners[i + 1 :]:
            assert abs(other_x - x) >= 50 or abs(other_y - y) >= 50


def test_kr180model_is_the_papers_figure_9() -> None:
    diagram = load_diagram("kr180model", BLOCKS)
    kinds = {name: block.title for name, block in diagram.blocks.items()}
    assert kinds == {
        "jtraj": "jtraj",
        "kuka": "fkine",
        "plot": "plot",
        "T2xyz": "T2xyz",
        "XY Graph": "XY Graph",
        "XZ Graph": "XY Graph",
        "YZ Graph": "XY Graph",
        "Display": "Display",
        "Joint angles": "Scope",
        "speed": "Derivative",
        "acceleration": "Derivative",
        "Joint speeds": "Scope",
        "Joint accelerations": "Scope",
        "rne": "rne",
        "Joint torques": "Scope",
    }
    assert diagram.settings.stop_time == 10


PAPER = {
    0: (1.95, -1.25, -1.85),
    2: (2.36963237462, -0.835183999087, -1.693963015984),
    5: (1.252643063297, 3.318570240624, 0.041710789934),
    10: (-2.949278739196, 1.254698768685, 2.347929043243),
}


def test_kr180model_agrees_with_a_separate_computation() -> None:
    """Reference: a NumPy computation, printed to 12 digits; documented accuracy 1e-9 m."""
    result = ab.simulate("kr180model")
    for t, expected in PAPER.items():
        (i,) = np.flatnonzero(result.time == t)
        actual = [result[f"T2xyz/{axis}"][i] for axis in "xyz"]
        np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-11)
    peak = np.degrees(np.abs(result["speed/y"]).max(axis=0))
    np.testing.assert_allclose(peak, [33.73, 0, 16.87, 0], atol=0.005)
    assert result["Joint torques/u"].shape == (1001, 4)


PENDULUM = {
    1: (0.98629175113187532, -0.16501085312554117),
    2: (-0.79356619534332175, -0.60848393044379151),
    5: (-0.94230543504375734, -0.33475433841400058),
    10: (-0.27508746257611686, -0.96141920509912506),
}


def test_falling_pendulum_follows_the_elliptic_function() -> None:
    """Exact: modulus sin(pi/4), period 4 K(1/2) / sqrt(9.81); at rtol 1e-10 the error is 1e-8 after 10 s."""
    result = ab.simulate("falling_pendulum")
    for t, (x, z) in PENDULUM.items():
        (i,) = np.flatnonzero(result.time == t)
        np.testing.assert_allclose(result["T2xyz/x"][i], x, rtol=0, atol=1e-7)
        np.testing.assert_allclose(result["T2xyz/z"][i], z, rtol=0, atol=1e-7)
    energy = 0.5 * result["pendulum/qd"][:, 0] ** 2 + 9.81 * result["T2xyz/z"]
    np.testing.assert_allclose(energy, 0, atol=1e-6)


def test_the_computed_torque_error_obeys_its_linear_equation() -> None:
    """The error obeys e'' + 20 e' + 100 e = 0 with e(0) = -0.1: e = -0.1 (1 + 10 t) exp(-10 t)."""
    result = ab.simulate("puma560_computed_torque")
    t = result.time[:, np.newaxis]
    exact = -0.1 * (1 + 10 * t) * np.exp(-10 * t)
    np.testing.assert_allclose(result["angle error/y"], np.broadcast_to(exact, (t.size, 6)), atol=1e-7)


def test_van_der_pol_with_pid_agrees_with_scipy() -> None:
    def equations(t: float, x: np.ndarray) -> list[float]:
        e = np.sin(2 * np.pi * 0.1 * t) - x[0]
        u = 2 * e + x[2] - 0.5 * x[1]
        return [x[1], (1 - x[0] ** 2) * x[1] - x[0] + u, 0.5 * e]

    reference = solve_ivp(equations, (0, 100), [1, 0, 0], method="DOP853", rtol=1e-11, atol=1e-12)
    result = ab.simulate("van_der_pol_pid")
    actual = [result["x1/y"][-1], result["x2/y"][-1]]
    # 100 s on a limit cycle at rtol 1e-6: the phase error is about 1e-5 s.
    np.testing.assert_allclose(actual, reference.y[:2, -1], atol=2e-4)


def test_robertson_kinetics_agrees_with_published_values_and_radau() -> None:
    """At 40 s and 400 s: the values printed by CVODE's example program, to their four digits."""
    result = ab.simulate("robertson_kinetics")
    for t, values in {40: (7.158e-1, 9.185e-6, 2.842e-1), 400: (4.505e-1, 3.223e-6, 5.495e-1)}.items():
        (i,) = np.flatnonzero(np.isclose(result.time, t, atol=1e-9))
        np.testing.assert_allclose([result[name][i] for name in "ABC"], values, rtol=2e-4)

    def rates(t: float, y: np.ndarray) -> list[float]:
        slow, fast, back = 0.04 * y[0], 3e7 * y[1] ** 2, 1e4 * y[1] * y[2]
        return [back - slow, slow - back - fast, fast]

    at = result.time[::50]
    reference = solve_ivp(rates, (0, 400), [1, 0, 0], method="Radau", rtol=1e-10, atol=1e-14, t_eval=at)
    actual = np.array([result[name][::50] for name in "ABC"])
    np.testing.assert_allclose(actual, reference.y, rtol=2e-5, atol=1e-12)
    np.testing.assert_allclose(result["total"], 1.0, rtol=1e-13)


def test_every_example_has_a_description(example: Diagram) -> None:
    assert 10 <= len(example.description) <= 60


def test_the_ball_bounces_at_the_published_times_and_comes_to_rest() -> None:
    """Impacts and end of the FMI reference ball: h0 = 1 m, e = 0.7, g = 9.81 m/s2."""
    result = ab.simulate("bouncing_ball")
    t, x, dx = result.time, result["ball/x"], result["ball/dx"]
    for impact, before in ((0.451523640985731, 0.0), (1.08365673836575, 0.451523640985731)):
        after = int(np.searchsorted(t, impact))
        # the recorded speed determines the start and end of the flight exactly
        speed = 0.7 ** (1 if before == 0.0 else 2) * 9.81 * 0.451523640985731
        assert dx[after] == pytest.approx(speed - 9.81 * (t[after] - impact), abs=1e-8)
    rests = t > 2.55863396558581
    assert not x[rests].any()
    assert not dx[rests].any()
    assert result.run.complete
    assert x.min() >= 0.0


def test_stick_slip_has_its_analytical_period() -> None:
    """m x'' = k (v t - x) - Fc from F = Fs: a slip takes 2 (pi - atan((Fs - Fc) w / (k v))) / w."""
    result = ab.simulate("stick_slip")
    w = np.sqrt(2.0)
    slips = 2 * (np.pi - np.arctan(1.0 * w / (2.0 * 0.5))) / w
    period = slips + 2.0  # at the end of a slip the force is 2 Fc - Fs = 0, and grows by 1 N/s to 2 N
    phase = np.mod(result.time - 2.0, period)
    moves = (result.time > 2.0) & (phase < slips)
    v = 0.5 + (1.0 * w * np.sin(w * phase) - 2.0 * 0.5 * np.cos(w * phase)) / 2.0
    clear = np.minimum(abs(phase - slips), np.minimum(phase, period - phase)) > 1e-6
    assert result["mass/v"][moves & clear] == pytest.approx(v[moves & clear], abs=1e-6)
    assert not result["mass/v"][~moves & clear].any()


def test_the_four_bar_linkage_stays_closed_and_loses_the_energy_of_its_friction() -> None:
    """The coupler and the rocker meet at the pin; energy decreases by the work of 0.05 N m s at the crank."""
    result = ab.simulate("four_bar_spring")
    robot = load_diagram("four_bar_spring", BLOCKS).blocks["linkage"].parameter_value("robot")
    poses = ab.Arm(robot).link_poses(result["linkage/q"])
    ends = [poses[:, k] @ (length, 0, 0, 1) for k, length in ((2, 0.9), (3, 0.7))]
    np.testing.assert_allclose(ends[0], ends[1], rtol=0, atol=1e-12)
    power = 0.05 * result["linkage/qd"][:, 0] ** 2
    work = np.concatenate(([0.0], np.cumsum((power[1:] + power[:-1]) / 2 * np.diff(result.time))))
    total = result["total/y"]
    np.testing.assert_allclose(total[0] - total, work, rtol=0, atol=5e-3)
    assert total[-1] < total[0] - 0.4


def test_the_slider_has_the_position_of_its_crank_and_sticks() -> None:
    """x = 0.2 cos a + sqrt(0.5^2 - (0.2 sin a)^2) with the crank at a = q + 0.5 rad."""
    result = ab.simulate("slider_crank")
    angle = result["mechanism/q"][:, 0] + 0.5
    expected = 0.2 * np.cos(angle) + np.sqrt(0.25 - 0.04 * np.sin(angle) ** 2)
    np.testing.assert_allclose(result["position/x"], expected, rtol=0, atol=1e-10)
    sticks = result["mechanism/qd"][:, 0] == 0.0
    assert 10 < sticks.sum() < 400
    assert np.abs(result["mechanism/friction"][sticks, 0]).max() <= 3.0 + 1e-9


def test_the_tracking_error_of_the_palletiser_decays_as_designed() -> None:
    """Gains 225 and 30: e = -0.02 (1 + 15 t) exp(-15 t) for all four axes."""
    result = ab.simulate("palletiser_cycle")
    t = result.time[:, np.newaxis]
    expected = -0.02 * (1 + 15 * t) * np.exp(-15 * t) * np.ones(4)
    np.testing.assert_allclose(result["error/y"], expected, rtol=0, atol=2e-6)

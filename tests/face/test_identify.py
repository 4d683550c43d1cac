"""Identification: known parameters are recovered from simulated noisy logs, with correct standard errors."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

import armblocks as ab
from armblocks.errors import InputError, UnknownNameError
from armblocks.robot import inertia_findings
from robots_for_tests import MIXED_ROBOTS, build_random_tree

NOISE = np.array([0.3, 0.1, 0.05])


def small_arm() -> ab.Arm:
    """Return a chain of revolute, prismatic and revolute joints with gears and asymmetric friction."""
    inertia = ((0.02, 0.001, 0.0), (0.001, 0.03, 0.002), (0.0, 0.002, 0.025))
    links = [
        ab.Link(
            name=name,
            parent=parent,
            joint=joint,
            before=ab.Transform(translation=(0.3, 0.0, 0.1)),
            mass=mass,
            centre_of_mass=(0.1, -0.05, 0.08),
            inertia=inertia,
            motor=ab.Motor(inertia=2e-4, gear_ratio=G, viscous_friction=2e-3, coulomb_friction=(0.03, -0.02)),
        )
        for name, parent, joint, mass, G in (
            ("base", None, ab.Revolute(axis=(0, 1, 0)), 4.0, -20.0),
            ("slide", "base", ab.Prismatic(axis=(1, 0, 0)), 2.0, 30.0),
            ("wrist", "slide", ab.Revolute(axis=(0, 0, 1)), 1.0, 15.0),
        )
    ]
    return ab.Arm(ab.Robot(name="small", links=tuple(links)))


def motion(n: int, count: int, step: float = 0.01, seed: int = 1) -> dict[str, np.ndarray]:
    """Return a smooth exact motion: sums of sines."""
    random = np.random.default_rng(seed)
    t = step * np.arange(count)
    log = {"t": t, **{name: np.zeros((count, n)) for name in ("q", "qd", "qdd")}}
    for k in range(1, 5):
        w, phase = 2.0 * np.pi * 0.3 * k, random.uniform(0, 2 * np.pi, n)
        size = random.uniform(0.2, 0.5, n) / k
        log["q"] += size * np.sin(w * t[:, None] + phase)
        log["qd"] += size * w * np.cos(w * t[:, None] + phase)
        log["qdd"] -= size * w * w * np.sin(w * t[:, None] + phase)
    return log


def noisy_log(arm: ab.Arm, count: int = 1500, seed: int = 2, noise: Any = NOISE) -> dict[str, np.ndarray]:
    log = motion(arm.n, count)
    exact = arm.rne(log["q"], log["qd"], log["qdd"])
    return {**log, "tau": exact + noise * np.random.default_rng(seed).normal(size=exact.shape)}


def test_known_parameters_are_recovered_within_their_standard_errors() -> None:
    arm = small_arm()
    result = ab.identify(arm, noisy_log(arm))
    deviations = (result.values - result.prior) / result.standard_errors
    assert np.abs(deviations).max() < 3.5 and 0.3 < np.mean(deviations**2) < 2.0
    assert_allclose(result.noise, NOISE, rtol=0.06)  # standard error 2 %
    assert not result.not_identified and result.dropped == 0 and not result.notes
    assert np.abs(result.autocorrelation).max() < 0.1
    assert result["wrist.Tc+"] == result.values[result.parameters.index("wrist.Tc+")]
    intervals = result.confidence_intervals()
    assert_allclose(intervals.mean(axis=1), result.values)
    assert_allclose(np.diff(intervals)[:, 0], 2 * 1.96 * result.standard_errors, rtol=1e-3)
    assert_allclose(np.diag(result.correlation), 1.0)
    text = str(result)
    assert "base parameters from 1500 samples" in text and "wrist.Tc+" in text and "condition number" in text
    assert_allclose(result.fitted + result.residuals, result.tau)


def test_intervals_of_95_percent_contain_the_parameters_in_95_percent_of_the_logs() -> None:
    arm = small_arm()
    log = motion(3, 300)
    exact = arm.rne(log["q"], log["qd"], log["qdd"])
    random = np.random.default_rng(11)
    for robust, runs in ((False, 80), (True, 20)):
        inside: list[np.ndarray] = []
        for _ in range(runs):
            tau = exact + NOISE * random.normal(size=exact.shape)
            result = ab.identify(arm, {**log, "tau": tau}, robust=robust)
            low, high = result.confidence_intervals().T
            inside.append((low < result.prior) & (result.prior < high))
        # About 22 correlated parameters in each run.
        assert 0.92 < np.mean(inside) < 0.98


@pytest.mark.parametrize("robot", [build_random_tree(2), MIXED_ROBOTS[1]], ids=lambda robot: robot.name)
def test_trees_with_all_joint_types_are_identified(robot: ab.Robot) -> None:
    random = np.random.default_rng(3)
    count = 600
    q = random.uniform(-2, 2, (count, robot.nq))
    qd, qdd = random.normal(size=(2, count, robot.n))
    arm = ab.Arm(robot)
    log = {"t": np.arange(count), "q": q, "qd": qd, "qdd": qdd, "tau": arm.rne(q, qd, qdd)}
    result = ab.identify(robot, log)
    assert_allclose(result.values, result.prior, atol=1e-7)
    assert_allclose(result.fitted, result.tau, atol=1e-6)
    # The random trees are physically consistent, so that the robot reproduces the torques.
    q, qd, qdd = q[:20], qd[:20], qdd[:20]
    scale = np.abs(log["tau"]).max()
    assert_allclose(result.arm.rne(q, qd, qdd), log["tau"][:20], atol=1e-3 * scale)


@pytest.mark.parametrize("name", ["irb460", "stanford"])
def test_exact_logs_of_shipped_robots_give_their_parameters(name: str) -> None:
    arm = ab.load_robot(name)  # one with coupled joints, one with a prismatic joint
    q, qd, qdd = np.random.default_rng(0).normal(size=(3, 300, arm.n))
    log = {"t": np.arange(300.0), "q": q, "qd": qd, "qdd": qdd, "tau": arm.rne(q, qd, qdd)}
    size = np.abs(log["tau"]).max()
    for friction, rotors in (("asymmetric", True), ("viscous", True), ("none", False)):
        result = ab.identify(arm, log, friction=friction, rotor_inertia=rotors)
        assert_allclose(result.values, result.prior, atol=1e-9 * size)
        assert_allclose(result.arm.rne(q, qd, qdd), log["tau"], atol=1e-3 * size)


def test_the_robot_is_physically_consistent_and_stays_near_the_description() -> None:
    arm = ab.load_robot("puma560")  # two of its published inertias are impossible
    log = noisy_log(arm, 800, noise=np.array([1, 1, 1, 0.1, 0.1, 0.1]))
    result = ab.identify(arm, log)
    assert inertia_findings(arm.robot) and not inertia_findings(result.robot)
    assert all(motor.coulomb_friction[0] >= 0 >= motor.coulomb_friction[1] for motor in result.robot.motors)
    errors = (result.consistent_values - result.values) / result.standard_errors
    assert np.abs(errors).max() < 4.0
    exact = arm.rne(log["q"], log["qd"], log["qdd"])
    error = result.arm.rne(log["q"], log["qd"], log["qdd"]) - exact
    assert (np.sqrt(np.mean(error**2, axis=0)) < 0.25 * result.noise).all()
    # The mass of link 3 has no effect of its own.
    assert abs(result.robot.link("link3").mass / 4.8 - 1.0) < 0.3
    assert_allclose(result.validate(log), result.noise, rtol=0.1)


def test_a_wrong_payload_gives_impossible_bodies_and_is_reported() -> None:
    motor = ab.Motor(inertia=1e-3, gear_ratio=10.0, viscous_friction=0.01, coulomb_friction=(0.02, -0.03))
    first = ab.Link(
        name="a",
        joint=ab.Revolute(axis=(0, 1, 0)),
        mass=1.0,
        centre_of_mass=(0.5, 0, 0.02),
        inertia=((0.02, 0, 0), (0, 0.1, 0), (0, 0, 0.1)),
        motor=motor,
    )
    second = replace(first, name="b", parent="a", before=ab.Transform(translation=(1, 0, 0)))
    arm = ab.Arm(ab.Robot(name="two", links=(first, second)))
    t, rates = np.arange(0.0, 4.0, 0.01), np.array([[2.0, 3.1], [1.3, 4.7]])
    angles = rates * t[:, None, None]
    q = 0.5 * np.sin(angles).sum(axis=2)
    qd, qdd = 0.5 * (rates * np.cos(angles)).sum(axis=2), -0.5 * (rates**2 * np.sin(angles)).sum(axis=2)
    noise = 0.05 * np.random.default_rng(1).normal(size=q.shape)
    log = {"t": t, "q": q, "qd": qd, "qdd": qdd, "tau": arm.rne(q, qd, qdd) + noise}
    for payload, is_possible in ((0.5, True), (2.0, False)):
        result = ab.identify(arm, log, payload=payload)
        assert is_possible is ("no possible bodies have the estimated parameters" not in str(result))
        deviation = result.validate(log, payload=payload)
        assert is_possible is bool((deviation < 1.1 * result.noise).all())
        assert result.validate(log)[0] > 5.0 * result.noise[0], "without the payload"


def test_descriptions_without_friction_or_masses_do_not_bias_the_robot() -> None:
    arm = small_arm()
    log = noisy_log(arm)
    empty = {"mass": 0.0, "inertia": np.zeros((3, 3))}
    for changes in ({"motor": ab.Motor()}, empty, {"motor": None, **empty}):
        robot = arm.robot
        for link in robot.links:
            gears = {"motor": ab.Motor(gear_ratio=link.motor.gear_ratio)} if changes.get("motor") else {}
            robot = robot.with_link(link.name, **{**changes, **gears})
        result = ab.identify(robot, log)
        errors = (result.consistent_values - result.values) / result.standard_errors
        assert np.abs(errors).max() < 0.2
        assert_allclose(result.validate(log), result.noise, rtol=0.05)


def test_parameters_without_excitation_are_named_and_not_invented() -> None:
    arm = small_arm()
    log = noisy_log(arm)
    log["q"][:, 2] = 0.3
    log["qd"][:, 2] = log["qdd"][:, 2] = 0.0
    log["tau"] = arm.rne(log["q"], log["qd"], log["qdd"]) + NOISE * np.random.default_rng(1).normal(
        size=(1500, 3)
    )
    result = ab.identify(arm, log)
    assert {"wrist.B", "wrist.Tc+", "wrist.Tc-"} <= set(result.not_identified)
    assert np.isnan(result["wrist.B"]) and np.isfinite(result["base.B"])
    assert "the motion does not excite them: " in str(result)
    motor = result.robot.link("wrist").motor
    assert motor is not None and motor.viscous_friction == pytest.approx(2e-3, rel=1e-3)


def test_friction_kinds_rotor_inertia_and_links_are_chosen() -> None:
    arm = small_arm()
    log = noisy_log(arm)
    full = ab.identify(arm, log)
    for kind, fewer in (("coulomb", 3), ("viscous", 6), ("none", 9)):
        other = ab.identify(arm.nofriction() if kind == "viscous" else arm, log, friction=kind)
        assert len(other.parameters) == len(full.parameters) - fewer
    without = ab.identify(arm, log, rotor_inertia=False)
    assert not any(name.endswith("Jm") for name in without.parameters)
    # Known: everything but the payload, which is rigidly fixed to the last link.
    body = ab.Payload(mass=1.5, centre=(0.05, 0.0, 0.1), inertia=(0.01, 0.02, 0.02, 0, 0, 0))
    loaded = {**log, "tau": arm.rne(log["q"], log["qd"], log["qdd"], payload=body)}
    alone = ab.identify(arm, loaded, links="wrist", friction="none", rotor_inertia=False)
    assert {name.partition(".")[0] for name in alone.parameters} == {"wrist"}
    known = ab.identify(arm, loaded, payload=body)
    assert_allclose(known.values, known.prior, atol=1e-9)


def test_positions_alone_and_decimation_give_correct_standard_errors() -> None:
    arm = small_arm()
    log = motion(3, 20_000, step=1e-3)
    tau = arm.rne(log["q"], log["qd"], log["qdd"])
    random = np.random.default_rng(5)
    positions = log["q"] + 1e-6 * random.normal(size=tau.shape)
    measured = {"time": log["t"], "q": positions, "tau": tau + NOISE * random.normal(size=tau.shape)}
    result = ab.identify(arm, measured, cutoff=10.0, decimate=20)
    assert "motion filtered without phase shift, cut-off 10 Hz" in result.notes
    assert "decimated by 20" in result.notes[1] and result.dropped > 0
    assert np.abs(result.autocorrelation).max() < 0.25
    deviations = (result.values - result.prior) / result.standard_errors
    assert np.mean(deviations**2) < 2.5
    automatic = ab.identify(arm, measured)
    assert "cut-off" in automatic.notes[0]
    assert_allclose(automatic["wrist.Tc+"], 0.03, atol=0.01)
    # Filtered torques are correlated, which the result reports.
    from armblocks.estimation.filtering import low_passed

    smooth = {**measured, "tau": low_passed(measured["tau"], 1e-3, 20.0)}
    assert "the standard errors are too small" in str(ab.identify(arm, smooth, cutoff=10.0))


def test_a_joint_without_torque_or_without_fast_samples_is_identified() -> None:
    arm = small_arm()
    free = arm.robot.with_link("wrist", motor=ab.Motor())
    log = motion(3, 600)
    log["qdd"][:, 2] = 0.0
    exact = ab.Arm(free).rne(log["q"], log["qd"], log["qdd"])
    rest = ab.Arm(free).rne(log["q"], log["qd"], np.eye(3)[2] * np.ones((600, 1))) - ab.Arm(free).rne(
        log["q"], log["qd"], np.zeros((600, 3))
    )
    log["qdd"][:, 2] = -exact[:, 2] / rest[:, 2]  # the acceleration of a joint without a motor
    tau = ab.Arm(free).rne(log["q"], log["qd"], log["qdd"])
    tau[:, 2] = 0.0
    result = ab.identify(free, {**log, "tau": tau}, friction="none", rotor_inertia=False)
    assert_allclose(result.values, result.prior, atol=1e-6)
    slow = noisy_log(arm)
    slow["qd"][:, 2] *= 1e-4
    some = ab.identify(arm, slow, min_speed=0.1)
    assert {"wrist.B", "wrist.Tc+"} <= set(some.not_identified) and np.isfinite(some.noise).all()


def test_missing_samples_outliers_and_slow_samples() -> None:
    arm = small_arm()
    log = noisy_log(arm)
    gaps = {name: value.copy() for name, value in log.items()}
    gaps["tau"][10:20, 1] = np.nan
    gaps["qd"][100, 0] = np.nan
    result = ab.identify(arm, gaps)
    assert result.dropped == 11 and "11 samples omitted, with missing values" in str(result)
    rows = np.ones(1500, dtype=bool)
    rows[10:20] = rows[100] = False
    kept = ab.identify(arm, {name: value[rows] for name, value in log.items()})
    assert_allclose(result.values, kept.values, rtol=1e-9)
    positions = {"t": log["t"], "q": gaps["qd"], "tau": log["tau"]}
    assert ab.identify(arm, positions, cutoff=10.0).dropped > 11  # two segments, without their ends
    outliers = {**log, "tau": log["tau"].copy()}
    outliers["tau"][::25] += 30.0
    robust = ab.identify(arm, outliers, robust=True)
    plain = ab.identify(arm, outliers)
    errors = [np.abs(one.values - one.prior) / kept.standard_errors for one in (robust, plain)]
    assert np.mean(errors[0]) < 1.5 and np.mean(errors[1]) > 3.0 * np.mean(errors[0])
    slow = ab.identify(arm, log, min_speed=0.2)
    assert slow.degrees_of_freedom < result.degrees_of_freedom - 100


def test_samples_at_rest_do_not_distort_a_vertical_slide_and_logs_may_be_split() -> None:
    """On a vertical slide, weight and asymmetric Coulomb friction have one effect, except at rest."""
    motor = ab.Motor(inertia=2e-3, gear_ratio=50.0, viscous_friction=1e-3, coulomb_friction=(0.02, -0.03))
    up = ab.Link(name="up", joint=ab.Prismatic(axis=(0, 0, 1)), mass=3.0, motor=motor)
    arm = ab.Arm(ab.Robot(name="lift", links=(up,)))
    moving = noisy_log(arm, 600, noise=0.0)
    rest = np.zeros((600, 1))
    still = {"t": moving["t"], "q": rest, "qd": rest, "qdd": rest, "tau": arm.rne(rest, rest, rest)}
    halves = [{k: v[part] for k, v in moving.items()} for part in (slice(0, 250), slice(250, None))]
    for friction in ("asymmetric", "coulomb"):
        alone = ab.identify(arm, moving, friction=friction)
        for logs in ([moving, still], halves[::-1], [*halves, still]):
            found = ab.identify(arm, logs, friction=friction)
            assert_allclose(found.values, alone.values, rtol=1e-8, atol=1e-8)
    with pytest.raises(InputError, match="decimate = nan"):
        ab.identify(arm, moving, decimate=float("nan"))


def test_logs_are_read_from_files_frames_and_runs(tmp_path: Path) -> None:
    arm = small_arm()
    log = noisy_log(arm, 200)
    expected = ab.identify(arm, log).values
    names = [f"{name}{j + 1}" for name in ("q", "qd", "qdd", "tau") for j in range(3)]
    columns = np.column_stack([log[name] for name in ("q", "qd", "qdd", "tau")])
    path = tmp_path / "log.csv"
    header = ",".join(["t", *names]).replace("q1", "q1 [deg]", 1)
    degrees = columns.copy()
    degrees[:, 0] = np.degrees(degrees[:, 0])
    np.savetxt(
        path, np.column_stack([log["t"], degrees]), delimiter=",", header=header, comments="", fmt="%.17g"
    )
    assert_allclose(ab.identify(arm, path).values, expected, rtol=1e-6, atol=1e-9)
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame({"t": log["t"], **dict(zip(names, columns.T))})
    assert_allclose(ab.identify(arm, frame).values, expected, rtol=1e-9)
    units = frame.rename(columns={"q1": "q1 [deg]"}).assign(comment="none")
    units["q1 [deg]"] = np.degrees(units["q1 [deg]"])
    assert_allclose(ab.identify(arm, units).values, expected, rtol=1e-9, atol=1e-12)
    np.savez(tmp_path / "log.npz", **log)
    assert_allclose(ab.identify(arm, tmp_path / "log.npz").values, expected, rtol=1e-9)
    twice = ab.identify(arm, [log, log])
    assert_allclose(twice.values, expected, rtol=1e-2, atol=1e-3)  # the weights differ slightly
    assert len(twice.time) == 400 and "log" not in twice.notes
    for heads, words in (
        ("q1 [furlong],q2,q3,tau1", "a column has the unit 'furlong'"),
        ("q1 [mm],q2,q3,tau1", "a column has the unit 'mm'. Allowed: units of rad, deg, °, or"),
        (
            "q1,q2 [deg],q3,tau1",
            "column 'q2 .deg.': a column has the unit 'deg'. Allowed: units of m, mm",
        ),
        ("q1 [rad/s],q2,q3,tau1", "the unit 'rad/s'"),
        ("q1,q2,q3,tau1 [N]", "a column has the unit 'N'. Allowed: units of Nm"),
        ("q1,q2,q3,qd1 [rad/min]", "the unit 'rad/min'. Allowed: units of rad, deg, °, divided by s, or"),
        ("q1,q2,q3,q_1", "the columns 'q1' and 'q_1' are both q1"),
    ):
        path.write_text(f"t,{heads},tau2,tau3\n0,1,1,1,1,1,1\n1,1,1,1,1,1,1\n", encoding="utf-8")
        with pytest.raises(InputError, match=words):
            ab.identify(arm, path)


def test_results_are_pickled_and_drawn(tmp_path: Path) -> None:
    arm = small_arm()
    log = noisy_log(arm, 200)
    result = ab.identify(arm, [log, log])
    copy = pickle.loads(pickle.dumps(result))
    assert str(copy) == str(result) and copy.robot == result.robot
    picture = result.plot(save=tmp_path / "torques.svg")
    assert "Force of slide" in (tmp_path / "torques.svg").read_text() and picture.height > 400
    assert result.picture(joints=("wrist",)).height < picture.height
    with pytest.raises(UnknownNameError, match="no joint named 'elbow'"):
        result.picture(joints=("elbow",))
    with pytest.raises(UnknownNameError, match="no base parameter named 'wrist_X'"):
        result["wrist_X"]
    with pytest.raises(InputError, match="a probability between 0 and 1"):
        result.confidence_intervals(95)
    empty = {**log, "tau": np.full_like(log["tau"], np.nan)}
    with pytest.raises(InputError, match="no sample is complete"):
        result.validate(empty)


def test_unsuitable_arguments_are_refused() -> None:
    arm = small_arm()
    log = noisy_log(arm, 200)
    cases: list[tuple[str, dict[str, Any], dict[str, Any]]] = [
        ("no parameter is selected for", {}, {"links": (), "friction": "none", "rotor_inertia": False}),
        ("no kind of friction named 'dry'", {}, {"friction": "dry"}),
        ("a frequency in Hz above 0", {}, {"cutoff": -1.0}),
        ("an integer, 1 or more", {}, {"decimate": 0}),
        ("a speed in rad/s or m/s, 0 or more", {}, {"min_speed": np.nan}),
        ("q has the shape", {"q": log["q"][:, :2]}, {}),
        ("a row for each time, a column for each joint of 'small'", {"tau": log["tau"][:5]}, {}),
        ("the times are missing, not finite or not ascending", {"t": log["t"][::-1]}, {}),
        ("an array of numbers, NaN where", {"q": "fast"}, {}),
        ("complete samples for", {"tau": np.full_like(log["tau"], np.nan)}, {}),
        ("samples below min_speed do not count", {}, {"min_speed": 100.0}),
    ]
    for message, changes, options in cases:
        with pytest.raises(InputError if "named" not in message else UnknownNameError, match=message):
            ab.identify(arm, {**log, **changes}, **options)
    with pytest.raises(InputError, match="there is no log"):
        ab.identify(arm, [])
    with pytest.raises(InputError, match="give a dictionary of arrays, a data frame"):
        ab.identify(arm, {"position": log["q"]})
    with pytest.raises(UnknownNameError, match="no column named 'tau1'"):
        ab.identify(arm, {"t": log["t"], "q": log["q"]})
    with pytest.raises(InputError, match="the columns of q have the numbers 1, 3"):
        ab.identify(arm, {"t": log["t"], "q1": log["t"], "q3": log["t"]})
    uneven = {"t": log["t"] ** 1.3, "q": log["q"], "tau": log["tau"]}
    with pytest.raises(InputError, match="the samples are not equally spaced in time"):
        ab.identify(arm, uneven)
    ball = MIXED_ROBOTS[1]
    with pytest.raises(InputError, match="has a ball joint, and its positions are quaternions"):
        ab.identify(ball, {"t": np.arange(50), "q": np.ones((50, ball.nq)), "tau": np.ones((50, ball.n))})

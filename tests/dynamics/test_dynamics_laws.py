"""Laws of dynamics for any arm: every shipped robot, and random trees of all joint types."""

from dataclasses import replace

import numpy as np
import pytest
from casadi import SX, Function, jacobian, jtimes, vertcat
from numpy.testing import assert_allclose

from armblocks.dynamics import TRACES
from armblocks.dynamics.ball_joints import position_rates
from armblocks.dynamics.joint_motion import entries
from armblocks.robot import Fixed, Link, Robot
from armblocks.spatial import Transform
from robots_for_tests import evaluate, random_states


def rates_of(robot: Robot, q: SX, qd: SX) -> SX:
    """Return dq/dt (nq,)."""
    return SX(vertcat(*position_rates(robot, entries(q), entries(qd))))


def check_close(actual: np.ndarray, expected: np.ndarray, tolerance: float) -> None:
    """Check equality within ``tolerance`` of the largest entry, because single entries may cancel."""
    size = max(1.0, float(np.abs(expected).max(initial=0.0)))
    assert_allclose(actual, expected, rtol=0, atol=tolerance * size)


def test_forward_dynamics_is_the_inverse_of_inverse_dynamics(robot: Robot):
    for q, qd, qdd in random_states(robot):
        tau = evaluate(robot, "rne", q, qd, qdd)
        back = evaluate(robot, "accel", q, qd, tau)
        condition = np.linalg.cond(evaluate(robot, "inertia", q))
        # Rounding errors of tau are multiplied by the condition number of M.
        check_close(back, qdd, max(1e-10, 1e3 * condition * np.finfo(float).eps))


def test_mass_matrix_is_symmetric_and_positive_definite(robot: Robot):
    for q, _, _ in random_states(robot):
        M = evaluate(robot, "inertia", q)
        check_close(M, M.T, 1e-14)
        assert np.linalg.eigvalsh(M).min() > 0


def test_columns_of_the_mass_matrix_are_torques_of_unit_accelerations(robot: Robot):
    zeros = np.zeros(robot.n)
    for q, _, _ in random_states(robot, 2):
        at_rest = evaluate(robot, "rne", q, zeros, zeros)
        columns = [evaluate(robot, "rne", q, zeros, unit) - at_rest for unit in np.eye(robot.n)]
        check_close(evaluate(robot, "inertia", q), np.column_stack(columns), 1e-12)


def test_mass_matrix_rate_minus_twice_coriolis_is_skew_symmetric(robot: Robot):
    traced = TRACES["inertia"](robot)
    q, qd = traced.arguments[0], SX.sym("qd", robot.n)
    rate = Function("Mdot", [q, qd], [jtimes(traced.results[0], q, rates_of(robot, q, qd))])
    for q, v, _ in random_states(robot):
        Mdot = np.asarray(rate(q, v)).reshape(robot.n, robot.n)
        N = Mdot - 2 * evaluate(robot, "coriolis", q, v)
        check_close(N, -N.T, 1e-12)


def test_coriolis_and_gravity_are_the_torque_at_zero_acceleration(robot: Robot):
    frictionless = robot.nofriction()
    for q, qd, qdd in random_states(robot):
        C = evaluate(robot, "coriolis", q, qd)
        g = evaluate(robot, "gravload", q)
        check_close(evaluate(frictionless, "rne", q, qd, 0 * qd), C @ qd + g, 1e-12)
        M = evaluate(robot, "inertia", q)
        friction = evaluate(robot, "friction", qd)
        check_close(evaluate(robot, "rne", q, qd, qdd), M @ qdd + C @ qd + g + friction, 1e-12)


def test_kinetic_energy_is_half_the_quadratic_form_of_the_mass_matrix(robot: Robot):
    for q, qd, _ in random_states(robot):
        expected = 0.5 * qd @ evaluate(robot, "inertia", q) @ qd
        check_close(evaluate(robot, "kinetic_energy", q, qd), expected, 1e-13)


def test_gravity_load_is_the_gradient_of_potential_energy(robot: Robot):
    traced = TRACES["potential_energy"](robot)
    (symbol,), qd = traced.arguments, SX.sym("qd", robot.n)
    power = jtimes(traced.results[0], symbol, rates_of(robot, symbol, qd))
    rates = Function("g", [symbol, qd], [jacobian(power, qd)])
    for q, v, _ in random_states(robot):
        check_close(evaluate(robot, "gravload", q), np.asarray(rates(q, 0 * v)).ravel(), 1e-12)


def test_power_of_the_torques_is_the_time_derivative_of_energy(robot: Robot):
    frictionless = robot.nofriction()
    T, V = TRACES["kinetic_energy"](frictionless), TRACES["potential_energy"](frictionless)
    q, qd = T.arguments
    (q_of_V,) = V.arguments
    qdd = SX.sym("qdd", robot.n)
    kinetic = jtimes(T.results[0], q, rates_of(robot, q, qd)) + jtimes(T.results[0], qd, qdd)
    rate = Function("Edot", [q, qd, qdd], [kinetic])
    potential_power = Function(
        "Vdot", [q_of_V, qd], [jtimes(V.results[0], q_of_V, rates_of(robot, q_of_V, qd))]
    )
    for position, speed, acceleration in random_states(robot):
        power = evaluate(frictionless, "rne", position, speed, acceleration) @ speed
        change = float(rate(position, speed, acceleration)) + float(potential_power(position, speed))
        assert power == pytest.approx(change, rel=1e-11, abs=1e-9)


def test_energy_stays_constant_without_friction(robot: Robot):
    frictionless = robot.nofriction()
    random = np.random.default_rng(3)
    q, qd = robot.neutral + random.uniform(-0.5, 0.5, robot.nq), random.uniform(-0.5, 0.5, robot.n)
    no_torque = np.zeros(robot.n)

    def energy() -> float:
        return float(
            evaluate(frictionless, "kinetic_energy", q, qd) + evaluate(frictionless, "potential_energy", q)
        )

    def rates(q: np.ndarray, qd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rates = evaluate(frictionless, "position_rates", q, qd)
        return rates, evaluate(frictionless, "accel", q, qd, no_torque)

    start, h = energy(), 5e-4
    max_kinetic_energy = float(evaluate(frictionless, "kinetic_energy", q, qd))
    for _ in range(100):
        a1, b1 = rates(q, qd)
        a2, b2 = rates(q + h / 2 * a1, qd + h / 2 * b1)
        a3, b3 = rates(q + h / 2 * a2, qd + h / 2 * b2)
        a4, b4 = rates(q + h * a3, qd + h * b3)
        q, qd = q + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4), qd + h / 6 * (b1 + 2 * b2 + 2 * b3 + b4)
        max_kinetic_energy = max(max_kinetic_energy, float(evaluate(frictionless, "kinetic_energy", q, qd)))
    # A fourth-order method with h = 0.5 ms has an error of 1e-9 of the exchanged energy.
    assert abs(energy() - start) < 1e-8 * max_kinetic_energy


def test_potential_energy_is_that_of_the_total_mass_at_the_centre_of_mass(robot: Robot):
    mass = sum(link.mass for link in robot.links)
    for q, _, _ in random_states(robot):
        expected = -mass * np.array(robot.gravity) @ evaluate(robot, "centre_of_mass", q)
        check_close(evaluate(robot, "potential_energy", q), expected, 1e-13)


def test_centre_of_mass_is_the_weighted_mean_of_the_links(robot: Robot):
    mass = np.array([link.mass for link in robot.links])
    for q, _, _ in random_states(robot, 2):
        poses = evaluate(robot, "link_poses", q)[1:-1]
        centres = np.array([T[:3, :3] @ link.r + T[:3, 3] for T, link in zip(poses, robot.links)])
        check_close(evaluate(robot, "centre_of_mass", q), mass @ centres / mass.sum(), 1e-13)


def test_torque_of_a_tip_wrench_is_the_transposed_jacobian_of_the_last_link(robot: Robot):
    at_link = replace(robot, tool=Transform())
    random = np.random.default_rng(5)
    for q, qd, qdd in random_states(robot, 2):
        wrench = random.uniform(-20, 20, 6)
        load = evaluate(robot, "rne_loaded", q, qd, qdd, wrench, np.zeros(10))
        free = evaluate(robot, "rne", q, qd, qdd)
        check_close(load - free, evaluate(at_link, "jacobe", q).T @ wrench, 1e-11)


def test_payload_equals_a_fixed_link_of_the_same_mass_at_the_tool(robot: Robot):
    random = np.random.default_rng(6)
    mass, centre = 12.0, random.uniform(-0.2, 0.2, 3)
    second = np.array((0.4, 0.5, 0.6, 0.01, -0.02, 0.03))
    grown = replace(
        robot,
        links=(
            *robot.links,
            Link(
                name="payload",
                parent=robot.links[-1].name,
                joint=Fixed(),
                before=robot.tool,
                mass=mass,
                centre_of_mass=centre,
                inertia=second,
            ),
        ),
    )
    payload = np.concatenate(([mass], centre, second))
    for q, qd, qdd in random_states(robot, 2):
        no_wrench = np.zeros(6)
        loaded = evaluate(robot, "rne_loaded", q, qd, qdd, no_wrench, payload)
        check_close(loaded, evaluate(grown, "rne", q, qd, qdd), 1e-11)
        back = evaluate(robot, "accel_loaded", q, qd, loaded, no_wrench, payload)
        condition = np.linalg.cond(evaluate(grown, "inertia", q))
        check_close(back, qdd, max(1e-10, 1e3 * condition * np.finfo(float).eps))


def test_loaded_functions_without_load_equal_the_unloaded_ones(robot: Robot):
    for q, qd, tau in random_states(robot, 2):
        no_load = (np.zeros(6), np.zeros(10))
        check_close(
            evaluate(robot, "rne_loaded", q, qd, tau, *no_load), evaluate(robot, "rne", q, qd, tau), 1e-11
        )
        expected = evaluate(robot, "accel", q, qd, tau)
        condition = np.linalg.cond(evaluate(robot, "inertia", q))
        tolerance = max(1e-10, 1e3 * condition * np.finfo(float).eps)
        check_close(evaluate(robot, "accel_loaded", q, qd, tau, *no_load), expected, tolerance)

"""Runs compared with closed forms, SciPy and published numbers; choice of solver, Ctrl-C and progress."""

from __future__ import annotations

import signal
import time

import casadi as ca
import numpy as np
import pytest
from casadi import SX
from scipy.integrate import solve_ivp
from scipy.special import ellipk
from small_systems import oscillator, scalar, states_of, system, van_der_pol_pid

from armblocks.equations import SimulationOptions
from armblocks.equations import signature as layout
from armblocks.integration.system import CompiledSystem, compile_system
from armblocks.simulation import SimulationResult, find_tableau, simulate

OSCILLATOR = compile_system(oscillator())
VAN_DER_POL = compile_system(van_der_pol_pid())


def pendulum() -> CompiledSystem:
    """IFToMM benchmark A01: 1 kg on a massless rod of 1 m, released horizontally; angle 0 is downwards."""
    return compile_system(
        system(
            "pendulum",
            states=states_of("pendulum/q", "pendulum/qd"),
            signals=layout(
                ("pendulum/p", (2,), "m"), ("pendulum/v", (2,), "m/s"), ("pendulum/energy", (), "J")
            ),
            derivative=lambda t, x, p: ca.vertcat(x[1], -9.81 * ca.sin(x[0])),
            outputs=lambda t, x, p: ca.vertcat(
                ca.sin(x[0]),
                -ca.cos(x[0]),
                x[1] * ca.cos(x[0]),
                x[1] * ca.sin(x[0]),
                x[1] ** 2 / 2 - 9.81 * ca.cos(x[0]),
            ),
            initial=(-np.pi / 2, 0.0),
        )
    )


def test_an_oscillator_agrees_with_its_closed_form_at_every_sample() -> None:
    result = simulate(OSCILLATOR, SimulationOptions(stop_time=20.0, rtol=1e-10, atol=1e-12))
    assert result.time.shape == (1001,)
    # 100 rtol after 6 periods
    np.testing.assert_allclose(result["mass/x"], np.cos(2 * result.time), atol=2e-8)
    np.testing.assert_allclose(result["mass/v"], -2 * np.sin(2 * result.time), atol=4e-8)


def test_a_pendulum_reaches_the_published_states() -> None:
    """Reference values to 15 digits at 1, 2, 5 and 10 s."""
    published = {
        1.0: (0.98629175113187532, -0.16501085312554117, 0.29690551591631582, 1.7746436411126556),
        2.0: (-0.79356619534332175, -0.60848393044379151, -2.1024378744361258, 2.7419353930105091),
        5.0: (-0.94230543504375734, -0.33475433841400058, 0.85790425688594907, -2.4149286543704886),
        10.0: (-0.27508746257611686, -0.96141920509912506, 4.1755981009517288, -1.1947490545604753),
    }
    options = SimulationOptions(stop_time=10.0, solver="dop853", rtol=1e-13, atol=1e-14, sample_time=1.0)
    result = simulate(pendulum(), options)
    for t, expected in published.items():
        row = int(t)
        assert result.time[row] == t
        state = np.concatenate([result["pendulum/p"][row], result["pendulum/v"][row]])
        np.testing.assert_allclose(state, expected, atol=2e-11)
    assert np.ptp(result["pendulum/energy"]) < 1e-10


def test_a_pendulum_has_the_exact_period_and_constant_energy() -> None:
    period = 4 * ellipk(0.5) / np.sqrt(9.81)
    options = SimulationOptions(stop_time=period, rtol=1e-12, atol=1e-12)
    result = simulate(pendulum(), options)
    np.testing.assert_allclose(result["pendulum/p"][-1], (-1.0, 0.0), atol=1e-10)
    assert period == pytest.approx(2.3678419475762374493, abs=1e-15)


@pytest.mark.parametrize(("solver", "method"), [("rk45", "RK45"), ("rk23", "RK23"), ("dop853", "DOP853")])
def test_steps_and_evaluations_of_van_der_pol_equal_those_of_scipy(solver: str, method: str) -> None:
    """With equal steps, evaluations and results, the benchmarks compare the speed of the same computation."""

    def f(t: float, x: np.ndarray) -> list[float]:
        e = np.sin(2 * np.pi * 0.1 * t) - x[0]
        return [x[1], (1 - x[0] ** 2) * x[1] - x[0] + 2 * e + 0.5 * x[2] - 0.5 * x[1], e]

    stop = 100.0 if solver == "rk45" else 10.0
    expected = solve_ivp(f, (0, stop), [1.0, 0, 0], method=method, rtol=1e-6, atol=1e-9)
    result = simulate(VAN_DER_POL, SimulationOptions(stop_time=stop, solver=solver, sample_time=stop))
    assert result.run.steps == expected.t.size - 1
    assert result.run.evaluations == expected.nfev
    np.testing.assert_allclose(result.states[-1], expected.y[:, -1], rtol=1e-8, atol=1e-10)
    if solver == "rk45":
        assert (result.run.steps + 1, result.run.evaluations) == (894, 6722)
        assert result["position"][-1] == pytest.approx(-0.106502307, abs=1e-9)


def test_dense_output_has_the_accuracy_of_the_steps() -> None:
    options = SimulationOptions(stop_time=10.0, rtol=1e-8, atol=1e-10)
    fine = simulate(OSCILLATOR, options)
    error = np.abs(fine["mass/x"] - np.cos(2 * fine.time))
    assert fine.run.steps < 300 < fine.time.size  # most samples are between steps
    assert error.max() < 5e-7


def jumping() -> CompiledSystem:
    """A step source with a jump of 1 at 0.35 s, and its integral."""

    def step(t: SX, p: SX) -> SX:
        return ca.if_else(t < p, SX(0), SX(1))

    return compile_system(
        system(
            "jump",
            states=states_of("integrator/x"),
            signals=layout(("step/y", ()), ("integrator/y", ())),
            derivative=lambda t, x, p: step(t, p),
            outputs=lambda t, x, p: ca.vertcat(step(t, p), x),
            initial=(0.0,),
            parameters=layout(("step.time", ())),
            values=(0.35,),
            breakpoints=lambda p: [p[0]],
        )
    )


@pytest.mark.parametrize("solver", ["euler", "rk4", "rk45", "dop853"])
def test_steps_end_at_a_jump_and_the_new_value_holds_at_its_time(solver: str) -> None:
    """The integral of a step is exact for every method because no integrator step crosses the jump."""
    result = simulate(jumping(), SimulationOptions(stop_time=1.0, solver=solver, sample_time=0.05))
    np.testing.assert_allclose(result["integrator/y"], np.maximum(result.time - 0.35, 0), atol=1e-15)
    assert result["step/y"].tolist() == (result.time >= 0.35).astype(float).tolist()
    moved = simulate(jumping(), SimulationOptions(stop_time=1.0, solver=solver), {"step.time": 0.7123})
    assert moved["integrator/y"][-1] == pytest.approx(1 - 0.7123, abs=1e-15)


def test_a_system_without_states_is_evaluated_directly() -> None:
    clock = compile_system(
        system(
            "clock",
            signals=layout(("clock/y", (), "s"), ("pose/T", (2, 2))),
            outputs=lambda t, x, p: ca.vertcat(t, ca.cos(t), -ca.sin(t), ca.sin(t), ca.cos(t)),
        )
    )
    result = simulate(clock, SimulationOptions(stop_time=10.0))
    assert result.run.solver == "none"
    assert "no states" in result.run.reason
    assert result.run.steps == result.run.evaluations == 0
    assert result.time.shape == (1001,)
    assert result.time[7] == 7 * (10.0 / 1000)
    np.testing.assert_array_equal(result["clock/y"], result.time)
    assert result["pose/T"].shape == (1001, 2, 2)
    np.testing.assert_allclose(result["pose/T"][:, 0, 1], -np.sin(result.time), atol=1e-15)


def test_the_run_report_has_the_solver_and_the_reason_of_its_choice() -> None:
    automatic = simulate(OSCILLATOR, SimulationOptions(stop_time=1.0)).run
    assert automatic.solver == "rk45"
    assert "auto" in automatic.reason
    stepped = simulate(OSCILLATOR, SimulationOptions(stop_time=1.0, step=0.01)).run
    assert (stepped.solver, stepped.steps) == ("rk4", 100)
    assert "step was given" in stepped.reason
    requested = simulate(OSCILLATOR, SimulationOptions(stop_time=1.0, solver="ODE23")).run
    assert requested.solver == "rk23"
    assert "requested" in requested.reason
    assert requested.real_time_factor == pytest.approx(1.0 / requested.wall_time)


def test_stop_time_zero_gives_one_sample() -> None:
    for solver in ("rk45", "rk4"):
        result = simulate(OSCILLATOR, SimulationOptions(stop_time=0.0, solver=solver))
        assert result.time.tolist() == [0.0]
        assert result["mass/x"].tolist() == [1.0]
        assert result.run.complete


def test_max_step_bounds_every_step() -> None:
    result = simulate(OSCILLATOR, SimulationOptions(stop_time=1.0, rtol=1e-2, atol=1e-2, max_step=0.001))
    assert result.run.steps >= 1000


def test_parameters_change_a_run_and_are_part_of_the_result() -> None:
    options = SimulationOptions(stop_time=3.0, rtol=1e-9, atol=1e-12)
    fast = simulate(OSCILLATOR, options, {"mass.omega": 5.0})
    flat = simulate(OSCILLATOR, options, np.array([5.0]))
    np.testing.assert_allclose(fast["mass/x"], np.cos(5 * fast.time), atol=1e-6)
    assert fast.signals.tobytes() == flat.signals.tobytes()
    assert fast.parameters["mass.omega"] == 5.0
    assert OSCILLATOR.parameter_values.tolist() == [2.0]


def test_progress_is_reported_until_the_end() -> None:
    reported: list[tuple[float, float, float]] = []
    result = simulate(
        OSCILLATOR,
        SimulationOptions(stop_time=50.0, solver="rk4", step=5e-5),
        progress=lambda *values: reported.append(values),
    )
    times, fractions, factors = np.array(reported).T
    assert times[-1] == 50.0
    assert fractions[-1] == 1.0
    assert np.all(np.diff(times) >= 0)
    assert np.all(factors > 0)
    assert len(reported) <= 2 + result.run.wall_time * 17


def test_ctrl_c_returns_the_computed_samples_marked_as_incomplete() -> None:
    def interrupt(time: float, fraction: float, factor: float) -> None:
        raise KeyboardInterrupt

    options = SimulationOptions(stop_time=1e4, solver="rk4", step=1e-4, sample_time=0.5)
    result = simulate(OSCILLATOR, options, progress=interrupt)
    assert not result.run.complete
    assert "Ctrl-C" in result.run.message
    assert "of 10000 s" in result.run.message
    assert 0 < result.time.size < 20001
    np.testing.assert_allclose(result["mass/x"], np.cos(2 * result.time), atol=1e-6)
    whole = simulate(OSCILLATOR, SimulationOptions(stop_time=5.0, solver="rk4", step=1e-4, sample_time=0.5))
    count = min(result.time.size, whole.time.size)
    assert result.states[:count].tobytes() == whole.states[:count].tobytes()


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="POSIX timers")
def test_a_unix_signal_ends_a_long_native_run_promptly() -> None:
    def interrupt(number: int, frame: object) -> None:
        raise KeyboardInterrupt

    previous = signal.signal(signal.SIGALRM, interrupt)
    try:
        OSCILLATOR.integrator(find_tableau("rk4"))
        used = time.process_time()
        signal.setitimer(signal.ITIMER_REAL, 0.15)
        options = SimulationOptions(stop_time=1e6, solver="rk4", step=1e-4, sample_time=1.0)  # takes minutes
        result = simulate(OSCILLATOR, options)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, previous)
    assert not result.run.complete
    assert time.process_time() - used < 5.0  # the whole run takes minutes


def test_runs_repeat_bit_for_bit() -> None:
    def run() -> SimulationResult:
        return simulate(VAN_DER_POL, SimulationOptions(stop_time=30.0))

    assert run().signals.tobytes() == run().signals.tobytes()


def test_sample_times_have_no_accumulated_rounding_error() -> None:
    """After a million samples of 0.1 s the time is 1e5 s up to one rounding error."""
    constant_system = compile_system(scalar("still", lambda t, x, p: SX(0) * x, 1.0))
    options = SimulationOptions(stop_time=1e5, solver="euler", step=0.1, sample_time=0.1)
    result = simulate(constant_system, options)
    assert result.time.size == 1_000_001
    assert result.time[-1] == 1e5
    assert result.time[654_321] == 654_321 * 0.1
    assert result.run.steps == 1_000_000

"""Stiff systems: known problems, events and ticks, implicit equations, the automatic choice."""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from hybrid_systems import column, hybrid, loop_of_cosine
from scipy.integrate import solve_ivp
from small_systems import scalar
from stiff_systems import (
    KINETICS,
    ROBERTSON_END,
    VAN_DER_POL_END,
    ball_on_fast_plate,
    heat,
    kinetics,
    pendulum,
    robertson,
    robertson_dae,
    van_der_pol,
)

from armblocks.equations import SimulationOptions
from armblocks.errors import SimulationError
from armblocks.integration.system import compile_system
from armblocks.simulation import RunState, simulate
from armblocks.simulation.methods.rosenbrock import RODAS5P
from armblocks.simulation.methods.runge_kutta import RK45

ROBERTSON = compile_system(robertson())
VAN_DER_POL = compile_system(van_der_pol(1000.0))
STIFF_LAG = compile_system(scalar("lag", lambda t, x, p: -1e6 * (x - ca.cos(t)), 1.0))


@pytest.mark.parametrize(("rtol", "error"), [(1e-4, 1e-4), (1e-6, 2e-6), (1e-9, 2e-9)])
def test_robertson_at_1e11_seconds_agrees_with_the_published_state(rtol: float, error: float) -> None:
    """The accuracy is near the tolerance, with at most 1500 steps over 11 decades of time."""
    options = SimulationOptions(stop_time=1e11, solver="rodas5p", rtol=rtol, atol=rtol * 1e-8)
    result = simulate(ROBERTSON, options)
    np.testing.assert_allclose(result["y"][-1], ROBERTSON_END, rtol=error)
    assert result.run.steps < 1500
    # The equations conserve the sum of the three substances, and so does every Rosenbrock method.
    np.testing.assert_allclose(result["y"].sum(axis=1), 1.0, rtol=1e-12)


def test_robertson_with_an_implicit_conservation_law_agrees_with_the_published_state() -> None:
    options = SimulationOptions(stop_time=1e11, solver="rodas5p", rtol=1e-6, atol=1e-14)
    result = simulate(compile_system(robertson_dae()), options)
    actual = np.array([result[name][-1] for name in "abc"])
    np.testing.assert_allclose(actual, ROBERTSON_END, rtol=1e-5)
    total = result["a"] + result["b"] + result["c"]
    np.testing.assert_allclose(total, 1.0, rtol=1e-15)  # solved at every sample, without drift


@pytest.mark.parametrize(("rtol", "error"), [(1e-4, 1e-3), (1e-6, 1e-6), (1e-9, 1e-9)])
def test_van_der_pol_with_mu_1000_agrees_with_the_published_state(rtol: float, error: float) -> None:
    options = SimulationOptions(stop_time=2000.0, solver="rodas5p", rtol=rtol, atol=rtol * 1e-3)
    result = simulate(VAN_DER_POL, options)
    np.testing.assert_allclose(result["y"][-1], VAN_DER_POL_END, rtol=error)


@pytest.mark.parametrize("name", list(KINETICS))
def test_chemical_kinetics_agree_with_radau(name: str) -> None:
    """SciPy's Radau at 1e-9 is an independent method; its error is a thousandth of the allowed difference."""
    rates, start, stop = KINETICS[name]
    system = compile_system(kinetics(name))
    expected = solve_ivp(
        lambda t, y: rates(y), (0, stop), start, method="Radau", rtol=1e-9, atol=1e-14, dense_output=True
    ).sol
    # The method of order 2 is less accurate at the steep fronts of the oscillator.
    for solver, rtol, allowed in (("rodas5p", 1e-8, 2e-6), ("ros23", 1e-6, 5e-3)):
        result = simulate(system, SimulationOptions(stop_time=stop, solver=solver, rtol=rtol, atol=1e-12))
        time = result.time[::100]
        np.testing.assert_allclose(result["y"][::100], expected(time).T, rtol=allowed, atol=1e-9)


def test_heat_in_a_rod_of_500_states_decays_at_the_known_rate() -> None:
    """The fastest rate is 1e6 1/s: few steps, each with work proportional to the number of states."""
    rod, mode, rate = heat(500)
    compiled = compile_system(rod)
    result = simulate(compiled, SimulationOptions(stop_time=0.3, solver="rodas5p", rtol=1e-8, atol=1e-12))
    expected = np.exp(-rate * result.time)[:, np.newaxis] * mode
    np.testing.assert_allclose(result["y"], expected, atol=3e-8)
    assert result.run.steps < 100
    layout = compiled.integrator(RODAS5P).layout
    assert layout is not None and layout.plan is not None
    assert layout.plan.filled == 500 + 2 * 499  # no fill-in


def test_a_pendulum_of_index_1_reaches_the_exact_state() -> None:
    """Elliptic functions give the values at 10 s; only the rod force keeps the length of the rod."""
    result = simulate(
        compile_system(pendulum()),
        SimulationOptions(stop_time=10.0, solver="rodas5p", rtol=1e-10, atol=1e-12),
    )
    expected = [-0.27508746257611686, -0.96141920509912506, 4.1755981009517288, -1.1947490545604753]
    actual = [result[name][-1] for name in ("x", "y", "vx", "vy")]
    np.testing.assert_allclose(actual, expected, atol=1e-6)  # 10 s with a tolerance of 1e-10 per step
    np.testing.assert_allclose(result["x"] ** 2 + result["y"] ** 2, 1.0, atol=1e-7)


def test_an_implicit_equation_is_solved_at_every_stage() -> None:
    result = simulate(compile_system(loop_of_cosine()), SimulationOptions(stop_time=1.0, solver="rodas5p"))
    np.testing.assert_allclose(result["loop/u"], 0.7390851332151607, rtol=1e-14)


def test_an_implicit_equation_that_becomes_singular_is_reported() -> None:
    """``w^2 = x`` with ``x = 1 - t``: at 1 s the two solutions coincide, and later there is none."""
    without_later_solution = hybrid(
        "ending",
        states=("tank/x",),
        algebraic=("root/w",),
        signals=("x", "w"),
        x0=(1.0,),
        w0=(1.0,),
        derivative=lambda t, x, z, w, p: column(-1.0 + 0.0 * w),
        outputs=lambda t, x, z, w, p: column(x, w),
        residual=lambda t, x, z, w, p: w * w - x,
    )
    with pytest.raises(
        SimulationError, match="no solution of the implicit equations of the loop through 'root'"
    ) as error:
        simulate(compile_system(without_later_solution), SimulationOptions(stop_time=2.0, solver="rodas5p"))
    partial_result = error.value.partial
    assert partial_result is not None
    np.testing.assert_allclose(partial_result["w"], np.sqrt(1.0 - partial_result.time), atol=1e-6)  # pyright: ignore


@pytest.mark.parametrize("solver", ["rodas5p", "ros23"])
def test_events_and_ticks_are_at_the_known_times_with_stiff_methods(solver: str) -> None:
    """A ball with known bounce times, and samples of a lag of 1e-4 s that follows its height."""
    impacts = [0.451523640985731, 1.08365673836575, 1.52614990653177]
    system = compile_system(ball_on_fast_plate())
    options = SimulationOptions(stop_time=1.6, solver=solver, sample_time=0.01, rtol=1e-9, atol=1e-11)
    result = simulate(system, options)
    assert result.run.ticks == 17
    assert result.run.events == 3
    last = np.unique(result["last"])
    np.testing.assert_allclose(last[1:], impacts, atol=1e-9)
    # Far from a bounce the lag has the error v / rate.
    at = np.searchsorted(result.time, 0.3 - 1e-9)
    behind = result["h"][at] - result["v"][at] / 1e4
    assert result["lag"][at] == pytest.approx(behind, abs=1e-6)
    assert result["hold"][at] == result["lag"][at]


# Implicit Euler linearises its input, with an error of h^2 / 2 for the cosine.
@pytest.mark.parametrize(("solver", "error"), [("ros5", 2e-6), ("implicit_euler", 5.1e-5)])
def test_fixed_steps_may_exceed_the_stability_limit_of_explicit_methods(solver: str, error: float) -> None:
    """Steps of 0.01 s for a lag of 1e-6 s: the output equals the input up to the order of the method."""
    result = simulate(STIFF_LAG, SimulationOptions(stop_time=2.0, solver=solver, step=0.01))
    assert result.run.steps == 200
    np.testing.assert_allclose(result["block/y"], np.cos(result.time), atol=error)


def test_an_initially_infinite_jacobian_does_not_end_the_run() -> None:
    """``x' = 1 - sqrt(x)`` from 0, where the Jacobian is infinite; ``t = -2 (s + log(1 - s))``, s² = x."""
    tank = compile_system(scalar("tank", lambda t, x, p: 1.0 - ca.sqrt(x), 0.0))
    result = simulate(tank, SimulationOptions(stop_time=3.0, solver="rodas5p", rtol=1e-8, atol=1e-12))
    s = np.sqrt(result["block/y"])
    np.testing.assert_allclose(-2.0 * (s + np.log1p(-s)), result.time, atol=1e-5)


def test_auto_changes_to_the_stiff_method_and_reports_it() -> None:
    result = simulate(STIFF_LAG, SimulationOptions(stop_time=10.0))
    assert result.run.solver == "rk45, then rodas5p"
    assert result.run.reason.startswith("auto: Dormand-Prince 5(4) until 0.0")
    assert "then Rodas5P 5(4), because the system is stiff" in result.run.reason
    assert result.run.message == ""
    assert result.run.steps < 10_000  # the explicit method needs three million
    np.testing.assert_allclose(result["block/y"], np.cos(result.time), atol=1e-5)


def test_auto_stays_explicit_if_stability_does_not_limit_the_steps() -> None:
    """Here ``max_step`` limits the steps: many steps, none at the limit of stability."""
    nonstiff = compile_system(scalar("quiet", lambda t, x, p: ca.cos(t) - x, 0.0))
    result = simulate(nonstiff, SimulationOptions(stop_time=100.0, max_step=0.01))
    assert result.run.steps >= 10_000
    assert result.run.solver == "rk45"
    assert "no stiffness was detected" in result.run.reason


@pytest.mark.parametrize("cuts", [[0.001], [0.03, 0.5], [0.02, 0.3, 0.6]])
def test_an_interrupted_automatic_run_gives_the_same_bits(cuts: list[float], tmp_path: Path) -> None:
    """Interruptions before the change of the method, after it, and both."""

    def options(stop: float) -> SimulationOptions:
        return SimulationOptions(stop_time=stop, sample_time=0.0005)

    whole = simulate(STIFF_LAG, options(1.0))
    assert whole.run.solver == "rk45, then rodas5p"
    state: RunState | None = None
    for stop in cuts:
        state = simulate(STIFF_LAG, options(stop), initial_state=state).final_state
        assert state is not None
        state.save(tmp_path / "state")
        state = RunState.load(tmp_path / "state")
    rest = simulate(STIFF_LAG, options(1.0), initial_state=state)
    assert "exactly as the previous run" in rest.run.reason
    if cuts[-1] > 0.03:
        assert rest.run.solver == "rodas5p"
        assert "because the previous run detected stiffness" in rest.run.reason
    common_samples = np.isin(whole.time, rest.time)
    assert common_samples.sum() > 700
    assert (
        rest.signals[:, np.isin(rest.time, whole.time)].tobytes()
        == whole.signals[:, common_samples].tobytes()
    )


def test_pauses_between_steps_do_not_move_the_change_of_the_method() -> None:
    """The loop requests the other method at the same step for any number of steps per call."""
    native = STIFF_LAG.integrator(RK45)
    times = []
    for chunk in (10**6, 777, 1000):
        run = native.begin(
            np.array([1.0]), np.empty(0), np.array([0.0, 10.0]), np.empty(0), detect_stiffness=True
        )
        while not run.other_method_faster:
            run.advance(chunk)
        times.append((run.time, run.accepted))
    assert times[0] == times[1] == times[2]


def test_unbounded_growth_with_a_stiff_method_is_reported_with_its_time() -> None:
    unbounded = compile_system(scalar("blow_up", lambda t, x, p: x * x, 1.0))
    with pytest.raises(SimulationError, match="the step became as small as the rounding") as error:
        simulate(unbounded, SimulationOptions(stop_time=2.0, solver="rodas5p"))
    text = str(error.value)
    assert "'block/x'" in text
    time = float(text.split("rounding of the time at ")[1].split(" s")[0])
    assert time == pytest.approx(1.0, abs=1e-3)


def test_a_root_of_a_negative_number_is_reported_with_a_stiff_method() -> None:
    falling = compile_system(scalar("falling", lambda t, x, p: -ca.sqrt(1.0 - t) - 1e3 * x, 1.0))
    with pytest.raises(SimulationError, match="the derivative of state 'block/x' is not finite at 1"):
        simulate(falling, SimulationOptions(stop_time=2.0, solver="rodas5p"))

"""Clocks, events and implicit equations in runs, compared with closed forms."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hybrid_systems import (
    bouncing_ball,
    column,
    hybrid,
    loop_of_cosine,
    relay_oscillator,
    sampled_loop,
    stick_slip,
    tick_recorder,
)

from armblocks.equations import HybridSystem, SimulationOptions
from armblocks.errors import SimulationError
from armblocks.integration.run_point import RunPoint
from armblocks.integration.system import cached_system, compile_system
from armblocks.simulation import SimulationResult, find_tableau, simulate

SOLVERS = [("rk45", None), ("dop853", None), ("tsit5", None), ("rk23", None), ("rk4", 0.01), ("heun", 0.004)]


def run(
    system: HybridSystem, stop: float, sample_time: float | None = None, **more: object
) -> SimulationResult:
    options = SimulationOptions(stop_time=stop, sample_time=sample_time, **more)  # pyright: ignore
    return simulate(compile_system(system), options)


# The ball: t1 = sqrt(2 h / g), then intervals 2 e^k v1 / g, whose sum ends at t1 + 2 e v1 / (g (1 - e)).


@pytest.mark.parametrize(("solver", "step"), SOLVERS)
def test_a_ball_bounces_at_the_known_times(solver: str, step: float | None) -> None:
    result = run(bouncing_ball(), 1.6, 1e-3, solver=solver, step=step)
    times = np.unique(result["ball/last"])[1:]
    np.testing.assert_allclose(
        times, [0.451523640985731, 1.08365673836575, 1.52614990653177], rtol=0, atol=1e-9
    )
    assert result.run.events == 3
    assert result["ball/h"].min() > -1e-14


def test_a_ball_thrown_upwards_bounces_at_the_known_times() -> None:
    result = run(bouncing_ball(0.8, 10.0, 15.0), 10.0, 1e-2)
    times = np.unique(result["ball/last"])[1:]
    np.testing.assert_allclose(
        times, [3.62111698794949, 6.96842098824054, 9.64626418847337], rtol=0, atol=1e-9
    )


@pytest.mark.parametrize(("solver", "step"), SOLVERS)
@pytest.mark.parametrize("restitution", [0.1, 0.5, 0.7, 0.9])
def test_infinitely_many_bounces_end_the_run_with_an_error(
    restitution: float, solver: str, step: float | None
) -> None:
    """The ball stays above the floor until the error, also with loose tolerances and long steps."""
    first = np.sqrt(2 / 9.81)
    zeno = first + 2 * restitution * first / (1 - restitution)
    with pytest.raises(SimulationError, match="block 'ball' causes events without end at") as caught:
        run(bouncing_ball(restitution), 10.0, solver=solver, step=step, rtol=1e-3, atol=1e-3)
    assert "give 'ball' a hysteresis" in str(caught.value)
    partial = caught.value.partial
    assert isinstance(partial, SimulationResult)
    assert zeno - 0.011 < partial.time[-1] <= zeno
    assert partial["ball/h"].min() > -1e-9


def test_chattering_is_reported_with_its_block() -> None:
    """``x' = -sign(x)`` without hysteresis: the relay switches forever at x = 0."""
    system = hybrid(
        "chatter",
        states=("plant/x",),
        discrete=("relay/mode",),
        signals=("plant/x",),
        x0=(1.0,),
        z0=(1.0,),
        guards=(("relay", 0),),
        derivative=lambda t, x, z, w, p: -z,
        outputs=lambda t, x, z, w, p: x,
        guard=lambda t, x, z, w, p: x,
        reset=lambda t, x, z, w, p, e: (x, e),
    )
    with pytest.raises(SimulationError, match=r"block 'relay' causes events without end at 1\.0"):
        run(system, 2.0)


def test_two_guards_of_one_state_that_fire_together_are_processed_once() -> None:
    system = hybrid(
        "flip",
        discrete=("flip/a",),
        signals=("flip/a",),
        z0=(1.0,),
        clocks=((1.0, 0.5),),
        guards=(("flip", 0), ("flop", 0)),
        outputs=lambda t, x, z, w, p: z,
        update=lambda t, x, z, w, p, m: -z,
        guard=lambda t, x, z, w, p: column(z[0], z[0]),
        reset=lambda t, x, z, w, p, e: (x, ca.if_else(e[0] != 0, -z, -z)),
    )
    # Both guards fire at the tick and the reset restores the sign, so that no further event follows.
    assert run(system, 1.0, 0.25)["flip/a"].tolist() == [1.0, 1.0, 1.0, 1.0, 1.0]


def test_a_relay_oscillates_with_the_known_period() -> None:
    result = run(relay_oscillator(), 10.0, 0.25)
    t = result.time
    np.testing.assert_allclose(result["plant/x"], 0.5 - np.abs((t + 0.5) % 2 - 1), atol=1e-12)
    assert result.run.events == 10
    # Signals are right-continuous: at the switching time the relay has its new value.
    assert result["relay/y"][[0, 1, 2, 3]].tolist() == [-1.0, -1.0, 1.0, 1.0]


def test_a_mass_is_exactly_at_rest_until_it_breaks_away_at_the_known_time() -> None:
    result = run(stick_slip(), 3.0, 0.25)
    assert result["mass/last"][-1] == pytest.approx(1.5, rel=1e-15)
    resting = result.time < 1.5
    assert not result["mass/v"][resting].any()
    slid = result.time[-1] - 1.5  # F - mu N = 2 t - 2 = 1 + 2 s, with the time s after the break-away
    assert result["mass/v"][-1] == pytest.approx(slid + slid**2, abs=1e-12)


# Clocks.


@pytest.mark.parametrize(("solver", "step"), SOLVERS)
def test_a_sampled_loop_agrees_with_its_recursion(solver: str, step: float | None) -> None:
    result = run(sampled_loop(0.25), 5.0, 0.25, solver=solver, step=step)
    np.testing.assert_allclose(result["plant/x"], 0.75 ** np.arange(21), rtol=1e-13)
    assert result["hold/y"].tolist() == result["plant/x"].tolist()
    assert result.run.ticks == 21


def test_sampled_values_of_a_decay_agree_with_its_exponential() -> None:
    """``x' = -x`` sampled with period T: ``x_k = exp(-k T)``, held between ticks."""
    system = hybrid(
        "decay",
        states=("plant/x",),
        discrete=("hold/y",),
        signals=("plant/x", "hold/y"),
        x0=(1.0,),
        z0=(0.0,),
        clocks=((0.1, 0.05),),
        derivative=lambda t, x, z, w, p: -x,
        outputs=lambda t, x, z, w, p: column(x, z),
        update=lambda t, x, z, w, p, m: x,
    )
    result = run(system, 2.0, 0.05, rtol=1e-10, atol=1e-12)
    ticks = np.floor((result.time - 0.05) / 0.1 + 1e-9)
    expected = np.where(ticks < 0, 0.0, np.exp(-(0.05 + 0.1 * ticks)))
    np.testing.assert_allclose(result["hold/y"], expected, atol=1e-9)


def test_the_times_of_a_million_ticks_have_no_accumulated_rounding_error() -> None:
    result = run(tick_recorder([(0.1, 0.0)]), 1e5, 1000.0)
    assert result.run.ticks == 1_000_001
    assert abs(result["clock0/time"][-1] - 1e5) <= np.spacing(1e5)
    np.testing.assert_array_equal(result["clock0/time"], np.arange(101) * 10_000 * 0.1)


@pytest.mark.parametrize(
    ("clocks", "stop", "common_ticks"),
    [
        ([(0.002, 0.0), (0.005, 0.0)], 10.0, 1001),
        ([(0.1, 0.0), (0.3, 0.0)], 3000.0, 10_001),
        ([(0.1, 0.0), (0.7, 0.1)], 70.1, 101),
        ([(1 / 3, 0.0), (0.5, 0.0)], 100.0, 101),
        ([(0.001, 0.0), (0.001, 0.0005)], 1.0, 0),
    ],
)
def test_common_ticks_of_two_clocks_coincide_despite_rounding(
    clocks: list[tuple[float, float]], stop: float, common_ticks: int
) -> None:
    result = run(tick_recorder(clocks), stop, stop)
    assert result["all/count"][-1] == common_ticks
    for k, (period, offset) in enumerate(clocks):
        count = np.floor((stop - offset) / period + 1e-9) + 1
        assert result[f"clock{k}/count"][-1] == count
        assert result[f"clock{k}/time"][-1] == pytest.approx((count - 1) * period + offset, rel=4e-16)


def test_a_tick_at_a_breakpoint_samples_the_new_value() -> None:
    """The jump is at 0.3 s or 2.1 s; the third ticks are rounded to 3 * 0.1 > 0.3 and 3 * 0.7 < 2.1."""
    for period, instant in ((0.1, 0.3), (0.7, 2.1)):
        system = hybrid(
            "sampled_step",
            states=("plant/x",),
            discrete=("hold/y",),
            signals=("hold/y",),
            x0=(0.0,),
            z0=(0.0,),
            clocks=((period, 0.0),),
            breakpoints=(instant,),
            derivative=lambda t, x, z, w, p: z,
            outputs=lambda t, x, z, w, p: z,
            update=lambda t, x, z, w, p, m, instant=instant: ca.if_else(t < instant, 0, 1),
        )
        y = run(system, 4 * period, period)["hold/y"]
        assert y.tolist() == [0.0, 0.0, 0.0, 1.0, 1.0]


def test_a_guard_whose_sign_changes_at_a_tick_fires_at_that_time() -> None:
    system = hybrid(
        "tick_then_event",
        discrete=("count/n", "edge/t"),
        signals=("count/n", "edge/t"),
        z0=(0.0, -1.0),
        clocks=((0.5, 0.0),),
        guards=(("edge", 1),),
        outputs=lambda t, x, z, w, p: z,
        update=lambda t, x, z, w, p, m: column(z[0] + 1, z[1]),
        guard=lambda t, x, z, w, p: z[0] - 3.5,
        reset=lambda t, x, z, w, p, e: (x, column(z[0], t)),
    )
    result = run(system, 2.0, 0.5)
    assert result["count/n"].tolist() == [1.0, 2.0, 3.0, 4.0, 5.0]
    assert result["edge/t"].tolist() == [-1.0, -1.0, -1.0, 1.5, 1.5]


def test_a_guard_that_depends_only_on_time_is_located_without_states() -> None:
    system = hybrid(
        "timer",
        discrete=("timer/t",),
        signals=("timer/t",),
        z0=(0.0,),
        guards=(("timer", 0),),
        outputs=lambda t, x, z, w, p: z,
        guard=lambda t, x, z, w, p: ca.sin(t),
        reset=lambda t, x, z, w, p, e: (x, t),
    )
    times = np.unique(run(system, 10.0, 0.1)["timer/t"])[1:]
    np.testing.assert_allclose(times, np.pi * np.arange(1, 4), rtol=1e-12)


# Implicit equations.


def test_an_implicit_equation_is_solved_at_every_evaluation() -> None:
    result = run(loop_of_cosine(), 2.0, 0.5)
    np.testing.assert_allclose(result["loop/u"], 0.7390851332151607, rtol=0, atol=2e-16)


def test_nonlinear_loops_that_need_pivoting_are_solved() -> None:
    """``w1 w2 = 1 + t``, ``w1 + w2 = 3 + t``, and a third equation that needs a row exchange."""
    system = hybrid(
        "three",
        states=("plant/x",),
        algebraic=("a/u", "b/u", "c/u"),
        signals=("a/u", "b/u", "c/u", "plant/x"),
        x0=(0.0,),
        w0=(0.2, 2.0, 0.0),
        derivative=lambda t, x, z, w, p: w[2],
        outputs=lambda t, x, z, w, p: column(w, x),
        residual=lambda t, x, z, w, p: column(w[2] - w[0] ** 3, w[0] * w[1] - (1 + t), w[0] + w[1] - (3 + t)),
    )
    result = run(system, 1.0, 0.125)
    s, q = 3 + result.time, 1 + result.time
    small = (s - np.sqrt(s * s - 4 * q)) / 2
    np.testing.assert_allclose(result["a/u"], small, rtol=1e-12)
    np.testing.assert_allclose(result["c/u"], small**3, rtol=1e-12)


@pytest.mark.parametrize("shift", [1.0, 0.0])
def test_an_implicit_equation_without_a_unique_solution_is_reported(shift: float) -> None:
    system = hybrid(
        "endless",
        states=("plant/x",),
        algebraic=("adder/y",),
        signals=("plant/x", "adder/y"),
        x0=(0.0,),
        w0=(0.5,),
        derivative=lambda t, x, z, w, p: w,
        outputs=lambda t, x, z, w, p: column(x, w),
        residual=lambda t, x, z, w, p: w + shift - w + 0 * w,
    )
    with pytest.raises(SimulationError, match="loop through 'adder' at 0 s"):
        run(system, 1.0)


# The integration loop.


def test_pauses_do_not_change_the_bits_and_fixed_steps_end_at_ticks() -> None:
    compiled = compile_system(sampled_loop(0.03))
    outcomes = []
    for chunk in (1, 7, 10**6):
        native = compiled.integrator(find_tableau("rk4"))
        start = RunPoint(time=0.0, x=np.ones(1), z=np.zeros(1))
        begun = native.begin(start, np.empty(0), np.linspace(0, 1, 11), np.empty(0), step=0.05)
        while begun.advance(chunk).name == "PAUSED":
            pass
        outcomes.append((begun.states.tobytes(), begun.reals.tobytes(), begun.accepted))
    assert outcomes[0] == outcomes[1] == outcomes[2]
    # 34 ticks and 20 grid times, six of them common; the start is not a step
    assert outcomes[0][2] == 34 + 20 - 6 - 1


def test_a_hybrid_system_loaded_from_the_cache_gives_the_same_run(
    tmp_path: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ARMBLOCKS_CACHE_DIR", str(tmp_path))
    options = SimulationOptions(stop_time=1.5, sample_time=0.01)
    first = simulate(cached_system("ball", bouncing_ball), options)

    def never() -> HybridSystem:
        raise AssertionError("was traced again")

    again = simulate(cached_system("ball", never), options)
    assert first.signals.tobytes() == again.signals.tobytes()


def test_an_initial_discrete_value_that_is_not_finite_is_named() -> None:
    system = hybrid(
        "bad",
        discrete=("hold/y",),
        signals=("hold/y",),
        z0=(float("nan"),),
        clocks=((1.0, 0.0),),
        outputs=lambda t, x, z, w, p: z,
    )
    with pytest.raises(SimulationError, match="initial value of state 'hold/y' is"):
        run(system, 1.0)

"""Failed runs: messages, times and partial results; and invalid options."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from casadi import SX
from small_systems import oscillator, scalar, states_of, system

from armblocks.equations import SimulationOptions, signature
from armblocks.errors import InputError, SimulationError, UnknownNameError
from armblocks.integration.system import compile_system
from armblocks.simulation import Simulation, SimulationResult, simulate

OSCILLATOR = compile_system(oscillator())


def partial(error: pytest.ExceptionInfo[SimulationError]) -> SimulationResult:
    result = error.value.partial
    assert isinstance(result, SimulationResult)
    assert not result.run.complete
    assert result.run.message
    assert np.isfinite(result.signals).all()
    return result


def test_unbounded_growth_is_reported_with_its_time() -> None:
    """x' = x^2 with x(0) = 1 has the solution 1 / (1 - t), with a pole at 1 s."""
    with pytest.raises(SimulationError, match=r"the step became as small as the rounding") as error:
        simulate(
            compile_system(scalar("blow_up", lambda t, x, p: x * x, 1.0)), SimulationOptions(stop_time=2.0)
        )
    text = str(error.value)
    assert "'block/x'" in text
    assert "grow without bound" in text
    partial_result = partial(error)
    assert partial_result.time[-1] == pytest.approx(1.0, abs=2e-3)  # the last sample before 1 s
    time = float(text.split("rounding of the time at ")[1].split(" s")[0])
    assert time == pytest.approx(1.0, abs=1e-3)
    np.testing.assert_allclose(partial_result["block/y"][:-1], 1 / (1 - partial_result.time[:-1]), rtol=1e-3)


def test_the_state_with_the_largest_error_is_named() -> None:
    """Two decaying states and one that grows without bound."""
    states = states_of("a/x", "b/x", "c/x")
    three_states = system(
        "three",
        states=states,
        signals=signature(("a/y", ())),
        derivative=lambda t, x, p: ca.vertcat(-x[0], x[1] ** 2, -x[2]),
        outputs=lambda t, x, p: x[0],
        initial=(1.0, 1.0, 1.0),
    )
    with pytest.raises(SimulationError, match=r"relative to the tolerance: 'b/x' \("):
        simulate(compile_system(three_states), SimulationOptions(stop_time=2.0))


def chain(stop_at: float = 1.0) -> object:
    """The square root of a ramp that becomes negative, and two blocks after it; the root is the cause."""

    def signals(t: SX, x: SX, p: SX) -> SX:
        root = ca.sqrt(stop_at - t)
        return ca.vertcat(stop_at - t, root, 2 * root, x[0])

    return compile_system(
        system(
            "chain",
            states=states_of("integrator/x"),
            signals=signature(("ramp/y", ()), ("root/y", ()), ("gain/y", ()), ("integrator/y", ())),
            derivative=lambda t, x, p: signals(t, x, p)[2],
            outputs=signals,
            initial=(0.0,),
        )
    )


@pytest.mark.parametrize("solver", ["rk45", "rk4"])
def test_the_first_signal_that_is_not_finite_is_named_with_the_time(solver: str) -> None:
    with pytest.raises(SimulationError, match=r"signal 'root/y' is -?nan at 1\.?\d* s") as error:
        simulate(chain(), SimulationOptions(stop_time=3.0, solver=solver))
    assert "block 'root'" in str(error.value)
    assert partial(error).time[-1] == pytest.approx(1.0, abs=4e-3)


def test_without_states_the_first_signal_that_is_not_finite_is_named_with_the_time() -> None:
    bad = system(
        "direct",
        signals=signature(("clock/y", ()), ("log/y", (2,)), ("after/y", ())),
        outputs=lambda t, x, p: ca.vertcat(t, t, ca.log(2.0 - t), 1 / (1.5 - t)),
    )
    options = SimulationOptions(stop_time=4.0, sample_time=0.5)
    with pytest.raises(SimulationError, match=r"signal 'after/y' is inf at 1.5 s") as error:
        simulate(compile_system(bad), options)
    partial_result = partial(error)
    assert partial_result.time.tolist() == [0.0, 0.5, 1.0]
    assert partial_result["log/y"].shape == (3, 2)
    later = system(
        "direct",
        signals=signature(("clock/y", ()), ("log/y", (2,)), ("after/y", ())),
        outputs=lambda t, x, p: ca.vertcat(t, t, ca.log(2.0 - t), 1 / (2.0 - t)),
    )
    with pytest.raises(SimulationError, match=r"signal 'log/y\[1\]' is -inf at 2 s"):
        simulate(compile_system(later), options)


def test_large_finite_signals_are_accepted() -> None:
    """The fast check squares the signals: squares of 1e200 overflow although the signals are finite."""
    large = system("large", signals=signature(("big/y", ())), outputs=lambda t, x, p: 1e200 * (1 + t))
    result = simulate(compile_system(large), SimulationOptions(stop_time=1.0))
    assert result["big/y"][-1] == 2e200


def test_a_derivative_that_is_not_finite_is_reported_with_its_state() -> None:
    hidden = scalar("hidden", lambda t, x, p: ca.log(0.5 - t) + 0 * x, 0.0)
    with pytest.raises(SimulationError, match=r"derivative of state 'block/x' is not finite at 0\.5"):
        simulate(compile_system(hidden), SimulationOptions(stop_time=1.0))


def test_an_initial_value_that_is_not_finite_is_named() -> None:
    at_start = scalar("start", lambda t, x, p: 1 / x, 0.0)
    with pytest.raises(SimulationError, match=r"derivative of state 'block/x' is not finite at 0 s") as error:
        simulate(compile_system(at_start), SimulationOptions(stop_time=1.0))
    assert partial(error).time.tolist() == [0.0]
    infinite = scalar("start", lambda t, x, p: -x, float("inf"))
    with pytest.raises(SimulationError, match=r"the initial value of state 'block/x' is \[inf\]"):
        simulate(compile_system(infinite), SimulationOptions(stop_time=1.0))


def test_the_message_suggests_a_stiff_solver_only_for_a_stiff_system() -> None:
    """x' = -1e6 (x - cos t): an explicit method takes steps of 3.3e-6 s for any tolerance."""
    stiff = compile_system(scalar("stiff", lambda t, x, p: -1e6 * (x - ca.cos(t)), 1.0))
    result = simulate(stiff, SimulationOptions(stop_time=0.2, solver="rk45"))
    assert result.run.complete
    assert "looks stiff" in result.run.message
    assert "solver='rodas5p' is suitable for such systems" in result.run.message
    assert "1e+06 1/s" in result.run.message
    np.testing.assert_allclose(result["block/y"], np.cos(result.time), atol=1e-5)
    # As many steps because of accuracy: no suggestion.
    result_without_stiffness = simulate(
        OSCILLATOR, SimulationOptions(stop_time=200.0, max_step=0.005, solver="rk45")
    )
    assert result_without_stiffness.run.steps >= 40_000
    assert result_without_stiffness.run.message == ""


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"stop_time": -1.0}, r"stop_time is -1\.0\. Allowed: a finite time in s, 0 or more"),
        ({"stop_time": float("nan")}, r"stop_time is nan"),
        ({"stop_time": float("inf")}, r"stop_time is inf"),
        ({"stop_time": "10"}, r"stop_time is '10'"),
        ({"step": 0.0}, r"step is 0\.0\. Allowed: a time in s above 0"),
        ({"step": -0.1}, r"step is -0\.1"),
        ({"step": 11.0}, r"oscillator: step is 11 s\. Allowed: above 0, at most the stop time 10 s"),
        ({"step": 1e-16}, r"step is 1e-16 s, and times near 10 s are 1\.8e-15 s apart.*at least 7\.1e-15 s"),
        ({"max_step": 1e-17}, r"max_step is 1e-17 s, and times near 10 s"),
        ({"step": 0.1, "solver": "rodas5p"}, r"rodas5p chooses its own steps.*implicit_euler, ros5"),
        ({"step": 0.1, "solver": "rk45"}, r"rk45 chooses its own steps.*euler, heun, rk3, rk4, rk5"),
        ({"sample_time": 0.0}, r"sample_time is 0\.0"),
        ({"sample_time": -1.0}, r"sample_time is -1\.0"),
        (
            {"sample_time": 1e-9},
            r"records 1e\+10 samples of 5 numbers\. Allowed: at most 100000000 samples",
        ),
        ({"max_step": 0.0}, r"max_step is 0\.0"),
        ({"max_step": float("nan")}, r"max_step is nan"),
        ({"rtol": 1e-15}, r"rtol is 1e-15\. Allowed: 1e-13 to 1"),
        ({"rtol": 2.0}, r"rtol is 2\.0"),
        ({"rtol": float("nan")}, r"rtol is nan"),
        ({"atol": 0.0}, r"atol is 0\.0"),
        ({"atol": -1.0}, r"atol is -1\.0"),
    ],
)
def test_invalid_options_are_refused(options: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        simulate(OSCILLATOR, SimulationOptions(**options))  # pyright: ignore


def test_an_unknown_solver_is_refused_even_if_none_is_needed() -> None:
    stateless = compile_system(system("still", signals=signature(("a/y", ())), outputs=lambda t, x, p: t))
    with pytest.raises(UnknownNameError, match=r"no solver named 'ode45s'.*did you mean 'ode45'"):
        simulate(stateless, SimulationOptions(solver="ode45s"))


@pytest.mark.parametrize(
    ("parameters", "kind", "message"),
    [
        ({"mass.omga": 1.0}, UnknownNameError, r"no parameter named 'mass.omga'.*did you mean 'mass.omega'"),
        ({"mass.omega": [1.0, 2.0]}, InputError, r"'mass.omega' got a value of shape \(2,\)"),
        ({"mass.omega": float("nan")}, InputError, r"parameter 'mass.omega' is \[nan\]. Allowed: finite"),
        (np.zeros(3), InputError, r"parameter vector has shape \(3,\).*\(1,\): one number for each of mass"),
        (np.array([np.inf]), InputError, r"parameter 'mass.omega' is \[inf\]"),
    ],
)
def test_invalid_parameters_are_refused(parameters: object, kind: type[Exception], message: str) -> None:
    with pytest.raises(kind, match=message):
        simulate(OSCILLATOR, SimulationOptions(), parameters)  # pyright: ignore


@pytest.mark.parametrize("solver", ["rk23", "rk45", "dop853", "rodas5p"])
@pytest.mark.parametrize("rtol", [1e-3, 1e-6])
def test_extremely_short_steps_are_detected_at_any_order_and_tolerance(solver: str, rtol: float) -> None:
    jumping = compile_system(scalar("friction", lambda t, x, p: -1 + 2 * (x < 0), 1.0))
    options = SimulationOptions(stop_time=1e9, sample_time=1e8, solver=solver, rtol=rtol, atol=1e-6)
    with pytest.raises(SimulationError, match=r"the run takes extremely short steps at \d+\.\d+ s: "):
        simulate(jumping, options)


@pytest.mark.parametrize("solver", ["rk23", "rk45", "dop853"])
@pytest.mark.parametrize("rtol", [1e-3, 1e-6])
def test_a_driven_system_with_tight_tolerance_is_not_reported_as_too_slow(solver: str, rtol: float) -> None:
    """The input never decays, so that the steps stay short; 1e9 s remain after these steps."""
    driven = compile_system(scalar("driven", lambda t, x, p: ca.cos(t) - x, 0.0))
    options = SimulationOptions(stop_time=1e9, sample_time=1e8, solver=solver, rtol=rtol, atol=1e-6)
    run = Simulation(driven, options)
    run.advance(steps=400_000)
    assert run.time > 1000.0 and not run.finished


@pytest.mark.parametrize(
    ("solver", "max_steps"), [("rk45", 200_000), ("dop853", 200_000), ("rodas5p", 50_000)]
)
def test_a_run_with_extremely_short_steps_is_ended(solver: str, max_steps: int) -> None:
    """x' = -1 + 2 (x < 0): after 1 s the sign of x' alternates; 1000 s would take 1e10 steps."""
    jumping = compile_system(scalar("friction", lambda t, x, p: -1 + 2 * (x < 0), 1.0))
    with pytest.raises(SimulationError, match=r"the run takes extremely short steps at 1\.\d+ s: ") as error:
        simulate(jumping, SimulationOptions(stop_time=1000.0, solver=solver))
    partial_result = partial(error)
    assert partial_result.run.steps < max_steps
    assert partial_result.time[-1] == pytest.approx(1.0, abs=0.05)
    text = str(error.value)
    assert len(text) < 400
    assert "the input of 'block/x'" in text
    assert "StickSlipFriction" in text
    assert ("rodas5p" in text) == (solver != "rodas5p")


@pytest.mark.parametrize("solver", ["rk23", "rk45"])
def test_many_regular_steps_are_not_reported_as_too_slow(solver: str) -> None:
    """Steps of some hundredths of a second, bounded by accuracy; more than 1e8 remain until 1e9 s."""
    options = SimulationOptions(stop_time=1e9, solver=solver, sample_time=1e7, rtol=1e-6)
    run = Simulation(OSCILLATOR, options)
    run.advance(steps=400_000)
    assert not run.finished
    assert run.time > (20_000.0 if solver == "rk45" else 2_000.0)


def test_unbounded_growth_raises_no_numpy_warning() -> None:
    """The check for stiffness evaluates a state near the largest double without a warning."""
    options = SimulationOptions(stop_time=1e6, solver="rk45", sample_time=1e5, rtol=0.1)
    with pytest.raises(SimulationError, match="not finite"):
        simulate(OSCILLATOR, options)


def test_too_many_fixed_steps_are_refused() -> None:
    with pytest.raises(
        InputError, match=r"step is 1e-12 s, and the stop time 1 s: 1e\+12 steps.*that step is in seconds"
    ):
        simulate(OSCILLATOR, SimulationOptions(stop_time=1.0, solver="rk4", step=1e-12))

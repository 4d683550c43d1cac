"""The automatic solver returns to the explicit method when a system is no longer stiff."""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from small_systems import states_of, system
from stiff_systems import robertson, van_der_pol

from armblocks.equations import HybridSystem, SimulationOptions, signature
from armblocks.integration.system import compile_system
from armblocks.simulation import RunState, SimulationResult, simulate


def lag_and_oscillator(rate: ca.SX, t: ca.SX, x: ca.SX) -> ca.SX:
    """A lag of the given rate (1/s) that follows ``sin t``, beside an oscillator of 10 rad/s."""
    return ca.vertcat(ca.cos(t) - rate * (x[0] - ca.sin(t)), x[2], -100.0 * x[1])


def fading() -> HybridSystem:
    """A lag that is fast until 5 s and slow after about 8 s."""
    return system(
        "fading",
        states=states_of("lag/x", "wave/x", "wave/v"),
        signals=signature(("y", (3,))),
        derivative=lambda t, x, p: lag_and_oscillator(1e5 / (1 + ca.exp(4 * (t - 5))), t, x),
        outputs=lambda t, x, p: x,
        initial=(0.0, 1.0, 0.0),
    )


def recurring() -> HybridSystem:
    """A lag that alternates between fast and slow every 31 s."""
    return system(
        "recurring",
        states=states_of("lag/x", "wave/x", "wave/v"),
        signals=signature(("y", (3,))),
        derivative=lambda t, x, p: lag_and_oscillator(1e5 / (1 + ca.exp(40 * ca.cos(t / 10))), t, x),
        outputs=lambda t, x, p: x,
        initial=(0.0, 1.0, 0.0),
    )


FADING = compile_system(fading())
STOP = 100.0


def run(solver: str, stop: float = STOP, state: RunState | None = None) -> SimulationResult:
    options = SimulationOptions(stop_time=stop, sample_time=0.5, solver=solver, rtol=1e-8, atol=1e-10)
    return simulate(FADING, options, initial_state=state)


def test_the_solver_returns_to_the_explicit_method_and_reports_both_changes() -> None:
    result = run("auto")
    assert result.run.solver == "rk45, then rodas5p, then rk45"
    assert "because the system is stiff" in result.run.reason
    assert "s are stable now" in result.run.reason
    back = float(result.run.reason.split("; from ")[1].split(" s")[0])
    assert 6.0 < back < 20.0
    t = result.time
    exact = np.column_stack([np.sin(t), np.cos(10 * t), -10 * np.sin(10 * t)])
    # The error of the oscillator grows over its 160 radians of phase with every method.
    np.testing.assert_allclose(result["y"], exact, atol=2e-4)
    assert result.run.evaluations < 0.6 * run("rk45").run.evaluations


@pytest.mark.parametrize("cuts", [[5.0], [30.0], [2.0, 9.0, 60.0]])
def test_an_interrupted_run_returns_at_the_same_step(cuts: list[float], tmp_path: Path) -> None:
    whole = run("auto")
    state: RunState | None = None
    for stop in cuts:
        state = run("auto", stop, state).final_state
        assert state is not None
        state.save(tmp_path / "state")
        state = RunState.load(tmp_path / "state")
    rest = run("auto", STOP, state)
    assert "exactly as the previous run" in rest.run.reason
    common_samples = np.isin(whole.time, rest.time)
    assert common_samples.sum() > 50
    assert (
        rest.signals[:, np.isin(rest.time, whole.time)].tobytes()
        == whole.signals[:, common_samples].tobytes()
    )


def test_a_repeatedly_stiff_system_changes_the_method_only_a_few_times() -> None:
    """Each return quadruples the delay before the next one: their number grows logarithmically."""
    options = SimulationOptions(stop_time=1000.0, sample_time=10.0, rtol=1e-6, atol=1e-9)
    compiled = compile_system(recurring())
    result = simulate(compiled, options)
    changes = result.run.solver.count("then")
    assert 2 <= changes <= 6
    stiff = simulate(compiled, SimulationOptions(stop_time=1000.0, sample_time=10.0, solver="rodas5p"))
    assert result.run.evaluations < 3 * stiff.run.evaluations
    np.testing.assert_allclose(result["y"][:, 0], np.sin(result.time), atol=1e-4)


@pytest.mark.parametrize(
    ("problem", "stop"),
    [(robertson(), 1e11), (van_der_pol(1000.0), 2000.0)],
    ids=["robertson", "van der Pol"],
)
def test_the_method_changes_once_for_problems_that_stay_stiff(problem: HybridSystem, stop: float) -> None:
    result = simulate(compile_system(problem), SimulationOptions(stop_time=stop, rtol=1e-6, atol=1e-12))
    assert result.run.solver == "rk45, then rodas5p"

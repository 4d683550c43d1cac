"""The native integrator loop without compiled systems."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np
import pytest
from casadi import SX

from armblocks.compiler.from_casadi import tape_from
from armblocks.equations import TracedFunction, signature
from armblocks.errors import InputError
from armblocks.integration.butcher_tableau import ButcherTableau, hermite_dense
from armblocks.integration.native_integrator import NativeIntegrator
from armblocks.integration.workspace import LoopSizes, Status

RK4 = ButcherTableau(
    name="rk4",
    title="",
    source="",
    order=4,
    dense_order=4,
    nodes=(0.0, 0.5, 0.5, 1.0),
    matrix=((), (0.5,), (0.0, 0.5), (0.0, 0.0, 1.0)),
    weights=(1 / 6, 1 / 3, 1 / 3, 1 / 6),
    dense=hermite_dense((1 / 6, 1 / 3, 1 / 3, 1 / 6)),
)
PAIR = ButcherTableau(
    name="rk23",
    title="",
    source="",
    order=3,
    dense_order=3,
    nodes=(0.0, 1 / 2, 3 / 4),
    matrix=((), (1 / 2,), (0.0, 3 / 4)),
    weights=(2 / 9, 1 / 3, 4 / 9),
    error=(5 / 72, -1 / 12, -1 / 9, 1 / 8),
    error_order=2,
    dense=hermite_dense((2 / 9, 1 / 3, 4 / 9)),
)


def integrator(
    equations, states: int, tableau: ButcherTableau = PAIR, parameters: int = 0
) -> NativeIntegrator:
    traced = TracedFunction.trace(
        "f",
        signature(("t", ()), ("x", (states,)), ("z", (0,)), ("w", (0,)), ("p", (parameters,))),
        signature(("xd", (states,))),
        lambda t, x, z, w, p: equations(t, x, p),
    )
    tape = tape_from(traced)
    return NativeIntegrator(LoopSizes(states=states), {"derivative": tape.digest}, lambda name: tape, tableau)


NONE = np.empty(0)


def test_states_in_loops_and_in_unrolled_code_give_the_same_steps() -> None:
    """The code for twelve independent copies of an equation has loops; that for one copy is unrolled."""
    alone = integrator(lambda t, x, p: -x * ca.sin(3 * t), 1)
    many = integrator(lambda t, x, p: -x * ca.sin(3 * t), 12)
    samples = np.linspace(0, 5, 101)
    results = []
    for native in (alone, many):
        run = native.begin(np.ones(native.states), NONE, samples, NONE)
        assert run.advance(10**9) is Status.DONE
        results.append(run)
    # The error norm of twelve equal parts is rounded differently: steps differ in the last place.
    assert results[0].accepted == results[1].accepted
    np.testing.assert_allclose(results[1].states, np.repeat(results[0].states, 12, axis=1), rtol=1e-13)


@pytest.mark.parametrize("tableau", [PAIR, RK4])
def test_pauses_between_steps_do_not_change_the_bits(tableau: ButcherTableau) -> None:
    native = integrator(lambda t, x, p: ca.vertcat(x[1], (1 - x[0] ** 2) * x[1] - x[0]), 2, tableau)
    samples = np.linspace(0, 10, 51)
    outcomes = []
    for chunk in (1, 7, 10**9):
        run = native.begin(np.array([2.0, 0.0]), NONE, samples, np.array([2.5, 7.1]), step=0.03)
        while run.advance(chunk) is Status.PAUSED:
            pass
        outcomes.append((run.states.tobytes(), run.counts.tobytes(), run.reals[:6].tobytes()))
    assert outcomes[0] == outcomes[1] == outcomes[2]


def test_a_repeated_run_gives_the_same_bits() -> None:
    native = integrator(lambda t, x, p: ca.vertcat(x[1], -ca.sin(x[0])), 2)
    runs = [native.begin(np.array([1.0, 0.0]), NONE, np.linspace(0, 9, 33), NONE) for _ in range(2)]
    for run in runs:
        run.advance(10**9)
    assert runs[0].states.tobytes() == runs[1].states.tobytes()


def test_steps_end_at_breakpoints_and_use_the_value_before_the_jump() -> None:
    """x' jumps from 1 to -3 at 0.7: each method is exact on both sides if no stage uses the other side."""
    for tableau in (PAIR, RK4):
        native = integrator(lambda t, x, p: ca.if_else(t < p, SX(1), SX(-3)), 1, tableau, parameters=1)
        samples = np.array([0.0, 0.35, 0.7, 1.0, 2.0])
        run = native.begin(np.zeros(1), np.array([0.7]), samples, np.array([0.7]), step=0.1)
        assert run.advance(10**9) is Status.DONE
        np.testing.assert_allclose(run.states[:, 0], [0, 0.35, 0.7, -0.2, -3.2], rtol=0, atol=2e-15)
        assert run.rejected == 0


def test_breakpoints_may_be_unordered_repeated_or_outside_the_run() -> None:
    native = integrator(lambda t, x, p: ca.if_else(t < 1, SX(1), SX(-3)), 1)
    for points in ([1.0], [5.0, 1.0, -2.0, 1.0, 0.0, 2.0]):
        run = native.begin(np.zeros(1), NONE, np.array([0.0, 2.0]), np.array(points))
        assert run.advance(10**9) is Status.DONE
        assert run.states[1, 0] == pytest.approx(-2.0, abs=1e-14)


def test_a_fixed_step_keeps_its_grid_after_a_breakpoint() -> None:
    """The grid 0, 0.1, …, 1 with a breakpoint at 0.25 has eleven steps, and the grid times remain k h."""
    native = integrator(lambda t, x, p: SX(1) + 0 * x, 1, RK4)
    run = native.begin(np.zeros(1), NONE, np.arange(11) * 0.1, np.array([0.25]), step=0.1)
    assert run.advance(10**9) is Status.DONE
    assert run.accepted == 11
    np.testing.assert_allclose(run.states[:, 0], np.arange(11) * 0.1, atol=1e-15)


def test_no_tiny_step_is_taken_when_the_grid_misses_the_end_by_rounding() -> None:
    native = integrator(lambda t, x, p: SX(1) + 0 * x, 1, RK4)
    run = native.begin(np.zeros(1), NONE, np.array([0.0, 3 * 0.7]), NONE, step=0.1)  # 21 * 0.1 < 3 * 0.7
    assert run.advance(10**9) is Status.DONE
    assert run.accepted == 21
    assert run.time == 3 * 0.7


def test_a_run_of_zero_duration_records_its_start() -> None:
    run = integrator(lambda t, x, p: -x, 1).begin(np.ones(1), NONE, np.zeros(1), NONE)
    assert run.advance(100) is Status.DONE
    assert run.states.tolist() == [[1.0]]


def test_failures_have_different_status_codes() -> None:
    samples = np.array([0.0, 2.0])
    grows = integrator(lambda t, x, p: x * x, 1)
    run = grows.begin(np.ones(1), NONE, samples, NONE)
    assert run.advance(10**9) is Status.STEP_TOO_SMALL
    assert run.time == pytest.approx(1.0, abs=1e-3)
    assert run.recorded == 1
    assert run.weighted_errors()[0] >= 1.0
    root = integrator(lambda t, x, p: ca.sqrt(1 - t) + 0 * x, 1)
    run = root.begin(np.ones(1), NONE, samples, NONE)
    assert run.advance(10**9) is Status.NON_FINITE
    assert run.first_non_finite_stage()[0] == pytest.approx(1.0, abs=1e-12)
    run = integrator(lambda t, x, p: 1 / x, 1).begin(np.zeros(1), NONE, samples, NONE)
    assert run.advance(10**9) is Status.NON_FINITE_START
    fixed = integrator(lambda t, x, p: ca.sqrt(1 - t) + 0 * x, 1, RK4)
    run = fixed.begin(np.ones(1), NONE, samples, NONE, step=0.3)
    assert run.advance(10**9) is Status.NON_FINITE
    assert run.time == pytest.approx(0.9)
    assert run.first_non_finite_stage()[0] == pytest.approx(1.05)


def test_a_state_that_overflows_is_a_failure() -> None:
    """x' = 1e308: after an overflow the ratio of error and scale would be 0 / inf."""
    native = integrator(lambda t, x, p: SX(1e308) + 0 * x, 1)
    run = native.begin(np.zeros(1), NONE, np.array([0.0, 10.0]), NONE)
    assert run.advance(10**9) in (Status.NON_FINITE, Status.STEP_TOO_SMALL)
    assert math.isfinite(run.state[0])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"weights": (1.0,)}, "'weights' does not fit the 3 stages"),
        ({"weights": (2 / 9, 1 / 3, 4 / 8)}, "weights adds up to"),
        ({"matrix": ((), (0.4,), (0.0, 0.75))}, "matrix row 1 adds up to 0.4"),
        ({"error": (0.1, 0.0, 0.0, 0.0)}, "error adds up to 0.1"),
    ],
)
def test_a_tableau_with_a_wrong_coefficient_is_refused(changes: dict[str, object], message: str) -> None:
    fields = {name: getattr(PAIR, name) for name in PAIR.__dataclass_fields__} | changes
    with pytest.raises(InputError, match=message) as caught:
        ButcherTableau(**fields)
    assert "integrator rk23" in str(caught.value)

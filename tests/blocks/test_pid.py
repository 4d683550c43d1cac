"""PID controllers: transfer functions, limits and resets compared with independent computations."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy import integrate, signal

from armblocks.blocks import (
    PID,
    PID2DOF,
    Constant,
    DiscretePID,
    DiscretePID2DOF,
    PulseGenerator,
    Saturation,
    SineWave,
    Step,
)
from armblocks.diagram import Block, DiagramBuilder
from armblocks.equations import SimulationOptions
from armblocks.errors import InputError
from armblocks.simulation import SimulationResult, simulate
from compiled_diagrams import compiled

SOLVERS = pytest.mark.parametrize(("solver", "step"), [("rk45", None), ("rk4", 0.002)])
T = 0.05


def run(
    block: Block, *sources: Block, solver: str = "auto", step: float | None = None, stop: float = 4.0
) -> SimulationResult:
    """Simulate a controller with its sources, recorded every 0.05 s."""
    builder = DiagramBuilder("d")
    handles = [builder.add(f"u{k}", source) for k, source in enumerate(sources)]
    builder.add("pid", block, *handles)
    options = SimulationOptions(
        stop_time=stop, sample_time=T, solver=solver, step=step, rtol=1e-10, atol=1e-12
    )
    return simulate(compiled(builder.build()), options)


@SOLVERS
@pytest.mark.parametrize("form", ["parallel", "ideal"])
def test_the_step_response_agrees_with_the_transfer_function(
    form: str, solver: str, step: float | None
) -> None:
    P, I, D, N = 3.0, 2.0, 0.5, 8.0  # noqa: E741
    result = run(PID(P=P, I=I, D=D, N=N, form=form), Step(time=0.0), solver=solver, step=step)
    factor = P if form == "ideal" else 1.0
    t = result.time
    expected = P + factor * (I * t + D * N * np.exp(-N * t))
    np.testing.assert_allclose(result["pid/y"], expected, atol=1e-7)


@SOLVERS
def test_two_degrees_of_freedom_weigh_the_reference(solver: str, step: float | None) -> None:
    P, I, D, N, b, c = 3.0, 2.0, 0.5, 8.0, 0.4, 0.2  # noqa: E741
    block = PID2DOF(P=P, I=I, D=D, N=N, b=b, c=c)
    result = run(block, Step(time=0.0), Constant(value=0.3), solver=solver, step=step)
    t = result.time
    expected = P * (b - 0.3) + I * 0.7 * t + D * N * (c - 0.3) * np.exp(-N * t)
    np.testing.assert_allclose(result["pid/y"], expected, atol=1e-7)


def test_two_degrees_of_freedom_with_weights_of_1_agree_with_the_pid() -> None:
    parameters = {"P": 3.0, "I": 2.0, "D": 0.5, "N": 8.0}
    wave = SineWave(amplitude=[1.0, 2.0], frequency=3.0)
    one = run(PID(**parameters), wave)["pid/y"]
    two = run(PID2DOF(**parameters), wave, Constant(value=0.0))["pid/y"]
    np.testing.assert_allclose(two, one, rtol=1e-12, atol=1e-14)
    one = run(DiscretePID(**parameters, sample_time=T), wave)["pid/y"]
    two = run(DiscretePID2DOF(**parameters, sample_time=T), wave, Constant(value=0.0))["pid/y"]
    np.testing.assert_allclose(two, one, rtol=1e-12, atol=1e-14)


def limited_reference(anti_windup: str, times: np.ndarray) -> np.ndarray:
    """Output for P = 2, I = 3 and a sine as error, with limits -1 and 1.5, computed by SciPy."""
    P, I, low, high, Kb = 2.0, 3.0, -1.0, 1.5, 4.0  # noqa: E741

    def error(t: float) -> float:
        return np.sin(2.0 * t)

    def free(t: float, i: float) -> float:
        return P * error(t) + i

    def rate(t: float, x: np.ndarray) -> list[float]:
        value = free(t, x[0])
        excess = value - min(max(value, low), high)
        rate = I * error(t)
        if anti_windup == "clamping" and excess * rate > 0.0:
            return [0.0]
        return [rate - (Kb * excess if anti_windup == "back_calculation" else 0.0)]

    # the switching times are not located; the small step limits the error
    span = (0.0, times[-1])
    solved = integrate.solve_ivp(rate, span, [0.0], max_step=2e-3, t_eval=times, rtol=1e-9)
    return np.clip([free(t, i) for t, i in zip(times, solved.y[0])], low, high)


@SOLVERS
@pytest.mark.parametrize("anti_windup", ["none", "clamping", "back_calculation"])
def test_output_limits_with_each_anti_windup_method(
    anti_windup: str, solver: str, step: float | None
) -> None:
    block = PID(P=2.0, I=3.0, limit_output=True, lower=-1.0, upper=1.5, anti_windup=anti_windup, Kb=4.0)
    result = run(block, SineWave(frequency=2.0), solver=solver, step=step)
    y = result["pid/y"]
    np.testing.assert_allclose(y, limited_reference(anti_windup, result.time), atol=2e-3)
    assert y.max() == 1.5
    assert result.run.events > 0


def test_clamping_holds_the_integral_exactly() -> None:
    """With P = 1, I = 1 and an error of 1 the limit 1.5 is reached at 0.5 s; the error becomes -1 at 2 s."""
    block = PID(limit_output=True, upper=1.5, lower=-1.5, anti_windup="clamping")
    result = run(block, Step(time=2.0, initial=1.0, final=-1.0), solver="rk45")
    t = result.time
    expected = np.where(t < 2.0, np.minimum(1.0 + t, 1.5), np.maximum(-1.0 + 0.5 - (t - 2.0), -1.5))
    np.testing.assert_allclose(result["pid/y"], expected, atol=1e-12)


@SOLVERS
def test_a_reset_restores_the_initial_integral(solver: str, step: float | None) -> None:
    block = PID(P=0.5, I=2.0, initial_integral=1.0, external_reset="rising")
    pulses = PulseGenerator(period=1.0, delay=0.5)
    result = run(block, Constant(value=1.0), pulses, solver=solver, step=step)
    t = result.time
    since = np.where(t < 0.5, t, (t - 0.5) % 1.0 * ((t - 0.5) % 1.0 < 1.0 - 1e-9))
    np.testing.assert_allclose(result["pid/y"], 0.5 + 1.0 + 2.0 * since, atol=1e-9)


def test_a_reset_moves_the_output_away_from_its_limit() -> None:
    block = PID(I=2.0, limit_output=True, upper=2.0, anti_windup="clamping", external_reset="either")
    result = run(block, Constant(value=1.0), Step(time=2.0), solver="rk45")
    t = result.time
    rising = 1.0 + 2.0 * np.where(t < 2.0, t, t - 2.0)
    np.testing.assert_allclose(result["pid/y"], np.minimum(rising, 2.0), atol=1e-12)


@SOLVERS
def test_tracking_moves_the_output_to_the_tracking_signal(solver: str, step: float | None) -> None:
    """With P = I = 0, y' = Kt (tracking - y)."""
    block = PID(P=0.0, I=0.0, tracking=True, Kt=3.0)
    result = run(block, Constant(value=1.0), Constant(value=2.0), solver=solver, step=step)
    np.testing.assert_allclose(result["pid/y"], 2.0 * (1.0 - np.exp(-3.0 * result.time)), atol=1e-8)


METHODS = ("forward_euler", "backward_euler", "trapezoidal")
SUMS = {
    "forward_euler": ([0.0, T], [1.0, -1.0]),
    "backward_euler": ([T, 0.0], [1.0, -1.0]),
    "trapezoidal": ([T / 2, T / 2], [1.0, -1.0]),
}


@pytest.mark.parametrize(("integrator", "filtered"), [*itertools.product(METHODS, METHODS)])
def test_a_discrete_pid_agrees_with_the_transfer_function_in_z(integrator: str, filtered: str) -> None:
    P, I, D, N = 3.0, 2.0, 0.5, 8.0  # noqa: E741
    block = DiscretePID(
        P=P, I=I, D=D, N=N, integrator_method=integrator, filter_method=filtered, sample_time=T
    )
    result = run(block, SineWave(frequency=3.0, phase=0.4))
    u = result["u0/y"]
    (bi, ai), (bf, af) = SUMS[integrator], SUMS[filtered]
    # D N / (1 + N F) with F = bf / af
    slope = signal.lfilter(D * N * np.array(af), np.array(af) + N * np.array(bf), u)
    expected = P * u + I * signal.lfilter(bi, ai, u) + slope
    np.testing.assert_allclose(result["pid/y"], expected, atol=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_back_calculation_in_a_discrete_pid_solves_its_implicit_equation(method: str) -> None:
    """The integral uses y - v of the same tick; the reference solves this equation by iteration."""
    P, I, low, high, Kb = 2.0, 3.0, -1.0, 1.5, 4.0  # noqa: E741
    share = {"forward_euler": 0.0, "backward_euler": 1.0, "trapezoidal": 0.5}[method]
    block = DiscretePID(
        P=P,
        I=I,
        lower=low,
        upper=high,
        anti_windup="back_calculation",
        Kb=Kb,
        integrator_method=method,
        sample_time=T,
    )
    result = run(block, SineWave(amplitude=2.0, frequency=3.0))
    x, expected = 0.0, []
    for u in result["u0/y"]:
        v = 0.0
        for _ in range(400):  # a contraction with the factor Kb T share <= 0.2
            rate = I * u + Kb * (np.clip(v, low, high) - v)
            v = P * u + x + share * T * rate
        expected.append(np.clip(v, low, high))
        x += T * (I * u + Kb * (np.clip(v, low, high) - v))
    np.testing.assert_allclose(result["pid/y"], expected, atol=1e-12)
    assert {low, high} <= set(result["pid/y"])


@pytest.mark.parametrize(
    ("external_reset", "reset_times"), [("rising", [1.0]), ("falling", [2.0]), ("either", [1.0, 2.0])]
)
def test_a_discrete_pid_is_reset_at_a_tick(external_reset: str, reset_times: list[float]) -> None:
    block = DiscretePID(P=0.0, I=1.0, external_reset=external_reset, initial_integral=5.0, sample_time=T)
    pulse = PulseGenerator(period=2.0, width=50.0, delay=1.0)
    result = run(block, Constant(value=1.0), pulse, stop=2.5)
    since = result.time.copy()
    for reset_time in reset_times:
        after = result.time > reset_time - 1e-9
        since[after] = result.time[after] - reset_time
    np.testing.assert_allclose(result["pid/y"], 5.0 + since, atol=1e-12)


def test_a_discrete_pid_tracks_the_tracking_signal() -> None:
    block = DiscretePID(P=0.0, I=0.0, tracking=True, Kt=3.0, sample_time=T)
    result = run(block, Constant(value=1.0), Constant(value=2.0))
    ticks = np.arange(len(result.time))
    np.testing.assert_allclose(result["pid/y"], 2.0 * (1.0 - (1.0 - 3.0 * T) ** ticks), atol=1e-12)


def test_a_pid_tracks_the_output_of_an_external_limiter() -> None:
    """The controller tracks the output of the saturated actuator, which prevents windup."""
    builder = DiagramBuilder("d")
    error = builder.add("error", SineWave(frequency=2.0))
    control = builder.add("pid", PID(P=2.0, I=3.0, tracking=True, Kt=4.0), error)
    actuator = builder.add("actuator", Saturation(lower=-1.0, upper=1.5), control)
    builder.connect(actuator["y"], control["tracking"])
    options = SimulationOptions(stop_time=4.0, sample_time=T, solver="rk45", rtol=1e-10, atol=1e-12)
    result = simulate(compiled(builder.build()), options)
    expected = limited_reference("back_calculation", result.time)
    np.testing.assert_allclose(result["actuator/y"], expected, atol=2e-3)


def test_limits_without_limit_output_are_refused() -> None:
    with pytest.raises(
        InputError, match=r"PID: there are limits, but limit_output is false.*set limit_output"
    ):
        PID(upper=1.0)
    with pytest.raises(InputError, match=r"lower is 2\.0 and upper is 1\.0"):
        DiscretePID2DOF(lower=2.0, upper=1.0)

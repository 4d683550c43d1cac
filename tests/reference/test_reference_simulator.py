"""The reference simulator compared with closed forms, and with the native run of every block."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from block_formulas import FORMULAS, broken_formulas
from reference_simulator import EndlessEventsError, UnsupportedError, run_reference

import armblocks as ab
from armblocks import blocks as bl
from armblocks.blocks import BLOCKS
from armblocks.diagram import Block, DiagramBuilder
from worked_examples import worked_example

TIMES = np.arange(41) * 0.05


def chain(source: Block, *blocks: Block) -> ab.Diagram:
    """Build a source and blocks in series after it, named ``u``, ``b1``, ``b2`` …"""
    builder = DiagramBuilder("chain")
    last = builder.add("u", source)
    for number, block in enumerate(blocks, 1):
        last = builder.add(f"b{number}", block, last)
    return builder.build()


# -- closed forms ------------------------------------------------------------------------------------------


def test_a_mode_is_consistent_after_a_jump_at_a_limit() -> None:
    """The sawtooth reaches the limit -1 exactly when it jumps to 1: the limiter never limits."""
    wave = bl.SignalGenerator(waveform="sawtooth", frequency=2.652)
    result = run_reference(chain(wave, bl.Saturation(lower=-1.0, upper=1.0), bl.Integrator()), TIMES)
    phase = np.mod(TIMES * 2.652, 1.0)
    np.testing.assert_allclose(result["u/y"], 1.0 - 2.0 * phase, atol=1e-12)
    np.testing.assert_array_equal(result["b1/y"], np.clip(result["u/y"], -1.0, 1.0))
    np.testing.assert_allclose(result["b2/y"], (phase - phase**2) / 2.652, atol=1e-10)


def test_a_relay_keeps_its_mode_within_the_hysteresis() -> None:
    """The relay is on from sin t = 0.5 (rising) to sin t = -0.5 (falling)."""
    t = np.arange(101) * 0.1
    result = run_reference(chain(bl.SineWave(), bl.Relay(), bl.Integrator()), t)
    on, off = math.pi / 6, 7 * math.pi / 6
    hours = sum(np.clip(t, on + k, off + k) - (on + k) for k in (0.0, 2 * math.pi))
    np.testing.assert_allclose(result["b2/y"], hours, atol=1e-10)


def test_a_signal_that_becomes_consistent_at_the_start_does_not_trigger() -> None:
    """The integrator starts at its external initial value 1, not at the parameter -1: no edge rises."""
    inside = DiagramBuilder("passing")
    inside.add("y", bl.Outport(port=1, initial=0.5), inside.add("u", bl.Inport(port=1)))
    builder = DiagramBuilder("start")
    one = builder.add("one", bl.Constant(value=1.0))
    integrator = bl.ResettableIntegrator(initial_condition_source="external", initial=-1.0)
    edge = builder.add("integrator", integrator, one, one, one)
    triggered = bl.TriggeredSubsystem(diagram=inside.build())
    builder.add("triggered", triggered, builder.add("minus", bl.Constant(value=-1.0)), edge)
    diagram = builder.build()
    np.testing.assert_array_equal(run_reference(diagram, TIMES)["triggered/y/y"], 0.5)
    np.testing.assert_array_equal(ab.simulate(diagram, stop_time=2.0)["triggered/y/y"], 0.5)


def test_a_ball_bounces() -> None:
    """A fall from 1 m with e = 0.5: the intervals between bounces form a geometric series."""
    builder = DiagramBuilder("ball")
    position = bl.SecondOrderIntegratorLimited(initial=1.0, lower=0.0, reinitialize=True)
    ball = builder.add("ball", position, builder.add("weight", bl.Constant(value=-9.81)))
    builder.connect(builder.add("bounce", bl.Gain(gain=-0.5), ball["dx"]), ball["dx0"])
    actual = run_reference(builder.build(), TIMES)
    fall = math.sqrt(2 / 9.81)
    t = TIMES - fall
    expected = 1.0 - 9.81 / 2 * TIMES**2
    for bounce in range(60):
        speed, flight = 9.81 * fall * 0.5 ** (bounce + 1), 2 * fall * 0.5 ** (bounce + 1)
        expected = np.where(t >= 0.0, speed * t - 9.81 / 2 * t**2, expected)
        t = t - flight
    expected = np.where(3 * fall <= TIMES, 0.0, expected)
    np.testing.assert_allclose(actual["ball/x"], expected, atol=1e-9)


def test_a_delayed_jump_arrives_on_time() -> None:
    """The integral of a step at 0.31 s after a delay of 0.5 s."""
    result = run_reference(chain(bl.Step(time=0.31), bl.TransportDelay(delay=0.5), bl.Integrator()), TIMES)
    np.testing.assert_allclose(result["b2/y"], np.maximum(TIMES - 0.81, 0.0), atol=1e-12)


def test_a_held_output_has_the_value_just_before_the_subsystem_is_disabled() -> None:
    """A subsystem with input t, enabled in (0, 1): its output stays 1, its integral stays 1/2."""
    builder, inner = DiagramBuilder("outer"), DiagramBuilder("inner")
    entered = inner.input("u")
    inner.output("y", entered)
    inner.output("area", inner.add("area of u", bl.Integrator(), entered))
    enable = builder.add("enable", bl.Step(time=1.0, initial=1.0, final=0.0))
    builder.add(
        "sub", bl.EnabledSubsystem(diagram=inner.build()), builder.add("t", bl.Clock()), enable=enable
    )
    result = run_reference(builder.build(), TIMES)
    np.testing.assert_allclose(result["sub/y/y"], np.minimum(TIMES, 1.0), atol=1e-15)
    np.testing.assert_allclose(result["sub/area/y"], np.minimum(TIMES, 1.0) ** 2 / 2, atol=1e-12)


def test_ticks_use_the_previous_discrete_state() -> None:
    """z(k + 1) = z(k) + 0.1 k 0.1; the output is evaluated before the update."""
    result = run_reference(chain(bl.Clock(), bl.DiscreteIntegrator(sample_time=0.1)), TIMES)
    k = np.floor(TIMES / 0.1 + 1e-9)
    np.testing.assert_allclose(result["b1/y"], 0.01 * k * (k - 1) / 2, atol=1e-14)


def test_an_algebraic_loop_is_solved() -> None:
    """The loop y = sin t - y^3."""
    builder = DiagramBuilder("loop")
    rest = builder.add("rest", bl.Sum(signs="+-"), builder.add("u", bl.SineWave()))
    builder.connect(builder.add("cube", bl.Expression(formula="u^3"), rest), rest["u2"])
    y = run_reference(builder.build(), TIMES)["rest/y"]
    np.testing.assert_allclose(y + y**3, np.sin(TIMES), atol=1e-12)


def test_a_signal_that_passes_through_zero_is_zero_for_one_instant_on_request() -> None:
    """The condition u ~= 0 of ramps u triggers a hold of the time at which u passes through 0, or never."""
    inside = DiagramBuilder("hold")
    inside.add("y", bl.Outport(port=1, initial=-1.0), inside.add("u", bl.Inport(port=1)))
    rng = np.random.default_rng(3)
    for slope, initial in zip(rng.uniform(1.5, 4.0, 8), rng.uniform(-1.0, -0.1, 8)):
        builder = DiagramBuilder("crossing")
        nonzero = builder.add("nonzero", bl.CompareToZero(relation="~="))
        builder.connect(builder.add("ramp", bl.Ramp(slope=slope, initial=initial)), nonzero)
        hold = bl.TriggeredSubsystem(diagram=inside.build(), edge="falling")
        builder.add("hold", hold, u=builder.add("clock", bl.Clock()), trigger=nonzero)
        at_zero = run_reference(builder.build(), TIMES, momentary=True)
        rounded = run_reference(builder.build(), TIMES)
        assert at_zero["hold/y/y"][-1] == pytest.approx(-initial / slope, abs=1e-12)
        assert rounded["hold/y/y"][-1] in (-1.0, at_zero["hold/y/y"][-1])


@pytest.mark.parametrize("method", ["forward_euler", "backward_euler", "trapezoidal"])
def test_an_integral_at_irregular_triggers_agrees_with_its_formula(method: str) -> None:
    inside, builder = DiagramBuilder("inside"), DiagramBuilder("triggered")
    inside.output("y", inside.add("integral", bl.DiscreteIntegrator(method=method), inside.input("u")))
    edges = bl.FromTable(times=[0.0, 0.1, 0.5, 0.9, 0.95, 1.0], values=[-1, 1, -1, 1, -1, 1], method="flat")
    subsystem = bl.TriggeredSubsystem(diagram=inside.build())
    builder.add("sub", subsystem, builder.add("u", bl.Clock()), trigger=builder.add("trigger", edges))
    integral = run_reference(builder.build(), np.array([0.0, 0.1, 0.9, 1.0]))["sub/y/y"][1:]
    expected = {
        "forward_euler": [0.0, 0.08, 0.17],
        "backward_euler": [0.01, 0.73, 0.83],
        "trapezoidal": [0.005, 0.405, 0.5],
    }
    assert np.ravel(integral) == pytest.approx(expected[method], abs=1e-12)


def test_too_many_events_raise_an_error() -> None:
    with pytest.raises(EndlessEventsError, match="more than 20 events"):
        run_reference(chain(bl.SineWave(frequency=1e3), bl.Sign()), TIMES, max_events=20)


def test_an_unsupported_diagram_raises_an_error() -> None:
    with pytest.raises(UnsupportedError, match="differentiated twice"):
        run_reference(chain(bl.SineWave(), bl.Derivative(), bl.Derivative()), TIMES)


# -- every block of the library ----------------------------------------------------------------------------

NOT_COVERED = {
    "ArmPlant": "sticking_reference covers it, and it is slow here",
    "CalledPythonFunction": "Python is called at ticks",
    "FromFile": "reads a table by index",
    "PositionDrivenArm": "reads a second derivative",
    "Trajectory": "reads a table by index",
}
TRIALS = ((0.05, 11), (0.01, 11), (0.0005, 4))
"""Step and number of recorded times. One trial that agrees is sufficient: steps of 0.05 s for slow signals,
the shortest steps for stiff systems, such as a robot with a stiff controller."""


@pytest.mark.parametrize("kind", [name for name in BLOCKS if name not in NOT_COVERED])
def test_a_native_run_agrees_with_the_reference(kind: str) -> None:
    """The worked example of the block, simulated natively with rtol 1e-9."""
    diagram = worked_example(BLOCKS[kind])
    times = np.arange(11) * 0.1
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # warnings about exceeded joint limits are not tested here
        result = ab.simulate(diagram, stop_time=float(times[-1]), sample_time=0.1, rtol=1e-9, atol=1e-12)
    worst: dict[str, float] = {}
    for step, count in TRIALS:
        expected = run_reference(diagram, times[:count], step)
        # Signals between the blocks of a mechanism are not recorded.
        recorded = {name: values for name, values in expected.items() if name in result}
        worst = {name: distance(result[name][:count], values) for name, values in recorded.items()}
        if all(value < 1e-6 for value in worst.values()):
            return
    raise AssertionError({name: value for name, value in worst.items() if not value < 1e-6})


def distance(actual: np.ndarray, expected: np.ndarray) -> float:
    """Return the largest difference, relative to 1 + the largest value."""
    if actual.shape != expected.shape:
        return math.inf
    return float(np.abs(actual - expected).max(initial=0.0) / (1.0 + np.abs(expected).max(initial=0.0)))


@pytest.mark.parametrize("kind", FORMULAS)
def test_a_block_agrees_with_its_formula(kind: str) -> None:
    """The comparison uses every recorded time of the worked example."""
    diagram = worked_example(BLOCKS[kind])
    result = ab.simulate(diagram, stop_time=10.0, sample_time=0.05)
    assert broken_formulas(diagram, result, result.time) == {}

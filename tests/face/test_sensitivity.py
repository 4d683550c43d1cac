"""Derivatives of runs with respect to parameters compared with closed forms and differences of runs."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import (
    PWM,
    Backlash,
    Constant,
    Derivative,
    DifferentialIkine,
    EnabledSubsystem,
    Expression,
    FirstOrderHold,
    Fkine,
    FromFile,
    Gain,
    HitCrossing,
    Inport,
    Integrator,
    JTraj,
    Modulo,
    Outport,
    Ramp,
    RandomNumber,
    ResettableIntegrator,
    ResettableSubsystem,
    Saturation,
    SignalGenerator,
    SineWave,
    Step,
    Sum,
    TransferFunction,
    TransportDelay,
    TriggeredSubsystem,
    VariableTimeDelay,
    VariableTransportDelay,
    ZeroOrderHold,
)
from armblocks.errors import InputError, SimulationError, UnknownNameError

TIGHT = {"rtol": 1e-10, "atol": 1e-12, "stop_time": 3.0, "sample_time": 0.1}


def decay() -> ab.Diagram:
    """x' = -k x, x(0) = a."""
    builder = ab.DiagramBuilder("decay")
    state = builder.add("x", Integrator(initial=2.0))
    builder.connect(builder.add("k", Gain(gain=-0.7), state), state["u"])
    return builder.build()


def test_sensitivities_of_a_decay_agree_with_the_closed_form() -> None:
    for solver in ({}, {"solver": "rk4", "step": 0.001}):
        result = ab.sensitivity(decay(), ["k.gain", "x.initial"], "x", **{**TIGHT, **solver})
        t = result.time
        assert np.allclose(result["x", "k.gain"], 2.0 * t * np.exp(-0.7 * t), atol=1e-9)
        assert np.allclose(result["x", "x.initial"], np.exp(-0.7 * t), atol=1e-9)


def differences(
    diagram: ab.Diagram, parameter: str, output: str, step: float, **settings: object
) -> tuple[np.ndarray, np.ndarray]:
    """Return Richardson-extrapolated central differences of runs, and their change with half the step."""
    compiled = ab.compile_diagram(diagram)
    middle = compiled.system.parameters.unpack(compiled.system.parameter_values)[parameter]

    def run(change: float) -> np.ndarray:
        return ab.simulate(diagram, parameters={parameter: middle + change}, **settings)[output]

    plain = [(run(h) - run(-h)) / (2.0 * h) for h in (step, 0.5 * step, 0.25 * step)]
    first, second = ((4.0 * fine - coarse) / 3.0 for coarse, fine in pairwise(plain))
    return second, np.abs(second - first)


def sampled_diagram() -> ab.Diagram:
    builder = ab.DiagramBuilder("sampled")
    reference = builder.add("reference", Constant(value=1.0))
    error = builder.add("error", Sum(signs="+-"), reference)
    held = builder.add("hold", ZeroOrderHold(sample_time=0.25), builder.add("gain", Gain(gain=2.0), error))
    rate = builder.add("rate", Sum(signs="+-"), held)
    state = builder.add("x", Integrator(), rate)
    builder.connect(state, rate["u2"])
    builder.connect(state, error["u2"])
    return builder.build()


def implicit_diagram() -> ab.Diagram:
    builder = ab.DiagramBuilder("implicit")
    state = builder.add("x", Integrator(initial=0.7))
    total = builder.add("sum", Sum(signs="+-"), state)
    builder.connect(
        builder.add("cube", Expression(formula="k*u^3", names="k", values=1.5), total), total["u2"]
    )
    builder.connect(builder.add("gain", Gain(gain=-1.0), total), state["u"])
    return builder.build()


def limiter_diagram() -> ab.Diagram:
    """The integral of a sine after a gain and a limiter."""
    builder = ab.DiagramBuilder("limited")
    wave = builder.add("wave", SineWave(frequency=3.0, amplitude=2.0))
    gain = builder.add("gain", Gain(gain=1.3), wave)
    builder.add("x", Integrator(), builder.add("limit", Saturation(lower=-1.0, upper=1.5), gain))
    return builder.build()


def delay_diagram() -> ab.Diagram:
    """A delay in a loop, two delays before a Derivative, and a variable delay."""
    builder = ab.DiagramBuilder("delayed")
    square = builder.add("square", SignalGenerator(waveform="square", frequency=0.9, amplitude=1.2))
    rate = builder.add("rate", Sum(signs="+-++"), square)
    state = builder.add("x", Integrator(initial=0.3), rate)
    builder.connect(
        builder.add("gain", Gain(gain=1.1), builder.add("loop", TransportDelay(delay=0.53), state)),
        rate["u2"],
    )
    wave = builder.add("wave", SineWave(frequency=2.0, amplitude=1.3, bias=0.4))
    twice = builder.add(
        "twice", TransportDelay(delay=0.31), builder.add("once", TransportDelay(delay=0.27), wave)
    )
    builder.connect(
        builder.add("power", Expression(formula="u^2"), builder.add("derivative", Derivative(), twice)),
        rate["u3"],
    )
    late = builder.add("late", VariableTimeDelay(shortest=0.1, longest=2.0, initial=0.7), square)
    builder.connect(builder.add("delay", SineWave(amplitude=0.2, bias=0.5)), late["d"])
    builder.connect(late, rate["u4"])
    return builder.build()


def conditional_subsystems() -> ab.Diagram:
    """Enabled, triggered and resettable subsystems in one loop with their control signals."""
    builder = ab.DiagramBuilder("switched")
    wave = builder.add("wave", SineWave(frequency=2.0, bias=0.3))
    ramp = builder.add("ramp", Ramp(slope=0.8, initial=0.2))
    total = builder.add("total", Sum(signs="+++"))
    builder.add("x", Integrator(), total)
    kinds = (
        EnabledSubsystem(diagram=gain_and_integrator(), states_when_enabling="reset"),
        TriggeredSubsystem(diagram=gain_and_integrator(states=False), edge="either"),
        ResettableSubsystem(diagram=gain_and_integrator()),
    )
    for number, (kind, port) in enumerate(zip(kinds, ("enable", "trigger", "reset")), start=1):
        block = builder.add(port, kind)
        builder.connect(ramp, block["In1"])
        builder.connect(wave, block[port])
        builder.connect(block, total[f"u{number}"])
    return builder.build()


def gain_and_integrator(*, states: bool = True) -> ab.Diagram:
    """A gain followed by an integrator."""
    builder = ab.DiagramBuilder("inside")
    last = builder.add("gain", Gain(gain=1.5), builder.add("In1", Inport()))
    last = builder.add("state", Integrator(initial=0.3), last) if states else last
    builder.add("Out1", Outport(), last)
    return builder.build()


def backlash_outside_its_band() -> ab.Diagram:
    """Backlash that is enabled and reset outside its dead band, before a block with an event at that time."""
    builder = ab.DiagramBuilder("pushed")
    wave = builder.add("wave", SineWave(frequency=3.0, amplitude=2.0, phase=0.3))
    control = builder.add("control", SineWave(frequency=2.1, bias=0.2, phase=-0.6))
    total = builder.add("total", Sum(signs="++"))
    builder.add("x", Integrator(), total)
    for number, port in enumerate(("enable", "reset"), start=1):
        inner = ab.DiagramBuilder("inside")
        inner.add(
            "Out1",
            Outport(),
            inner.add("play", Backlash(width=0.5 + 0.2 * number), inner.add("In1", Inport())),
        )
        kind = EnabledSubsystem if port == "enable" else ResettableSubsystem
        gear = builder.add(port, kind(diagram=inner.build()), wave)
        builder.connect(control, gear[port])
        builder.connect(gear, total[f"u{number}"])
        builder.add(f"{port} hits", HitCrossing(offset=0.6), gear)
    return builder.build()


def pulses() -> ab.Diagram:
    """Pulses of variable width, a limited sawtooth and a step; the integrator adds them."""
    builder = ab.DiagramBuilder("pulses")
    pwm = builder.add("pwm", PWM(period=0.13), builder.add("duty", SineWave(amplitude=0.3, bias=0.5)))
    total = builder.add("total", Sum(signs="+++"), pwm)
    saw = builder.add("saw", SignalGenerator(waveform="sawtooth", frequency=1.3, amplitude=1.5))
    builder.connect(builder.add("cut", Saturation(lower=-1.0, upper=1.0), saw), total["u2"])
    builder.connect(builder.add("step", Step(time=1.03)), total["u3"])
    builder.add("x", Integrator(), total)
    return builder.build()


def limited_loop() -> ab.Diagram:
    """An implicit equation that depends on a state; the input of the state is limited."""
    builder = ab.DiagramBuilder("limited loop")
    state = builder.add("x", Integrator(initial=0.7))
    total = builder.add("sum", Sum(signs="+-"), state)
    cube = builder.add("cube", Expression(formula="k*u^3", names="k", values=(1.5,)), total)
    builder.connect(cube, total["u2"])
    drive = builder.add("drive", Sum(signs="+-"), builder.add("wave", SineWave(frequency=4.0, amplitude=3.0)))
    builder.connect(builder.add("gain", Gain(gain=1.0), total), drive["u2"])
    builder.connect(builder.add("limit", Saturation(lower=-1.0, upper=0.8), drive), state["u"])
    return builder.build()


@pytest.mark.parametrize(
    ("make", "step", "parameters"),
    [
        (sampled_diagram, 1e-3, ["gain.gain"]),
        (implicit_diagram, 1e-3, ["cube.values"]),
        (limiter_diagram, 1e-3, ["gain.gain", "limit.upper", "wave.frequency"]),
        (limited_loop, 1e-3, ["gain.gain", "cube.values", "limit.upper", "wave.frequency"]),
        (delay_diagram, 4e-3, ["square.frequency", "loop.delay", "gain.gain", "x.initial"]),
        (
            delay_diagram,
            4e-3,
            ["once.delay", "twice.delay", "wave.frequency", "delay.amplitude", "late.initial"],
        ),
        (
            conditional_subsystems,
            1e-3,
            ["wave.bias", "wave.frequency", "ramp.slope", "enable/gain.gain", "trigger/gain.gain"],
        ),
        (
            backlash_outside_its_band,
            1e-3,
            ["wave.amplitude", "control.bias", "enable/play.width", "reset/play.width"],
        ),
        (
            pulses,
            1e-4,
            ["pwm.period", "pwm.amplitude", "duty.bias", "saw.frequency", "cut.upper", "step.time"],
        ),
    ],
)
def test_sensitivities_agree_with_differences_of_runs(
    make: Callable[[], ab.Diagram], step: float, parameters: list[str]
) -> None:
    diagram = make()
    # No signal jumps at a multiple of the sample time.
    settings = {**TIGHT, "sample_time": 0.0997}
    result = ab.sensitivity(diagram, parameters, "x", **settings)
    for parameter in parameters:
        actual = result["x", parameter]
        # Where an event of one run is before a sample and that of another run after it, differences are
        # invalid.
        expected, uncertainty = differences(diagram, parameter, "x", step, **settings)
        assert np.mean(uncertainty < 1e-3) > 0.8
        assert np.all(np.abs(actual - expected) <= 1e-5 * (1.0 + np.abs(expected)) + 10.0 * uncertainty), (
            parameter
        )
        assert np.abs(actual).max() > 1e-2


def test_the_sensitivity_of_a_delayed_ramp_agrees_with_the_closed_form() -> None:
    """y = a (t - d) for t > d, otherwise y is the initial value."""
    builder = ab.DiagramBuilder("ramp")
    builder.add("y", TransportDelay(delay=0.7, initial=0.2), builder.add("u", Ramp(slope=1.5)))
    result = ab.sensitivity(builder.build(), ["u.slope", "y.delay", "y.initial"], "y", **TIGHT)
    after_delay = result.time > 0.75
    assert np.allclose(result["y", "u.slope"], np.where(after_delay, result.time - 0.7, 0.0), atol=1e-12)
    assert np.allclose(result["y", "y.delay"][after_delay], -1.5, atol=1e-12)
    assert np.array_equal(result["y", "y.initial"], result.time < 0.65)


def test_the_arrival_in_a_pipe_whose_transit_time_changes_at_the_start() -> None:
    """With the transit time a for t < 0 and T from 0 on, the delay is a + t (1 - a/T) until the first arrival
    at t = T, then it is T. The rate of the delay jumps at the arrival."""
    builder = ab.DiagramBuilder("pipe")
    pipe = builder.add("pipe", VariableTransportDelay(initial_delay=0.55, initial=-0.5))
    builder.connect(builder.add("u", Constant(value=1.0)), pipe["u"])
    builder.connect(builder.add("T", Constant(value=0.52)), pipe["T"])
    builder.add("sum", Integrator(), pipe["y"])
    names = ["T.value", "pipe.initial_delay"]
    result = ab.sensitivity(builder.build(), names, ["pipe/delay", "sum"], **TIGHT)
    t, arrived = result.time, result.time > 0.52
    by_transit = np.where(arrived, 1.0, t * 0.55 / 0.52**2)
    assert np.allclose(result["pipe/delay", "T.value"], by_transit, atol=1e-8)
    by_initial = np.where(arrived, 0.0, 1.0 - t / 0.52)
    assert np.allclose(result["pipe/delay", "pipe.initial_delay"], by_initial, atol=1e-8)
    assert np.allclose(result["sum", "T.value"], np.where(arrived, -1.5, 0.0), atol=1e-8)


def test_every_jump_of_a_rapid_series_arrives_after_a_delay() -> None:
    """u moves from -9.4 to -1.4, and from 0.5 s on from 7.06 to -0.14, with the time constant 0.01 s. y =
    mod(u, M) jumps at u = k M, at first twice a millisecond. Its integral is that of u - M floor(u / M)."""
    builder = ab.DiagramBuilder("series")
    step = builder.add("step", Step(time=0.5, initial=1.0, final=0.1))
    lag = builder.add("lag", TransferFunction(numerator=(8.0,), denominator=(0.01, 1.0)), step)
    u = builder.add("u", Sum(signs="+-"), lag, builder.add("direct", Gain(gain=9.4), step))
    y = builder.add("y", Modulo(), u, builder.add("M", Constant(value=0.31)))
    builder.add("sum", Integrator(), builder.add("late", TransportDelay(delay=0.3), y))
    settings = {**TIGHT, "stop_time": 1.4, "solver": "dop853"}
    result = ab.sensitivity(builder.build(), "M.value", "sum", **settings)
    expected = 0.0
    for begin, end, first, last in ((0.0, 0.5, -9.4, -1.4), (0.5, 1.1, 7.06, -0.14)):
        direction = math.copysign(1.0, last - first)
        k = np.arange(math.floor(first / 0.31) + (direction > 0.0), last / 0.31, direction)
        times = begin - 0.01 * np.log((k * 0.31 - last) / (first - last))
        rates = (last - k * 0.31) / 0.01
        floors = math.floor(first / 0.31) + direction * np.arange(k.size + 1)
        expected -= np.sum(floors * np.diff([begin, *times, end])) - 0.31 * np.sum(direction * k / rates)
    assert abs(result["sum", "M.value"][-1] - expected) < 1e-5


def test_a_held_output_depends_on_the_time_when_the_subsystem_is_disabled() -> None:
    """The subsystem outputs t until c - t = 0, and then holds c, whose derivative is 1."""
    builder = ab.DiagramBuilder("off")
    ramp = builder.add("t", Ramp(slope=1.0))
    off = builder.add("off", Sum(signs="+-"), builder.add("c", Constant(value=1.33)), ramp)
    inner = ab.DiagramBuilder("inside")
    inner.add("Out1", Outport(), inner.add("In1", Inport()))
    held = builder.add("held", EnabledSubsystem(diagram=inner.build()))
    builder.connect(ramp, held["In1"])
    builder.connect(off, held["enable"])
    result = ab.sensitivity(builder.build(), "c.value", "held/Out1", **TIGHT)
    assert np.allclose(result["held/Out1", "c.value"], result.time > 1.35, atol=1e-12)


def test_derivatives_by_a_vector_parameter_have_an_additional_axis() -> None:
    builder = ab.DiagramBuilder("entries")
    state = builder.add("x", Integrator(initial=(1.0, 2.0)))
    both = builder.add("f", Expression(formula="a*u - b", names="a, b", values=(-0.5, 0.2)), state)
    builder.connect(both, state["u"])
    result = ab.sensitivity(builder.build(), ["f.values", "x.initial"], "x", **TIGHT)
    assert result.parameters == ("f.values", "x.initial")
    decay = np.exp(-0.5 * result.time)
    assert result["x", "f.values"].shape == (result.time.size, 2, 2)
    assert np.array_equal(result["x", "f.values"][..., 1], result["x", "f.values[1]"])
    assert np.allclose(result["x", "f.values[1]"], 2.0 * (decay - 1.0)[:, np.newaxis], atol=1e-9)
    assert np.allclose(result["x", "x.initial"], decay[:, np.newaxis, np.newaxis] * np.eye(2), atol=1e-9)


def test_coinciding_events_that_a_parameter_separates_are_refused() -> None:
    builder = ab.DiagramBuilder("together")
    total = builder.add("sum", Sum(signs="++"), builder.add("first", Step()), builder.add("second", Step()))
    builder.add("x", Integrator(), total)
    with pytest.raises(SimulationError, match=r"several events coincide at 1 s, one of 'first' among them"):
        ab.sensitivity(builder.build(), "first.time", "x")


def test_the_sensitivity_includes_the_shift_of_a_reset_time() -> None:
    """x' = 2, reset to 0 when y = a t reaches 1 at t = 1 / a: then x = 2 (t - 1 / a), dx/da = 2 / a^2."""
    builder = ab.DiagramBuilder("reset")
    rate = builder.add("a", Constant(value=0.8))
    ramp = builder.add("y", Integrator(), rate)
    trigger = builder.add("trigger", Sum(signs="+-"), ramp, builder.add("one", Constant(value=1.0)))
    two = builder.add("two", Constant(value=2.0))
    builder.add("x", ResettableIntegrator(external_reset="rising"), two, trigger)
    result = ab.sensitivity(builder.build(), "a.value", "x", **TIGHT)
    after = result.time > 1.25 + 1e-9
    assert np.allclose(result.run["x"][after], 2.0 * (result.time[after] - 1.25), atol=1e-9)
    assert np.allclose(result["x", "a.value"][after], 2.0 / 0.8**2, atol=1e-8)
    assert np.allclose(result["x", "a.value"][~after & (result.time < 1.2)], 0.0, atol=1e-12)


def test_an_event_at_a_breakpoint_does_not_depend_on_the_gain() -> None:
    """The limiter switches at the time of the step for every gain."""
    builder = ab.DiagramBuilder("known")
    gain = builder.add("gain", Gain(gain=3.0), builder.add("step", Step(time=1.0)))
    builder.add("x", Integrator(), builder.add("limit", Saturation(lower=-1.0, upper=1.5), gain))
    result = ab.sensitivity(builder.build(), ["gain.gain", "limit.upper"], "x", **TIGHT)
    assert np.allclose(result["x", "gain.gain"], 0.0, atol=1e-12)
    assert np.allclose(result["x", "limit.upper"], np.maximum(result.time - 1.0, 0.0), atol=1e-9)


def test_a_hold_samples_where_a_mode_changes_at_the_same_instant() -> None:
    """Every sample is proportional to the amplitude of the square wave, above 1 and below -1 in part."""
    builder = ab.DiagramBuilder("samples")
    square = builder.add("square", SignalGenerator(waveform="square", amplitude=1.3))
    total = builder.add("total", Sum(), builder.add("cut", Saturation(lower=-1.0, upper=5.0), square), square)
    builder.add("line", FirstOrderHold(period=0.25), total)
    inner = ab.DiagramBuilder("part")
    inner.add("y", Outport(), inner.add("line", FirstOrderHold(period=0.25), inner.add("u", Inport())))
    wave = builder.add("wave", SineWave(amplitude=1.3, frequency=3.0, phase=0.3))
    always = builder.add("always", Constant(value=1.0))
    builder.add("enabled", EnabledSubsystem(diagram=inner.build()), wave, enable=always)
    diagram, settings = builder.build(), {"stop_time": 2.0, "sample_time": 0.0625}
    result = ab.sensitivity(diagram, ("square.amplitude", "wave.amplitude"), ("line", "enabled"), **settings)
    t, by_wave = result.time, result["enabled", "wave.amplitude"]
    np.testing.assert_allclose(by_wave, result.run["enabled"] / 1.3, rtol=0.0, atol=1e-12)
    # The samples have the derivatives -1 (square wave -1.3, cut) and 2 (1.3); the sample before them is 0.
    samples = np.array([0.0, *np.tile([-1.0, -1.0, 2.0, 2.0], 3)])
    k = np.floor(4.0 * t).astype(int)
    expected = samples[k + 1] + (samples[k + 1] - samples[k]) * (4.0 * t - k)
    np.testing.assert_allclose(result["line", "square.amplitude"], expected, rtol=0.0, atol=1e-12)


def test_delays_and_implicit_equations_together_are_refused() -> None:
    builder = ab.DiagramBuilder("both")
    state = builder.add("x", Integrator(initial=0.7))
    total = builder.add("sum", Sum(signs="+-"), state)
    builder.connect(builder.add("cube", Expression(formula="u^3"), total), total["u2"])
    gain = builder.add("gain", Gain(gain=-1.0), total)
    builder.connect(builder.add("late", TransportDelay(), gain), state["u"])
    with pytest.raises(InputError, match=r"the delayed signals and the implicit equation of '.*' are in one"):
        ab.sensitivity(builder.build(), "gain.gain", "x")


def test_a_parameter_of_a_jump_time_with_an_implicit_equation_is_refused() -> None:
    builder = ab.DiagramBuilder("both")
    total = builder.add("sum", Sum(signs="+-"), builder.add("step", Step()))
    builder.connect(builder.add("cube", Expression(formula="u^3"), total), total["u2"])
    builder.add("x", Integrator(), total)
    with pytest.raises(
        InputError, match=r"the parameter that determines when a signal jumps and the implicit equ"
    ):
        ab.sensitivity(builder.build(), "step.time", "x")


def test_the_sensitivity_to_a_seed_is_refused() -> None:
    builder = ab.DiagramBuilder("noise")
    builder.add("x", Integrator(), builder.add("noise", RandomNumber(sample_time=0.1)))
    with pytest.raises(InputError, match=r"'noise.seed' acts only through comparisons or its integer part"):
        ab.sensitivity(builder.build(), "noise.seed", "x")


def test_unknown_names_and_empty_lists_are_refused() -> None:
    with pytest.raises(UnknownNameError, match=r"there is no tunable parameter named 'k.gian'"):
        ab.sensitivity(decay(), "k.gian", "x")
    with pytest.raises(UnknownNameError, match="there is no signal named 'y'"):
        ab.sensitivity(decay(), "k.gain", "y")
    with pytest.raises(InputError, match="0 parameters and 1 output are given"):
        ab.sensitivity(decay(), [], "x")
    result = ab.sensitivity(decay(), "k.gain", "x", **TIGHT)
    with pytest.raises(UnknownNameError, match="there is no parameter named 'k'"):
        _ = result["x", "k"]


def test_the_sensitivity_to_an_indexed_table_is_refused_and_others_are_correct() -> None:
    builder = ab.DiagramBuilder("table", settings=ab.SimulationOptions(stop_time=2.0, sample_time=0.5))
    table = builder.add("table", FromFile(data=((0.0, 1.0), (1.0, 3.0), (2.0, -1.0))))
    builder.add("sum", Integrator(), builder.add("gain", Gain(gain=2.0), table))
    diagram = builder.build()
    with pytest.raises(InputError, match=r"'table\.data' is a table that is read by index"):
        ab.sensitivity(diagram, "table.data", "sum")
    result = ab.sensitivity(diagram, ["gain.gain"], ["sum"])
    # d/dk of k times the integral of the table is that integral: 0, 0.75, 2, 3, 3 every half second
    assert result["sum", "gain.gain"] == pytest.approx([0.0, 0.75, 2.0, 3.0, 3.0], rel=1e-5, abs=1e-6)


def test_the_rotation_error_of_an_arm_passes_zero_in_a_run_with_derivatives() -> None:
    """A condition for a rotation of zero would divide zero by zero at its event."""
    robot = ab.load_robot("twolink").robot
    builder = ab.DiagramBuilder("passes")
    motion = builder.add(
        "motion",
        JTraj(
            q0=[0.34094470689079426, 0.5996500799331719],
            qf=[0.9687810390959505, 1.3432089519442145],
            tmax=7.278617312138701,
        ),
    )
    ikine = DifferentialIkine(
        robot=robot,
        q0=[0.5678733792354316, 0.9749222175472892],
        gain=10.809977675593643,
        damping=0.09330546833103433,
        region=0.022557222485450844,
        max_speed=2.870894557652534,
    )
    target = builder.add("target", Fkine(robot=robot), motion["q"])
    velocity = builder.add("velocity", Constant(value=[0.0] * 6))
    speeds = builder.add("ikine", ikine, target, velocity)
    for port in ("q", "qd"):
        late = builder.add(f"late {port}", TransportDelay(delay=0.37), speeds[port])
        builder.add(f"integral of {port}", Integrator(), late)
    diagram, names = builder.build(), ("ikine.gain", "motion.tmax")
    settings = {"rtol": 1e-10, "atol": 1e-11, "stop_time": 1.0, "sample_time": 3.0 / 37.3, "solver": "rk45"}
    found = ab.sensitivity(diagram, names, "integral of q", **settings)
    for name in names:
        value = diagram.blocks[name.partition(".")[0]].parameter_value(name.partition(".")[2])
        low, high = (
            ab.simulate(diagram, parameters={name: value + step}, **settings)["integral of q"]
            for step in (-1e-4, 1e-4)
        )
        assert found["integral of q", name] == pytest.approx((high - low) / 2e-4, rel=1e-4, abs=1e-6)

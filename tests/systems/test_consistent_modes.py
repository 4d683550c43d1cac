"""Modes are consistent with the signals after jumps, and where a signal touches a switching value.

The references are formulas in NumPy, which hold at every recorded time for every tolerance.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import pytest
from numpy.typing import NDArray

import armblocks as ab
from armblocks import DiagramBuilder
from armblocks.blocks import (
    Abs,
    Backlash,
    Bias,
    Clock,
    CombinatorialLogic,
    CompareToConstant,
    CompareToZero,
    Constant,
    CoulombFriction,
    DeadZone,
    DirectLookup,
    EnabledSubsystem,
    Expression,
    Gain,
    HitCrossing,
    Inport,
    Integrator,
    IntegratorLimited,
    IntervalTest,
    LogicalOperator,
    MathFunction,
    Modulo,
    Mux,
    Outport,
    Product,
    PulseGenerator,
    Quantizer,
    Ramp,
    RateLimiterContinuous,
    RateLimiterDynamic,
    RelationalOperator,
    Relay,
    RepeatingSequence,
    ResettableIntegrator,
    Rounding,
    Saturation,
    SecondOrderIntegratorLimited,
    Sign,
    SignalGenerator,
    SineWave,
    Step,
    StickSlipFriction,
    Sum,
    Switch,
    TransportDelay,
    TriggeredSubsystem,
    TruthTable,
    ZeroOrderHold,
)
from armblocks.diagram import Block, Diagram
from armblocks.errors import SimulationError

Array = NDArray[np.float64]

SWITCHING: Mapping[str, tuple[Callable[[], Block], Callable[[Array], Array]]] = {
    "saturation": (lambda: Saturation(lower=-1.0, upper=1.0), lambda u: np.clip(u, -1.0, 1.0)),
    "inner": (lambda: Saturation(lower=-0.5, upper=0.25), lambda u: np.clip(u, -0.5, 0.25)),
    "dead zone": (lambda: DeadZone(start=-1.0, end=1.0), lambda u: u - np.clip(u, -1.0, 1.0)),
    "sign": (Sign, np.sign),
    "absolute": (Abs, np.abs),
    "compared": (lambda: CompareToZero(relation=">"), lambda u: (u > 0.0).astype(float)),
    "interval": (
        lambda: IntervalTest(lower=-1.0, upper=1.0),
        lambda u: ((u >= -1.0) & (u <= 1.0)).astype(float),
    ),
    "friction": (CoulombFriction, lambda u: np.sign(u) + u),
    "quantizer": (lambda: Quantizer(interval=0.5), lambda u: 0.5 * np.floor(u / 0.5 + 0.5)),
    "ceiling": (lambda: Rounding(function="ceil"), np.ceil),
}


def sources() -> dict[str, Block]:
    """Return signals that jump to or touch a switching value; the random frequencies have a fixed seed."""
    random = np.random.default_rng(9)
    blocks: dict[str, Block] = {"as found": SignalGenerator(waveform="sawtooth", frequency=2.652)}
    for number, frequency in enumerate((1.0, 2.5, *random.uniform(0.3, 4.0, 2))):
        blocks[f"sawtooth {number}"] = SignalGenerator(waveform="sawtooth", frequency=frequency)
        blocks[f"square {number}"] = SignalGenerator(waveform="square", frequency=frequency)
        blocks[f"rise {number}"] = RepeatingSequence(times=(0.0, 1.0 / frequency), values=(-1.0, 1.0))
        blocks[f"pulses {number}"] = PulseGenerator(period=1.0 / frequency, width=37.0)
    blocks["step"] = Step(time=1.55, initial=1.0, final=-1.0)
    blocks["crest"] = SineWave(frequency=2.0)
    return blocks


@pytest.mark.parametrize("rtol", [1e-3, 1e-8])
def test_the_output_of_a_switching_block_agrees_with_its_formula(rtol: float) -> None:
    builder = DiagramBuilder("borders")
    for name, source in sources().items():
        signal = builder.add(name, source)
        builder.add(f"{name}: integral", Integrator(), signal)
        for kind, (block, _) in SWITCHING.items():
            builder.add(f"{name}: {kind}", block(), signal)
    result = ab.simulate(builder.build(), stop_time=10.0, sample_time=0.05, rtol=rtol)
    errors: list[str] = []
    for name in sources():
        u = result[f"{name}/y"]
        for kind, (_, formula) in SWITCHING.items():
            output = result[f"{name}: {kind}/y"]
            # If the input crosses a switching value at a recorded time, rounding decides between the two
            # sides.
            sides = [formula(u + shift) for shift in (0.0, -1e-12, 1e-12)]
            differs = np.min([np.abs(output - side) for side in sides], axis=0) > 1e-11
            errors += [
                f"{name}: {kind} at {t} s: {y} of {value}"
                for t, y, value in zip(result.time[differs], output[differs], u[differs])
            ]
    assert not errors, "\n".join(errors[:20])


def rate_limited(u: Array, dt: float, rising: float, falling: float, start: float) -> Array:
    """Limit the rates of ``u (N, n)`` with small steps."""
    y = np.empty_like(u)
    y[0] = start
    for k in range(1, len(u)):
        y[k] = y[k - 1] + np.clip(u[k] - y[k - 1], falling * dt, rising * dt)
    return y


def test_rates_of_many_sines_are_limited() -> None:
    """Sines with crests, contacts with the limit, and starts below and above, with few events each."""
    random = np.random.default_rng(4)
    count, dt = 30, 1e-3
    amplitude, frequency = random.uniform(0.3, 3.0, count), random.uniform(0.3, 3.0, count)
    phase = random.uniform(0.0, 6.0, count)
    amplitude[0], frequency[0], phase[0] = 1.1166089529668757, 1.7826608001550557, 2.350048796723417
    amplitude[1], frequency[1], phase[1] = 1.5, 1.0, 0.0
    frequency[2] = 1.0 / amplitude[2]  # the rate of this sine touches the limit
    builder = DiagramBuilder("sines")
    sines = builder.add("u", SineWave(amplitude=amplitude, frequency=frequency, phase=phase))
    builder.add("fixed", RateLimiterContinuous(), sines)
    one, minus = builder.add("one", Constant(value=1.0)), builder.add("minus", Constant(value=-1.0))
    builder.add("dynamic", RateLimiterDynamic(), one, sines, minus)
    result = ab.simulate(builder.build(), stop_time=10.0, sample_time=dt)
    u = result["u/y"]
    for name in ("fixed/y", "dynamic/y"):
        expected = rate_limited(u, dt, 1.0, -1.0, 0.0)
        # The reference is a first-order method.
        np.testing.assert_allclose(result[name], expected, rtol=0, atol=2e-3)
    assert result.run.events < 60 * count


def test_a_rate_limiter_approaches_its_input_after_a_jump() -> None:
    builder = DiagramBuilder("jump")
    jump = builder.add("u", Step(time=1.0, initial=0.5, final=2.0))
    builder.add("limited", RateLimiterContinuous(rising=0.5, falling=-0.5, initial=0.5), jump)
    result = ab.simulate(builder.build(), stop_time=6.0, sample_time=0.25)
    np.testing.assert_allclose(
        result["limited/y"], np.clip(0.5 + 0.5 * (result.time - 1.0), 0.5, 2.0), atol=1e-9
    )


def ball(restitution: float, start: float, rest_speed: float = 1e-6) -> Diagram:
    """A ball 1 m above the floor that is released at a given time."""
    builder = DiagramBuilder("ball")
    gravity = builder.add("gravity", Step(time=start, initial=0.0, final=-9.81))
    block = SecondOrderIntegratorLimited(initial=1.0, lower=0.0, reinitialize=True, rest_speed=rest_speed)
    body = builder.add("ball", block)
    builder.connect(gravity, body["u"])
    builder.connect(builder.add("bounce", Gain(gain=-restitution), body["dx"]), body["dx0"])
    return builder.build()


@pytest.mark.parametrize(
    ("restitution", "start", "stop"),
    [(0.7, 300.0, 310.0), (0.7, 3e5, 3e5 + 10.0), (0.999, 0.0, 1000.0), (0.99, 1e6, 1e6 + 100.0)],
)
def test_a_ball_comes_to_rest_at_any_time(restitution: float, start: float, stop: float) -> None:
    """The ball bounces until its speed is 1e-6 m/s, which gives the number of bounces, and then rests."""
    result = ab.simulate(ball(restitution, start), stop_time=stop, sample_time=(stop - start) / 10.0)
    impact = np.sqrt(2 * 9.81)
    bounces = int(np.ceil(np.log(1e-6 / impact) / np.log(restitution)))
    assert result.run.complete
    assert result["ball/x"].min() >= 0.0
    assert result["ball/x"][-1] == 0.0
    # Rounding errors of the time affect the number of the last slow bounces.
    assert result.run.events == pytest.approx(bounces, rel=0.1, abs=2)


@pytest.mark.parametrize("restitution", [0.001, 0.5])
def test_a_ball_with_rest_speed_zero_is_reported_for_endless_events(restitution: float) -> None:
    with pytest.raises(SimulationError, match=r"block 'ball' causes events without end at 30[01]"):
        ab.simulate(ball(restitution, 300.0, rest_speed=0.0), stop_time=310.0, sample_time=1.0)


def test_the_error_names_the_chattering_block_and_no_other() -> None:
    builder = DiagramBuilder("chatter")
    early = builder.add("early", SignalGenerator(waveform="square", frequency=3.0))
    builder.add("bystander", Saturation(lower=-0.3, upper=0.3), early)
    speed = builder.add("turned", Gain(gain=-1.0))
    place = builder.add("place", Integrator(initial=1.0), speed)
    builder.connect(builder.add("relay", Sign(), place), speed["u"])
    with pytest.raises(SimulationError, match="block 'relay' causes events without end") as caught:
        ab.simulate(builder.build(), stop_time=3.0)
    assert "early" not in str(caught.value)


@pytest.mark.parametrize("initial", [-2.0, 0.3, 2.0])
def test_a_backlash_with_an_initial_output_outside_its_band_moves_into_it(initial: float) -> None:
    builder = DiagramBuilder("play")
    play = builder.add("play", Backlash(initial=initial), builder.add("input", Ramp(initial=0.5, slope=-1.0)))
    builder.add("hit", HitCrossing(offset=-0.1), play)
    result = ab.simulate(builder.build(), stop_time=2.0)
    pushed = np.clip(initial, 0.0, 1.0)
    np.testing.assert_allclose(result["play/y"], np.minimum(pushed, 1.0 - result.time), atol=1e-12)


@pytest.mark.parametrize("states", ["held", "reset"])
def test_a_backlash_that_is_enabled_outside_its_band_moves_once(states: str) -> None:
    """An event caused by the output at the same time uses the new output."""
    inside = DiagramBuilder("inside")
    inside.add("out", Outport(), inside.add("play", Backlash(), inside.add("in", Inport())))
    builder = DiagramBuilder("play")
    fall = builder.add("input", Ramp(initial=2.0, slope=-1.0))
    switch = builder.add("switch", PulseGenerator(period=8.0, delay=0.5))
    gear = EnabledSubsystem(diagram=inside.build(), states_when_enabling=states)
    builder.add("hit", HitCrossing(offset=0.5), builder.add("gear", gear, fall, switch))
    result = ab.simulate(builder.build(), stop_time=4.0, sample_time=0.25)
    pushed = np.where(result.time < 0.5, 0.0, np.minimum(1.0, 2.5 - result.time))
    np.testing.assert_allclose(result["gear/out/y"], pushed, atol=1e-12)
    assert result["hit/count"][-1] == 2.0


@pytest.mark.parametrize(
    "gate",
    [
        LogicalOperator(operator="OR"),
        LogicalOperator(operator="AND"),
        CombinatorialLogic(),
        TruthTable(),
        DirectLookup(table=(0.0, 1.0)),
        MathFunction(function="sign"),
        MathFunction(function="ceil"),
    ],
    ids=lambda gate: f"{gate.title} {getattr(gate, 'operator', getattr(gate, 'function', ''))}",
)
def test_a_logical_input_is_true_from_the_time_at_which_it_leaves_0(gate: Block) -> None:
    """A step ends at that time, and the rate limiter continues from the output just before it."""
    builder = DiagramBuilder("gate")
    rise = builder.add("rise", Integrator(), builder.add("rate", Constant(value=0.75)))
    if isinstance(gate, DirectLookup):
        rise = builder.add("index", Bias(bias=1.0 - 1e-12), rise)
    ports = gate.input_ports()
    wide = [builder.add("both", Mux(inputs=2), rise, rise)] if ports[0].shape == (2,) else [rise] * len(ports)
    builder.add("limited", RateLimiterContinuous(), builder.add("gate", gate, *wide))
    result = ab.simulate(builder.build(), stop_time=1.25, sample_time=0.25)
    np.testing.assert_allclose(result["limited/y"], np.minimum(result.time, 1.0), atol=1e-9)


def test_a_quantizer_that_chatters_in_a_loop_is_reported() -> None:
    builder = DiagramBuilder("chatter")
    place = builder.add("place", Integrator())
    steps = builder.add("steps", Quantizer(interval=0.1), place)
    error = builder.add("error", Sum(signs="+-"), builder.add("aim", Constant(value=0.26)), steps)
    builder.connect(error, place["u"])
    with pytest.raises(SimulationError, match=r"'steps' causes events without end.*100000 within 1e-08"):
        ab.simulate(builder.build(), stop_time=100.0)


def test_an_equality_that_drives_its_signal_back_is_reported_and_passes_without_zero_crossings() -> None:
    """x' = (x ~= 0.5) - x: at 0.5 the comparison reverses x'. Elsewhere x = 1 - exp(-t)."""

    def run(zero_crossing: bool) -> float:
        builder = DiagramBuilder("equality")
        x = builder.add("x", Integrator())
        test = CompareToConstant(relation="~=", constant=0.5, zero_crossing=zero_crossing)
        rate = builder.add("rate", Sum(signs="+-"), builder.add("test", test, x), x)
        builder.connect(rate, x["u"])
        return float(ab.simulate(builder.build(), stop_time=2.0)["x"][-1])

    with pytest.raises(SimulationError, match=r"'test' causes events without end.* zero_crossing=False"):
        run(zero_crossing=True)
    assert run(zero_crossing=False) == pytest.approx(1.0 - np.exp(-2.0), abs=1e-6)


def test_jumps_that_accumulate_at_a_pole_are_reported() -> None:
    """``t mod (1 - t)`` has n jumps before t = n / (n + 1), and thus infinitely many before 1 s."""
    builder = DiagramBuilder("pole")
    builder.add(
        "rest", Modulo(), builder.add("time", Ramp()), builder.add("left", Ramp(slope=-1.0, initial=1.0))
    )
    with pytest.raises(SimulationError, match=r"'rest' causes events without end at 0\.9"):
        ab.simulate(builder.build(), stop_time=2.0)


@pytest.mark.parametrize("switch", [Sign(), CompareToZero(relation="~=")], ids=["Sign", "CompareToZero"])
def test_a_recorded_difference_of_0_gives_the_mode_of_0(switch: Block) -> None:
    """The product in the quantizer is rounded before the subtraction, in modes as well as in records."""
    builder = DiagramBuilder("tie")
    value = builder.add("value", Constant(value=-1.0))
    error = builder.add("error", Sum(signs="+-"), value, builder.add("steps", Quantizer(interval=0.1), value))
    builder.add("switch", switch, error)
    result = ab.simulate(builder.build(), stop_time=0.1)
    assert not result["error/y"].any()
    assert not result["switch/y"].any()


def test_modes_without_a_consistent_solution_are_reported() -> None:
    """``y = sign(bias - y)`` has no solution for a bias of 0.5: y = 1 requires -1, and y = -1 requires 1."""
    builder = DiagramBuilder("contradiction")
    bias = builder.add("bias", Step(time=1.0, initial=2.0, final=0.5))
    sum_ = builder.add("sum", Sum(signs="+-"))
    sign = builder.add("sign", Sign(), sum_)
    builder.connect(bias, sum_["u1"])
    builder.connect(sign, sum_["u2"])
    with pytest.raises(SimulationError, match="'sign'") as caught:
        ab.simulate(builder.build(), stop_time=2.0)
    assert "at 1 s" in str(caught.value)


def test_the_unique_solution_of_coupled_modes_is_found() -> None:
    """``y = max(0, M y + q)`` with saturations in a loop: a complementarity problem with one solution."""
    random = np.random.default_rng(7)
    for _ in range(3):
        n = 4
        root = random.normal(size=(n, n))
        matrix = np.eye(n) - (root @ root.T / n + 0.3 * np.eye(n))  # I - M is positive definite
        q = random.normal(size=n)
        builder = DiagramBuilder("complementarity")
        drive = builder.add("q", Step(time=1.0, initial=np.zeros(n), final=q))
        total = builder.add("sum", Sum(signs="++"))
        positive = builder.add("positive", Saturation(lower=0.0, upper=np.inf), total)
        builder.connect(drive, total["u1"])
        builder.connect(builder.add("M", ab.blocks.MatrixGain(gain=matrix), positive), total["u2"])
        result = ab.simulate(builder.build(), stop_time=2.0, sample_time=0.5)
        solution = result["positive/y"][-1]
        np.testing.assert_allclose(solution, np.maximum(matrix @ solution + q, 0.0), atol=1e-9)


@pytest.mark.parametrize("formula", ["if(u > 0, -1, 1)", "1 - (u > 0)"])
def test_a_contradictory_formula_in_a_loop_is_reported(formula: str) -> None:
    builder = DiagramBuilder("loop")
    block = builder.add("formula", Expression(formula=formula))
    builder.connect(block, block["u"])
    with pytest.raises(
        SimulationError, match="no solution of the implicit equations of the loop through 'formula'"
    ):
        ab.simulate(builder.build(), stop_time=1.0)


@pytest.mark.parametrize(
    ("formula", "expected"), [("0.5 * u + 1", 2.0), ("floor(u / 2) + 0.25", 0.25), ("max(u, 1) / 2 + 1", 2.0)]
)
def test_a_discontinuous_formula_in_a_loop_is_solved_if_a_solution_exists(
    formula: str, expected: float
) -> None:
    builder = DiagramBuilder("loop")
    block = builder.add("formula", Expression(formula=formula))
    builder.connect(block, block["u"])
    result = ab.simulate(builder.build(), stop_time=1.0)
    np.testing.assert_allclose(result["formula/y"], expected, rtol=1e-12)


def test_a_limited_state_is_correct_when_its_rate_jumps_at_the_limit() -> None:
    """The state reaches its limit at the time at which its rate jumps, away from or towards the limit."""
    builder = DiagramBuilder("limit")
    rate = builder.add("rate", RepeatingSequence(times=(0.0, 1.0, 1.5, 2.0), values=(1.0, 1.0, -1.0, -1.0)))
    builder.add("limited", IntegratorLimited(lower=0.0, upper=1.0), rate)
    result = ab.simulate(builder.build(), stop_time=20.0, sample_time=0.01)
    y = result["limited/y"]
    assert y.max() <= 1.0
    assert y.min() >= 0.0
    dt = 0.01
    expected = np.zeros_like(y)
    u = result["rate/y"]
    for k in range(1, len(y)):
        expected[k] = np.clip(expected[k - 1] + dt * (u[k] + u[k - 1]) / 2, 0.0, 1.0)
    np.testing.assert_allclose(y, expected, atol=0.03)


def test_a_switch_is_correct_when_its_control_rests_on_the_threshold() -> None:
    """The control signal stays exactly on the threshold, and leaves it to both sides."""
    builder = DiagramBuilder("touch")
    control = builder.add(
        "control",
        RepeatingSequence(times=(0.0, 1.0, 2.0, 3.0, 4.0, 5.0), values=(-1.0, 0.0, 0.0, 1.0, 0.0, -1.0)),
    )
    one, two = builder.add("one", Constant(value=1.0)), builder.add("two", Constant(value=2.0))
    builder.add("switch", Switch(threshold=0.0, criterion=">"), one, control, two)
    result = ab.simulate(builder.build(), stop_time=20.0, sample_time=0.05)
    u = result["control/y"]
    nonzero = np.abs(u) > 1e-12
    np.testing.assert_array_equal(result["switch/y"][nonzero], np.where(u > 0.0, 1.0, 2.0)[nonzero])


def test_blocks_with_memory_do_not_react_to_inconsistent_signals() -> None:
    """A limited square wave is never positive: relay, counter, reset and trigger must not react."""
    builder = DiagramBuilder("memory")
    square = builder.add("square", SignalGenerator(waveform="square", amplitude=0.5, frequency=0.5))
    cut = builder.add("cut", Saturation(lower=-0.5, upper=0.0), square)
    builder.add("relay", Relay(on_point=0.1, off_point=-2.0), cut)
    builder.add(
        "integral", ResettableIntegrator(external_reset="rising"), builder.add("one", Constant()), cut
    )
    builder.add("hits", HitCrossing(offset=0.1), cut)
    inside = DiagramBuilder("inside")
    inside.output("y", inside.add("gain", Gain(), inside.input("u")), initial=-1.0)
    triggered = TriggeredSubsystem(diagram=inside.build(), edge="rising")
    builder.add("triggered", triggered, builder.add("time", Clock()), trigger=cut)
    result = ab.simulate(builder.build(), stop_time=4.0, sample_time=0.25)
    np.testing.assert_array_equal(result["relay/y"], 0.0)
    np.testing.assert_allclose(result["integral/y"], result.time, atol=1e-12)
    np.testing.assert_array_equal(result["hits/count"], 0.0)
    np.testing.assert_array_equal(result["triggered/y"], -1.0)


def test_intermediate_outputs_of_hysteresis_blocks_are_not_stored() -> None:
    """After a jump, relay, rate limiter, backlash and friction need several mode iterations."""
    builder = DiagramBuilder("turns")
    jump = builder.add("jump", Step(time=1.0))
    relay = builder.add("relay", Relay(), jump)
    above = builder.add("above", CompareToZero(relation=">"), jump)
    limiter = builder.add("limited", RateLimiterContinuous(rising=0.0), jump)
    back = builder.add("back", Step(time=2.0, initial=2.0, final=1.5))
    driving = builder.add("driving", Product(), jump, back)
    play = builder.add("play", Backlash(width=1.0), driving)
    force = builder.add("force", Step(time=1.0, final=2.0))
    friction = builder.add("mass", StickSlipFriction(), force)["friction"]
    watched = {
        "friction": builder.add("friction", Sum(signs="+-"), friction, jump),
        "difference": builder.add("difference", Sum(signs="+-"), above, relay),
        "relays": builder.add("relays", Sum(signs="+-"), relay, builder.add("second", Relay(), relay)),
        "limit": limiter,
        "release": builder.add("release", Sum(signs="+-"), play, builder.add("one", Gain(gain=1.5), jump)),
    }
    for name, signal in watched.items():
        builder.add(f"{name} passes", HitCrossing(offset=0.25), signal)
        builder.add(f"{name} sinks", HitCrossing(offset=-0.25), signal)
        builder.add(f"{name} remembered", Relay(on_point=0.2, off_point=-0.2, off_value=0.5), signal)
    builder.add("continuous", Integrator(), jump)
    result = ab.simulate(builder.build(), stop_time=3.0, sample_time=0.25)
    for name in watched:
        np.testing.assert_array_equal(result[f"{name} passes/count"], 0.0)
        np.testing.assert_array_equal(result[f"{name} sinks/count"], 0.0)
        np.testing.assert_array_equal(result[f"{name} remembered/y"], 0.5)


def test_a_relay_that_resets_its_own_input_stays_on() -> None:
    """At the same time the integral reaches 1, the relay switches on and resets the integral; it stays on."""
    builder = DiagramBuilder("reset")
    integral = builder.add("integral", ResettableIntegrator(external_reset="rising"))
    relay = builder.add("relay", Relay(on_point=1.0, off_point=-1.0), integral)
    builder.connect(relay, integral["reset"])
    builder.connect(builder.add("rate", Constant(value=1.0)), integral["u"])
    result = ab.simulate(builder.build(), stop_time=1.75, sample_time=0.25)
    np.testing.assert_array_equal(result["relay/y"], result.time >= 1.0)
    np.testing.assert_allclose(result["integral/y"], result.time % 1.0, atol=1e-12)


@pytest.mark.parametrize("frequency", [4.0, 1.7, 0.9])
@pytest.mark.parametrize("settings", [{}, {"solver": "rodas5p"}, {"solver": "rk4", "step": 0.3}], ids=str)
def test_a_rising_edge_after_a_falling_one_in_the_same_step_is_detected(
    frequency: float, settings: Mapping[str, object]
) -> None:
    """A sawtooth falls through 0 within a step, and rises through 0 at its jump at the end of the step."""
    builder = DiagramBuilder("saw")
    saw = builder.add("saw", SignalGenerator(waveform="sawtooth", frequency=frequency))
    total = builder.add("total", ResettableIntegrator(), builder.add("one", Constant()), saw)
    builder.add("sampled", ZeroOrderHold(sample_time=0.3), total)
    result = ab.simulate(builder.build(), stop_time=4.0, sample_time=0.01, **settings)  # pyright: ignore
    since = np.mod(result.time, 1.0 / frequency)
    away_from_edges = np.minimum(since, 1.0 / frequency - since) > 1e-9
    np.testing.assert_allclose(result["total/y"][away_from_edges], since[away_from_edges], atol=1e-9)


def test_a_comparison_at_a_corner_of_its_input_is_sampled_correctly() -> None:
    """At 0.25 s and 1.25 s the input touches 1 at a corner, where a tick samples the comparison."""
    builder = DiagramBuilder("touch")
    values = builder.add(
        "course", RepeatingSequence(times=(0.0, 0.25, 0.5, 1.0), values=(-1.0, 1.0, 0.5, -1.0))
    )
    one = builder.add("one", SignalGenerator(waveform="square", frequency=0.2, amplitude=-1.0))
    below = builder.add("below", RelationalOperator(relation="<="), values, one)
    builder.add("held", ZeroOrderHold(sample_time=0.125), below)
    result = ab.simulate(builder.build(), stop_time=2.0, sample_time=0.0625, rtol=1e-9)
    np.testing.assert_array_equal(result["below/y"], 1.0)
    np.testing.assert_array_equal(result["held/y"], 1.0)


def test_an_event_just_after_the_start_does_not_affect_the_history_of_a_delay() -> None:
    """The speed of the ball leaves 0 just after the start, which is an event of the absolute value."""
    builder = DiagramBuilder("delayed ball")
    gravity = builder.add("gravity", Step(time=0.0, final=-9.81))
    block = SecondOrderIntegratorLimited(initial=0.3, lower=0.0, reinitialize=True)
    body = builder.add("ball", block)
    builder.connect(gravity, body["u"])
    builder.connect(body["dx"], body["dx0"])
    builder.add("delayed", TransportDelay(delay=0.5), body["x"])
    builder.add("speed", Abs(), body["dx"])
    result = ab.simulate(builder.build(), stop_time=1.0, sample_time=0.0625, rtol=1e-9, atol=1e-12)
    since = result.time - 0.5
    expected = np.where(since < 0.0, 0.0, np.maximum(0.3 - 9.81 / 2 * since**2, 0.0))
    np.testing.assert_allclose(result["delayed/y"], expected, atol=1e-9)

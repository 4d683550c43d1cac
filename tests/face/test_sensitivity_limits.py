"""Sensitivities where a signal is exactly at a limit after an event, between instants, or at a tick."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

import armblocks as ab
from armblocks.blocks import (
    Abs,
    Bias,
    CompareToConstant,
    CompareToZero,
    Constant,
    DeadZone,
    EdgeDetection,
    Expression,
    Integrator,
    LogicalOperator,
    Modulo,
    Quantizer,
    Ramp,
    RateLimiterContinuous,
    Relay,
    ResettableIntegrator,
    Rounding,
    Saturation,
    Sign,
    SineWave,
    Step,
    Sum,
    TransportDelay,
    UnitDelay,
    ZeroOrderHold,
)
from armblocks.diagram import Block
from armblocks.errors import ArmblocksError, SimulationError


@pytest.mark.parametrize("sampled", [False, True])
@pytest.mark.parametrize("speed", [0.0, 1.0])
@pytest.mark.parametrize(
    "block", [Sign(), CompareToZero(relation=">="), Relay(on_point=0.0, off_point=-3.0), Abs()]
)
def test_a_state_that_is_reset_to_a_limit(block: Block, speed: float, sampled: bool) -> None:
    """A change of its new value, or of its new speed 0, moves the event behind or before the reset."""
    builder = ab.DiagramBuilder("reset")
    edge = builder.add("edge", Step(time=1.0 if not sampled else 0.9))
    edge = builder.add("tick", ZeroOrderHold(sample_time=0.25), edge) if sampled else edge
    start = builder.add("start", Step(time=0.4, initial=-30.0, final=0.0))
    start_speed = builder.add("start speed", Step(time=0.4, initial=0.1, final=speed))
    settings = {"initial_condition_source": "external", "external_reset": "rising"}
    force = builder.add("force", Constant(value=1.0))
    v = builder.add("v", ResettableIntegrator(**settings), force, edge, start_speed)
    x = builder.add("x", ResettableIntegrator(**settings), v, edge, start)
    builder.add("integral", Integrator(), builder.add("y", block, x))
    diagram = builder.build()

    def derivative(name: str) -> float:
        return float(ab.sensitivity(diagram, name, "integral", stop_time=2.0)["integral", name][-1])

    if isinstance(block, Abs):
        assert derivative("start.final") == pytest.approx(1.0, rel=1e-9)
        assert derivative("start speed.final") == pytest.approx(0.5, rel=1e-9)
        return
    for name in ("start.final", "start speed.final"):
        if name == "start.final" or speed == 0.0:
            with pytest.raises(SimulationError, match=r"block 'y' is exactly at a limit .* at 1 s"):
                derivative(name)
        else:
            assert derivative(name) == pytest.approx(0.0, abs=1e-9)


def test_a_condition_that_stands_at_its_limit_until_an_event() -> None:
    """v is 0 until 0.4 s. For any other initial value, v ~= 0 holds from 0.3 s on."""

    def diagram(initial: float) -> ab.Diagram:
        builder = ab.DiagramBuilder("stands")
        v = builder.add("v", Integrator(initial=initial), builder.add("u", Step(time=0.4)))
        both = builder.add("both", LogicalOperator(), v, builder.add("on", Step(time=0.3)))
        builder.add("x", Integrator(), both)
        return builder.build()

    with pytest.raises(SimulationError, match=r"block 'both' is exactly at a limit .* at 0\.3 s"):
        ab.sensitivity(diagram(0.0), "v.initial", "x", stop_time=1.0)
    # Without a change of the initial value v leaves 0 when the step occurs.
    result = ab.sensitivity(diagram(0.0), ["u.time", "u.final"], "x", stop_time=1.0)
    assert result["x", "u.time"][-1] == pytest.approx(-1.0, abs=1e-9)
    assert result["x", "u.final"][-1] == pytest.approx(0.0, abs=1e-9)
    assert not ab.sensitivity(diagram(0.1), "v.initial", "x", stop_time=1.0)["x", "v.initial"].any()


HELD = [
    Sign(),
    CompareToZero(relation=">"),
    CompareToZero(relation="<"),
    Relay(on_point=0.0, off_point=-5.0),
    Rounding(function="floor"),
    Abs(),
    Saturation(lower=0.0),
    Expression(formula="if(u==0,1,2)"),
    LogicalOperator(operator="NOT"),
]


@pytest.mark.parametrize("sampled", [False, True])
@pytest.mark.parametrize("ends", [False, True])
@pytest.mark.parametrize("block", HELD)
def test_a_signal_that_is_held_at_a_limit(block: Block, ends: bool, sampled: bool) -> None:
    """A step to the limit, to the end of the run or for a while; sampled or not."""
    builder = ab.DiagramBuilder("held")
    u = builder.add("u", Step(time=0.9, initial=-3.2, final=0.0))
    if ends:
        end = builder.add("end", Step(time=1.3, initial=0.0, final=-2.0))
        u = builder.add("both", Sum(signs="++"), u, end)
    if sampled:
        u = builder.add("hold", ZeroOrderHold(sample_time=0.25), u)
    builder.add("integral", Integrator(), builder.add("y", block, u))
    diagram = builder.build()
    with pytest.raises(SimulationError, match=r"block 'y' is exactly at a limit .* at (0.9|1) s"):
        ab.sensitivity(diagram, "u.final", "integral", stop_time=2.0)
    # Beside the limit there is a derivative, and a parameter that does not move the held value has one.
    beside = ab.sensitivity(diagram, "u.final", "integral", stop_time=2.0, values={"u.final": 0.3})
    smooth = isinstance(block, Abs | Saturation)
    assert bool(beside["integral", "u.final"].any()) == smooth
    before = ab.sensitivity(diagram, "u.initial", "integral", stop_time=2.0)["integral", "u.initial"]
    expected = -(1.0 if sampled else 0.9) if isinstance(block, Abs) else 0.0
    assert before[-1] == pytest.approx(expected, abs=1e-9)


def test_a_formula_that_protects_a_division() -> None:
    """For u = 0 the value is a constant. Its derivative is right only if the formula has the derivative 0."""

    def diagram(formula: str) -> ab.Diagram:
        builder = ab.DiagramBuilder("protected")
        u = builder.add("u", Step(time=0.9, initial=2.0, final=0.0))
        builder.add("y", Expression(formula=formula), u)
        return builder.build()

    even = ab.sensitivity(diagram("if(u==0,1,sin(u)/u)"), "u.final", "y", stop_time=2.0)
    assert not even["y", "u.final"].any()
    with pytest.raises(SimulationError, match=r"block 'y' is exactly at a limit .* at 0\.9 s"):
        ab.sensitivity(diagram("if(u==0,1,(exp(u)-1)/u)"), "u.final", "y", stop_time=2.0)


def test_a_divisor_that_is_held_at_zero() -> None:
    builder = ab.DiagramBuilder("divisor")
    q = builder.add("q", Quantizer(interval=0.5), builder.add("u", Step(time=0.45, final=1.0)))
    held = builder.add("s", Sum(signs="+-"), q, builder.add("one", Constant(value=1.0)))
    builder.add("y", Modulo(), held, held)
    with pytest.raises(SimulationError, match=r"block 'y' is exactly at a limit .* at 0.45 s"):
        ab.sensitivity(builder.build(), "q.interval", "y", stop_time=1.0)


@pytest.mark.parametrize("sampled", [False, True])
def test_an_edge_that_only_a_tick_computes(sampled: bool) -> None:
    """A step from below to 0 is a rising edge only for a larger final value. The diagram has no events."""
    builder = ab.DiagramBuilder("edge")
    u = builder.add("u", Step(time=0.9, initial=-3.2, final=0.0))
    u = builder.add("hold", ZeroOrderHold(sample_time=0.25), u) if sampled else u
    builder.add("x", Integrator(), builder.add("y", EdgeDetection(sample_time=0.25), u))
    diagram = builder.build()
    with pytest.raises(SimulationError, match=r"block 'y' (samples|is exactly at a limit)"):
        ab.sensitivity(diagram, "u.final", "x", stop_time=2.0)
    beside = ab.sensitivity(diagram, "u.final", "x", stop_time=2.0, values={"u.final": 0.3})
    assert not beside["x", "u.final"].any()


SOURCES: dict[str, Callable[[], Block]] = {
    "u.phase": lambda: SineWave(frequency=math.pi),
    "u.initial": lambda: Ramp(initial=-1.0),
    "u.final": lambda: Step(time=0.8, initial=-1.0, final=0.0),
}


@pytest.mark.parametrize("hold", [ZeroOrderHold(sample_time=0.25), UnitDelay(sample_time=0.5)])
@pytest.mark.parametrize("name", SOURCES)
@pytest.mark.parametrize(
    "block",
    [Abs(), Saturation(lower=0.0, upper=5.0), DeadZone(start=-0.5, end=0.0), CompareToZero(relation=">")],
)
def test_a_limit_that_is_sampled(block: Block, name: str, hold: Block) -> None:
    """The signal is 0 at a tick. The differences of runs to both sides are unequal."""
    builder = ab.DiagramBuilder("sampled")
    signal = builder.add("y", block, builder.add("u", SOURCES[name]()))
    builder.add("x", Integrator(), builder.add("hold", hold, signal))
    diagram = builder.build()
    with pytest.raises(
        ArmblocksError, match=r"samples a signal exactly at a limit|'y' (at the start|is exac)"
    ):
        ab.sensitivity(diagram, name, "x", stop_time=1.6)


@pytest.mark.parametrize(
    "level",
    [CompareToConstant(constant=1.0, relation=">="), Bias(bias=-1.0), Relay(on_point=1.0, off_point=-0.5)],
)
@pytest.mark.parametrize("period", [0.25, 0.3])
def test_an_event_at_the_time_of_a_tick(level: Block, period: float) -> None:
    """u passes 1 at 1 s and resets x. A tick at 1 s samples x before or after the reset."""
    builder = ab.DiagramBuilder("event")
    rate = builder.add("rate", Constant(value=1.0))
    reached = builder.add("level", level, builder.add("u", Integrator(), rate))
    x = builder.add("x", ResettableIntegrator(external_reset="rising"), rate, reached)
    builder.add("y", Integrator(), builder.add("hold", ZeroOrderHold(sample_time=period), x))
    diagram = builder.build()

    def derivative() -> float:
        return float(ab.sensitivity(diagram, "rate.value", "y", stop_time=2.1)["y", "rate.value"][-1])

    if period == 0.25:
        with pytest.raises(
            SimulationError, match=r"'hold' samples a signal exactly at a limit or at a jump at 1 s"
        ):
            derivative()
    else:
        # x = r t, and x = r t - 1 from 1/r on: the sampled values have the derivatives t.
        assert derivative() == pytest.approx(0.3 * (0.3 + 0.6 + 0.9 + 1.2 + 1.5 + 1.8), rel=1e-9)


@pytest.mark.parametrize("name", ["y.rising", "delay.delay", "u.amplitude"])
def test_a_limit_of_the_rate_of_a_delayed_signal(name: str) -> None:
    """The guards depend on the time derivative of the delayed signal."""
    builder = ab.DiagramBuilder("rate")
    delayed = builder.add(
        "delay", TransportDelay(delay=0.3), builder.add("u", SineWave(amplitude=1.0, frequency=2.0))
    )
    limited = builder.add("y", RateLimiterContinuous(rising=0.5, falling=-0.5), delayed)
    builder.add("x", Integrator(), limited)
    diagram = builder.build()
    settings = {"stop_time": 2.0, "rtol": 1e-10, "atol": 1e-12}
    value = {"y.rising": 0.5, "delay.delay": 0.3, "u.amplitude": 1.0}[name]
    low, high = (
        ab.simulate(diagram, parameters={name: value + step}, **settings)["x"][-1] for step in (-1e-5, 1e-5)
    )
    derivative = ab.sensitivity(diagram, name, "x", **settings)["x", name][-1]
    assert derivative == pytest.approx((high - low) / 2e-5, rel=1e-6)

"""Conditional subsystems compared with closed forms and with loops in plain Python."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import (
    ActionSubsystem,
    Clock,
    Constant,
    DiscreteIntegrator,
    EnabledSubsystem,
    EnabledTriggeredSubsystem,
    Expression,
    Gain,
    If,
    Integrator,
    Merge,
    Ramp,
    ResettableSubsystem,
    SineWave,
    Step,
    Subsystem,
    Sum,
    Switch,
    SwitchCase,
    TransportDelay,
    TriggeredSubsystem,
    UnitDelay,
    ZeroOrderHold,
)
from armblocks.diagram import Block, BlockHandle, Diagram, DiagramBuilder
from armblocks.errors import DiagramError, InputError

SETTINGS = pytest.mark.parametrize(
    "settings",
    [{"solver": "rk4", "step": 0.013}, {"solver": "rk45", "rtol": 1e-10, "atol": 1e-12, "max_step": 0.2}],
    ids=["fixed", "adaptive"],
)


def around(
    kind: Callable[..., Block],
    inside: Callable[[DiagramBuilder], object],
    controls: Callable[[DiagramBuilder], dict[str, BlockHandle]],
    source: Callable[[DiagramBuilder], BlockHandle] = lambda builder: builder.add("source", Clock()),
    **parameters: object,
) -> Diagram:
    """Build a subsystem ``sub`` with a source and its control signals."""
    builder, inner = DiagramBuilder("top"), DiagramBuilder("inner")
    inside(inner)
    builder.add("sub", kind(diagram=inner.build(), **parameters), source(builder), **controls(builder))
    return builder.build()


def integrator(inner: DiagramBuilder) -> None:
    inner.output("y", inner.add("integral", Integrator(initial=0.5), inner.input("u")), initial=-1.0)


def sine_control(port: str) -> Callable[[DiagramBuilder], dict[str, BlockHandle]]:
    return lambda builder: {port: builder.add("control", SineWave(frequency=math.pi))}


# -- enabled ---------------------------------------------------------------------------------------------


@SETTINGS
def test_states_are_held_while_a_subsystem_is_off(settings: dict[str, object]) -> None:
    """u = t, enabled in (0, 1) and (2, 3): the integral of t over the enabled intervals."""
    diagram = around(EnabledSubsystem, integrator, sine_control("enable"))
    result = ab.simulate(diagram, stop_time=4.0, sample_time=0.05, **settings)
    t = result.time
    on = np.clip(t, 0, 1) ** 2 / 2 + (np.clip(t, 2, 3) ** 2 - 4) / 2 + 0.5
    np.testing.assert_allclose(result["sub/integral"], on, atol=1e-11)
    np.testing.assert_allclose(result["sub/y"][1:], on[1:], atol=1e-11)
    assert result["sub/y"][0] == -1.0  # disabled at the start, because sin 0 is not positive


@SETTINGS
def test_states_are_reset_on_enabling_if_chosen(settings: dict[str, object]) -> None:
    diagram = around(EnabledSubsystem, integrator, sine_control("enable"), states_when_enabling="reset")
    result = ab.simulate(diagram, stop_time=4.0, sample_time=0.05, **settings)
    t = result.time
    first, second = 0.5 + np.clip(t, 0, 1) ** 2 / 2, 0.5 + (np.clip(t, 2, 3) ** 2 - 4) / 2
    expected = np.where(t < 2.0, first, second)
    inside = np.abs(t - 2.0) > 1e-9  # at the event time both values are correct
    np.testing.assert_allclose(result["sub/y"][1:][inside[1:]], expected[1:][inside[1:]], atol=1e-11)


@SETTINGS
def test_outputs_return_to_the_initial_value_when_disabled_if_chosen(settings: dict[str, object]) -> None:
    def inside(inner: DiagramBuilder) -> None:
        inner.output("y", inner.add("g", Gain(gain=2.0), inner.input("u")), when_off="reset", initial=7.0)

    result = ab.simulate(
        around(EnabledSubsystem, inside, sine_control("enable")), stop_time=4.0, sample_time=0.1, **settings
    )
    on = np.sin(np.pi * result.time) > 0
    away = np.abs(result.time - np.round(result.time)) > 1e-9  # at the event time both values are correct
    expected = np.where(on, 2.0 * result.time, 7.0)
    np.testing.assert_allclose(result["sub/y"][away], expected[away], atol=1e-12)


@SETTINGS
@pytest.mark.parametrize("kind", ["breakpoints", "ticks", "delays"])
def test_a_disabled_output_keeps_its_value_just_before_the_event(
    kind: str, settings: dict[str, object]
) -> None:
    """Input and enable signal jump at the same time: the value before the jump is held."""

    def jumping(builder: DiagramBuilder, name: str, first: float, last: float) -> BlockHandle:
        early = 0.3 if kind == "delays" else 0.0
        step = builder.add(name, Step(time=1.0 - early, initial=first, final=last))
        if kind == "delays":
            return builder.add(f"{name} late", TransportDelay(delay=early, initial=first), step)
        return builder.add(f"{name} held", ZeroOrderHold(sample_time=0.5), step) if kind == "ticks" else step

    diagram = around(
        EnabledSubsystem,
        lambda inner: inner.output("y", inner.add("gain", Gain(gain=3.0), inner.input("u"))),
        lambda builder: {"enable": jumping(builder, "enable", 1.0, 0.0)},
        lambda builder: jumping(builder, "input", 5.0, 6.0),
    )
    result = ab.simulate(diagram, stop_time=2.0, sample_time=0.25, **settings)
    assert (result["sub/gain"] == np.where(result.time < 1.0, 15.0, 18.0)).all()
    assert (result["sub/y"] == 15.0).all()


def sampled_counter(inner: DiagramBuilder) -> None:
    """Add a counter: y = x, then x = x + T u."""
    inner.output("y", inner.add("count", DiscreteIntegrator(initial=2.0, sample_time=0.1), inner.input("u")))


def pulses(builder: DiagramBuilder, sample_time: float) -> BlockHandle:
    """Add a signal that alternates between 0 and 1 every three ticks, starting with 0."""
    clock = builder.add("c", ZeroOrderHold(sample_time=sample_time), builder.add("clock", Clock()))
    wave = Expression(formula=f"sin(2*pi*(u/{sample_time} + 3.5)/6) > 0")
    return builder.add("pulses", wave, clock)


@SETTINGS
@pytest.mark.parametrize("when", ["held", "reset"])
def test_a_sampled_enable_signal_takes_effect_at_the_same_tick(
    when: str, settings: dict[str, object]
) -> None:
    """The inner counter is updated at the tick at which its enable signal becomes positive."""
    diagram = around(
        EnabledSubsystem,
        sampled_counter,
        lambda builder: {"enable": pulses(builder, 0.1)},
        lambda builder: builder.add("ten", Constant(value=10.0)),
        states_when_enabling=when,
    )
    result = ab.simulate(diagram, stop_time=3.0, sample_time=0.1, **settings)
    x, y, previous, expected = 2.0, 0.0, None, []
    for enable in result["pulses"]:
        if enable:
            if when == "reset" and previous == 0.0:
                x = 2.0
            y, x = x, x + 0.1 * 10.0
        previous = enable
        expected.append(y)
    assert set(result["pulses"].tolist()) == {0.0, 1.0}
    np.testing.assert_allclose(result["sub/y"], expected, atol=1e-12)


@SETTINGS
def test_a_continuous_enable_signal_resets_sampled_blocks_between_ticks(settings: dict[str, object]) -> None:
    """Enabled from 1.05 s to 2.05 s in each 2 s: the counter is reset, and counts at the next tick."""
    diagram = around(
        EnabledSubsystem,
        sampled_counter,
        lambda builder: {"enable": builder.add("w", SineWave(frequency=math.pi, phase=-1.05 * math.pi))},
        lambda builder: builder.add("ten", Constant(value=10.0)),
        states_when_enabling="reset",
    )
    result = ab.simulate(diagram, stop_time=5.0, sample_time=0.1, **settings)
    x, y, previous, expected = 2.0, 0.0, None, []
    for k in range(len(result.time)):
        t = 0.1 * k
        enable = math.sin(math.pi * (t - 1.05)) > 0
        if enable:
            if previous is False:
                x = 2.0
            y, x = x, x + 1.0
        previous = enable
        expected.append(y)
    # the output of the counter changes at the tick; between enabling and the tick it has the old value
    np.testing.assert_allclose(result["sub/y"], expected, atol=1e-12)


def test_a_division_by_zero_in_a_disabled_subsystem_has_no_effect() -> None:
    def inside(inner: DiagramBuilder) -> None:
        u = inner.input("u")
        root = inner.add("root", Expression(formula="sqrt(1 - u)"), u)
        inner.output("y", inner.add("integral", Integrator(), root))

    diagram = around(
        EnabledSubsystem,
        inside,
        lambda builder: {"enable": builder.add("on", Step(time=0.9, initial=1.0, final=0.0))},
    )
    result = ab.simulate(diagram, stop_time=3.0)
    assert np.isfinite(result["sub/root"]).all()
    assert result["sub/y"][-1] == pytest.approx((1 - 0.1**1.5) / 1.5, rel=1e-6)

    diagram = around(
        TriggeredSubsystem,
        lambda inner: inner.output("y", inner.add("inverse", Expression(formula="1 / u"), inner.input("u"))),
        lambda builder: {"trigger": builder.add("when", Step(time=0.5))},
    )
    result = ab.simulate(diagram, stop_time=1.0)
    assert np.isfinite(result["sub/inverse"]).all()
    assert result["sub/y"][-1] == 2.0


def test_a_nested_subsystem_executes_while_both_are_enabled() -> None:
    """The inner subsystem executes while both are enabled: sin(pi t) > 0 and t > 2.5."""
    builder = DiagramBuilder("top")
    outer, inner = DiagramBuilder("outer"), DiagramBuilder("inner")
    integrator(inner)
    outer.add(
        "deep",
        EnabledSubsystem(diagram=inner.build()),
        outer.input("u"),
        enable=outer.input("late"),
    )
    outer.output("y", outer["deep"])
    late = builder.add("late", Step(time=2.5))
    builder.add(
        "sub",
        EnabledSubsystem(diagram=outer.build()),
        builder.add("one", Constant()),
        late,
        enable=builder.add("control", SineWave(frequency=math.pi)),
    )
    result = ab.simulate(builder.build(), stop_time=6.0, sample_time=0.05, rtol=1e-9)
    t = result.time
    on = np.clip(t - 2.5, 0, 0.5) + np.clip(t - 4, 0, 1)
    np.testing.assert_allclose(result["sub/deep/integral"], 0.5 + on, atol=1e-9)


# -- triggered -------------------------------------------------------------------------------------------


@SETTINGS
@pytest.mark.parametrize("edge", ["rising", "falling", "either"])
def test_a_triggered_subsystem_samples_and_holds(edge: str, settings: dict[str, object]) -> None:
    diagram = around(
        TriggeredSubsystem,
        lambda inner: inner.output("y", inner.add("twice", Gain(gain=2.0), inner.input("u"))),
        lambda builder: {"trigger": builder.add("w", SineWave(frequency=math.pi, phase=-0.5 * math.pi))},
        edge=edge,
    )
    result = ab.simulate(diagram, stop_time=5.2, sample_time=0.1, **settings)
    fires = {"rising": [0.5, 2.5, 4.5], "falling": [1.5, 3.5], "either": [0.5, 1.5, 2.5, 3.5, 4.5]}[edge]
    expected = [2.0 * max([f for f in fires if f < t - 1e-9], default=0.0) for t in result.time]
    away = np.abs((result.time - 0.5) % 1.0) > 1e-6
    away &= np.abs((result.time - 0.5) % 1.0 - 1.0) > 1e-6
    np.testing.assert_allclose(result["sub/y"][away], np.array(expected)[away], atol=1e-11)


@SETTINGS
def test_sampled_blocks_are_updated_once_at_each_trigger(settings: dict[str, object]) -> None:
    """y(k) = y(k-1) + elapsed u(k-1): the rectangle rule with irregular steps, u = t."""

    def inside(inner: DiagramBuilder) -> None:
        delayed = inner.add("delay", UnitDelay(initial=-3.0), inner.input("u"))
        inner.output("y", inner.add("sum", DiscreteIntegrator(), inner["u"]))
        inner.output("before", delayed)

    diagram = around(
        TriggeredSubsystem,
        inside,
        lambda b: {"trigger": b.add("f", Expression(formula="sin(2*pi*(t*t - 0.5))", inputs=0))},
    )
    result = ab.simulate(diagram, stop_time=2.05, sample_time=0.01, **settings)
    fires = [math.sqrt(k + 0.5) for k in range(4)]
    y, last, memory = 0.0, fires[0], -3.0
    values = []
    for fire in fires:
        y += (fire - last) * last
        values.append((y, memory))
        last = memory = fire
    for (y, before), start, end in zip(values, fires, [*fires[1:], 2.05]):
        inside_interval = (result.time > start + 1e-6) & (result.time < end - 1e-6)
        np.testing.assert_allclose(result["sub/y"][inside_interval], y, atol=1e-9)
        np.testing.assert_allclose(result["sub/before"][inside_interval], before, atol=1e-9)


@SETTINGS
def test_a_sampled_trigger_takes_effect_at_the_same_tick(settings: dict[str, object]) -> None:
    builder = DiagramBuilder("top")
    inner = DiagramBuilder("inner")
    inner.output("y", inner.add("count", DiscreteIntegrator(gain=0.0, initial=0.0), inner.input("u")))
    counted = inner.add("delay", UnitDelay(initial=0.0), inner["u"])
    inner.output("last", counted)
    clock = builder.add("tick", ZeroOrderHold(sample_time=0.1), builder.add("time", Clock()))
    builder.add("sub", TriggeredSubsystem(diagram=inner.build()), clock, trigger=pulses(builder, 0.1))
    after = builder.add("after", Gain(gain=1.0), builder["sub"]["last"])
    builder.add("sampled", ZeroOrderHold(sample_time=0.1), after)
    result = ab.simulate(builder.build(), stop_time=3.0, sample_time=0.1, **settings)
    last, memory, previous, expected = 0.0, 0.0, None, []
    for enable, t in zip(result["pulses"], result["tick"]):
        if enable and previous == 0.0:
            last, memory = memory, t
        previous = enable
        expected.append(last)
    np.testing.assert_array_equal(result["sub/last"], expected)
    np.testing.assert_array_equal(result["sampled"], expected)  # not one tick later


def test_a_trigger_takes_effect_only_while_enabled() -> None:
    diagram = around(
        EnabledTriggeredSubsystem,
        lambda inner: inner.output("y", inner.input("u")),
        lambda builder: {
            "trigger": builder.add("w", SineWave(frequency=2 * math.pi, phase=-math.pi)),
            "enable": builder.add("on", Step(time=2.0)),
        },
    )
    result = ab.simulate(diagram, stop_time=3.2, sample_time=0.1)
    assert result["sub/y"][20] == 0.0
    assert result["sub/y"][-1] == pytest.approx(2.5, abs=1e-9)


def test_a_triggered_subsystem_with_states_or_clocks_is_refused() -> None:
    def trigger(builder: DiagramBuilder) -> dict[str, BlockHandle]:
        return {"trigger": builder.add("w", SineWave())}

    with pytest.raises(DiagramError, match="has the continuous state 'x'") as caught:
        around(TriggeredSubsystem, integrator, trigger)
    assert "block 'sub/integral' (Integrator)" in str(caught.value)
    with pytest.raises(DiagramError, match="a block in a triggered subsystem has its own sample time"):
        around(TriggeredSubsystem, sampled_counter, trigger)
    nested = DiagramBuilder("nested")
    nested.output("y", nested.add("e", EnabledSubsystem(), nested.input("u"), enable=nested["u"]))
    with pytest.raises(DiagramError, match="a conditional subsystem is inside a triggered one"):
        builder = DiagramBuilder("top")
        builder.add("s", TriggeredSubsystem(diagram=nested.build()), builder.add("c", Clock()), builder["c"])
        builder.build()
    named = DiagramBuilder("named")
    named.add("enable", Clock())
    with pytest.raises(DiagramError, match="an inner block or signal is named 'enable', like an input of"):
        EnabledSubsystem(diagram=named.build())


# -- reset -----------------------------------------------------------------------------------------------


@SETTINGS
def test_the_reset_restores_all_initial_states(settings: dict[str, object]) -> None:
    """The integral of 1 restarts at 0.5, 2.5 and 4.5 s, also that in an inner subsystem."""

    def inside(inner: DiagramBuilder) -> None:
        u = inner.input("u")
        integrator_inside = DiagramBuilder("deeper")
        integrator(integrator_inside)
        inner.add("deeper", Subsystem(diagram=integrator_inside.build()), u)
        inner.output("y", inner.add("integral", Integrator(initial=2.0), u))

    diagram = around(
        ResettableSubsystem,
        inside,
        lambda builder: {"reset": builder.add("w", SineWave(frequency=math.pi, phase=-0.5 * math.pi))},
        lambda builder: builder.add("one", Constant()),
    )
    result = ab.simulate(diagram, stop_time=5.2, sample_time=0.07, **settings)
    start = np.select([result.time > 4.5, result.time > 2.5, result.time > 0.5], [4.5, 2.5, 0.5], 0.0)
    np.testing.assert_allclose(result["sub/y"], 2.0 + result.time - start, atol=1e-11)
    np.testing.assert_allclose(result["sub/deeper/y"], 0.5 + result.time - start, atol=1e-11)


@SETTINGS
def test_a_sampled_reset_takes_effect_before_the_update_of_the_same_tick(settings: dict[str, object]) -> None:
    diagram = around(
        ResettableSubsystem,
        sampled_counter,
        lambda builder: {"reset": pulses(builder, 0.1)},
        lambda builder: builder.add("ten", Constant(value=10.0)),
    )
    result = ab.simulate(diagram, stop_time=3.0, sample_time=0.1, **settings)
    x, previous, expected = 2.0, None, []
    for reset in result["pulses"]:
        if reset and previous == 0.0:
            x = 2.0
        expected.append(x)
        x, previous = x + 1.0, reset
    np.testing.assert_allclose(result["sub/y"], expected, atol=1e-12)


# -- selected by conditions --------------------------------------------------------------------------------


def with_if(source: Callable[[DiagramBuilder], BlockHandle]) -> Diagram:
    builder = DiagramBuilder("choice")
    u = source(builder)
    choice = builder.add("if", If(expressions="u > 0.5; u > -0.5 && u <= 0.5"), u)
    for name, output, gain in (("high", "if1", 10.0), ("middle", "if2", 1.0), ("low", "else", -10.0)):
        inner = DiagramBuilder(name)
        inner.output("y", inner.add("gain", Gain(gain=gain), inner.input("u")))
        builder.add(name, ActionSubsystem(diagram=inner.build()), u, action=choice[output])
    builder.add("merge", Merge(inputs=3), builder["high"], builder["middle"], builder["low"])
    return builder.build()


@SETTINGS
def test_if_selects_an_action_and_merge_outputs_its_result(settings: dict[str, object]) -> None:
    result = ab.simulate(
        with_if(lambda b: b.add("u", SineWave())), stop_time=7.0, sample_time=0.05, **settings
    )
    u = result["u"]
    expected = np.where(u > 0.5, 10.0 * u, np.where(u > -0.5, u, -10.0 * u))
    np.testing.assert_allclose(result["merge"], expected, atol=1e-11)
    total = result["if/if1"] + result["if/if2"] + result["if/else"]
    assert (total == 1.0).all()


@SETTINGS
def test_if_with_sampled_inputs_takes_effect_at_the_same_tick(settings: dict[str, object]) -> None:
    def source(builder: DiagramBuilder) -> BlockHandle:
        return builder.add("u", ZeroOrderHold(sample_time=0.1), builder.add("sine", SineWave()))

    result = ab.simulate(with_if(source), stop_time=7.0, sample_time=0.1, **settings)
    u = result["u"]
    np.testing.assert_array_equal(
        result["merge"], np.where(u > 0.5, 10.0 * u, np.where(u > -0.5, u, -10.0 * u))
    )


@SETTINGS
def test_switch_case_truncates_its_input_to_an_integer(settings: dict[str, object]) -> None:
    builder = DiagramBuilder("cases")
    u = builder.add("u", Ramp(slope=1.0, initial=-2.55))
    builder.add("switch", SwitchCase(cases="-1 1; 0; 2"), u)
    result = ab.simulate(builder.build(), stop_time=5.6, sample_time=0.1, **settings)
    whole = np.trunc(result["u"])
    for port, numbers in (("case1", (-1, 1)), ("case2", (0,)), ("case3", (2,)), ("default", (-2, 3))):
        np.testing.assert_array_equal(result[f"switch/{port}"] == 1.0, np.isin(whole, numbers))


def test_merge_keeps_the_last_value_of_the_subsystem_that_executed_last() -> None:
    builder = DiagramBuilder("merge")
    u = builder.add("u", Clock())
    for name, start in (("first", 1.0), ("second", 3.0)):
        inner = DiagramBuilder(name)
        inner.output("y", inner.input("u"))
        on = builder.add(f"{name} on", Expression(formula=f"t >= {start} && t < {start + 1}", inputs=0))
        builder.add(name, EnabledSubsystem(diagram=inner.build()), u, enable=on)
    builder.add("merge", Merge(initial=-5.0), builder["first"], builder["second"])
    result = ab.simulate(builder.build(), stop_time=6.0, sample_time=0.5)
    values = dict(zip(result.time.tolist(), result["merge"].tolist()))
    assert values[0.5] == -5.0
    assert values[1.5] == pytest.approx(1.5)
    assert values[2.5] == pytest.approx(2.0, abs=1e-9)
    assert values[3.5] == pytest.approx(3.5)
    assert values[5.5] == pytest.approx(4.0, abs=1e-9)


def test_invalid_conditions_cases_and_merges_are_refused() -> None:
    builder = DiagramBuilder("merge")
    with pytest.raises(DiagramError, match="'c/y', which is not an output of a conditional subsystem"):
        builder.add("merge", Merge(inputs=1), builder.add("c", Clock()))
        builder.build()
    with pytest.raises(InputError, match="the formula ends where a value is expected"):
        If(expressions="u >")
    with pytest.raises(DiagramError, match="the condition 'u > 0' has 2 values"):
        builder = DiagramBuilder("if")
        builder.add("if", If(), builder.add("c", Constant(value=[1.0, 2.0])))
        builder.build()
    for invalid in ("1; a", "1; 1", "1;;2"):
        with pytest.raises(InputError, match="the cases are '"):
            SwitchCase(cases=invalid)


def test_merged_action_subsystems_without_states_agree_with_a_switch() -> None:
    """A Switch between two signals agrees with two merged action subsystems."""
    builder = DiagramBuilder("two ways")
    u = builder.add("u", SineWave(frequency=2.0))
    plus, minus = builder.add("plus", Gain(gain=2.0), u), builder.add("minus", Gain(gain=-3.0), u)
    builder.add("switch", Switch(), plus, u, minus)
    choice = builder.add("if", If(expressions="u >= 0"), u)
    for name, output, gain in (("a", "if1", 2.0), ("b", "else", -3.0)):
        inner = DiagramBuilder(name)
        inner.output("y", inner.add("g", Gain(gain=gain), inner.input("u")))
        builder.add(name, ActionSubsystem(diagram=inner.build()), u, action=choice[output])
    merged = builder.add("merge", Merge(), builder["a"], builder["b"])
    builder.add("difference", Sum(signs="+-"), merged, builder["switch"])
    result = ab.simulate(builder.build(), stop_time=5.0)
    assert np.abs(result["difference"]).max() < 1e-11

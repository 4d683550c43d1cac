"""Events at one instant: a block reacts to the signals that are recorded, not to values in between.

Sources jump at the same times. Conditional subsystems and resettable integrators read sums of earlier
signals, so that all signals are constant between jumps. Observers read one sum each. They must agree with
state machines that read the recorded values of this sum before and after each jump. Holds that tick at a jump
sample the value after it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from small_subsystems import counter, scaled

import armblocks as ab
from armblocks.blocks import (
    ActionSubsystem,
    Bias,
    CalledPythonFunction,
    Clock,
    CompareToConstant,
    Constant,
    EnabledSubsystem,
    Gain,
    HitCrossing,
    If,
    Inport,
    Integrator,
    Outport,
    PulseGenerator,
    Relay,
    ResettableIntegrator,
    ResettableSubsystem,
    Step,
    Sum,
    TriggeredSubsystem,
    ZeroOrderHold,
)
from armblocks.diagram import Diagram

STOP = 2.0
JUMPS = (0.3, 0.5, 0.8, 1.1, 1.6)


def resting() -> Diagram:
    """A subsystem with an integrator of 0 that starts from 1: its output jumps only at its reset."""
    inner = ab.DiagramBuilder("resting")
    zero = inner.add("zero", Gain(gain=0.0), inner.add("in", Inport()))
    inner.add("out", Outport(), inner.add("integral", Integrator(initial=1.0), zero))
    return inner.build()


def fixed_sources(builder: ab.DiagramBuilder, random: np.random.Generator) -> list[ab.BlockHandle]:
    """Sources that jump at the times ``JUMPS``."""
    signals = [builder.add("pulse", PulseGenerator(period=0.8, width=50.0, amplitude=2.0, delay=0.3))]
    for k in range(3):
        levels = random.uniform(-1.0, 1.0, 2)
        step = Step(time=float(random.choice(JUMPS)), initial=float(levels[0]), final=float(levels[1]))
        signals.append(builder.add(f"step{k}", step))
    return signals


def moving_sources(builder: ab.DiagramBuilder, random: np.random.Generator) -> list[ab.BlockHandle]:
    """Signals that jump at the times ``JUMPS`` divided by the parameter ``speed.gain``, which is 1."""
    speed = builder.add("speed", Gain(gain=1.0), builder.add("clock", Clock()))
    signals: list[ab.BlockHandle] = []
    for k in range(4):
        after = CompareToConstant(relation=">", constant=float(random.choice(JUMPS)))
        jump = Gain(gain=float(random.uniform(-2.0, 2.0)))
        jumping = builder.add(f"jump{k}", jump, builder.add(f"after{k}", after, speed))
        signals.append(builder.add(f"level{k}", Bias(bias=float(random.uniform(-1.0, 1.0))), jumping))
    return signals


def random_diagram(
    random: np.random.Generator,
    sources: Callable[[ab.DiagramBuilder, np.random.Generator], list[ab.BlockHandle]] = fixed_sources,
) -> tuple[Diagram, list[str]]:
    """A random diagram and the names of the observed sums."""
    builder = ab.DiagramBuilder("order")
    signals = sources(builder, random)
    zero = builder.add("zero", Constant(value=0.0))

    def combination(name: str) -> ab.BlockHandle:
        chosen = random.choice(len(signals), size=3, replace=False)
        gains = [
            builder.add(f"{name} gain{i}", Gain(gain=float(random.uniform(-2.0, 2.0))), signals[j])
            for i, j in enumerate(chosen)
        ]
        total = builder.add(f"{name} sum", Sum(signs="+++"), *gains)
        return builder.add(name, Bias(bias=float(random.uniform(-0.5, 0.5))), total)

    for k in range(6):
        data, control = combination(f"data{k}"), combination(f"control{k}")
        inner = scaled(float(random.uniform(-2.0, 2.0)))
        kind = int(random.integers(5))
        if kind == 0:
            block = builder.add(f"part{k}", EnabledSubsystem(diagram=inner), data, enable=control)
        elif kind == 1:
            edge = str(random.choice(["rising", "falling", "either"]))
            block = builder.add(
                f"part{k}", TriggeredSubsystem(diagram=inner, edge=edge), data, trigger=control
            )
        elif kind == 2:
            condition = builder.add(f"if{k}", If(expressions="u > 0"), control)
            block = builder.add(f"part{k}", ActionSubsystem(diagram=inner), data, action=condition["if1"])
        elif kind == 3:
            block = builder.add(f"part{k}", ResettableSubsystem(diagram=resting()), data, reset=control)
        else:
            rule = ResettableIntegrator(external_reset="either", initial_condition_source="external")
            block = builder.add(f"part{k}", rule, zero, control, data)
        signals.append(block)
    one = builder.add("one", Constant(value=1.0))
    observed = [combination(f"v{k}") for k in range(4)]
    for k, v in enumerate(observed):
        builder.add(f"count{k}", TriggeredSubsystem(diagram=counter()), one, trigger=v)
        builder.add(f"since{k}", ResettableIntegrator(external_reset="rising"), one, v)
        builder.add(f"relay{k}", Relay(on_point=0.5, off_point=-0.5), v)
        builder.add(f"hit{k}", HitCrossing(), v)
        builder.add(f"integral{k}", Integrator(), v)
        if sources is fixed_sources:
            builder.add(f"hold{k}", ZeroOrderHold(sample_time=0.1), v)
    return builder.build(), [f"v{k}" for k in range(4)]


@pytest.mark.parametrize("seed", range(4))
def test_blocks_react_to_the_recorded_values_only(seed: int) -> None:
    diagram, names = random_diagram(np.random.default_rng(seed))
    result = ab.simulate(diagram, stop_time=STOP, sample_time=0.05)
    for k, name in enumerate(names):
        jumps = result.jumps[name]
        on, rises, crossings, last = result[name][0] >= 0.5, 0, 0, 0.0
        for time, before, after in zip(*jumps):
            on = after >= 0.5 or (on and after > -0.5)
            if before <= 0.0 < after:
                rises, last = rises + 1, time
            crossings += (before <= 0.0) != (after <= 0.0)
        assert result[f"count{k}"][-1] == rises
        assert result[f"hit{k}/count"][-1] == crossings
        assert result[f"relay{k}"][-1] == on
        assert np.isclose(result[f"since{k}"][-1], STOP - last)
        assert np.array_equal(result[f"hold{k}"][2::2], result[name][2::2])


@pytest.mark.parametrize("seed", [2, 17])
def test_the_sensitivity_of_integrals_follows_from_the_recorded_jumps(seed: int) -> None:
    """A jump by h at T / g adds ``h (stop - T / g)`` to an integral; its derivative with respect to g = 1 is
    ``h T``."""
    diagram, names = random_diagram(np.random.default_rng(100 + seed), moving_sources)
    options = {"stop_time": STOP, "sample_time": 0.05}
    jumps = ab.simulate(diagram, **options).jumps
    integrals = [f"integral{k}" for k in range(len(names))]
    result = ab.sensitivity(diagram, ["speed.gain"], integrals, **options)
    for name, integral in zip(names, integrals):
        times, before, after = jumps[name]
        expected = np.sum((after - before) * times)
        assert np.isclose(result[integral, "speed.gain"][-1], expected, rtol=1e-6, atol=1e-8)


def test_a_called_function_reads_the_values_after_the_events_before_its_tick() -> None:
    builder = ab.DiagramBuilder("called")
    step, one = builder.add("step", Step(time=0.5)), builder.add("one", Constant(value=1.0))
    integral = builder.add("integral", ResettableIntegrator(external_reset="rising"), one, step)
    law = CalledPythonFunction(function=lambda u, w, t: u + 10.0 * w, results="y", sample_time=0.25)
    builder.add("law", law, integral, step)
    result = ab.simulate(builder.build(), stop_time=1.0, sample_time=0.25)
    assert np.allclose(result["law"], [0.0, 0.25, 10.0, 10.25, 10.5], rtol=0.0, atol=1e-12)


def test_a_state_port_gives_the_value_before_a_reset_at_the_same_instant() -> None:
    """Two integrators exchange their values at each reset through their state ports."""
    builder = ab.DiagramBuilder("exchange")
    pulse = builder.add("pulse", PulseGenerator(period=1.0, width=50.0, delay=0.5))
    zero = builder.add("zero", Constant(value=0.0))
    rule = ResettableIntegrator(
        external_reset="rising", initial_condition_source="external at resets", state_port=True
    )
    one = builder.add("one", rule.with_parameters(initial=1.0), zero, pulse)
    two = builder.add("two", rule.with_parameters(initial=2.0), zero, pulse)
    builder.connect(one["state"], two["initial"])
    builder.connect(two["state"], one["initial"])
    result = ab.simulate(builder.build(), stop_time=3.0, sample_time=0.25)
    resets = np.floor(result.time + 0.5)
    assert np.array_equal(result["one/y"], np.where(resets % 2, 2.0, 1.0))
    assert np.array_equal(result["two/y"], np.where(resets % 2, 1.0, 2.0))

"""Sample times: explicit, inherited through connections, and refused where they are incompatible."""

from __future__ import annotations

import pytest

from armblocks.blocks import (
    Clock,
    CompareToConstant,
    CompareToZero,
    Constant,
    CounterLimited,
    Gain,
    Integrator,
    LogicalOperator,
    Mux,
    RateTransition,
    SineWave,
    Step,
    Sum,
    UnitDelay,
    ZeroOrderHold,
)
from armblocks.diagram import Diagram, DiagramBuilder, trace_diagram
from armblocks.diagram.model import diagram_model
from armblocks.equations import SampleClock
from armblocks.errors import DiagramError, InputError


def clocks_of(diagram: Diagram) -> dict[str, SampleClock]:
    sampling = diagram_model(diagram).sampling
    return {name: sampling.clocks[clock] for name, clock in sampling.clock_of.items()}


def test_an_explicit_sample_time_is_inherited_through_blocks_without_sample_time() -> None:
    builder = DiagramBuilder("d")
    hold = builder.add("hold", ZeroOrderHold(sample_time=(0.2, 0.05)), builder.add("t", Clock()))
    gain = builder.add("gain", Gain(), hold)
    mux = builder.add("mux", Mux(), gain, builder.add("one", Constant()))
    builder.add("delay", UnitDelay(), builder.add("again", UnitDelay(), mux))
    clocks = clocks_of(builder.build())
    assert set(clocks.values()) == {SampleClock(0.2, 0.05)}
    assert set(clocks) == {"hold", "delay", "again"}


def test_blocks_fed_by_comparisons_have_no_guards_except_in_a_loop() -> None:
    """Comparisons change only at events, so that blocks with only such inputs need no modes outside loops."""
    builder = DiagramBuilder("d")
    moving = builder.add("moving", CompareToZero(), builder.add("sine", SineWave()))
    gate = builder.add("gate", LogicalOperator(), moving, builder.add("one", Constant()))
    builder.add("above", CompareToConstant(constant=0.5), gate)
    around = builder.add("around", CompareToConstant(constant=2.5))
    builder.connect(builder.add("sum", Sum(), gate, around), around["u"])
    guards = trace_diagram(builder.build()).guard_names
    assert sorted(set(guards)) == ["around", "moving"]


@pytest.mark.parametrize(("fastest", "other"), [(0.1, 0.3), (1.0 / 6.0, 1.0 / 3.0), (0.1 / 3.0, 0.7)])
def test_the_shortest_of_periods_that_are_rounded_multiples_is_inherited(
    fastest: float, other: float
) -> None:
    builder = DiagramBuilder("d")
    slow = builder.add("slow", CounterLimited(sample_time=other))
    fast = builder.add("fast", CounterLimited(sample_time=fastest))
    builder.add("delay", UnitDelay(), builder.add("mux", Mux(), slow, fast))
    diagram = builder.build()
    assert clocks_of(diagram)["delay"] == SampleClock(fastest)
    assert trace_diagram(diagram).clocks == (SampleClock(fastest), SampleClock(other))


def test_a_block_fed_by_constants_inherits_the_sample_time_of_its_target() -> None:
    builder = DiagramBuilder("d")
    delay = builder.add("delay", UnitDelay(), builder.add("one", Constant()))
    builder.add("hold", ZeroOrderHold(sample_time=0.5), builder.add("gain", Gain(), delay))
    assert clocks_of(builder.build())["delay"] == SampleClock(0.5)


def test_delays_in_a_loop_inherit_their_sample_time() -> None:
    builder = DiagramBuilder("d")
    mux = builder.add("mux", Mux(), builder.add("count", CounterLimited(sample_time=0.5)))
    first = builder.add("first", UnitDelay(initial=[0.0, 0.0]), mux)
    sum_of = builder.add(
        "gain", Gain(gain=0.5), builder.add("hold", UnitDelay(), builder.add("one", Constant()))
    )
    builder.connect(sum_of, mux["u2"])
    builder.add("third", UnitDelay(), first)
    builder.add("end", ZeroOrderHold(sample_time=1.0), sum_of)
    assert clocks_of(builder.build())["first"] == SampleClock(0.5)


@pytest.mark.parametrize("source", [Clock(), Step(), Integrator()], ids=["clock", "step", "state"])
def test_a_sample_time_cannot_be_inherited_from_a_continuous_signal(
    source: Clock | Step | Integrator,
) -> None:
    builder = DiagramBuilder("d")
    inputs = [builder.add("one", Constant())] if source.input_ports() else []
    gain = builder.add("gain", Gain(), builder.add("source", source, *inputs))
    builder.add("delay", UnitDelay(), gain)
    with pytest.raises(DiagramError, match=r"block 'delay' \(Unit Delay\): .*'source' changes continuously"):
        builder.build()


def test_a_missing_sample_time_is_refused() -> None:
    builder = DiagramBuilder("d")
    builder.add("delay", UnitDelay(), builder.add("one", Constant()))
    with pytest.raises(
        DiagramError, match=r"no connected block is sampled.*set the sample_time of the block"
    ):
        builder.build()


def test_incompatible_sample_times_are_refused_with_both_blocks() -> None:
    builder = DiagramBuilder("d")
    a = builder.add("a", CounterLimited(sample_time=0.2))
    b = builder.add("b", CounterLimited(sample_time=0.5))
    builder.add("delay", UnitDelay(), builder.add("mux", Mux(), a, b))
    message = r"'a' ticks every 0\.2 s \(offset 0 s\) and 'b' every 0\.5 s .* put a Rate Transition"
    with pytest.raises(DiagramError, match=message):
        builder.build()
    builder = DiagramBuilder("d")
    a = builder.add("a", CounterLimited(sample_time=0.2))
    b = builder.add("b", RateTransition(sample_time=0.2), builder.add("b0", CounterLimited(sample_time=0.5)))
    builder.add("delay", UnitDelay(), builder.add("mux", Mux(), a, b))
    assert clocks_of(builder.build())["delay"] == SampleClock(0.2)


@pytest.mark.parametrize("sample_time", [0.0, -2.0, (0.1, 0.1), (0.1, -0.1), (0.1, 0.0, 0.0), (-1.0, 0.1)])
def test_an_invalid_sample_time_of_a_block_is_refused(sample_time: object) -> None:
    builder = DiagramBuilder("d")
    builder.add("count", CounterLimited(sample_time=sample_time))  # pyright: ignore
    with pytest.raises(DiagramError, match=r"block 'count', CounterLimited\.sample_time: the sample time is"):
        builder.build()


@pytest.mark.parametrize(("period", "offset"), [(0.0, 0.0), (float("inf"), 0.0), (1.0, 1.0), (1.0, -0.1)])
def test_an_invalid_period_or_offset_of_a_clock_is_refused(period: float, offset: float) -> None:
    with pytest.raises(InputError, match=r"a clock has the period .* Allowed: a finite period > 0"):
        SampleClock(period, offset)

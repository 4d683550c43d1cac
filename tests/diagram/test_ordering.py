"""Evaluation order: detection of algebraic loops, and long chains without recursion."""

from __future__ import annotations

import sys

import pytest

from armblocks.blocks import (
    Clock,
    Constant,
    Derivative,
    Gain,
    Integrator,
    StateSpace,
    Sum,
    TransferFunction,
)
from armblocks.diagram import DiagramBuilder, trace_diagram
from armblocks.diagram.model import diagram_model
from armblocks.errors import AlgebraicLoopError


def loops_of(builder: DiagramBuilder) -> dict[str, tuple[str, ...]]:
    """Return the algebraic loops of the flow, by the signal at which each is cut."""
    model = diagram_model(builder.build())
    return {loop[-1]: loop for loop in model.flow_order.loops.values()}


def test_an_algebraic_loop_lists_its_signals_in_evaluation_order() -> None:
    builder = DiagramBuilder("d")
    total = builder.add("sum", Sum(signs="+-"), builder.add("one", Constant()))
    half = builder.add("half", Gain(gain=0.5), total)
    third = builder.add("third", Gain(gain=0.3), half)
    builder.connect(third, total["u2"])
    builder.add("after", Gain(), total)
    (loop,) = loops_of(builder).values()
    index = loop.index("sum/y")
    assert loop[index:] + loop[:index] == ("sum/y", "half/y", "third/y")


def test_a_loop_with_a_gain_of_zero_is_detected() -> None:
    builder = DiagramBuilder("d")
    gain = builder.add("gain", Gain(gain=0.0))
    builder.connect(gain, gain)
    assert loops_of(builder) == {"gain/y": ("gain/y",)}


def test_an_integrator_or_a_strictly_proper_filter_breaks_a_loop() -> None:
    for block in (Integrator(), TransferFunction(), StateSpace()):
        builder = DiagramBuilder("d")
        x = builder.add("x", block)
        builder.connect(builder.add("back", Gain(gain=-1.0), x), x)
        trace_diagram(builder.build())


@pytest.mark.parametrize(
    "block", [TransferFunction(numerator=(1.0, 0.0)), StateSpace(D=[[1.0]])], ids=["filter", "state space"]
)
def test_a_block_with_feedthrough_is_part_of_an_algebraic_loop(block: TransferFunction | StateSpace) -> None:
    builder = DiagramBuilder("d")
    x = builder.add("x", block)
    builder.connect(builder.add("back", Gain(gain=-1.0), x), x)
    assert {frozenset(loop) for loop in loops_of(builder).values()} == {frozenset({"x/y", "back/y"})}


def test_a_derivative_of_its_own_output_is_refused() -> None:
    builder = DiagramBuilder("d")
    rate = builder.add("rate", Derivative())
    builder.connect(rate, rate)
    with pytest.raises(AlgebraicLoopError, match="rate/y"):
        builder.build()


def test_a_derivative_in_an_algebraic_loop_is_refused() -> None:
    builder = DiagramBuilder("d")
    total = builder.add("sum", Sum(), builder.add("clock", Clock()))
    builder.connect(builder.add("rate", Derivative(), total), total["u2"])
    with pytest.raises(AlgebraicLoopError, match="sum/y"):
        builder.build()


def test_a_state_derivative_that_depends_on_its_second_derivative_is_refused() -> None:
    # x' = d2/dt2 x / 2: the order of the derivatives would grow without limit
    builder = DiagramBuilder("d")
    x = builder.add("x", Integrator())
    second = builder.add("second", Derivative(), builder.add("first", Derivative(), x))
    builder.connect(builder.add("back", Gain(gain=0.5), second), x)
    with pytest.raises(AlgebraicLoopError, match=r"diagram 'd': algebraic loop: .*every loop passes through"):
        builder.build()
    # x' = t + x' / 2 has derivatives of the same order and the solution x' = 2 t
    builder = DiagramBuilder("d")
    x = builder.add("x", Integrator())
    half = builder.add("half", Gain(gain=0.5), builder.add("rate", Derivative(), x))
    builder.connect(builder.add("sum", Sum(), builder.add("clock", Clock()), half), x)
    system = trace_diagram(builder.build())
    assert system.derivative(3.0, [0.0], (), (), system.parameter_values)[0].tolist() == [6.0]


def test_higher_derivatives_of_a_state_are_not_a_loop() -> None:
    builder = DiagramBuilder("d")
    x = builder.add("x", Integrator(initial=2.0))
    builder.connect(builder.add("back", Gain(gain=-3.0), x), x)
    last = x
    for k in range(4):
        last = builder.add(f"rate{k}", Derivative(), last)
    system = trace_diagram(builder.build())
    (y,) = system.signals(0.0, [2.0], (), (), system.parameter_values)
    signals = system.signals_layout.unpack(y)
    assert [float(signals[f"rate{k}/y"]) for k in range(4)] == [-6.0, 18.0, -54.0, 162.0]


def test_a_chain_longer_than_the_recursion_limit_is_ordered() -> None:
    count = 2 * sys.getrecursionlimit()
    builder = DiagramBuilder("chain")
    last = builder.add("source", Constant(value=0.0))
    for k in range(count):
        # descending names: the sorted order is the reverse of the evaluation order
        last = builder.add(f"{count - k:05d}", Gain(gain=1.0), last)
    system = trace_diagram(builder.build())
    assert system.signals_layout.names[0] == "source/y"
    assert system.signals_layout.names[-1] == "00001/y"

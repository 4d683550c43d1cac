"""Conditional subsystems whose controls and inputs jump at the same times, compared with the reference.

All times are multiples of 0.25 s. Levels and limits differ, so that no signal stays at a switching value.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from reference_simulator import run_reference

import armblocks as ab
from armblocks import blocks as bl
from armblocks.diagram import Block, BlockHandle

TIMES = np.arange(41) * 0.1
SUBSYSTEMS = 4


def source(rng: random.Random) -> Block:
    return rng.choice(
        (
            lambda: bl.Step(
                time=rng.choice((0.5, 1.0, 2.0)), initial=rng.choice((-0.9, 0.0, 1.1)), final=0.34
            ),
            lambda: bl.SignalGenerator(waveform="square", amplitude=1.3, frequency=rng.choice((0.5, 1.0))),
            lambda: bl.RepeatingSequence(times=(0.0, rng.choice((1.0, 2.0))), values=(0.71, -0.38)),
            lambda: bl.PulseGenerator(period=rng.choice((0.5, 1.0)), amplitude=rng.choice((1.2, -1.0, 0.63))),
            lambda: bl.Constant(value=rng.choice((0.97, 0.31, -0.83))),
        )
    )()


BLOCKS: Sequence[Callable[[], Block]] = (
    lambda: bl.Relay(on_point=0.53, off_point=-0.47),
    lambda: bl.Relay(on_point=0.21, off_point=0.12),
    lambda: bl.Backlash(width=0.43, initial=0.05),
    lambda: bl.RateLimiterContinuous(rising=1.1, falling=-2.9),
    lambda: bl.Saturation(upper=0.61, lower=-0.41),
    lambda: bl.DeadZone(start=-0.23, end=0.29),
    lambda: bl.Quantizer(interval=0.37),
    lambda: bl.CoulombFriction(offset=0.2),
    lambda: bl.Integrator(initial=0.02),
    lambda: bl.Gain(gain=-1.5),
    lambda: bl.UnitDelay(sample_time=0.25),
    lambda: bl.CompareToConstant(constant=0.26),
)


def inside(rng: random.Random) -> ab.Diagram:
    """A chain of two to four blocks."""
    inner = ab.DiagramBuilder("inside")
    last = inner.input("u")
    for number in range(rng.randint(2, 4)):
        last = inner.add(f"b{number}", rng.choice(BLOCKS)(), last)
    inner.output("y", last)
    return inner.build()


def add_subsystem(
    builder: ab.DiagramBuilder, name: str, rng: random.Random, u: BlockHandle, control: BlockHandle
) -> BlockHandle:
    kind = rng.choice(("enabled", "restarting", "if", "reset", "nested"))
    if kind == "if":
        choice = builder.add(f"if {name}", bl.If(expressions="u > 0.17"), control)
        branches = [
            builder.add(f"{name} {port}", bl.ActionSubsystem(diagram=inside(rng)), u, choice[port])
            for port in ("if1", "else")
        ]
        return builder.add(name, bl.Merge(inputs=2), *branches)
    if kind == "reset":
        return builder.add(name, bl.ResettableSubsystem(diagram=inside(rng)), u, reset=control)
    if kind == "nested":
        outer = ab.DiagramBuilder("outer")
        v, enable = outer.input("u"), outer.input("enable")
        outer.output("y", outer.add("inner", bl.EnabledSubsystem(diagram=inside(rng)), v, enable=enable))
        other = builder.add(f"{name} reset", source(rng))
        return builder.add(name, bl.ResettableSubsystem(diagram=outer.build()), u, control, reset=other)
    states = "reset" if kind == "restarting" else "held"
    subsystem = bl.EnabledSubsystem(diagram=inside(rng), states_when_enabling=states)
    return builder.add(name, subsystem, u, enable=control)


@pytest.mark.parametrize("seed", range(6))
def test_simultaneous_jumps_of_controls_and_inputs_agree_with_the_reference(seed: int) -> None:
    rng = random.Random(seed)
    builder = ab.DiagramBuilder("coincident")
    u = builder.add("u", source(rng))
    control = builder.add("control", source(rng))
    delayed = builder.add("delayed", bl.Relay(on_point=0.44, off_point=-0.19), control)
    for number in range(SUBSYSTEMS):
        y = add_subsystem(builder, f"sub {number}", rng, u, rng.choice((control, delayed)))
        builder.add(f"total {number}", bl.Integrator(), y)
    diagram = builder.build()
    result = ab.simulate(diagram, stop_time=4.0, sample_time=0.1, rtol=1e-9, atol=1e-12)
    expected = run_reference(diagram, TIMES, 0.02)
    for number in range(SUBSYSTEMS):
        # An enabled rate limiter follows an input that is within a thousandth of its last output.
        np.testing.assert_allclose(
            result[f"total {number}/y"], expected[f"total {number}/y"], atol=5e-3, err_msg=f"sub {number}"
        )

"""Sampled integrals in triggered subsystems with irregular trigger events, compared with closed forms."""

from __future__ import annotations

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import (
    Clock,
    Constant,
    DiscreteIntegrator,
    DiscretePID,
    FromTable,
    ResettableSubsystem,
    SampledJointPID,
    SineWave,
    TriggeredSubsystem,
)
from armblocks.diagram import Block, DiagramBuilder

GRID = 1.0 / 64.0
METHODS = ("forward_euler", "backward_euler", "trapezoidal")
SEEDS = range(3)
each_method = pytest.mark.parametrize("method", METHODS)
each_seed = pytest.mark.parametrize("seed", SEEDS)


def at_triggers(
    block: Block, source: Block, seed: int, *more: tuple[str, Block], reset: float | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """The random times of trigger events (s), and the output of a block in a triggered subsystem there.

    ``more``: constant inputs of the block by port. ``reset``: a time (s) at which the states are reset.
    """
    edges = np.sort(np.random.default_rng(seed).choice(np.arange(1, 255), 40, replace=False)) * GRID
    times, values = [0.0, *edges], [-1.0, *np.resize([1.0, -1.0], edges.size)]
    inner = DiagramBuilder("inner")
    handle = inner.add("block", block, **{port: inner.add(port, other) for port, other in more})
    inner.connect(inner.input("u"), handle["q" if isinstance(block, SampledJointPID) else "u"])
    inner.output("y", handle)
    kind = TriggeredSubsystem(diagram=inner.build())
    builder = DiagramBuilder("triggered")
    u = builder.add("u", source)
    trigger = builder.add("trigger", FromTable(times=times, values=values, method="flat"))
    if reset is None:
        builder.add("sub", kind, u, trigger=trigger)
    else:
        outer = DiagramBuilder("outer")
        outer.output("y", outer.add("sub", kind, outer.input("u"), trigger=outer.input("trigger")))
        step = builder.add("reset", FromTable(times=[0.0, reset], values=[-1.0, 1.0], method="flat"))
        builder.add("sub", ResettableSubsystem(diagram=outer.build()), u, trigger, reset=step)
    result = ab.simulate(builder.build(), stop_time=4.0, sample_time=GRID)
    rising = edges[::2]
    return rising, result["sub"][np.round(rising / GRID).astype(int)]


def integral(method: str, t: np.ndarray, u: np.ndarray, first: float = 0.0) -> np.ndarray:
    """Simulink's formulas: y(n) = y(n-1) + [t(n) - t(n-1)] u, where u depends on the rule."""
    before = np.concatenate([[0.0], u[:-1]])
    mean = {"forward_euler": before, "backward_euler": u, "trapezoidal": 0.5 * (before + u)}[method]
    return np.cumsum(np.diff(t, prepend=first) * mean)


@each_method
@each_seed
def test_a_constant_is_integrated_exactly_by_every_rule(method: str, seed: int) -> None:
    t, y = at_triggers(DiscreteIntegrator(method=method, gain=3.0, initial=0.5), Constant(value=2.0), seed)
    assert y - y[0] == pytest.approx(6.0 * (t - t[0]), abs=1e-12)


@each_seed
def test_a_linear_input_is_integrated_exactly_by_the_trapezoidal_rule(seed: int) -> None:
    t, y = at_triggers(DiscreteIntegrator(method="trapezoidal"), Clock(), seed)
    assert y == pytest.approx(0.5 * t**2, abs=1e-12)


@each_method
@each_seed
def test_integrals_follow_the_formulas_of_simulink(method: str, seed: int) -> None:
    t, y = at_triggers(DiscreteIntegrator(method=method), SineWave(frequency=5.0), seed)
    assert y == pytest.approx(integral(method, t, np.sin(5.0 * t)), abs=1e-9)


@each_method
def test_limits_apply_to_the_integral_at_each_trigger(method: str) -> None:
    t, y = at_triggers(DiscreteIntegrator(method=method, upper=1.5), Constant(value=1.0), 0)
    assert y[1:] == pytest.approx(np.minimum(integral(method, t, np.ones(t.size))[1:], 1.5), abs=1e-12)


@each_method
def test_a_reset_drops_the_input_of_the_previous_trigger(method: str) -> None:
    reset = 2.0 + 0.5 * GRID
    t, y = at_triggers(DiscreteIntegrator(method=method), Constant(value=1.0), 1, reset=reset)
    after = t > reset
    assert y[~after] == pytest.approx(integral(method, t[~after], np.ones((~after).sum())), abs=1e-12)
    assert y[after] == pytest.approx(integral(method, t[after], np.ones(after.sum()), reset), abs=1e-12)


@each_method
@each_seed
def test_the_integral_of_a_sampled_controller_is_exact_for_a_constant_error(method: str, seed: int) -> None:
    pid = DiscretePID(P=0.0, I=2.0, D=0.0, integrator_method=method)
    t, y = at_triggers(pid, Constant(value=1.5), seed)
    assert y - y[0] == pytest.approx(3.0 * (t - t[0]), abs=1e-12)
    joint = SampledJointPID(Kp=[0.0], Ki=[2.0], Kd=[0.0], sample_time=-1)
    zero = Constant(value=[0.0])
    inputs = (("qr", Constant(value=[3.0])), ("qd", zero), ("qdr", zero))
    t, y = at_triggers(joint, Constant(value=[1.5]), seed, *inputs)
    assert y[:, 0] == pytest.approx(3.0 * (t - t[0]), abs=1e-12)


@each_method
@each_seed
def test_the_filter_of_a_sampled_controller_follows_its_rule(method: str, seed: int) -> None:
    """The output d = N (u - f), where f is the integral of d by the rule."""
    N = 4.0
    t, y = at_triggers(
        DiscretePID(P=0.0, I=0.0, D=1.0, N=N, filter_method=method), SineWave(frequency=5.0), seed
    )
    f = integral(method, t, y)
    assert y == pytest.approx(N * (np.sin(5.0 * t) - f), abs=1e-8)

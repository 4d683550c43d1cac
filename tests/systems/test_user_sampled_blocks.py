"""A user-defined sampled block may have modes, left limits and continuous states, as other blocks may."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from casadi import SX, if_else
from numpy.typing import ArrayLike

import armblocks as ab
from armblocks import DiagramBuilder
from armblocks.blocks import (
    Inport,
    Outport,
    PulseGenerator,
    Relay,
    ResettableSubsystem,
    SineWave,
    Step,
    Sum,
    UnitDelay,
)
from armblocks.diagram import Block, Condition, Port, Shapes, Signals, State, sample_time_parameter

PERIOD = 0.1
VALUES = ("count", "left", "on", "above", "stuck", "area")


@dataclass(frozen=True, kw_only=True)
class Observer(Block):
    """Outputs at its ticks: tick count, left limit and integral of u, a relay, u > 0.5, and count >= 5."""

    title: ClassVar[str] = "Observer"
    sampled: ClassVar[bool] = True
    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "", "", ()),)

    def output_ports(self) -> tuple[Port, ...]:
        return tuple(Port(f"{name}_out", "", "", ()) for name in VALUES)

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("area", (), ""),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("count", (), ""), State("left", (), ""))

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("on", (), "", follows=True, hysteresis=True), State("stuck", (), ""))

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        return (Condition("above", (), ""),)

    def initial_states(self, p: Signals) -> Signals:
        return {"area": SX(0.0), "count": SX(0.0), "left": SX(-5.0)}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"area": u["u"]}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"count": x["count"] + 1.0, "left": x["left"]}

    def captures(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"left": u["u"]}

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"above": u["u"] - 0.5}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        on = if_else(u["u"] > 1.0, 1.0, if_else(u["u"] < 0.0, 0.0, x["on"]))
        return {"on": on, "stuck": if_else(x["count"] >= 5.0, 1.0, x["stuck"])}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {f"{name}_out": x[name] for name in VALUES}


def wave(t: np.ndarray) -> np.ndarray:
    return 2.0 * np.sin(3.0 * t + 0.5) - 0.4


def expected(restarts: list[float], stop: float) -> dict[str, list[float]]:
    """The outputs at the ticks, from the definition, with the relay evaluated on a fine grid."""
    values: dict[str, list[float]] = {name: [] for name in VALUES}
    for k in range(round(stop / PERIOD) + 1):
        t = k * PERIOD
        restart = max([0.0, *(time for time in restarts if time <= t + 1e-9)])
        first = next(n for n in range(k + 1) if n * PERIOD > restart - 1e-9)
        fine = np.linspace(restart, t, 4000)
        u = wave(fine) + 3.0 * (fine >= 1.0 - 1e-9)
        changed = np.flatnonzero((u > 1.0) | (u < 0.0))
        begins = abs(t - restart) < 1e-9
        values["count"].append(k - first)
        values["left"].append(-5.0 if begins else float(wave(np.array(t)) + 3.0 * (t > 1.0 + 1e-9)))
        values["on"].append(float(changed.size > 0 and u[changed[-1]] > 1.0))
        values["above"].append(float(u[-1] >= 0.5))
        values["stuck"].append(float(k - first >= 5))
        integral = (2.0 / 3.0) * (np.cos(3.0 * restart + 0.5) - np.cos(3.0 * t + 0.5)) - 0.4 * (t - restart)
        values["area"].append(0.0 if begins else integral + 3.0 * (max(t, 1.0) - max(restart, 1.0)))
    return values


@pytest.mark.parametrize("offset", (None, 0.7, 0.73))
def test_a_sampled_block_may_have_modes_left_limits_and_continuous_states(offset: float | None) -> None:
    """``offset``: the time of the first reset, at a tick or between two; the period of resets is 1.1 s."""
    b = DiagramBuilder("observed")
    sine = b.add("sine", SineWave(frequency=3.0, amplitude=2.0, phase=0.5, bias=-0.4))
    u = b.add("u", Sum(signs="++"), sine, b.add("jump", Step(time=1.0, final=3.0)))
    if offset is None:
        b.add("observer", Observer(sample_time=PERIOD), u)
    else:
        inner = DiagramBuilder("part")
        inner.add("observer", Observer(sample_time=PERIOD), inner.add("u", Inport(port=1)))
        pulse = b.add("pulse", PulseGenerator(period=1.1, delay=offset))
        b.add("sub", ResettableSubsystem(diagram=inner.build()), u, pulse)
    result = ab.simulate(b.build(), stop_time=3.0, sample_time=PERIOD, rtol=1e-10, atol=1e-12)
    restarts = [] if offset is None else [offset + 1.1 * k for k in range(3)]
    path = "observer" if offset is None else "sub/observer"
    for name, values in expected(restarts, 3.0).items():
        np.testing.assert_allclose(result[f"{path}/{name}_out"], values, atol=1e-8, err_msg=name)


def test_a_sampled_block_reads_the_restarted_relay_at_the_tick_that_resets_both() -> None:
    inner = DiagramBuilder("part")
    relay = inner.add("relay", Relay(on_point=1.0, off_point=-1.0), inner.add("u", Inport(port=1)))
    inner.add("y", Outport(port=1), inner.add("delay", UnitDelay(sample_time=0.25), relay))
    b = DiagramBuilder("reset at a tick")
    # On from t = 1/6 on; at the reset at t = 0.5 the input is below the point at which the relay turns on.
    u = b.add("u", SineWave(frequency=np.pi, amplitude=2.0))
    fall = b.add("fall", Step(time=0.375, final=-1.5))
    reset = b.add("reset", PulseGenerator(period=2.0, delay=0.5))
    sub = ResettableSubsystem(diagram=inner.build())
    b.add("sub", sub, b.add("sum", Sum(signs="++"), u, fall), reset)
    result = ab.simulate(b.build(), stop_time=1.0, sample_time=0.25)
    assert [*result["sub/relay"]] == [0.0, 1.0, 0.0, 0.0, 0.0]
    assert [*result["sub/delay"]] == [0.0, 0.0, 0.0, 0.0, 0.0]

"""Ticks and events at one instant: a sampled system equals its blocks executed in the order of feedthrough.

All signals of the random networks change at the ticks of one clock, or at every second of them. At each tick
a plain loop over the blocks computes their outputs in order, then the states of the delays. This is the
execution of a discrete model in Simulink. Feedback passes through delays.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from small_subsystems import counter, scaled

import armblocks as ab
from armblocks.blocks import (
    ActionSubsystem,
    Backlash,
    Bias,
    Constant,
    EnabledSubsystem,
    Gain,
    If,
    RateLimiterContinuous,
    Relay,
    ResettableIntegrator,
    SignalGenerator,
    SineWave,
    Sum,
    TriggeredSubsystem,
    UnitDelay,
    ZeroOrderHold,
)

PERIOD, TICKS = 0.1, 40
BETWEEN_TICKS = slice(1, 2 * TICKS, 2)
"""The rows between ticks, for a record with half the period."""
Values = dict[str, float]
Rule = Callable[[Values, Values], float]
"""The output of a block at a tick, from the signals at this tick and at the tick before."""


class SampledNetwork:
    """A random diagram, and the rules of its blocks in the order of feedthrough."""

    def __init__(self, random: np.random.Generator) -> None:
        self.random = random
        self.builder = ab.DiagramBuilder("ticks")
        self.rules: dict[str, Rule] = {}
        self.delayed: dict[str, str] = {}
        """For each delay in a feedback, its input."""
        self.signals: dict[str, ab.BlockHandle] = {}
        for k in range(3):
            self._add_source(f"source{k}")
        delays = [self.builder.add(f"delay{k}", UnitDelay(sample_time=PERIOD)) for k in range(2)]
        self.signals |= {f"delay{k}": delay for k, delay in enumerate(delays)}
        for k in range(8):
            self._add_block(f"block{k}", self._combination(f"data{k}"), self._combination(f"control{k}"))
        for k, delay in enumerate(delays):
            source = self._combination(f"feedback{k}")
            # A feedback of small amplitude stays bounded.
            small = self.builder.add(f"small{k}", Gain(gain=0.05), self.signals.pop(source))
            self._rule(f"small{k}", lambda now, _, source=source: 0.05 * now[source])
            self.builder.connect(small, delay)
            self.delayed[f"delay{k}"] = f"small{k}"

    def run(self, change: float = 0.0) -> dict[str, list[float]]:
        """All signals at the ticks, by block. ``change`` is added to the amplitude of the first source."""
        self.change = change
        rows: list[Values] = []
        states = dict.fromkeys(self.delayed, 0.0)
        for number in range(TICKS):
            now: Values = {"number": number, "t": number * PERIOD, **states}
            before = rows[-1] if rows else {}
            for name, rule in self.rules.items():
                now[name] = rule(now, before)
            rows.append(now)
            states = {delay: now[source] for delay, source in self.delayed.items()}
        return {name: [row[name] for row in rows] for name in self.rules}

    def _rule(self, name: str, rule: Rule) -> None:
        self.rules[name] = rule

    def _add_source(self, name: str) -> None:
        amplitude, frequency, phase = self.random.uniform((0.5, 3.0, 0.0), (2.0, 20.0, 6.0)).tolist()
        sine = SineWave(amplitude=amplitude, frequency=frequency, phase=phase)
        wave = self.builder.add(f"{name} wave", sine)
        self.signals[name] = self.builder.add(name, ZeroOrderHold(sample_time=PERIOD), wave)
        changes = float(name == "source0")
        self._rule(
            name,
            lambda now, _: (amplitude + changes * self.change) * np.sin(frequency * now["t"] + phase),
        )

    def _combination(self, name: str) -> str:
        """A weighted sum of three earlier signals and a constant."""
        chosen = [str(key) for key in self.random.choice(list(self.signals), size=3, replace=False)]
        weights, bias = self.random.uniform(-1.5, 1.5, 3).tolist(), float(self.random.uniform(-0.5, 0.5))
        gains = [
            self.builder.add(f"{name} gain{i}", Gain(gain=weight), self.signals[key])
            for i, (key, weight) in enumerate(zip(chosen, weights))
        ]
        total = self.builder.add(f"{name} sum", Sum(signs="+++"), *gains)
        self.signals[name] = self.builder.add(name, Bias(bias=bias), total)
        self._rule(name, lambda now, _: sum(w * now[key] for w, key in zip(weights, chosen)) + bias)
        return name

    def _add_block(self, name: str, data: str, control: str) -> None:
        add, kind = self.builder.add, int(self.random.integers(8))
        u, c = self.signals.pop(data), self.signals.pop(control)
        gain = float(self.random.uniform(-1.5, 1.5))
        edge = str(self.random.choice(["rising", "falling", "either"]))

        def is_edge(now: Values, before: Values) -> bool:
            if not before or (now[control] > 0.0) == (before[control] > 0.0):
                return False
            return edge == "either" or (edge == "rising") == (now[control] > 0.0)

        def held(now: Values, before: Values) -> float:
            return gain * now[data] if now[control] > 0.0 else before.get(name, 0.0)

        def reset(now: Values, before: Values) -> float:
            return now[data] if not before or is_edge(now, before) else before[name]

        def relay(now: Values, before: Values) -> float:
            on = now[control] >= 0.3 or (before.get(name, 0.0) == 1.0 and now[control] > -0.3)
            return float(on)

        one = add(f"{name} one", Constant(value=1.0))
        if kind == 0:
            block = add(name, EnabledSubsystem(diagram=scaled(gain)), u, enable=c)
            self._rule(name, held)
        elif kind == 1:
            condition = add(f"{name} if", If(expressions="u > 0"), c)
            block = add(name, ActionSubsystem(diagram=scaled(gain)), u, action=condition["if1"])
            self._rule(name, held)
        elif kind == 2:
            block = add(name, TriggeredSubsystem(diagram=counter(), edge=edge), one, trigger=c)
            self._rule(name, lambda now, before: before.get(name, 0.0) + is_edge(now, before))
        elif kind == 3:
            rule = ResettableIntegrator(external_reset=edge, initial_condition_source="external")
            block = add(name, rule, add(f"{name} zero", Constant(value=0.0)), c, u)
            self._rule(name, reset)
        elif kind == 4:
            block = add(name, Relay(on_point=0.3, off_point=-0.3), c)
            self._rule(name, relay)
        elif kind == 5:
            block = add(name, ZeroOrderHold(sample_time=PERIOD), u)
            self._rule(name, lambda now, _: now[data])
        elif kind == 6:
            block = add(name, ZeroOrderHold(sample_time=2.0 * PERIOD), u)
            self._rule(name, lambda now, before: now[data] if now["number"] % 2 == 0 else before[name])
        else:
            block = add(name, UnitDelay(sample_time=PERIOD), u)
            self._rule(name, lambda _, before: before.get(data, 0.0))
        self.signals[name] = block


@pytest.mark.parametrize("seed", range(6))
def test_sampled_networks_run_in_the_order_of_feedthrough(seed: int) -> None:
    network = SampledNetwork(np.random.default_rng(seed))
    expected = network.run()
    result = ab.simulate(network.builder.build(), stop_time=TICKS * PERIOD, sample_time=PERIOD / 2)
    for name, values in expected.items():
        actual = np.ravel(result[name])[BETWEEN_TICKS]
        np.testing.assert_allclose(actual, values, atol=1e-9, err_msg=name)


@pytest.mark.parametrize("seed", [1, 2])
def test_derivatives_follow_the_order_of_ticks(seed: int) -> None:
    network = SampledNetwork(np.random.default_rng(seed))
    higher, lower = network.run(1e-6), network.run(-1e-6)
    diagram, parameter = network.builder.build(), "source0 wave.amplitude"
    derivatives = ab.sensitivity(
        diagram, parameter, list(higher), stop_time=TICKS * PERIOD, sample_time=PERIOD / 2
    )
    for name, values in higher.items():
        expected = (np.array(values) - np.array(lower[name])) / 2e-6
        actual = np.ravel(derivatives[name, parameter])[BETWEEN_TICKS]
        np.testing.assert_allclose(actual, expected, atol=1e-6, rtol=1e-6, err_msg=name)


@pytest.mark.parametrize("seed", range(3))
def test_a_hold_samples_blocks_with_hysteresis_after_a_jump_at_the_tick(seed: int) -> None:
    """The input jumps at ticks and runs back at once. A rate limiter causes events before the ticks."""
    random = np.random.default_rng(seed)
    builder = ab.DiagramBuilder("jumps at ticks")
    limited = builder.add(
        "limited", RateLimiterContinuous(initial=1.0), builder.add("end", Constant(value=0.3))
    )
    names = []
    for k, gain in enumerate([*random.uniform(0.5, 3.0, 2), *random.uniform(-3.0, -0.5, 2)]):
        jumping = SignalGenerator(waveform="sawtooth", frequency=1.0 / (2.0 * PERIOD), amplitude=gain)
        u = builder.add(f"u{k}", Sum(signs="++"), builder.add(f"jumping{k}", jumping), limited)
        for block in (Backlash(width=random.uniform(0.1, 2.0)), Relay(on_point=0.4, off_point=-0.2)):
            names.append(f"{block.type_name().lower()}{k}")
            y = builder.add(names[-1], block, u)
            builder.add(f"{names[-1]} held", ZeroOrderHold(sample_time=PERIOD), y)
    result = ab.simulate(builder.build(), stop_time=20 * PERIOD, sample_time=PERIOD)
    for name in names:
        np.testing.assert_allclose(result[f"{name} held"], result[name], atol=1e-9, err_msg=name)

"""Acceptance tests of hybrid and delayed systems against closed forms, before and after saving to a file."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import armblocks as ab
from armblocks import blocks as bl

Array = NDArray[np.float64]
SOLVERS: Mapping[str, Mapping[str, object]] = {
    "rk45": {"solver": "rk45", "rtol": 1e-10, "atol": 1e-12},
    "dop853": {"solver": "dop853", "rtol": 1e-10, "atol": 1e-12},
    "rodas5p": {"solver": "rodas5p", "rtol": 1e-9, "atol": 1e-11},
    "rk4": {"solver": "rk4", "step": 0.005},
}


@pytest.fixture(params=SOLVERS)
def run(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[..., ab.SimulationResult]:
    """A function that runs a diagram with one solver. The saved and loaded diagram gives equal results."""

    def run_and_reload(diagram: ab.Diagram, stop_time: float, **settings: object) -> ab.SimulationResult:
        options = {**SOLVERS[request.param], "sample_time": stop_time / 97.0, **settings}
        result = ab.simulate(diagram, stop_time=stop_time, **options)
        ab.save_diagram(diagram, tmp_path / "saved.json")
        reloaded = ab.simulate(ab.load_diagram(tmp_path / "saved.json"), stop_time=stop_time, **options)
        for name in result.names:
            assert np.array_equal(result[name], reloaded[name]), name
        return result

    return run_and_reload


Run = Callable[..., ab.SimulationResult]


def add_integrator(
    builder: ab.DiagramBuilder, name: str, rate: object, **parameters: object
) -> ab.BlockHandle:
    """Add an integrator with the input ``rate``."""
    return builder.add(name, bl.Integrator(**parameters), rate)


def test_a_ball_rolls_down_a_slope_and_bounces_at_the_end(run: Run) -> None:
    """On a slope of 30 degrees, a = g/2. With restitution e = 0.6, the bounces are at t1, t1 + 2 e v1/a, …"""
    a, e, s0 = 9.81 / 2, 0.6, 2.0
    builder = ab.DiagramBuilder("slope")
    gravity = builder.add("gravity", bl.Constant(value=-a))
    ball = builder.add(
        "ball",
        bl.SecondOrderIntegratorLimited(initial=s0, lower=0.0, reinitialize=True),
        gravity,
    )
    bounce = builder.add("bounce", bl.Gain(gain=-e), ball["dx"])
    builder.connect(bounce, ball["dx0"])
    first = math.sqrt(2 * s0 / a)
    v1 = a * first
    stop = first + 2 * v1 / a * (e + e * e) + 0.9 * v1 * e**3 / a
    result = run(builder.build(), stop)
    assert result.run.events >= 3
    t = result.time
    expected = np.where(t <= first, s0 - a * t**2 / 2, np.nan)
    start = first
    for k in (1, 2, 3):
        speed, length = v1 * e**k, 2 * v1 * e**k / a
        inside = (t > start) & (t <= start + length)
        expected[inside] = (speed * (t - start) - a * (t - start) ** 2 / 2)[inside]
        start += length
    np.testing.assert_allclose(result["ball/x"], expected, atol=3e-9)


def test_a_mass_on_a_belt_sticks_and_slips_periodically(run: Run) -> None:
    """m v' = -k x - friction(v - V): the mass sticks until k x = Fs, then slips with friction Fc."""
    k, m, V, Fs, Fc = 4.0, 1.0, 0.5, 1.0, 0.6
    builder = ab.DiagramBuilder("belt")
    # In belt coordinates, y = x - V t, the input of the friction block is the relative speed.
    mass = builder.add("mass", bl.StickSlipFriction(mass=m, coulomb=Fc, static=Fs))
    belt = builder.add("belt", bl.Ramp(slope=V))
    position = builder.add("position", bl.Sum(signs="++"), mass["x"], belt)
    builder.connect(builder.add("spring", bl.Gain(gain=-k), position), mass["F"])
    t1 = Fs / (k * V)  # end of sticking from x = 0
    w = math.sqrt(k / m)
    # During the slip, x'' = -w^2 x + Fc/m, from x = Fs/k, x' = V.
    A, B = Fs / k - Fc / k, V / w

    def x(time: Array) -> Array:
        s = time - t1
        return Fc / k + A * np.cos(w * s) + B * np.sin(w * s)

    # The mass sticks again at the first time after t1 with x' = V, s2 later.
    s2 = (2 * math.pi - 2 * math.atan2(A, B)) / w
    result = run(builder.build(), t1 + s2 + 0.3)
    t = result.time
    slip = (t > t1) & (t <= t1 + s2)
    expected = np.where(t <= t1, V * t, x(t))
    end = float(x(np.array([t1 + s2]))[0])
    expected = np.where(t > t1 + s2, end + V * (t - t1 - s2), expected)
    np.testing.assert_allclose(result["position/y"], expected, atol=1e-8)
    stuck = ~slip & (np.abs(t - t1) > 1e-9)
    assert (result["mass/v"][stuck] == 0.0).all()


def test_a_thermostat_with_exponential_branches_agrees_with_its_closed_form(run: Run) -> None:
    """T' = -(T - 10 - 20 on): heating from 15 to 22, then cooling to 18, ...: exponentials in closed form."""
    builder = ab.DiagramBuilder("thermostat")
    room = builder.add("room", bl.Integrator(initial=15.0))
    relay = builder.add("relay", bl.Relay(on_point=22.0, off_point=18.0, on_value=10.0, off_value=30.0), room)
    builder.connect(builder.add("rate", bl.Sum(signs="+-"), relay, room), room["u"])
    result = run(builder.build(), 4.0)
    t, expected = result.time, np.empty_like(result.time)
    since, value, target = 0.0, 15.0, 30.0
    while since < 4.0:
        edge = 22.0 if target == 30.0 else 18.0
        length = math.log((target - value) / (target - edge))
        inside = (t >= since) & (t <= since + length)
        expected[inside] = target + (value - target) * np.exp(-(t[inside] - since))
        since, value, target = since + length, edge, 40.0 - target
    np.testing.assert_allclose(result["room"], expected, atol=3e-8)


def test_a_loop_of_two_rates_with_offsets_is_piecewise_linear(run: Run) -> None:
    """x' = u held at 0.02 + 0.1 j, u = -K w, w = x held at 0.07 + 0.25 j: x is exactly piecewise linear."""
    builder = ab.DiagramBuilder("rates")
    x = builder.add("x", bl.Integrator(initial=1.0))
    sensor = builder.add("sensor", bl.ZeroOrderHold(sample_time=(0.25, 0.07)), x)
    control = builder.add("control", bl.ZeroOrderHold(sample_time=(0.1, 0.02)), sensor)
    builder.connect(builder.add("gain", bl.Gain(gain=-1.5), control), x["u"])
    result = run(builder.build(), 3.0)
    ticks = sorted([(0.07 + 0.25 * j, 0) for j in range(12)] + [(0.02 + 0.1 * j, 1) for j in range(30)])
    value, sampled, held, since = 1.0, 0.0, 0.0, 0.0
    expected = np.empty_like(result.time)
    pieces = [(0.0, 1.0, 0.0)]
    for time, clock in ticks:
        value += -1.5 * held * (time - since)
        since = time
        if clock == 0:
            sampled = value
        # both clocks tick at 0.32 + 0.5 j: the sensor is evaluated first, because the control depends on it
        else:
            held = sampled
        pieces.append((time, value, held))
    for start, level, hold in pieces:
        after = result.time >= start - 1e-12
        expected[after] = level - 1.5 * hold * (result.time[after] - start)
    np.testing.assert_allclose(result["x"], expected, atol=1e-12)


def test_a_double_integrator_with_a_relay_moves_on_parabolas(run: Run) -> None:
    """x'' = -relay(x) with hysteresis h: parabolas, on which v^2 grows by 4 h in each half period."""
    h = 0.1
    builder = ab.DiagramBuilder("relay")
    v = builder.add("v", bl.Integrator(initial=1.0))
    x = add_integrator(builder, "x", v)
    relay = builder.add("relay", bl.Relay(on_point=h, off_point=-h, on_value=-1.0, off_value=1.0), x)
    builder.connect(relay, v["u"])
    result = run(builder.build(), 6.0)
    t, expected = result.time, np.empty_like(result.time)
    since, position, speed, push = 0.0, 0.0, 1.0, 1.0
    while since < 6.0:
        edge = h if push > 0 else -h
        # position + speed s + push s^2/2 = edge, the last crossing in the direction of the switch
        s = (-speed + push * math.sqrt(speed**2 + 2 * push * (edge - position))) / push
        inside = (t >= since) & (t <= since + s)
        expected[inside] = position + speed * (t[inside] - since) + push * (t[inside] - since) ** 2 / 2
        since, position, speed, push = since + s, edge, speed + push * s, -push
    np.testing.assert_allclose(result["x"], expected, atol=2e-8)


def test_a_loop_with_dead_time_agrees_with_the_method_of_steps(run: Run) -> None:
    """x'(t) = -x(t - 1) with x = 1 for t <= 0: the method of steps gives a polynomial for every second."""
    builder = ab.DiagramBuilder("dead time")
    x = builder.add("x", bl.Integrator(initial=1.0))
    late = builder.add("late", bl.TransportDelay(delay=1.0, initial=1.0), x)
    builder.connect(builder.add("minus", bl.Gain(gain=-1.0), late), x["u"])
    result = run(builder.build(), 5.0)
    t = result.time
    expected = sum(
        np.where(t > k - 1, (-1.0) ** k * np.maximum(t - (k - 1), 0.0) ** k / math.factorial(k), 0.0)
        for k in range(1, 7)
    )
    np.testing.assert_allclose(result["x"], 1.0 + expected, atol=2e-8)


def test_a_sampled_pi_with_a_delay_of_one_tick_agrees_with_its_recurrence(run: Run) -> None:
    """The recurrence of plant, integrator and delay is exact: between two ticks the plant decays by e^-T."""
    T, kp, ki = 0.2, 0.8, 0.5
    builder = ab.DiagramBuilder("pi")
    plant = builder.add("plant", bl.TransferFunction(numerator=[2.0], denominator=[1.0, 1.0]))
    error = builder.add("error", bl.Sum(signs="+-"), builder.add("reference", bl.Constant(value=1.0)), plant)
    control = builder.add("control", bl.DiscretePID(P=kp, I=ki, sample_time=T), error)
    builder.connect(builder.add("late", bl.UnitDelay(sample_time=T), control), plant["u"])
    result = run(builder.build(), 6.0, sample_time=T)
    x, total, pending, expected = 0.0, 0.0, 0.0, []
    for _ in range(31):
        e = 1.0 - x
        expected.append(x)
        u, pending = pending, kp * e + total
        total += ki * T * e
        x = x * math.exp(-T) + 2.0 * u * (1.0 - math.exp(-T))
    np.testing.assert_allclose(result["plant/y"], expected, atol=2e-9)


def test_a_hold_samples_the_value_after_an_event_at_its_tick(run: Run) -> None:
    """A ramp crosses 0.5 exactly at the tick at 0.5 s: the hold samples the value after the event."""
    builder = ab.DiagramBuilder("instant")
    ramp = builder.add("ramp", bl.Ramp(slope=1.0))
    above = builder.add("above", bl.CompareToConstant(relation=">=", constant=0.5), ramp)
    builder.add("hold", bl.ZeroOrderHold(sample_time=0.25), above)
    add_integrator(builder, "count", above)
    result = run(builder.build(), 1.0, sample_time=0.0625)
    t = result.time
    assert result["hold/y"].tolist() == (t >= 0.5).astype(float).tolist()
    np.testing.assert_allclose(result["count"], np.maximum(t - 0.5, 0.0), atol=1e-12)


def test_backlash_in_an_integrating_loop_agrees_with_its_closed_form(run: Run) -> None:
    """x' = -b(x): first the backlash is crossed, then x decays exponentially to the edge of the backlash."""
    builder = ab.DiagramBuilder("play")
    x = builder.add("x", bl.Integrator(initial=2.0))
    play = builder.add("play", bl.Backlash(width=1.0, initial=1.5), x)
    builder.connect(builder.add("minus", bl.Gain(gain=-1.0), play), x["u"])
    result = run(builder.build(), 6.0)
    t = result.time
    # b stays 1.5 while x falls from 2 to 1 (2/3 s); then b = x + 0.5, x' = -(x + 0.5)
    t1 = 1.0 / 1.5
    expected = np.where(t < t1, 2.0 - 1.5 * t, -0.5 + 1.5 * np.exp(-(t - t1)))
    np.testing.assert_allclose(result["x"], expected, atol=2e-8)


def test_an_enabled_counter_agrees_with_a_state_machine(run: Run) -> None:
    """The ticks of a clock of 0.1 s are counted while a square wave of period 0.7 s is high."""
    inner = ab.DiagramBuilder("count")
    one = inner.add("one", bl.Constant(value=1.0))
    total = inner.add("total", bl.Sum(signs="++"), one)
    before = inner.add("before", bl.UnitDelay(sample_time=0.1), total)
    inner.connect(before, total["u2"])
    inner.output("n", before)
    builder = ab.DiagramBuilder("enabled")
    wave = builder.add("wave", bl.PulseGenerator(amplitude=1.0, period=0.7, width=50.0))
    builder.add("counter", bl.EnabledSubsystem(diagram=inner.build()), enable=wave)
    result = run(builder.build(), 2.0, sample_time=0.02)
    count, expected, k = 0, [], 0
    for row in range(result.time.size):
        if row % 5 == 0:
            # the output at a tick is the state before the update at this tick
            if (0.1 * k + 1e-9) % 0.7 < 0.35:
                shown, count = count, count + 1
            k += 1
        expected.append(shown)
    assert result["counter/n"].tolist() == expected


def test_a_switch_that_chatters_is_reported_with_its_block(tmp_path: Path) -> None:
    """x' = -1 for x >= 0, else 1: the switch chatters after 1 s; the samples before that are kept."""
    builder = ab.DiagramBuilder("chattering")
    x = builder.add("x", bl.Integrator(initial=1.0))
    down, up = builder.add("down", bl.Constant(value=-1.0)), builder.add("up", bl.Constant(value=1.0))
    switch = builder.add("switch", bl.Switch(criterion=">=", threshold=0.0), down, x, up)
    builder.connect(switch, x["u"])
    with pytest.raises(ab.errors.SimulationError, match="block 'switch' causes events without end") as error:
        ab.simulate(builder.build(), stop_time=3.0)
    assert len(str(error.value)) < 400
    partial = error.value.partial
    assert isinstance(partial, ab.SimulationResult)
    assert partial.time[-1] == pytest.approx(1.0, abs=4e-3)

"""Measures of signals: closed forms, the step measures of linear systems, and NumPy on random signals."""

from __future__ import annotations

import math

import numpy as np
import pytest

from armblocks.analysis.time_response import step_measures
from armblocks.errors import InputError, UnknownArgumentError, UnknownNameError
from armblocks.sweeps.measures import Measure
from armblocks.sweeps.quantities import RunMeasure

RNG = np.random.default_rng(7)


def measure(text: str, t: object, y: object) -> float:
    parsed = Measure.parse(text)
    times, values = np.asarray(t, dtype=float), np.asarray(y, dtype=float)
    return RunMeasure(kind=parsed.kind, options=parsed.values).of(times, values)


def signals() -> list[tuple[np.ndarray, np.ndarray]]:
    """Random signals, some with jumps: two rows with the same time."""
    made = []
    for count in (1, 2, 3, 40, 201):
        t = np.sort(RNG.uniform(0.0, 5.0, count))
        t[count // 2 :] += 0.0
        if count > 3:
            t[5] = t[4]
        made.append((t, RNG.normal(0.3, 1.0, count)))
    return made


def test_a_second_order_step_has_its_textbook_measures() -> None:
    zeta, w = 0.4, 2.0
    t = np.linspace(0.0, 20.0, 40_001)
    wd = w * math.sqrt(1.0 - zeta**2)
    y = 1.0 - np.exp(-zeta * w * t) * (np.cos(wd * t) + zeta * w / wd * np.sin(wd * t))
    expected = 100.0 * math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta**2))
    assert measure("overshoot(y, final=1)", t, y) == pytest.approx(expected, abs=1e-4)
    # The integral of the error of this step is 2 zeta / w.
    assert measure("integral(y)", t, 1.0 - y) == pytest.approx(2.0 * zeta / w, abs=1e-6)


def test_exponential_decay_has_its_integrals() -> None:
    t = np.linspace(0.0, 40.0, 400_001)
    e = np.exp(-t)
    for text, value in (("iae(y)", 1.0), ("ise(y)", 0.5), ("itae(y)", 1.0), ("integral(y)", 1.0)):
        assert measure(text, t, e) == pytest.approx(value, abs=1e-7), text
    assert measure("rms(y)", t, e) == pytest.approx(math.sqrt(0.5 / 40.0), rel=1e-7)
    assert measure("mean(y)", t, e) == pytest.approx(1.0 / 40.0, rel=1e-7)


def test_step_measures_are_those_of_linear_systems() -> None:
    for t, y in signals():
        for final in (1.0, -0.7, 2.5):
            known = step_measures(t, y, final)
            for name in ("overshoot", "undershoot", "rise_time", "settling_time"):
                given = measure(f"{name}(y, final={final})", t, y)
                assert given == pytest.approx(getattr(known, name), rel=1e-12, abs=1e-12, nan_ok=True), name
        assert measure("overshoot(y)", t, y) == pytest.approx(step_measures(t, y, float(y[-1])).overshoot)
    assert math.isnan(measure("settling_time(y)", [0.0, 1.0], [1.0, 0.0]))


def test_integrals_are_exact_for_lines() -> None:
    """Each interval is divided into fine pieces, also at zeros, and integrated by the midpoint rule."""
    for t, y in signals():
        n = 20_000
        pieces = {"iae": 0.0, "ise": 0.0, "itae": 0.0, "time_outside": 0.0, "rms": 0.0, "mean": 0.0}
        for t0, t1, a, b in zip(t, t[1:], y, y[1:]):
            s = (np.arange(n) + 0.5) / n
            time, e, h = t0 + s * (t1 - t0), a + s * (b - a), (t1 - t0) / n
            pieces["iae"] += h * np.abs(0.2 - e).sum()
            pieces["ise"] += h * ((0.2 - e) ** 2).sum()
            pieces["itae"] += h * (time * np.abs(0.2 - e)).sum()
            pieces["time_outside"] += h * ((e < -0.3) | (e > 0.4)).sum()
            pieces["rms"] += h * (e**2).sum()
            pieces["mean"] += h * e.sum()
        span = t[-1] - t[0]
        pieces["rms"] = math.sqrt(pieces["rms"] / span) if span else abs(y[-1])
        pieces["mean"] = pieces["mean"] / span if span else y[-1]
        for name, value in pieces.items():
            options = {"time_outside": ", low=-0.3, high=0.4"}.get(
                name, ", reference=0.2" * (name[-1] == "e")
            )
            assert measure(f"{name}(y{options})", t, y) == pytest.approx(value, abs=5e-4), name


def test_extremes_and_crossings() -> None:
    for t, y in signals():
        assert measure("minimum(y)", t, y) == y.min()
        assert measure("maximum(y)", t, y) == y.max()
        assert measure("peak(y)", t, y) == np.abs(y).max()
        assert measure("final(y)", t, y) == y[-1]
    t, y = [0.0, 1.0, 2.0, 3.0], [-1.0, 1.0, -1.0, 3.0]
    assert measure("crossing_time(y, level=0)", t, y) == 0.5
    assert measure("crossing_time(y, level=0, direction=-1)", t, y) == 1.5
    assert measure("crossing_time(y, level=2, direction=1)", t, y) == 2.75
    assert measure("crossing_time(y, level=-1)", t, y) == 0.0
    assert math.isnan(measure("crossing_time(y, level=4)", t, y))
    # Both sides of a jump count.
    assert measure("peak(y)", [0.0, 1.0, 1.0, 2.0], [0.0, 5.0, 0.0, 0.0]) == 5.0


def test_texts_are_read_and_written() -> None:
    for text in ("peak(arm/tau[0])", "iae({a/y} - {b/y}, reference=2)", "events()", "rms(max({a/y}, 2))"):
        assert str(Measure.parse(text)) == text
        assert Measure.parse(text) == Measure.parse(str(Measure.parse(text)))


def test_texts_of_measures_are_exact() -> None:
    for value in (0.1 + 0.2, 1e-300, 1.0 + 1e-12, -math.inf, 1e22):
        given = Measure("time_outside", "a/y", {"low": value})
        assert Measure.parse(str(given)) == given


def test_messages_of_invalid_measures() -> None:
    with pytest.raises(InputError, match="low is 3 and high is -3"):
        Measure("time_outside", "a/y", {"low": 3.0, "high": -3.0})
    with pytest.raises(UnknownNameError, match="overshot"):
        Measure("overshot", "a/y")
    with pytest.raises(UnknownArgumentError, match="finale"):
        Measure("overshoot", "a/y", {"finale": 1.0})
    with pytest.raises(InputError, match=r"final is nan.*a number"):
        Measure("overshoot", "a/y", {"final": math.nan})
    with pytest.raises(InputError, match="the signal is ''"):
        Measure("peak")
    with pytest.raises(InputError, match=r"no signal.*write events\(\)"):
        Measure("events", "a/y")
    with pytest.raises(InputError, match="the level is missing"):
        Measure("crossing_time", "a/y")
    with pytest.raises(InputError, match="'peak of a' is not a measure"):
        Measure.parse("peak of a")
    with pytest.raises(InputError, match="'final' is not an option"):
        Measure.parse("overshoot(a/y, final)")

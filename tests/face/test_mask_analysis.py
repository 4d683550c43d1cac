"""Derivatives with respect to mask parameters include the parameters that depend on them through formulas."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import Gain, Integrator, SineWave, Subsystem, Sum, UnitDelay
from armblocks.diagram import Diagram, DiagramBuilder, formula
from armblocks.errors import InputError, UnknownNameError


def loop() -> Diagram:
    """x' = K^2 (u - 3 K x) with two masks and u = sin t."""
    inner = DiagramBuilder("inner")
    a = inner.parameter("a", 1.0, unit="1/s")
    inner.output("y", inner.add("gain", Gain(gain=a), inner.input("u")))
    builder = DiagramBuilder("loop")
    builder.parameter("K", 2.0, unit="1/s")
    builder.parameter("n", 0.5, unit="s")
    builder.parameter("way", "+-")
    sum_ = builder.add("sum", Sum(signs=formula("way")), builder.add("u", SineWave()))
    forward = builder.add("forward", Subsystem(diagram=inner.build()).with_parameters(a=formula("K^2")), sum_)
    x = builder.add("x", Integrator(initial=formula("K/4")), forward)
    builder.connect(builder.add("back", Gain(gain=formula("3*K")), x), sum_["u2"])
    builder.add("hold", UnitDelay(sample_time=formula("n")), x)
    return builder.build()


def test_sensitivity_to_a_mask_parameter_agrees_with_differences_of_runs() -> None:
    settings: dict[str, Any] = {"stop_time": 2.0, "rtol": 1e-12, "atol": 1e-14, "sample_time": 0.1}
    actual = ab.sensitivity(loop(), ["K", "forward.a"], "x", **settings)
    h = 1e-5
    runs = [ab.simulate(loop(), parameters={"K": 2.0 + step}, **settings)["x"] for step in (h, -h)]
    # A central difference has the error h^2/6 times the third derivative, plus rounding errors over h.
    assert np.abs(actual["x", "K"] - (runs[0] - runs[1]) / (2 * h)).max() < 1e-8
    assert actual["x", "K"][0] == 0.25
    assert np.abs(actual["x", "forward.a"]).max() > 0.01


def test_sensitivity_to_an_entry_of_a_mask_parameter() -> None:
    builder = DiagramBuilder("rates")
    builder.parameter("rates", (1.0, 2.0), unit="1/s")
    x = builder.add("x", Integrator(initial=(1.0, 1.0)))
    builder.connect(builder.add("fall", Gain(gain=formula("-rates")), x), x["u"])
    settings: dict[str, Any] = {"stop_time": 1.0, "rtol": 1e-10, "atol": 1e-12, "sample_time": 0.1}
    result = ab.sensitivity(builder.build(), "rates[1]", "x", **settings)
    t = result.time
    assert np.allclose(result["x", "rates[1]"][:, 1], -t * np.exp(-2.0 * t), atol=1e-8)
    assert not result["x", "rates[1]"][:, 0].any()
    with pytest.raises(
        InputError, match=r"'rates\[2\]' is not an entry of 'rates'.*rates\[0\] to rates\[1\]"
    ):
        ab.sensitivity(builder.build(), "rates[2]", "x")


def test_linearisation_by_a_mask_parameter_uses_the_chain_rule() -> None:
    point = ab.linearize(loop(), inputs=["K", "forward.a", "back.gain"], outputs="x", at=1.0)
    u, x = np.sin(1.0), ab.simulate(loop(), stop_time=1.0)["x"][-1]
    row = point.B[0] if point.B.shape[0] == 1 else point.B[list(point.states).index("x/x")]
    assert point.input_units[:2] == ("1/s", "1/s")
    by_K, by_a, by_back = (float(entry) for entry in row[:3])
    assert by_K == pytest.approx(2 * 2.0 * by_a + 3 * by_back, rel=1e-12)
    assert by_K != 0.0
    assert u
    assert x


def test_mask_parameters_without_derivative_are_refused_with_the_reason() -> None:
    with pytest.raises(InputError, match=r"'hold.sample_time', which is not tunable, depends on 'n'"):
        ab.sensitivity(loop(), "n", "x")
    with pytest.raises(InputError, match="the mask parameter 'way' is str, which has no derivative"):
        ab.sensitivity(loop(), "way", "x")
    with pytest.raises(UnknownNameError, match=r"no tunable parameter named 'k'.*did you mean 'K'"):
        ab.sensitivity(loop(), "k", "x")
    run = ab.begin(loop(), stop_time=1.0)
    with pytest.raises(
        InputError,
        match=r"parameter 'n' cannot take this value during a run: 'hold.sample_time', which "
        r"depends on it, is not tunable.*Allowed: tunable parameters, .*: K, ",
    ):
        run.set("n", 0.25)

"""Sensitivities of runs that start at an event, at a limit or at a jump."""

from __future__ import annotations

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import (
    PWM,
    Abs,
    Bias,
    CompareToZero,
    Constant,
    DeadZone,
    FirstOrderHold,
    FromFile,
    Gain,
    Integrator,
    LogicalOperator,
    Polynomial,
    Ramp,
    RateLimiterContinuous,
    RateLimiterDynamic,
    Relay,
    Rounding,
    Saturation,
    SecondOrderIntegratorLimited,
    Sign,
    SineWave,
    Step,
    StickSlipFriction,
    Sum,
)
from armblocks.diagram import Block
from armblocks.errors import InputError

TIGHT = {"rtol": 1e-10, "atol": 1e-12, "stop_time": 3.0, "sample_time": 0.1}


def test_events_at_the_start_that_depend_on_the_parameter_are_refused() -> None:
    def integrated(block: Block) -> ab.Diagram:
        builder = ab.DiagramBuilder("start")
        builder.add("x", Integrator(), builder.add("y", block, builder.add("wave", SineWave())))
        return builder.build()

    def integrated_twice(block: Block) -> ab.Diagram:
        builder = ab.DiagramBuilder("start")
        builder.add("y", block, builder.add("fall", Constant(value=-9.81)))
        return builder.build()

    for block, parameter in ((Sign(), "wave.phase"), (PWM(), "y.offset"), (FirstOrderHold(), "y.offset")):
        with pytest.raises(InputError, match=f"event of 'y' at the start moves with .* '{parameter}'"):
            ab.sensitivity(integrated(block), parameter, "x")
    ball = SecondOrderIntegratorLimited(lower=0.0)
    with pytest.raises(InputError, match=r"'y' starts exactly at a limit .* 'y.lower'"):
        ab.sensitivity(integrated_twice(ball), "y.lower", "y/x")
    # The absolute value has a kink at the start but no jump: dx/dphase = |sin(t)|.
    result = ab.sensitivity(integrated(Abs()), "wave.phase", "x", **TIGHT)
    assert np.allclose(result["x", "wave.phase"], np.sin(result.time), atol=1e-9)


def test_events_at_the_start_of_a_table_that_is_read_by_index(capfd: pytest.CaptureFixture[str]) -> None:
    """The sign of table + c changes at the start if the first value is 0.5 and c = -0.5."""

    def diagram(first: float) -> ab.Diagram:
        builder = ab.DiagramBuilder("table", settings=ab.SimulationOptions(stop_time=1.0, sample_time=0.25))
        table = builder.add("table", FromFile(data=((0.0, first), (1.0, first + 1.0))))
        builder.add("x", Integrator(), builder.add("y", Sign(), builder.add("c", Bias(bias=-0.5), table)))
        return builder.build()

    with pytest.raises(InputError, match=r"event of 'y' at the start moves with .* 'c.bias'"):
        ab.sensitivity(diagram(0.5), "c.bias", "x")
    # The sign changes at 0.5 s, earlier by dc: dx/dc = 2 afterwards.
    result = ab.sensitivity(diagram(0.0), "c.bias", "x")
    assert result["x", "c.bias"][[0, 1, 3, 4]] == pytest.approx([0.0, 0.0, 2.0, 2.0], abs=1e-6)
    assert capfd.readouterr().out == ""


def test_the_sensitivity_to_the_speed_of_a_stuck_mass_is_refused() -> None:
    builder = ab.DiagramBuilder("rest")
    mass = builder.add("mass", StickSlipFriction(), builder.add("force", Ramp(slope=0.8)))
    builder.add("x", Integrator(), mass["x"])
    with pytest.raises(InputError, match=r"event of 'mass' at the start moves with .* 'mass.initial_speed'"):
        ab.sensitivity(builder.build(), "mass.initial_speed", "x")


@pytest.mark.parametrize(
    ("block", "value"),
    [
        (Saturation(lower=-1.0, upper=1.0), 1.0),
        (Saturation(lower=-1.0, upper=1.0), -1.0),
        (DeadZone(start=-1.0, end=1.0), 1.0),
        (Abs(), 0.0),
        (Sign(), 0.0),
        (CompareToZero(), 0.0),
        (Rounding(function="round"), 0.5),
        (Relay(), 0.5),
    ],
    ids=lambda entry: type(entry).__name__ if isinstance(entry, Block) else str(entry),
)
def test_a_constant_at_a_limit_or_at_a_jump_has_no_derivative(block: Block, value: float) -> None:
    def derivative(bias: float) -> np.ndarray:
        builder = ab.DiagramBuilder("limit")
        bias_of = builder.add("bias", Bias(bias=bias), builder.add("zero", Constant(value=0.0)))
        builder.add("x", Integrator(), builder.add("y", block, bias_of))
        return ab.sensitivity(builder.build(), "bias.bias", "y", stop_time=0.5)["y", "bias.bias"]

    with pytest.raises(InputError, match=r"'y' starts exactly at a limit .* 'bias.bias' moves"):
        derivative(value)
    for side in (value - 1e-3, value + 1e-3):
        assert np.isin(derivative(side), (-1.0, 0.0, 1.0)).all()


def test_the_time_at_which_a_ramp_begins_may_be_the_start_of_the_run() -> None:
    builder = ab.DiagramBuilder("ramp")
    builder.add("y", Gain(gain=3.0), builder.add("ramp", Ramp(slope=2.0)))
    result = ab.sensitivity(builder.build(), "ramp.start", "y", stop_time=1.0)
    assert result["y", "ramp.start"][1:] == pytest.approx(-6.0, rel=1e-12)


def test_a_body_at_rest_at_a_limit_has_no_derivative_by_its_speed() -> None:
    """It moves away with a positive speed, and stays with a negative speed."""

    def derivative(speed: float) -> np.ndarray:
        builder = ab.DiagramBuilder("rest")
        body = SecondOrderIntegratorLimited(lower=0.0, initial_speed=speed)
        builder.add("body", body, builder.add("no force", Constant(value=0.0)))
        result = ab.sensitivity(builder.build(), "body.initial_speed", "body/x", stop_time=1.0)
        return result["body/x", "body.initial_speed"]

    with pytest.raises(InputError, match=r"'body' starts exactly at a limit"):
        derivative(0.0)
    assert derivative(0.1)[-1] == pytest.approx(1.0, rel=1e-12)


def test_a_rate_limiter_that_starts_at_its_input() -> None:
    """It leaves the limit of its rate at once, unless its limits are 0."""
    builder = ab.DiagramBuilder("follows")
    wave = builder.add("wave", SineWave(frequency=0.5))
    builder.add("y", RateLimiterContinuous(), wave)
    result = ab.sensitivity(builder.build(), "wave.phase", "y", stop_time=1.0)
    assert np.allclose(result["y", "wave.phase"][1:], np.cos(0.5 * result.time[1:]), atol=1e-6)

    builder = ab.DiagramBuilder("stands")
    zero = builder.add("zero", Constant(value=0.0))
    builder.add("y", RateLimiterDynamic(), zero, builder.add("u", Gain(), zero), zero)
    with pytest.raises(InputError, match="'y' starts exactly at a limit"):
        ab.sensitivity(builder.build(), "y.initial", "y", stop_time=1.0)


def test_the_start_of_a_diagram_with_an_implicit_equation() -> None:
    """w + w^3 = sin(t + phase) + bias is an implicit equation; the sign of w changes at the start."""

    def diagram(phase: float, bias: float) -> ab.Diagram:
        builder = ab.DiagramBuilder("loop")
        total = builder.add("w", Sum(signs="+-"), builder.add("wave", SineWave(phase=phase)))
        cube = builder.add("cube", Polynomial(coefficients=[1.0, 0.0, 0.0, 0.0]), total)
        builder.connect(cube, total["u2"])
        builder.add("x", Integrator(), builder.add("sign", Sign(), total))
        constant = builder.add("bias", Bias(bias=bias), builder.add("zero", Constant(value=0.0)))
        builder.add("limited", Saturation(lower=-1.0, upper=1.0), constant)
        return builder.build()

    with pytest.raises(InputError, match=r"event of 'sign' at the start moves .* 'wave.phase'"):
        ab.sensitivity(diagram(0.0, 0.0), "wave.phase", "x")
    with pytest.raises(InputError, match=r"'limited' starts exactly at a limit .* 'bias.bias'"):
        ab.sensitivity(diagram(0.5, 1.0), "bias.bias", "limited")
    result = ab.sensitivity(diagram(0.5, 0.0), ["wave.phase", "bias.bias"], ["x", "limited"], **TIGHT)
    # The sign changes at pi - 0.5, earlier by a change of the phase.
    assert result["x", "wave.phase"][-1] == pytest.approx(-2.0, abs=1e-8)
    assert np.array_equal(result["limited", "bias.bias"], np.ones(result.time.size))


@pytest.mark.parametrize("order", [2, 3])
@pytest.mark.parametrize(
    "block", [Sign(), CompareToZero(relation=">="), LogicalOperator(operator="NOT"), Abs()]
)
def test_a_body_that_starts_from_rest_at_a_limit(block: Block, order: int) -> None:
    """Its position x(0) = 0 has a multiple zero, which any change of position or speed splits."""
    builder = ab.DiagramBuilder("rest")
    signal = builder.add("force", Constant(value=1.0))
    for k in range(order):
        signal = builder.add(f"x{k}", Integrator(), signal)
    builder.add("integral", Integrator(), builder.add("y", block, signal))
    diagram = builder.build()
    for k in range(1, order):
        name = f"x{k}.initial"
        if isinstance(block, Abs):
            # The signal does not jump, and the derivatives by position and speed are 1 and t.
            by_name = ab.sensitivity(diagram, name, "y", stop_time=1.0)["y", name]
            assert by_name[-1] == pytest.approx(1.0, rel=1e-9)
        else:
            with pytest.raises(InputError, match=f"'y' at the start moves with the parameter '{name}'"):
                ab.sensitivity(diagram, name, "integral", stop_time=1.0)


def test_a_jump_that_the_run_leaves_at_once_has_no_derivative() -> None:
    """The time in which the signal has its other value depends on the parameter."""

    def diagram(source: Block, block: Block) -> ab.Diagram:
        builder = ab.DiagramBuilder("leaves")
        builder.add("x", Integrator(), builder.add("y", block, builder.add("source", source)))
        return builder.build()

    for name, case in (
        ("source.time", diagram(Step(time=0.0), Gain())),
        ("source.bias", diagram(SineWave(), Rounding(function="floor"))),
        ("y.on_point", diagram(SineWave(), Relay(on_point=0.0, off_point=-2.0))),
    ):
        with pytest.raises(InputError, match=r"starts exactly at a limit or at a jump|an event of 'y'"):
            ab.sensitivity(case, name, "x", stop_time=1.0)

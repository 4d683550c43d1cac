"""Sensitivities to parameters that shift the jumps of formulas, compared with closed forms."""

from __future__ import annotations

import math
from collections.abc import Callable

import casadi
import numpy as np
import pytest
from casadi import SX, Function

import armblocks as ab
from armblocks.blocks import (
    Constant,
    DeadZoneDynamic,
    EnabledSubsystem,
    Expression,
    FirstOrderLag,
    Gain,
    Inport,
    Integrator,
    Memory,
    Modulo,
    Outport,
    Quantizer,
    Ramp,
    Rounding,
    Sign,
    SignalGenerator,
    SineWave,
    Step,
    Sum,
    Switch,
    TransportDelay,
    ZeroOrderHold,
)
from armblocks.diagram import Block, DiagramBuilder
from armblocks.equations.jump_modes import JUMPS, JumpModes
from armblocks.errors import InputError, SimulationError

SETTINGS = {"rtol": 1e-10, "atol": 1e-12, "stop_time": 3.0, "sample_time": 0.5}
T = 3.0
UNARY = (casadi.OP_SIGN, casadi.OP_FLOOR, casadi.OP_CEIL)
RANDOM = np.random.default_rng(5)


def integral(formula: str, p: float) -> float:
    """d/dp of the integral of formula(u, t, p) with u = t, from 0 to 3 s."""
    builder = ab.DiagramBuilder("jumps")
    value = builder.add("f", Expression(formula=formula, names="p", values=p), builder.add("u", Ramp()))
    builder.add("x", Integrator(), value)
    return float(ab.sensitivity(builder.build(), "f.values", "x", **SETTINGS)["x", "f.values"][-1])


def of_floor(p: float) -> float:
    """The integral of floor(p t) is the sum of T - k/p."""
    return sum(k / p**2 for k in range(1, math.floor(p * T) + 1))


CLOSED_FORMS: dict[str, Callable[[float], float]] = {
    "if(u > p, 1, 0)": lambda _: -1.0,
    "if(u >= p, u, -u)": lambda p: -2.0 * p,
    "2*(u < p) - (p <= t)": lambda _: 3.0,
    "if(u > p, if(u > 2*p, 3, 1), 0)": lambda _: -5.0,
    "if(u - p, 0, 1) + if(u > p && u < 1.5*p, 1, 0)": lambda _: 0.5,
    "sign(u - p)": lambda _: -2.0,
    "floor(p*u)": of_floor,
    "ceil(p*u)": of_floor,
    "-floor(-p*u)": of_floor,
    "fix(-p*u)": lambda p: -of_floor(p),
    "round(p*u)": lambda p: sum((k + 0.5) / p**2 for k in range(math.floor(p * T + 0.5))),
    # mod(u, p) = u - p floor(u/p); the integral of floor(u/p) is the sum of T - k p.
    "mod(u, p)": lambda p: sum(2.0 * k * p - T for k in range(1, math.floor(T / p) + 1)),
    "rem(-u, p)": lambda p: -sum(2.0 * k * p - T for k in range(1, math.floor(T / p) + 1)),
    # The angle is p t, less 2 pi after each jump at p t = pi, 3 pi, …
    "atan2(sin(4*p*u), cos(4*p*u))": lambda p: (
        2.0 * T**2
        - sum(
            2.0 * math.pi * (2 * k + 1) * math.pi / (4.0 * p**2)
            for k in range(9)
            if (2 * k + 1) * math.pi < 4 * p * T
        )
    ),
}


@pytest.mark.parametrize("formula", CLOSED_FORMS)
def test_the_integral_of_a_formula_that_jumps_has_the_derivative_of_its_closed_form(formula: str) -> None:
    for p in RANDOM.uniform(0.6, 1.4, 3).tolist():
        assert integral(formula, p) == pytest.approx(CLOSED_FORMS[formula](p), rel=1e-7, abs=1e-7), p


@pytest.mark.parametrize("operation", sorted(JUMPS))
def test_a_consistent_mode_gives_the_value_of_the_operation(operation: int) -> None:
    a, b, jumps = SX.sym("a"), SX.sym("b"), JumpModes()
    value = jumps.replaced(operation, a, b)
    plain = SX.unary(operation, a) if operation in UNARY else SX.binary(operation, a, b)
    mode = Function("mode", [a, b], jumps.consistent)
    values = Function("values", [a, b, *jumps.modes], [value, plain])
    for x, y in RANDOM.uniform(-3.0, 3.0, (40, 2)).tolist():
        replaced, expected = values(x, y, mode(x, y))
        assert float(replaced) == float(expected)


def after(block: Block, **inputs: Block) -> ab.DiagramBuilder:
    """The integral ``x`` of the block ``b`` behind ``f``, which is 1 after u = t has reached 0.73."""
    builder = ab.DiagramBuilder("after")
    u = builder.add("u", Ramp())
    f = builder.add("f", Expression(formula="if(u > p, 1, 0)", names="p", values=0.73), u)
    b = builder.add("b", block)
    ports = [port.name for port in block.input_ports()]
    for port in ports:
        other = inputs.get(port)
        builder.connect(f if other is None else builder.add(port, other), b[port])
    builder.add("x", Integrator(), b)
    return builder


def derivative(builder: ab.DiagramBuilder, parameter: str) -> np.ndarray:
    return ab.sensitivity(builder.build(), parameter, "x", **SETTINGS)["x", parameter]


def test_a_jump_that_switches_a_block_or_passes_a_delay_shifts_with_the_parameter() -> None:
    time = np.linspace(0.0, T, 7)
    switch = after(Switch(threshold=0.5), u1=Constant(value=2.0), u3=Constant(value=-1.0))
    assert derivative(switch, "f.values") == pytest.approx(-3.0 * (time > 0.73), abs=1e-8)
    delayed = after(TransportDelay(delay=0.4))
    assert derivative(delayed, "f.values") == pytest.approx(-1.0 * (time > 1.13), abs=1e-8)
    assert derivative(delayed, "b.delay") == pytest.approx(-1.0 * (time > 1.13), abs=1e-8)
    held = after(ZeroOrderHold(sample_time=0.25))
    assert not derivative(held, "u.slope").any()


@pytest.mark.parametrize(
    ("formula", "expected"),
    [
        ("if(u > 1.3, u, 2*u)", lambda t: np.where(t < 0.3, 2.0 * t, t)),
        ("sign(u - 1.3)*u", lambda t: np.where(t < 0.3, -t, t)),
        ("floor(u)*u", lambda t: np.floor(1.0 + t) * t),
    ],
)
def test_formulas_that_jump_in_a_diagram_without_states(
    formula: str, expected: Callable[[np.ndarray], np.ndarray]
) -> None:
    builder = ab.DiagramBuilder("no states")
    builder.add("f", Expression(formula=formula), builder.add("u", Ramp(initial=1.0)))
    result = ab.sensitivity(builder.build(), "u.slope", "f", stop_time=1.0, sample_time=0.25)
    np.testing.assert_allclose(result["f", "u.slope"].ravel(), expected(result.time), atol=1e-12)


def test_a_jump_inside_an_enabled_subsystem_and_in_a_modulo_without_events() -> None:
    inside = ab.DiagramBuilder("inside")
    value = Expression(formula="if(u > p, 1, 0)", names="p", values=0.73)
    inside.connect(inside.add("g", value, inside.add("u", Inport())), inside.add("y", Outport())["u"])
    builder = ab.DiagramBuilder("enabled")
    part = builder.add("part", EnabledSubsystem(diagram=inside.build()))
    builder.connect(builder.add("u", Ramp()), part["u"])
    builder.connect(builder.add("on", SineWave(frequency=0.5, bias=0.5)), part["enable"])
    builder.add("x", Integrator(), part)
    assert derivative(builder, "part/g.values")[-1] == pytest.approx(-1.0, abs=1e-8)

    builder = ab.DiagramBuilder("modulo")
    remainder = builder.add("b", Modulo(zero_crossing=False), builder.add("u", Ramp()))
    builder.connect(builder.add("v", Constant(value=0.73)), remainder["v"])
    builder.add("x", Integrator(), remainder)
    expected = CLOSED_FORMS["mod(u, p)"](0.73)
    assert derivative(builder, "v.value")[-1] == pytest.approx(expected, rel=1e-8)


def test_a_remainder_has_a_derivative_if_its_divisor_is_zero_or_becomes_zero() -> None:
    for zero_crossing in (True, False):
        builder = ab.DiagramBuilder("divisors")
        u = builder.add("u", Gain(gain=2.6), builder.add("time", Ramp(initial=0.5)))
        divisors = Step(time=0.5, initial=[0.4, 0.0], final=[0.0, 0.4])
        builder.add("y", Modulo(zero_crossing=zero_crossing), u, builder.add("v", divisors))
        result = ab.sensitivity(builder.build(), "u.gain", "y", stop_time=1.0, sample_time=0.1)
        expected = np.tile(0.5 + result.time[:, np.newaxis], 2)
        np.testing.assert_allclose(result["y", "u.gain"], expected, atol=1e-12)

        builder = ab.DiagramBuilder("many jumps")
        fall = builder.add("v", Gain(), builder.add("time", Ramp(initial=1.0, slope=-0.8)))
        u = builder.add("u", Constant(value=-9.81))
        builder.add("y", Modulo(zero_crossing=zero_crossing), u, fall)
        result = ab.sensitivity(builder.build(), "v.gain", "y", stop_time=1.0, sample_time=0.1)
        v = result.run["v"]
        np.testing.assert_allclose(result["y", "v.gain"], -np.floor(-9.81 / v) * v, rtol=1e-12)


def test_a_remainder_of_zero_by_zero_at_the_start_has_a_derivative() -> None:
    """x' = k mod(x, x) - x. With the modes before the start, the remainder is 0 / 0."""
    builder = ab.DiagramBuilder("zero by zero")
    lag = builder.add("x", FirstOrderLag())
    rest = builder.add("rest", Modulo(zero_crossing=False), lag, lag)
    builder.connect(rest, lag["u"])
    result = ab.sensitivity(builder.build(), "x.gain", "x", stop_time=1.0)
    assert not result["x", "x.gain"].any()


def test_signals_have_the_same_bits_in_a_run_with_derivatives() -> None:
    """The stored multiple of the interval equals the present one only if both products are rounded."""
    builder = ab.DiagramBuilder("tie")
    wave = builder.add("wave", SineWave(amplitude=1.0, frequency=0.5, bias=-0.5))
    steps = builder.add("steps", Quantizer(interval=0.1), wave)
    stored = builder.add("stored", Memory(sample_time=0.1), steps)
    zone = builder.add("zone", DeadZoneDynamic(), upper=steps, u=stored, lower=wave)
    builder.add("sign", Sign(), builder.add("difference", Sum(signs="+-"), stored, steps))
    builder.add(
        "sum", Sum(signs="++"), zone, builder.add("formula", Expression(formula="floor(u * 3)"), steps)
    )
    diagram = builder.build()
    settings = {"stop_time": 3.0, "sample_time": 0.05}
    result = ab.sensitivity(diagram, "steps.interval", ["zone", "steps", "stored"], **settings)
    plain = ab.simulate(diagram, **settings)
    for name in plain.names:
        assert np.array_equal(result.run[name], plain[name]), name
    of_steps, of_stored = (result[name, "steps.interval"] for name in ("steps", "stored"))
    above, below = plain["stored"] > plain["steps"], plain["stored"] < plain["wave"]
    expected = np.where(above, of_stored - of_steps, np.where(below, of_stored, 0.0))
    assert np.array_equal(result["zone", "steps.interval"], expected)


def test_a_formula_that_is_not_a_number_ends_a_run_with_derivatives_by_this_reason() -> None:
    builder = ab.DiagramBuilder("nan")
    u = builder.add("u", Gain(gain=2.6), builder.add("time", Ramp(initial=0.5)))
    rest = builder.add(
        "rest", Modulo(function="rem"), u, builder.add("v", Step(time=0.5, initial=0.4, final=0.0))
    )
    builder.add("y", Rounding(zero_crossing=False), rest)
    with pytest.raises(SimulationError, match=r"'rest/y' is nan at 0\.5 s"):
        ab.sensitivity(builder.build(), "u.gain", "y", stop_time=1.0, sample_time=0.1)


def test_a_jump_in_an_implicit_equation() -> None:
    """s = t - s^3/2 - [t > p] jumps at t = p: for s^3/2 + s = r, the integral changes by s(p) - s(p - 1)."""
    builder = ab.DiagramBuilder("loop")
    total = builder.add("s", Sum(signs="+-"), builder.add("u", Ramp()))
    formula = "0.5*u1^3 + if(u2 > p, 1, 0)"
    f = builder.add("f", Expression(formula=formula, inputs=2, names="p", values=0.73), total)
    builder.connect(builder.add("t", Ramp()), f["u2"])
    builder.connect(f, total["u2"])
    builder.add("x", Integrator(), total)

    def s(right: float) -> float:
        return float(next(root.real for root in np.roots([0.5, 0.0, 1.0, -right]) if abs(root.imag) < 1e-12))

    assert derivative(builder, "f.values")[-1] == pytest.approx(s(0.73) - s(-0.27), rel=1e-8)


def test_a_jump_at_the_start_and_a_chattering_formula_are_refused() -> None:
    builder = ab.DiagramBuilder("start")
    f = Expression(formula="if(u > p, 1, 0)", names="p", values=0.0)
    builder.add("x", Integrator(), builder.add("f", f, builder.add("u", Ramp())))
    with pytest.raises(
        InputError, match=r"an event of 'f' at the start moves with the parameter 'f\.values'"
    ):
        derivative(builder, "f.values")
    builder = ab.DiagramBuilder("sliding")
    x = builder.add("x", Integrator(initial=1.0))
    builder.connect(builder.add("f", Expression(formula="-k*sign(u)", names="k", values=2.0), x), x["u"])
    with pytest.raises(SimulationError, match=r"'f'.* events without end at 0\.5"):
        derivative(builder, "f.values")


@pytest.mark.parametrize("function", ["floor", "ceil", "rem", "mod"])
def test_a_jump_may_pass_many_integers(function: str) -> None:
    """The derivative by a formula agrees with differences of runs of the block, which has exact events."""
    diagrams: list[ab.Diagram] = []
    for as_formula in (True, False):
        builder = DiagramBuilder("sawtooth")
        u = builder.add("saw", SignalGenerator(waveform="sawtooth", amplitude=84.4, frequency=0.7))
        one = builder.add("one", Constant(value=1.0))
        if as_formula:
            formula = f"{function}(u)" if function in ("floor", "ceil") else f"{function}(u, 1)"
            f = builder.add("f", Expression(formula=formula), u)
        elif function in ("floor", "ceil"):
            f = builder.add("f", Rounding(function=function), u)
        else:
            f = builder.add("f", Modulo(function=function), u, one)
        builder.add("x", Integrator(), f)
        diagrams.append(builder.build())
    exact = ab.sensitivity(diagrams[0], "saw.amplitude", "x", **SETTINGS)["x", "saw.amplitude"]
    h = 1e-3
    runs = [
        ab.simulate(diagrams[1], parameters={"saw.amplitude": 84.4 + d}, **SETTINGS)["x"] for d in (-h, h)
    ]
    assert np.allclose(exact, (runs[1] - runs[0]) / (2.0 * h), rtol=0.0, atol=1e-6)

"""Masks: a diagram with mask parameters equals the diagram with the numbers in place of the formulas."""

from __future__ import annotations

import math
from typing import cast

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import (
    BLOCKS,
    Constant,
    Gain,
    Integrator,
    MatrixGain,
    Mux,
    Ramp,
    Scope,
    SineWave,
    Subsystem,
    Sum,
    UnitDelay,
)
from armblocks.diagram import (
    Diagram,
    DiagramBuilder,
    ParameterFormula,
    formula,
    mask_parameter,
    with_parameters,
)
from armblocks.diagram.mask import formula_number
from armblocks.errors import DiagramError, InputError, UnknownNameError
from armblocks.formats import diagram_from_bytes, diagram_to_bytes, load_robot


def spring() -> Diagram:
    """A mass on a spring with mass and natural frequency as mask parameters: x'' = F/m - w^2 x."""
    builder = DiagramBuilder("spring")
    m = builder.parameter("m", 2.0, unit="kg", doc="mass", above=0.0)
    builder.parameter("f", 0.5, unit="Hz", doc="natural frequency", above=0.0)
    force = builder.input("F")
    push = builder.add("push", Gain(gain=formula("1/m")), force)
    total = builder.add("total", Sum(signs="+-"), push)
    speed = builder.add("speed", Integrator(), total)
    x = builder.add("x", Integrator(initial=formula("m/4")), speed)
    builder.connect(builder.add("pull", Gain(gain=formula("(2*pi*f)^2")), x), total["u2"])
    builder.output("out", x)
    assert str(m) == "m"
    return builder.build()


def oscillator(masked: bool) -> Diagram:
    builder = DiagramBuilder("oscillator")
    K = builder.parameter("K", 3.0, doc="mass of both") if masked else 3.0
    inner = spring()
    one, two = Subsystem(diagram=inner), Subsystem(diagram=inner)
    one = one.with_parameters(m=K)
    two = two.with_parameters(m=formula("K/2") if masked else 1.5, f=0.7)
    shake = builder.add("shake", SineWave(amplitude=4.0))
    builder.add("scope", Scope(inputs=2), builder.add("one", one, shake), builder.add("two", two, shake))
    return builder.build()


def test_a_diagram_with_masks_equals_the_diagram_with_numbers() -> None:
    plain = DiagramBuilder("plain")
    shake = plain.add("shake", SineWave(amplitude=4.0))
    outs = []
    for name, m, f in (("one", 3.0, 0.5), ("two", 1.5, 0.7)):
        push = plain.add(f"{name} push", Gain(gain=1 / m), shake)
        total = plain.add(f"{name} total", Sum(signs="+-"), push)
        x = plain.add(f"{name} x", Integrator(initial=m / 4), plain.add(f"{name} speed", Integrator(), total))
        plain.connect(plain.add(f"{name} pull", Gain(gain=(2 * np.pi * f) ** 2), x), total["u2"])
        outs.append(x)
    plain.add("scope", Scope(inputs=2), *outs)
    by_hand = ab.simulate(plain.build(), stop_time=3.0)
    masked = ab.simulate(oscillator(masked=True), stop_time=3.0)
    for name in ("one", "two"):
        assert np.array_equal(masked[f"{name}/x"], by_hand[f"{name} x"])
    assert masked["one/out"][0] == 0.75


def test_formulas_are_evaluated_on_all_levels() -> None:
    diagram = with_parameters(oscillator(masked=True), {"K": 8.0, "one.f": 1.0})
    inner = {name: diagram.blocks[name].parameter_value("diagram") for name in ("one", "two")}
    assert inner["one"].blocks["push"].parameter_value("gain") == 0.125
    assert inner["two"].blocks["push"].parameter_value("gain") == 0.25
    assert inner["two"].blocks["x"].parameter_value("initial") == 1.0
    assert inner["one"].blocks["pull"].parameter_value("gain") == (2 * np.pi) ** 2
    assert diagram.blocks["two"].parameter_value("m") == 4.0
    assert diagram.blocks["two"].stated_value("m") == ParameterFormula("K/2")


def test_mask_parameters_are_tuned_without_compilation() -> None:
    model = ab.compile_diagram(oscillator(masked=True))
    compiled = model.compiled
    run = ab.begin(model, stop_time=2.0, solver="RK4", step=0.01)
    run.advance(1.0, exactly=True)
    run.set("K", 6.0)
    run.set("two.f", 0.2)
    run.advance()
    assert run.parameters["one/push.gain"] == 1 / 6
    assert run.parameters["two/pull.gain"] == pytest.approx((2 * np.pi * 0.2) ** 2, rel=1e-15)
    assert model.compiled is compiled
    whole = ab.simulate(model, parameters={"K": 6.0}, stop_time=1.0)
    recompiled = ab.simulate(with_parameters(oscillator(masked=True), {"K": 6.0}), stop_time=1.0)
    assert np.array_equal(whole["one"], recompiled["one"])
    assert whole["one"][0] == 1.5


def test_a_mask_parameter_of_a_sample_time_cannot_be_tuned() -> None:
    builder = DiagramBuilder("wide")
    builder.parameter("n", 2, doc="number of inputs")
    builder.parameter("T", 0.5, unit="s", doc="sample time")
    one = builder.add("one", Constant())
    builder.add("delay", UnitDelay(sample_time=formula("T")), builder.add("mux", Mux(inputs=1), one))
    diagram = builder.build()
    run = ab.begin(diagram, stop_time=1.0)
    with pytest.raises(InputError, match="parameter 'T' cannot take this value during a run"):
        run.set("T", 0.25)
    assert ab.simulate(diagram, parameters={"T": 0.25}, stop_time=1.0).run.ticks > 4
    run.set("n", 3)  # no formula depends on it


def test_arrays_and_choices_pass_through_masks() -> None:
    builder = DiagramBuilder("arrays")
    builder.parameter("A", [[1.0, 2.0], [3.0, 4.0]], doc="a matrix")
    builder.parameter("signs", "+-", doc="signs of the sum")
    v = builder.add("v", Constant(value=[1.0, 10.0]))
    product = builder.add("product", MatrixGain(gain=formula("A'*0.5")), v)
    builder.add("sum", Sum(signs=formula("signs")), product, v)
    result = ab.simulate(builder.build(), stop_time=0.1)
    assert result["sum"][-1].tolist() == [14.5, 11.0]


def test_reading_a_written_diagram_gives_the_same_diagram() -> None:
    for diagram in (oscillator(masked=True), oscillator(masked=False)):
        data = diagram_to_bytes(diagram, load_robot)
        reread = diagram_from_bytes(data, "oscillator.json", BLOCKS, load_robot)
        assert reread == diagram
        assert diagram_to_bytes(reread, load_robot) == data
    text = diagram_to_bytes(oscillator(masked=True), load_robot).decode()
    assert '"m": "K/2"' in text
    assert '"gain": 0.3333' not in text  # computed values are not written


def test_differences_list_masks_and_formulas() -> None:
    before = oscillator(masked=True)
    after = with_parameters(before, {"K": 8.0, "two.f": 0.9})
    difference = ab.diagram_difference(before, after)
    assert [(entry.path, entry.name, entry.after) for entry in difference.parameters] == [
        ("two", "f", 0.9),
        ("", "K", 8.0),
    ]
    difference = ab.diagram_difference(before, oscillator(masked=False))
    assert {(entry.path, entry.name) for entry in difference.parameters} == {
        ("one", "m"),
        ("two", "m"),
        ("", "K"),
    }
    assert [(entry.path, entry.name) for entry in difference.masks] == [("", "K")]


def test_formulas_of_constants_need_no_mask() -> None:
    assert Gain(gain=formula("2*pi")).gain == 2 * np.pi
    assert dict(Gain(gain=formula("2*pi")).formulas) == {"gain": "2*pi"}


def invalid_uses() -> list[tuple[object, type[Exception], str]]:
    def add(block_of: object) -> object:
        def act() -> None:
            builder = DiagramBuilder("d")
            builder.parameter("gain", 2.0)
            builder.add("block", block_of())  # pyright: ignore

        return act

    def declaration(*names: str, **rules: object) -> object:
        def act() -> None:
            builder = DiagramBuilder("d")
            for name in names:
                builder.parameter(name, **{"default": 1.0, **rules})  # pyright: ignore

        return act

    return [
        (
            add(lambda: Constant(value=formula("2*gian"))),
            UnknownNameError,
            "block 'block' .Constant., parameter 'value': there is no "
            "mask parameter named 'gian'.*did you mean 'gain'",
        ),
        (
            add(lambda: Gain(gain=formula("2*"))),
            InputError,
            "the formula ends where a value is expected",
        ),
        (
            add(lambda: Ramp(start=formula("[gain gain]"))),
            DiagramError,
            "block 'block' .Ramp., parameter 'start'.*Allowed: a number",
        ),
        (
            add(lambda: Constant(formulas=(("valeu", "gain"),))),
            UnknownNameError,
            "there is no parameter named 'valeu'.*did you mean 'value'",
        ),
        (declaration("sin"), InputError, "'sin' cannot be the name of a mask parameter"),
        (declaration("k", "k"), InputError, "diagram 'd': the mask parameter 'k' is declared twice"),
        (declaration("k", default=-1.0, minimum=0.0), InputError, "mask parameter 'k': the value is -1.0"),
        (
            lambda: Subsystem(diagram=Diagram(name="d", blocks={}, mask=(mask_parameter("diagram", 1.0),))),
            InputError,
            "diagram 'd': the mask parameter 'diagram' is also a parameter of every Subsystem",
        ),
        (
            lambda: Diagram(name="d", blocks={}, mask=(mask_parameter("k", 1.0),), mask_values={"kk": 2.0}),
            UnknownNameError,
            "there is no mask parameter named 'kk'",
        ),
        (
            lambda: with_parameters(oscillator(masked=True), {"one.m": 2.0}),
            DiagramError,
            "block 'one': 'one.m' is set by the formula 'K'. Allowed: K. Fix: change the parameters",
        ),
        (
            lambda: with_parameters(oscillator(masked=False), {"one/push.gain": 2.0}),
            DiagramError,
            "'one/push.gain' is set by the formula '1/m'. Allowed: one.m",
        ),
        (
            lambda: with_parameters(oscillator(masked=True), {"one.f": -1.0}),
            DiagramError,
            "block 'one'.*the value is -1.0.*Allowed: a number, > 0",
        ),
        (
            lambda: with_parameters(oscillator(masked=True), {"k": 2.0}),
            UnknownNameError,
            "diagram 'oscillator': there is no parameter named 'k'.*did you mean 'K'",
        ),
        (
            lambda: mask_parameter("t", ab.load_diagram("kr180model"), kind=None),
            InputError,
            "the value is Diagram",
        ),
    ]


@pytest.mark.parametrize("number", range(len(invalid_uses())))
def test_invalid_masks_and_formulas_are_refused(number: int) -> None:
    act, kind, message = invalid_uses()[number]
    with pytest.raises(kind, match=message):
        act()  # pyright: ignore


def test_division_by_zero_follows_ieee_754() -> None:
    assert formula_number("-1/0", "here") == -math.inf
    assert formula_number("[1 -2]./[0 0]", "here") == [math.inf, -math.inf]
    assert math.isnan(cast("float", formula_number("0/0", "here")))
    with pytest.raises(UnknownNameError, match="there is no name named 'k'"):
        formula_number("2*k", "here")

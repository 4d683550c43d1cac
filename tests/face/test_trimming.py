"""Operating points: steady states of diagrams."""

from __future__ import annotations

import math

import numpy as np
import pytest

import armblocks as ab
from armblocks.analysis.trim import TrimResult
from armblocks.blocks import (
    Clock,
    Constant,
    DiscreteIntegrator,
    Expression,
    Gain,
    Integrator,
    LookupTable1D,
    Saturation,
    StateSpace,
    Sum,
    Switch,
    UnitDelay,
)
from armblocks.errors import InputError, SimulationError, UnknownNameError


def pendulum() -> ab.Diagram:
    """qdd = torque - 9.81 sin(q) - 0.1 qd."""
    builder = ab.DiagramBuilder("pendulum")
    torque = builder.add("torque", Constant(value=0.0))
    total = builder.add("sum", Sum(signs="+--"), torque)
    speed = builder.add("qd", Integrator(initial=0.2), total)
    angle = builder.add("q", Integrator(initial=0.5), speed)
    builder.connect(builder.add("weight", Expression(formula="9.81 * sin(u)"), angle), total["u2"])
    builder.connect(builder.add("friction", Gain(gain=0.1), speed), total["u3"])
    return builder.build()


def test_the_guess_selects_the_lower_or_upper_equilibrium_of_a_pendulum() -> None:
    down = ab.trim(pendulum())
    assert float(down.point.states["q/x"]) == pytest.approx(0.0, abs=1e-12)
    up = ab.trim(pendulum(), guess={"q": 3.0})
    assert float(up.point.states["q/x"]) == pytest.approx(math.pi, rel=1e-13)
    assert up.largest_residual < 1e-13
    unstable = ab.linearize(pendulum(), "torque", "q", at=up.point)
    assert unstable.poles().real.max() == pytest.approx(-0.05 + math.sqrt(0.05**2 + 9.81), rel=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_values_that_are_zero_to_their_accuracy_are_shown_as_zero(seed: int) -> None:
    """x' = A x + b has the steady state (1, 0, 1e-9); the computed middle value is a rounding error."""
    random = np.random.default_rng(seed)
    A = random.normal(size=(3, 3)) - 3.0 * np.eye(3)
    rest = np.array([1.0, 0.0, 1e-9])
    block = StateSpace(A=A, B=-A @ rest[:, None], C=np.eye(3), D=np.zeros((3, 1)), initial=[0.3, -0.2, 0.1])
    builder = ab.DiagramBuilder("rest")
    builder.add("plant", block, builder.add("one", Constant(value=1.0)))
    trimmed = ab.trim(builder.build())
    (name,) = trimmed.point.states
    value, accuracy = trimmed.point.states[name], trimmed.accuracies[name]
    assert (np.abs(value - rest) <= accuracy).all()
    assert accuracy.max() < 1e-13
    shown = trimmed.shown(name, value)
    assert shown.tolist() == [value[0], 0.0, value[2]]
    assert np.array2string(shown, precision=8) in repr(trimmed)
    assert np.array2string(shown, precision=6) in repr(trimmed.point)


def test_joint_angles_that_gravity_compensation_makes_zero_are_shown_as_zero() -> None:
    """The gravity torques of a few N m cancel; their roundings move the joints by about 1e-17 rad."""
    trimmed = ab.trim("puma560_computed_torque")
    assert trimmed.accuracies["arm/q"].max() < 1e-14
    for text in (repr(trimmed), repr(trimmed.point)):
        assert text.count("[0. 0. 0. 0. 0. 0.]") == 2


def test_small_values_of_an_operating_point_are_shown() -> None:
    trimmed = ab.trim("puma560_computed_torque", states={"arm/q": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]})
    assert trimmed.shown("arm/q", np.full(6, 1e-30)).tolist() == [1e-30] * 6


def test_a_free_torque_holds_a_given_angle() -> None:
    for conditions in ({"states": {"q": 0.7}}, {"outputs": {"q": 0.7}}):
        trimmed = ab.trim(pendulum(), free=["torque"], **conditions)  # type: ignore[arg-type]
        assert float(trimmed.free["torque.value"]) == pytest.approx(9.81 * math.sin(0.7), rel=1e-12)
    held = ab.simulate(pendulum(), parameters=trimmed.free, initial_state=trimmed.point, stop_time=5.0)
    assert np.allclose(held["q"], 0.7, atol=1e-9)


def test_a_state_may_move_while_another_is_steady() -> None:
    builder = ab.DiagramBuilder("car")
    force = builder.add("force", Constant(value=10.0))
    total = builder.add("sum", Sum(signs="+-"), force)
    speed = builder.add("speed", Integrator(), total)
    builder.add("place", Integrator(), speed)
    builder.connect(builder.add("drag", Expression(formula="0.4 * u * abs(u)"), speed), total["u2"])
    trimmed = ab.trim(builder.build(), moving=["place"], guess={"speed": 1.0})
    assert float(trimmed.point.states["speed/x"]) == pytest.approx(5.0, rel=1e-12)
    with pytest.raises(SimulationError, match="no operating point was found"):
        ab.trim(builder.build(), guess={"speed": 1.0})


def test_the_steady_state_of_a_sampled_controller_with_integral_action() -> None:
    builder = ab.DiagramBuilder("sampled")
    reference = builder.add("reference", Constant(value=2.0))
    error = builder.add("error", Sum(signs="+-"), reference)
    control = builder.add("control", DiscreteIntegrator(sample_time=0.1), error)
    rate = builder.add("rate", Sum(signs="+-"), control)
    state = builder.add("x", Integrator(), rate)
    builder.connect(builder.add("loss", Gain(gain=3.0), state), rate["u2"])
    builder.connect(state, error["u2"])
    trimmed = ab.trim(builder.build())
    assert float(trimmed.point.signals["x/y"]) == pytest.approx(2.0, rel=1e-12)
    assert float(trimmed.point.signals["control/y"]) == pytest.approx(6.0, rel=1e-12)


def limited_plant(torque: float) -> ab.Diagram:
    """A diagram of x' = sat(torque) - x."""
    builder = ab.DiagramBuilder("limited")
    source = builder.add("torque", Constant(value=torque))
    limit = builder.add("limit", Saturation(lower=-1.0, upper=1.0), source)
    total = builder.add("sum", Sum(signs="+-"), limit)
    state = builder.add("x", Integrator(), total)
    builder.connect(state, total["u2"])
    return builder.build()


def test_modes_are_consistent_with_the_operating_point() -> None:
    trimmed = ab.trim(limited_plant(0.0), free=["torque"], guess={"torque.value": 5.0}, outputs={"x": 0.4})
    assert float(trimmed.free["torque.value"]) == pytest.approx(0.4, rel=1e-12)


def test_bounds_are_respected_and_active_bounds_are_named() -> None:
    two = ab.trim(pendulum(), free=["torque"], states={"q": 0.3}, bounds={"torque": (-20.0, 20.0)})
    assert not two.at_bounds
    with pytest.raises(SimulationError, match=r"rate of qd/x is -0.8.*torque.value is at a bound") as caught:
        ab.trim(pendulum(), free=["torque"], states={"q": 0.3}, bounds={"torque.value": (-2.0, 2.0)})
    assert isinstance(caught.value.partial, TrimResult)
    assert caught.value.partial.at_bounds == ("torque.value",)


def test_an_operating_point_solves_implicit_equations() -> None:
    builder = ab.DiagramBuilder("implicit")
    source = builder.add("u", Constant(value=3.0))
    total = builder.add("sum", Sum(signs="+--"), source)
    state = builder.add("x", Integrator(initial=0.1), total)
    builder.connect(builder.add("cube", Expression(formula="u^3"), total), total["u2"])
    builder.connect(state, total["u3"])
    trimmed = ab.trim(builder.build())
    assert float(trimmed.point.states["x/x"]) == pytest.approx(3.0, rel=1e-12)


def test_the_torque_that_holds_a_puma_is_its_gravity_load() -> None:
    puma = ab.load_robot("puma560")
    q = np.array([0.1, 0.6, -0.4, 0.2, 0.5, -0.3])
    builder = ab.DiagramBuilder("held")
    torque = builder.add("torque", Constant(value=np.zeros(6)))
    builder.add("arm", ab.blocks.BLOCKS["ForwardDynamics"](robot=puma.robot), torque)  # type: ignore[call-arg]
    trimmed = ab.trim(builder.build(), free=["torque"], states={"arm/q": q, "arm/qd": 0.0})
    assert np.allclose(trimmed.free["torque.value"], puma.gravload(q), rtol=0.0, atol=1e-9)


def test_an_equation_that_depends_on_nothing_free_is_named() -> None:
    builder = ab.DiagramBuilder("ramp")
    builder.add("x", Integrator(), builder.add("u", Constant(value=1.0)))
    with pytest.raises(SimulationError, match=r"rate of x/x is 1.*depends on none"):
        ab.trim(builder.build())


def test_more_equations_than_unknowns_are_refused() -> None:
    with pytest.raises(SimulationError, match="as many equations as unknowns"):
        ab.trim(pendulum(), outputs={"q": 0.7})


def test_an_equation_without_a_root_is_reported() -> None:
    builder = ab.DiagramBuilder("rootless")
    state = builder.add("x", Integrator(initial=0.3))
    builder.connect(builder.add("f", Expression(formula="1 + u^2"), state), state["u"])
    with pytest.raises(SimulationError, match=r"rate of x/x is 1\b.*(a start from which|depends on none)"):
        ab.trim(builder.build())
    builder = ab.DiagramBuilder("steep")
    state = builder.add("x", Integrator(initial=0.0))
    builder.connect(builder.add("f", Expression(formula="sqrt(u) + 1"), state), state["u"])
    with pytest.raises(SimulationError, match="points with finite derivatives"):
        ab.trim(builder.build())


def test_a_counter_has_no_operating_point() -> None:
    builder = ab.DiagramBuilder("counter")
    total = builder.add("sum", Sum(signs="++"), builder.add("one", Constant(value=1.0)))
    builder.connect(builder.add("count", UnitDelay(sample_time=1.0), total), total["u2"])
    with pytest.raises(SimulationError, match="tick of count"):
        ab.trim(builder.build())


def test_unknown_names_and_unsuitable_values_are_refused() -> None:
    with pytest.raises(UnknownNameError, match="there is no state named 'angle'"):
        ab.trim(pendulum(), states={"angle": 1.0})
    with pytest.raises(UnknownNameError, match="there is no parameter named 'tork'"):
        ab.trim(pendulum(), free=["tork"])
    with pytest.raises(UnknownNameError, match="there is no signal named 'angle'"):
        ab.trim(pendulum(), outputs={"angle": 1.0})
    with pytest.raises(InputError, match="is given values of shape"):
        ab.trim(pendulum(), states={"q": [1.0, 2.0]})
    with pytest.raises(InputError, match=r"the bounds of 'q' are 2 and 1.*the lower number first"):
        ab.trim(pendulum(), bounds={"q": (2.0, 1.0)})


def test_the_search_uses_the_given_time() -> None:
    builder = ab.DiagramBuilder("timed")
    total = builder.add("sum", Sum(signs="+-"), builder.add("t", Clock()))
    state = builder.add("x", Integrator(), total)
    builder.connect(state, total["u2"])
    assert float(ab.trim(builder.build(), at=4.0).point.states["x/x"]) == pytest.approx(4.0, rel=1e-12)


def test_modes_that_remain_inconsistent_are_named() -> None:
    """x' = -1 - x / 10 above 0 and 1 - x / 10 below: the equilibrium of each branch is in the other."""
    builder = ab.DiagramBuilder("chase")
    state = builder.add("x", Integrator(initial=0.5))
    above = builder.add("above", Expression(formula="-1 - 0.1 * u"), state)
    below = builder.add("below", Expression(formula="1 - 0.1 * u"), state)
    builder.connect(builder.add("switch", Switch(threshold=0.0), above, state, below), state["u"])
    with pytest.raises(SimulationError, match=r"the modes switch/[a-z]+ remain inconsistent"):
        ab.trim(builder.build())


def table_of(count: int) -> LookupTable1D:
    """A piecewise linear table of u^2 - 2 at ``count`` points from 0 to 5."""
    points = np.linspace(0.0, 5.0, count)
    return LookupTable1D(positions=points, table=points**2 - 2.0)


@pytest.mark.parametrize("count", [9, 1000])
def test_trim_finds_the_root_of_a_curve_with_many_segments(count: int) -> None:
    """x' = 2 - x^2: the root is in the segment near sqrt(2); a Newton step from the first one overshoots."""
    builder = ab.DiagramBuilder("pieces")
    state = builder.add("x", Integrator(initial=0.2))
    curve = builder.add("curve", table_of(count), state)
    builder.connect(builder.add("minus", Gain(gain=-1.0), curve), state["u"])
    points = np.linspace(0.0, 5.0, count)
    k = int(np.searchsorted(points, math.sqrt(2.0)))
    low, high = points[k - 1] ** 2 - 2.0, points[k] ** 2 - 2.0
    expected = points[k - 1] - low * (points[k] - points[k - 1]) / (high - low)
    assert float(ab.trim(builder.build()).point.states["x/x"]) == pytest.approx(expected, rel=1e-12)


def test_single_entries_of_short_tables_may_be_free() -> None:
    """The state follows a table at 2: the entries at 1.875 and 2.5 have the weights 4/5 and 1/5."""

    def following(count: int) -> ab.Diagram:
        builder = ab.DiagramBuilder("follows")
        curve = builder.add("curve", table_of(count), builder.add("place", Constant(value=2.0)))
        state = builder.add("x", Integrator())
        builder.connect(builder.add("error", Sum(signs="+-"), curve, state), state["u"])
        return builder.build()

    trimmed = ab.trim(following(9), free=["curve.table[3]"], states={"x": 3.0})
    upper = 2.5**2 - 2.0
    assert float(trimmed.free["curve.table"][3]) == pytest.approx((3.0 - 0.2 * upper) / 0.8, rel=1e-12)
    assert float(trimmed.free["curve.table"][4]) == upper
    for name in ("curve.table", "curve.table[400]", "curve.positions"):
        with pytest.raises(InputError, match="is part of a table that is read by index"):
            ab.trim(following(1000), free=[name], states={"x": 3.0})
    with pytest.raises(UnknownNameError, match=r"there is no parameter named 'curve.table\[9\]'"):
        ab.trim(following(9), free=["curve.table[9]"])

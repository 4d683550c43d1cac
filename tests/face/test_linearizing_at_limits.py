"""Linear systems about points at a limit or at a jump: a warning if and only if both sides differ."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from casadi import SX, fabs

import armblocks as ab
from armblocks.blocks import (
    Abs,
    CompareToConstant,
    Constant,
    DeadZone,
    Expression,
    Gain,
    Integrator,
    IntegratorLimited,
    MinMax,
    Rounding,
    Saturation,
    Sign,
    Sum,
    UnitDelay,
)
from armblocks.diagram import Block, Diagram, DiagramBuilder, Port, Shapes, Signals, State


@dataclass(frozen=True, kw_only=True)
class Rectifier(Block):
    """x' = |u|, with the output x."""

    title: ClassVar[str] = "Rectifier"

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "input", shape=()),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the state", shape=()),)

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", (), "the integral"),)

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": fabs(u["u"])}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["x"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": SX(0.0)}


LIMITED: dict[str, Block] = {
    "abs": Abs(),
    "saturation": Saturation(lower=0.3, upper=2.0),
    "dead zone": DeadZone(start=-1.0, end=0.3),
    "sign": Sign(),
    "comparison": CompareToConstant(constant=0.3, relation=">="),
    "floor": Rounding(function="floor"),
    "formula": Expression(formula="max(u, 0.3)"),
    "cube": Expression(formula="u^3"),
    "gain": Gain(gain=1e6),
}


def behind_a_limit(block: Block, u: float, *, place: str) -> Diagram:
    """A block with the input ``u``, before an output, an integrator or a unit delay."""
    builder = DiagramBuilder("limit")
    limited = builder.add("limited", block, builder.add("input", Constant(value=u)))
    match place:
        case "output":
            builder.add("last", Gain(), limited)
        case "flow":
            builder.add("last", Integrator(), limited)
        case _:
            builder.add("last", UnitDelay(sample_time=0.1), limited)
    return builder.build()


def warned_blocks(diagram: Diagram, inputs: str | tuple[()], output: str) -> str:
    """The text of the warning of a linearisation, or nothing."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        ab.linearize(diagram, inputs, output)
    return " ".join(str(warning.message) for warning in caught)


@pytest.mark.parametrize("place", ["output", "flow", "tick"])
@pytest.mark.parametrize("name", LIMITED)
def test_a_warning_names_the_block_whose_two_sides_differ(name: str, place: str) -> None:
    random = np.random.default_rng(len(name) + len(place))
    limits = {"saturation": 0.3, "dead zone": 0.3, "comparison": 0.3, "formula": 0.3}
    for u in (0.0, 0.3, *random.uniform(-0.9, 0.9, 2)):
        at_limit = u == limits.get(name, 0.0) and name not in ("cube", "gain")
        diagram = behind_a_limit(LIMITED[name], u, place=place)
        text = warned_blocks(diagram, "input", "last")
        assert ("'limited'" in text and "exactly at a limit or at a jump at 0 s" in text) == at_limit
        assert bool(text) == at_limit, (u, text)


def test_two_blocks_whose_kinks_cancel_give_no_warning() -> None:
    builder = DiagramBuilder("same")
    u = builder.add("input", Constant(value=0.0))
    parts = [builder.add(f"abs {k}", Abs(), u) for k in range(2)]
    builder.add("last", Sum(signs="+-"), *parts)
    assert not warned_blocks(builder.build(), "input", "last")


def test_states_at_a_limit_inside_a_loop_give_a_warning() -> None:
    # x1' = -x1 + max(x1, x2): equal states are a kink that no input moves.
    builder = DiagramBuilder("loop")
    first, second = (builder.add(f"x{k}", Integrator(initial=0.5)) for k in (1, 2))
    larger = builder.add("larger", MinMax(function="max"), first, second)
    builder.connect(builder.add("rate", Sum(signs="-+"), first, larger), first["u"])
    builder.connect(builder.add("decay", Gain(gain=-1.0), second), second["u"])
    assert "'larger'" in warned_blocks(builder.build(), (), "x1")


def test_a_limiter_at_its_limit_is_constant_without_a_warning() -> None:
    builder = DiagramBuilder("full")
    builder.add("tank", IntegratorLimited(initial=1.0, upper=1.0), builder.add("inflow", Constant(value=2.0)))
    diagram = builder.build()
    assert not warned_blocks(diagram, "inflow", "tank/y")
    linear = ab.linearize(diagram, "inflow", "tank/y")
    assert np.array_equal(linear.B, [[0.0]])


def test_a_loop_without_a_solution_beside_the_point_is_linearised() -> None:
    # w = u + 2 max(w, 0) has the solution 0 for u = 0, and no solution for u > 0.
    builder = DiagramBuilder("loop")
    total = builder.add("w", Sum(signs="++"), builder.add("input", Constant(value=0.0)))
    builder.connect(builder.add("twice", Expression(formula="if(u > 0, 2 * u, 0)"), total), total["u2"])
    assert abs(ab.linearize(builder.build(), "input", "w").D[0, 0]) == 1.0


def test_a_kink_inside_a_block_is_named_by_its_state() -> None:
    builder = DiagramBuilder("tank")
    builder.add("tank", Rectifier(), builder.add("inflow", Constant(value=0.0)))
    assert "'tank'" in warned_blocks(builder.build(), "inflow", "tank/y")

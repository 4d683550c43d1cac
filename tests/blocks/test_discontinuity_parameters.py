"""Switching blocks: invalid limits, guards for vectors, and outputs at fixed inputs."""

from __future__ import annotations

import numpy as np
import pytest
from block_evaluation import evaluate

from armblocks.blocks import (
    Constant,
    DeadZone,
    IntegratorLimited,
    Quantizer,
    Relay,
    Saturation,
    StickSlipFriction,
    Switch,
)
from armblocks.diagram import Block, DiagramBuilder, trace_diagram
from armblocks.errors import InputError


@pytest.mark.parametrize(
    ("kind", "lower", "upper"),
    [
        (Saturation, "lower", "upper"),
        (DeadZone, "start", "end"),
        (IntegratorLimited, "lower", "upper"),
        (Relay, "off_point", "on_point"),
        (StickSlipFriction, "coulomb", "static"),
    ],
)
def test_limits_in_the_wrong_order_are_refused(kind: type[Block], lower: str, upper: str) -> None:
    kind(**{lower: 1.0, upper: 1.0})
    message = (
        rf"{kind.__name__}: {lower} is 2\.0 and {upper} is 1\.0\. "
        rf"Allowed: {lower} <= {upper}\. Fix: exchange the two values"
    )
    with pytest.raises(InputError, match=message):
        kind(**{lower: 2.0, upper: 1.0})


def test_every_element_of_a_vector_has_its_own_guards_and_modes() -> None:
    builder = DiagramBuilder("d")
    builder.add("limit", Saturation(upper=[1.0, 2.0]), builder.add("u", Constant(value=[0.0, 3.0])))
    system = trace_diagram(builder.build())
    assert system.guard_names == ("limit",) * 4
    assert system.guard_directions == (0, 0, 0, 0)
    p = system.parameter_values
    assert system.guards(0.0, (), [0.0, 0.0], (), p)[0].tolist() == [-1.0, 1.0, 0.5, 3.5]
    # The mode of the second element contradicts its signal. The event of any guard corrects it.
    _, z = system.reset(0.0, (), [0.0, 0.0], (), p, [-1.0, 0.0, 0.0, 0.0])
    assert z.tolist() == [0.0, 1.0]
    # a guard that fired without a contradiction sets the mode of its element
    _, z = system.reset(0.0, (), [0.0, 0.0], (), p, [1.0, 0.0, 0.0, 0.0])
    assert z.tolist() == [1.0, 1.0]
    # no guard fired: the modes become consistent
    _, z = system.reset(0.0, (), [0.0, 0.0], (), p, [0.0, 0.0, 0.0, 0.0])
    assert z.tolist() == [0.0, 1.0]


def test_outputs_at_fixed_inputs_agree_with_numpy() -> None:
    u = np.array([-3.0, -0.5, -0.2, 0.0, 0.5, 0.76, 2.0])
    assert evaluate(Saturation(), u)["y"].tolist() == np.clip(u, -0.5, 0.5).tolist()
    assert evaluate(DeadZone(), u)["y"] == pytest.approx(u - np.clip(u, -0.5, 0.5), abs=0.0)
    assert evaluate(Quantizer(interval=0.5), u)["y"].tolist() == [-3.0, -0.5, 0.0, 0.0, 0.5, 1.0, 2.0]
    assert evaluate(Relay(), u)["y"].tolist() == [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0]
    assert evaluate(Switch(threshold=0.5), 7.0, u, u)["y"].tolist() == [-3.0, -0.5, -0.2, 0.0, 7.0, 7.0, 7.0]
    strict = evaluate(Switch(threshold=0.5, criterion=">"), 7.0, u, u)["y"]
    assert strict.tolist() == [-3.0, -0.5, -0.2, 0.0, 0.5, 7.0, 7.0]

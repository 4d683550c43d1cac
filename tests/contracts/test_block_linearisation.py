"""The linearisation of every continuous block agrees with finite differences."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Callable, Mapping

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import BLOCKS, Constant, Sum
from armblocks.diagram import Block, Connection, Diagram, PortRef
from armblocks.equations import Signature
from armblocks.errors import ArmblocksWarning
from armblocks.face.block_examples import example_block
from armblocks.face.model import compile_diagram
from worked_examples import worked_example

TIME = 1.7
"""Time of the linearisation, s. No worked example has a kink at this time."""

CONTINUOUS_BLOCKS = {
    name: kind
    for name, kind in BLOCKS.items()
    if not kind.sampled
    and not kind.virtual
    and kind.delay_lines is Block.delay_lines  # a dead time has no finite linear system and is refused
    and example_block(kind).input_ports()
    and example_block(kind).output_ports()
}


def with_perturbation(diagram: Diagram) -> Diagram:
    """The worked example with a Constant of 0 added to the signal at the first input of its block."""
    target = PortRef(diagram.name, diagram.blocks[diagram.name].input_ports()[0].name)
    source = diagram.drivers[target]
    connections = [connection for connection in diagram.connections if connection.target != target]
    connections += [Connection(source, PortRef("perturbed", "u1"))]
    connections += [Connection(PortRef("perturbation", "y"), PortRef("perturbed", "u2"))]
    connections += [Connection(PortRef("perturbed", "y"), target)]
    blocks = {**diagram.blocks, "perturbation": Constant(value=0.0), "perturbed": Sum()}
    return dataclasses.replace(diagram, blocks=blocks, connections=tuple(connections), layout={})


def packed_values(layout: Signature, values: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return named values as the flat vector of a layout."""
    return np.concatenate([np.zeros(0), *(np.ravel(values[slot.name]) for slot in layout)])


def derivative_at_zero(f: Callable[[float], np.ndarray]) -> np.ndarray:
    """Return df/ds at s = 0 by fourth-order central differences; for h = 1e-3 the error is about 1e-12."""
    h = 1e-3
    return (8 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12 * h)


STEPPED_INPUTS = {"IndexVector", "MultiportSwitch", "CombinatorialLogic", "DirectLookup"}
"""Blocks whose first input is an index or a flag, at which their output jumps."""


@pytest.mark.filterwarnings("ignore::armblocks.errors.LimitWarning")
@pytest.mark.parametrize("kind", CONTINUOUS_BLOCKS.values(), ids=CONTINUOUS_BLOCKS)
def test_linearisation_agrees_with_finite_differences(kind: type[Block]) -> None:
    example = worked_example(kind)
    # The added Constant has no states and is 0: the final state of the example is valid for both diagrams.
    state = ab.simulate(example, stop_time=TIME).final_state
    assert state is not None
    diagram = with_perturbation(example)
    outputs = [f"{diagram.name}/{port.name}" for port in diagram.blocks[diagram.name].output_ports()]
    jumps = pytest.warns(ArmblocksWarning, match="exactly at a limit or at a jump")
    with jumps if kind.__name__ in STEPPED_INPUTS else contextlib.nullcontext():
        linear = ab.linearize(diagram, inputs="perturbation.value", outputs=outputs, at=state)
    if linear.dt:
        pytest.skip("the example is sampled")
    assert linear.point is not None
    system, point = compile_diagram(diagram).system, linear.point
    if system.algebraic.size:
        pytest.skip("the example has an implicit equation")
    x, z = packed_values(system.states, point.states), packed_values(system.discrete, point.discrete)
    entry = system.parameters.ranges["perturbation.value"]

    def perturbed_signals(s: float) -> np.ndarray:
        p = packed_values(system.parameters, point.parameters)
        p[entry] += s
        (y,) = system.signals(TIME, x, z, (), p)
        (dx,) = system.derivative(TIME, x, z, (), p)
        signals = system.signals_layout.unpack(y)
        chosen = [np.ravel(signals[system.aliases.get(path, path)]) for path in outputs]
        return np.concatenate([np.ravel(dx), *chosen])

    expected = np.concatenate([linear.B.ravel(), linear.D.ravel()])
    np.testing.assert_allclose(expected, derivative_at_zero(perturbed_signals), rtol=1e-7, atol=1e-8)

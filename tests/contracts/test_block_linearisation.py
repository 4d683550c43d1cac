"""Every block that flows is linearised exactly: its slopes are those of finite differences."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import BLOCKS, Constant, Sum
from armblocks.diagram import Block, Connection, Diagram, PortRef
from armblocks.equations import Signature
from armblocks.face.block_examples import example_block
from armblocks.face.model import compile_diagram
from worked_examples import worked_example

TIME = 1.7
"""s: no worked example is at a kink there."""

FLOWING = {
    name: kind
    for name, kind in BLOCKS.items()
    if not kind.sampled
    and not kind.virtual
    and kind.delay_lines is Block.delay_lines  # a dead time has no finite linear system: it is refused
    and example_block(kind).input_ports()
    and example_block(kind).output_ports()
}


def nudged(diagram: Diagram) -> Diagram:
    """The worked example with a constant 0 added to what feeds the first input of its block."""
    target = PortRef(diagram.name, diagram.blocks[diagram.name].input_ports()[0].name)
    source = diagram.drivers[target]
    wires = [wire for wire in diagram.connections if wire.target != target]
    wires += [Connection(source, PortRef("nudged", "u1"))]
    wires += [Connection(PortRef("nudge", "y"), PortRef("nudged", "u2"))]
    wires += [Connection(PortRef("nudged", "y"), target)]
    blocks = {**diagram.blocks, "nudge": Constant(value=0.0), "nudged": Sum()}
    return dataclasses.replace(diagram, blocks=blocks, connections=tuple(wires), layout={})


def packed(layout: Signature, values: Mapping[str, np.ndarray]) -> np.ndarray:
    """Values by name as the flat vector of a layout."""
    return np.concatenate([np.zeros(0), *(np.ravel(values[slot.name]) for slot in layout)])


def slope(f: Callable[[float], np.ndarray]) -> np.ndarray:
    """df/ds at s = 0 by central differences of fourth order: 1e-3 leaves 1e-12 of the fifth derivative."""
    h = 1e-3
    return (8 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12 * h)


@pytest.mark.filterwarnings("ignore::armblocks.errors.LimitWarning")
@pytest.mark.parametrize("kind", FLOWING.values(), ids=FLOWING)
def test_slopes_are_exact(kind: type[Block]) -> None:
    example = worked_example(kind)
    # The nudge has no states and changes nothing: at the end of the example's run it is where the example is.
    state = ab.simulate(example, stop_time=TIME).final_state
    assert state is not None
    diagram = nudged(example)
    outputs = [f"{diagram.name}/{port.name}" for port in diagram.blocks[diagram.name].output_ports()]
    linear = ab.linearize(diagram, inputs="nudge.value", outputs=outputs, at=state)
    if linear.dt:
        pytest.skip("its example is sampled")
    assert linear.point is not None
    system, point = compile_diagram(diagram).system, linear.point
    if system.algebraic.size:
        pytest.skip("its example has an implicit equation")
    x, z = packed(system.states, point.states), packed(system.discrete, point.discrete)
    place = system.parameters.ranges["nudge.value"]

    def at(s: float) -> np.ndarray:
        p = packed(system.parameters, point.parameters)
        p[place] += s
        (y,) = system.signals(TIME, x, z, (), p)
        (dx,) = system.derivative(TIME, x, z, (), p)
        seen = system.signals_layout.unpack(y)
        chosen = [np.ravel(seen[system.aliases.get(path, path)]) for path in outputs]
        return np.concatenate([np.ravel(dx), *chosen])

    expected = np.concatenate([linear.B.ravel(), linear.D.ravel()])
    np.testing.assert_allclose(expected, slope(at), rtol=1e-7, atol=1e-8)

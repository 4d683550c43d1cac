"""When the inputs of a switching block jump, its output stays between the old and the new value.

At a jump, the mode iteration updates the modes in several passes. Events must not use the outputs between
the passes.
"""

from __future__ import annotations

from contextlib import suppress

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import (
    BLOCKS,
    Abs,
    Bias,
    Clock,
    Constant,
    HitCrossing,
    Integrator,
    Step,
    Switch,
    ZeroOrderHold,
)
from armblocks.diagram import Block, BlockHandle, Diagram
from armblocks.diagram.port import PortRef
from armblocks.errors import InputError
from armblocks.face.block_examples import example_block


def switching() -> list[str]:
    """Return the names of blocks with modes whose ports take scalars."""
    switching_names: list[str] = []
    for name, kind in BLOCKS.items():
        block = example_block(kind)
        ports = block.input_ports()
        scalars = dict.fromkeys((port.name for port in ports), ())
        scalar = bool(ports) and all(port.shape in (None, ()) for port in ports)
        if scalar and not block.sampled and not block.virtual:
            with suppress(InputError):  # some blocks take only vectors
                block.output_shapes(scalars)
                switching_names += [name] * bool(block.modes(scalars))
    return switching_names


def jump(builder: ab.DiagramBuilder, name: str, jump_kind: str, before: float, after: float) -> BlockHandle:
    """Add a signal that jumps at 1 s, at a breakpoint, a tick or an event."""
    if jump_kind == "breakpoint":
        return builder.add(name, Step(time=1.0, initial=before, final=after))
    if jump_kind == "tick":
        early_step = builder.add(f"early {name}", Step(time=0.5, initial=before, final=after))
        return builder.add(name, ZeroOrderHold(sample_time=1.0), early_step)
    first = builder.add(f"{name} before", Constant(value=before))
    second = builder.add(f"{name} after", Constant(value=after))
    return builder.add(name, Switch(threshold=1.0), second, builder.add(f"time of {name}", Clock()), first)


def diagram_of(
    kinds: list[str], jump_kind: str, random: np.random.Generator
) -> tuple[ab.DiagramBuilder, dict[str, Block]]:
    """A diagram with all these blocks; their input signals jump at 1 s."""
    builder = ab.DiagramBuilder("jumps")
    blocks = {name: example_block(BLOCKS[name]) for name in kinds}
    for name, block in blocks.items():
        steps = []
        for port in block.input_ports():
            values = random.choice((-2.0, -1.0, 0.0, 0.5, 1.0, 2.0, *random.uniform(-3.0, 3.0, 2)), 2)
            steps.append(jump(builder, f"{port.name} of {name}", jump_kind, *map(float, values)))
        builder.add(name, block, *steps)
        builder.add(f"flow of {name}", Integrator(), steps[0])
    return builder, blocks


def ranges(diagram: Diagram, blocks: dict[str, Block]) -> dict[str, tuple[float, float]]:
    """Return the middle and half the width of the range of each scalar output."""
    result = ab.simulate(diagram, stop_time=1.25, sample_time=0.005)
    result_ranges: dict[str, tuple[float, float]] = {}
    for name, block in blocks.items():
        for port in block.output_ports():
            values = np.asarray(result[f"{name}/{port.name}"])
            if values.ndim == 1:
                lowest, highest = float(values.min()), float(values.max())
                result_ranges[f"{name}/{port.name}"] = (0.5 * (lowest + highest), 0.5 * (highest - lowest))
    return result_ranges


@pytest.mark.parametrize("jump_kind", ["breakpoint", "tick", "event"])
@pytest.mark.parametrize("seed", range(2))
def test_no_event_uses_an_output_between_passes_of_the_mode_iteration(seed: int, jump_kind: str) -> None:
    builder, blocks = diagram_of(switching(), jump_kind, np.random.default_rng(seed))
    actual = ranges(builder.build(), blocks)
    assert len(actual) > 30
    for path, (middle, half) in actual.items():
        name, _, port = path.partition("/")
        distance = builder.add(f"distance of {port} of {name}", Bias(bias=-middle), PortRef(name, port))
        size = builder.add(f"size of {port} of {name}", Abs(zero_crossing=False), distance)
        builder.add(f"{port} of {name} leaves", HitCrossing(offset=1.02 * half + 1e-3), size)
    result = ab.simulate(builder.build(), stop_time=1.25, sample_time=0.25)
    left = [path for path in actual if result["{1} of {0} leaves/count".format(*path.split("/"))][-1] != 0.0]
    assert left == []

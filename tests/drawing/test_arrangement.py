"""Automatic layout: properties for random diagrams, and the layout of a control loop."""

from __future__ import annotations

import itertools
import random
from collections.abc import Callable
from dataclasses import replace

import pytest
from drawn_connections import connections_in_the_drawing, drawn_lines

from armblocks import blocks as kinds
from armblocks.blocks import (
    PID,
    Constant,
    Demux,
    Display,
    EnabledSubsystem,
    Gain,
    Inport,
    Integrator,
    Mux,
    Outport,
    Product,
    Scope,
    Step,
    Sum,
    Switch,
    TransferFunction,
)
from armblocks.diagram import Block, Connection, Diagram, DiagramBuilder, Placement, PortRef
from armblocks.drawing.block_boxes import NAME_HEIGHT
from armblocks.drawing.diagram_layout import arranged_layout, boxes


def enabled_block() -> Block:
    inner = DiagramBuilder("inner")
    inner.add("y", Outport(), inner.add("gain", Gain(), inner.add("u", Inport())))
    return EnabledSubsystem(diagram=inner.build())


KINDS: tuple[Callable[[], Block], ...] = (
    Step, Constant, Gain, Gain, Integrator, TransferFunction, PID, Switch, enabled_block,
    lambda: Sum(signs="+-"), lambda: Sum(signs="++"), lambda: Sum(signs="+-+"), lambda: Sum(signs="+-+-"),
    lambda: Product(operators="**"), lambda: Mux(inputs=3), lambda: Demux(parts=3),
    lambda: Scope(inputs=1), lambda: Scope(inputs=3), lambda: Display(inputs=1),
)  # fmt: skip


def random_diagram(draw: random.Random, count: int, *, loops: bool = True) -> Diagram:
    """Blocks with random connections; without ``loops`` only to blocks with a larger number."""
    builder = DiagramBuilder("random")
    added = [(k, builder.add(f"b{k:03}", draw.choice(KINDS)())) for k in range(count)]
    for k, handle in added:
        for port in handle.block.input_ports():
            near = [
                other[out.name]
                for j, other in added
                if abs(j - k) < 12 and (loops or j < k)
                for out in other.block.output_ports()
            ]
            if near and draw.random() < 0.85:
                builder.connect(draw.choice(near), handle[port.name])
    return builder.draft()


def with_arranged_layout(diagram: Diagram) -> Diagram:
    return replace(diagram, layout=arranged_layout(diagram), bends={})


def check_no_overlap(diagram: Diagram) -> None:
    """Check that no block overlaps another block or its name."""
    for a, b in itertools.combinations(boxes(diagram).values(), 2):
        beside = a.x + a.width <= b.x or b.x + b.width <= a.x
        below = a.y + a.height + NAME_HEIGHT <= b.y or b.y + b.height + NAME_HEIGHT <= a.y
        assert beside or below, (a.name, b.name)


@pytest.mark.parametrize("seed", range(8))
def test_arranged_blocks_do_not_overlap_and_lines_show_the_connections(seed: int) -> None:
    """The lines show the connections, and the positions depend only on blocks and connections."""
    draw = random.Random(seed)
    diagram = random_diagram(draw, draw.choice([3, 8, 14, 25]))
    result = with_arranged_layout(diagram)
    check_no_overlap(result)
    assert set(result.layout) == set(diagram.blocks)
    inferred, expected = connections_in_the_drawing(result)
    assert inferred == expected
    assert with_arranged_layout(result) == result
    elsewhere = {name: Placement(x=draw.randint(0, 500), y=7.0, flipped=True) for name in diagram.blocks}
    assert with_arranged_layout(replace(diagram, layout=elsewhere)) == result
    shuffled = list(diagram.blocks.items())
    draw.shuffle(shuffled)
    again = replace(diagram, blocks=dict(shuffled), connections=diagram.connections[::-1])
    assert with_arranged_layout(again) == result


@pytest.mark.parametrize("seed", range(4))
def test_without_loops_every_line_runs_to_the_right(seed: int) -> None:
    diagram = with_arranged_layout(random_diagram(random.Random(seed), 20, loops=False))
    placed = boxes(diagram)
    assert not any(box.flipped for box in placed.values())
    for wire in diagram.connections:
        source, target = placed[wire.source.block], placed[wire.target.block]
        assert source.x + source.width < target.x, wire


def test_many_blocks_do_not_overlap() -> None:
    check_no_overlap(with_arranged_layout(random_diagram(random.Random(1), 150)))


def control_loop(draw: random.Random) -> tuple[Diagram, list[str]]:
    """A loop with a disturbance and a sensor, names in random order; the blocks of its forward path."""
    letters = [f"n{k}" for k in range(12)]
    draw.shuffle(letters)
    r, e, c, load, d, y, sensor, *plants = letters
    plants = plants[: draw.randint(1, 5)]
    builder = DiagramBuilder("loop")
    path = builder.add(e, Sum(signs="+-"), builder.add(r, Step()))
    path = builder.add(load, Sum(signs="++"), builder.add(c, PID(), path), builder.add(d, Step()))
    for plant in plants:
        path = builder.add(plant, draw.choice([TransferFunction, Integrator])(), path)
    builder.add(y, Scope(inputs=1), path)
    builder.connect(builder.add(sensor, draw.choice([Gain, TransferFunction])(), path), builder[e]["u2"])
    return builder.build(), [r, e, c, load, *plants, y, d, sensor]


@pytest.mark.parametrize("seed", range(5))
def test_a_control_loop_has_a_straight_forward_path_and_mirrored_feedback(seed: int) -> None:
    """The forward path is one straight row; the sensor is below and mirrored, the disturbance above."""
    diagram, names = control_loop(random.Random(seed))
    *row, disturbance, sensor = names
    diagram = with_arranged_layout(diagram)
    placed, lines = boxes(diagram), drawn_lines(diagram)
    for source, target in itertools.pairwise(row):
        (path,) = [line for ends, line in lines.items() if ends[0] == source and ends[1] == target]
        assert len({y for _, y in path}) == 1, (source, target)
        assert placed[source].x + placed[source].width < placed[target].x
    middle = {name: box.y + box.height / 2 for name, box in placed.items()}
    assert middle[disturbance] < middle[row[0]] < middle[sensor]
    assert [name for name, box in placed.items() if box.flipped] == [sensor]


def test_the_state_feedback_of_a_mass_is_mirrored_above_and_below() -> None:
    builder = DiagramBuilder("mass")
    net = builder.add("net", Sum(signs="+--"), builder.add("force", Step()))
    speed = builder.add("speed", Integrator(), net)
    position = builder.add("place", Integrator(), speed)
    builder.connect(builder.add("damping", Gain(), speed), net["u2"])
    builder.connect(builder.add("spring", Gain(), position), net["u3"])
    builder.add("x", Scope(inputs=1), position)
    placed = boxes(with_arranged_layout(builder.build()))
    assert {name for name, box in placed.items() if box.flipped} == {"damping", "spring"}
    assert (placed["damping"].y - placed["net"].y) * (placed["spring"].y - placed["net"].y) < 0


def test_a_model_beside_its_plant_is_not_mirrored() -> None:
    builder = DiagramBuilder("internal model")
    error = builder.add("e", Sum(signs="+-"), builder.add("r", Step()))
    control = builder.add("c", kinds.LeadLag(), error)
    plant, model = (builder.add(name, TransferFunction(), control) for name in ("plant", "model"))
    builder.add("y", Scope(inputs=1), plant)
    builder.connect(builder.add("difference", Sum(signs="+-"), plant, model), error["u2"])
    assert not any(box.flipped for box in boxes(with_arranged_layout(builder.build())).values())


def test_arranged_blocks_keep_their_sizes_and_are_not_rotated() -> None:
    builder = DiagramBuilder("sizes")
    builder.add("gain", Gain(), builder.add("wide", Constant()))
    builder.place("wide", 0, 0, width=150, height=80)
    builder.place("gain", 200, 0, rotation=90)
    layout = with_arranged_layout(builder.draft()).layout
    assert (layout["wide"].width, layout["wide"].height) == (150, 80)
    assert layout["gain"].rotation == 0 and layout["gain"].width is None


def test_blocks_with_missing_or_invalid_connections_are_placed() -> None:
    builder = DiagramBuilder("draft")
    for k in range(30):
        builder.add(f"b{k}", Gain())
    loop = builder.add("loop", Gain())
    builder.connect(loop, loop)
    diagram = with_arranged_layout(builder.draft())
    check_no_overlap(diagram)
    dangling = Connection(PortRef("b1", "gone"), PortRef("b2", "u"))
    check_no_overlap(with_arranged_layout(replace(diagram, connections=(dangling,))))

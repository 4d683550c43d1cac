"""Ground and Terminator blocks at unconnected ports: every block type, positions, one undo step."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import BLOCKS, Gain, Ground, Terminator
from armblocks.diagram import Diagram, DiagramBuilder, Placement, infer_shapes, open_inputs
from armblocks.drawing.diagram_layout import boxes
from armblocks.errors import DiagramError, InputError
from armblocks.face.block_examples import example_block
from armblocks.formats import diagram_to_bytes, load_robot
from armblocks.studio.protocol.messages.sheet_edits import CommentBlocks, GroundPorts
from armblocks.studio.sheet.document import Document
from armblocks.studio.sheet.placing import placed

NOT_GROUNDED = ("Merge", "BusSelector", "BusAssignment")
"""Block types with inputs that zeros cannot drive. Other inputs of a Bus Assignment are grounded."""


def single_block(kind: str, placement: Placement) -> Diagram:
    block = example_block(BLOCKS[kind])
    return Diagram(name="single_block", blocks={"it": block}, layout={"it": placement})


@pytest.mark.parametrize("kind", [name for name, block in BLOCKS.items() if not issubclass(block, Ground)])
def test_every_block_type_can_be_grounded(kind: str) -> None:
    document = Document(single_block(kind, Placement(x=0.0, y=0.0)), load_robot)
    before = document.diagram
    block = before.blocks["it"]
    if not (block.input_ports() or block.output_ports()):
        return
    document.edit(GroundPorts())
    after = document.diagram
    still_open = {ref.port for ref in open_inputs({"": after})}
    allowed = {port.name for port in block.input_ports()} if kind == "Merge" else {"bus"}
    assert still_open <= (allowed if kind in NOT_GROUNDED else set())
    assert {ref.block for ref in {wire.source for wire in after.connections}} >= (
        {"it"} if block.output_ports() else set()
    )
    for port in block.input_ports():
        driver = next((w.source for w in after.connections if w.target.port == port.name), None)
        if driver is not None and port.shape is not None:
            shape = after.blocks[driver.block].output_ports()[0].shape
            assert shape is not None
            assert np.prod(shape) == np.prod(port.shape)
    document.undo()
    assert document.diagram == before


@pytest.mark.parametrize("rotation", [0, 90, 180, 270])
@pytest.mark.parametrize("flipped", [False, True])
def test_new_blocks_are_beside_their_ports_and_do_not_overlap(rotation: int, flipped: bool) -> None:
    diagram = single_block("ForwardDynamics", Placement(x=0.0, y=0.0, rotation=rotation, flipped=flipped))
    document = Document(diagram, load_robot)
    document.edit(GroundPorts(blocks=["it"]))
    after = document.diagram
    drawn = boxes(after)
    for one, other in itertools.combinations(drawn.values(), 2):
        disjoint = (
            one.x + one.width < other.x
            or other.x + other.width < one.x
            or one.y + one.height < other.y
            or other.y + other.height < one.y
        )
        assert disjoint, (one.name, other.name)
    for wire in after.connections:
        ends = drawn[wire.source.block].outputs, drawn[wire.target.block].inputs
        source = next(spot for spot in ends[0] if spot.name == wire.source.port)
        target = next(spot for spot in ends[1] if spot.name == wire.target.port)
        assert (source.dx, source.dy) == (target.dx, target.dy)
        assert (target.x - source.x) * target.dx + (target.y - source.y) * target.dy >= 40
        offset = abs((target.x - source.x) * target.dy) + abs((target.y - source.y) * target.dx)
        assert offset <= 81


def test_selected_blocks_alone_and_a_sheet_without_open_ports() -> None:
    builder = DiagramBuilder("two")
    builder.add("one", Gain(gain=2.0))
    builder.add("two", Gain(gain=3.0))
    document = Document(placed(builder.draft()), load_robot)
    document.edit(GroundPorts(blocks=["one"]))
    assert document.undo_title == "ground and terminate ports"
    assert sorted(document.diagram.blocks) == ["Ground", "Terminator", "one", "two"]
    document.edit(CommentBlocks(blocks=["two"], comment="out"))
    result = ab.simulate(document.diagram, stop_time=1.0)
    assert not result["one"].any()
    saved = diagram_to_bytes(document.diagram, load_robot)
    with pytest.raises(DiagramError, match="no unconnected port can be grounded"):
        document.edit(GroundPorts())
    assert diagram_to_bytes(document.diagram, load_robot) == saved
    document.edit(CommentBlocks(blocks=["two"], comment=""))
    document.edit(GroundPorts())
    added = [type(document.diagram.blocks[name]) for name in ("Ground 2", "Terminator 2")]
    assert added == [Ground, Terminator]


def test_new_blocks_have_names_that_no_signal_of_the_sheet_has() -> None:
    builder = DiagramBuilder("named")
    source = builder.add("one", Gain(gain=2.0))
    builder.name_signal(source, "ground")
    document = Document(placed(builder.draft()), load_robot)
    document.edit(GroundPorts())
    assert sorted(document.diagram.blocks) == ["Ground 2", "Terminator", "one"]


def test_a_ground_has_the_stated_shape() -> None:
    builder = DiagramBuilder("shapes")
    for name, dimensions in (("scalar", 1.0), ("vector", 3.0), ("matrix", [2.0, 4.0])):
        builder.add(name, Ground(dimensions=dimensions))
    shapes = infer_shapes(builder.build()).outputs
    assert [shapes[name]["y"] for name in ("scalar", "vector", "matrix")] == [(), (3,), (2, 4)]
    for invalid in (0.0, 1.5, [2.0, 2.0, 2.0], 1e9):
        with pytest.raises(InputError, match=r"Ground\.dimensions"):
            Ground(dimensions=invalid)

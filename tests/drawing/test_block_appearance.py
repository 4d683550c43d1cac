"""Sides of names and backgrounds of blocks: the same in files, drawings, edits and arranged sheets."""

from __future__ import annotations

import itertools

import pytest

from armblocks.blocks import BLOCKS, EnabledSubsystem, Gain, Mux, Scope, SineWave, Sum
from armblocks.diagram import BLOCK_COLOURS, NAME_SIDES, Block, Diagram, DiagramBuilder, Placement
from armblocks.drawing.block_boxes import MIN_PORT_DISTANCE, box_at_placement
from armblocks.drawing.diagram_drawing import diagram_svg, obstacle
from armblocks.drawing.diagram_layout import arranged_layout
from armblocks.errors import ArmblocksError, DiagramError
from armblocks.formats import diagram_from_bytes, diagram_to_bytes, load_robot
from armblocks.pictures.style import PALETTE, Tone, contrast
from armblocks.studio.protocol.messages.sheet_edits import MoveBlocks, Place, SetAppearance
from armblocks.studio.sheet.document import Document


def model() -> Diagram:
    builder = DiagramBuilder("looks")
    sine = builder.add("sine", SineWave())
    for number, (side, colour) in enumerate(itertools.product(NAME_SIDES, BLOCK_COLOURS)):
        block = builder.add(f"k {number}", Gain(), sine)
        builder.place(block, 100.0, 80.0 * number, name_side=side, colour=colour)
    builder.place(sine, 0.0, 0.0)
    return builder.build()


def enabled_diagram() -> Diagram:
    inner = DiagramBuilder("inner")
    inner.output("y", inner.input("u"))
    return inner.build()


def test_files_and_arranged_sheets_have_the_appearance() -> None:
    diagram = model()
    again = diagram_from_bytes(diagram_to_bytes(diagram, load_robot), "m", BLOCKS, load_robot)
    assert again.layout == diagram.layout
    arranged = arranged_layout(diagram)
    for name, place in diagram.layout.items():
        assert (arranged[name].name_side, arranged[name].colour) == (place.name_side, place.colour)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [({"name_side": "beneath"}, "'beneath'.*below"), ({"colour": "pink"}, "'pink'.*purple")],
)
def test_other_values_are_refused(wrong: dict[str, str], message: str) -> None:
    builder = DiagramBuilder("looks")
    block = builder.add("sine", SineWave())
    with pytest.raises(DiagramError, match=message):
        builder.place(block, 0.0, 0.0, **wrong)
    ((key, value),) = wrong.items()
    builder.place(block, 0.0, 0.0, name_side="above", colour="blue")
    text = diagram_to_bytes(builder.build(), load_robot)
    damaged = text.replace(b'"above"' if key == "name_side" else b'"blue"', f'"{value}"'.encode())
    with pytest.raises(ArmblocksError, match=message):
        diagram_from_bytes(damaged, "m", BLOCKS, load_robot)


@pytest.mark.parametrize("rotation", [0, 90, 180, 270])
@pytest.mark.parametrize(
    "block", [Gain(), SineWave(), Scope(), Sum(), EnabledSubsystem(diagram=enabled_diagram())]
)
def test_a_name_is_drawn_outside_the_block_at_a_side_without_ports(block: Block, rotation: int) -> None:
    for side in NAME_SIDES:
        box = box_at_placement("name", block, Placement(x=3.0, y=4.0, rotation=rotation, name_side=side))
        x, y, width, height = obstacle(box).label
        right, bottom = box.x + box.width, box.y + box.height
        inside = x < right - 1 and y < bottom - 1 and x + width > box.x + 1 and y + height > box.y + 1
        assert inside == (side == "hidden")
        at = {
            "below": y >= bottom,
            "above": y + height <= box.y,
            "left": x + width <= box.x,
            "right": x >= right,
        }
        spots = [*box.inputs, *box.outputs]
        ports = {
            "below": any(spot.y == bottom for spot in spots),
            "above": any(spot.y == box.y for spot in spots),
            "left": any(spot.x == box.x for spot in spots),
            "right": any(spot.x == right for spot in spots),
        }
        assert at.get(side, True) or ports[side]
        over_ports = [spot for spot in spots if x < spot.x < x + width and y < spot.y < y + height]
        assert side == "hidden" or not over_ports


def test_the_drawing_has_visible_names_and_backgrounds() -> None:
    svg = diagram_svg(model())
    for name, place in model().layout.items():
        assert (f">{name}</text>" in svg) == (place.name_side != "hidden")
    assert all(PALETTE[Tone(f"tint-{colour}")].light in svg for colour in BLOCK_COLOURS[1:])


def test_texts_are_legible_on_all_backgrounds() -> None:
    for colour in BLOCK_COLOURS[1:]:
        tint = PALETTE[Tone(f"tint-{colour}")]
        assert contrast(PALETTE[Tone.INK].light, tint.light) > 7.0
        assert contrast(PALETTE[Tone.INK].dark, tint.dark) > 7.0
        assert contrast(PALETTE[Tone.MUTED].light, tint.light) > 4.5
        assert contrast(PALETTE[Tone.MUTED].dark, tint.dark) > 4.5


def test_an_edit_changes_the_stated_property_of_the_blocks() -> None:
    document = Document(model(), load_robot)
    before = document.diagram.layout["k 0"]
    document.edit(SetAppearance(blocks=["k 0", "sine"], colour="green"))
    assert document.undo_title == "colour 2 blocks"
    assert document.diagram.layout["k 0"].colour == "green"
    assert document.diagram.layout["k 0"].name_side == before.name_side
    document.edit(SetAppearance(blocks=["k 0"], name_side="hidden"))
    assert document.undo_title == "hide the name of k 0"
    place = document.diagram.layout["k 0"]
    document.edit(MoveBlocks(places={"k 0": Place(x=1.0, y=2.0, name_side="hidden", colour="green")}))
    assert document.diagram.layout["k 0"] == type(place)(x=1.0, y=2.0, name_side="hidden", colour="green")


def test_a_block_is_never_so_small_that_the_wires_at_its_ports_would_touch() -> None:
    mux = Mux(inputs=24)
    for rotation in (0, 90, 180, 270):
        for flipped in (False, True):
            place = Placement(x=10, y=20, width=12, height=16, rotation=rotation, flipped=flipped)
            box = box_at_placement("mux", mux, place)
            assert (box.x, box.y) == (10, 20)
            spots = sorted((port.x, port.y) for port in box.inputs)
            distances = [abs(b[0] - a[0]) + abs(b[1] - a[1]) for a, b in itertools.pairwise(spots)]
            assert min(distances) >= MIN_PORT_DISTANCE - 1e-9
    assert box_at_placement("mux", Mux(inputs=2), Placement(x=0, y=0, width=12, height=16)).height == 16

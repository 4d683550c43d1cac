"""Drawings of diagrams: blocks do not overlap, and the lines show the connections unambiguously."""

import dataclasses
import itertools
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterable, Iterator
from functools import partial

import pytest
from drawn_connections import connections_in_the_drawing, drawn_lines

import armblocks as ab
from armblocks.blocks import (
    BLOCKS,
    PID,
    Clock,
    Constant,
    Demux,
    Display,
    EnabledSubsystem,
    Gain,
    Inport,
    Integrator,
    MathFunction,
    Mux,
    Outport,
    Product,
    Saturation,
    Scope,
    SineWave,
    StateSpace,
    Step,
    Subsystem,
    Sum,
    TransferFunction,
    Trigonometry,
)
from armblocks.diagram import Block, Diagram, DiagramBuilder, Note, Placement, formula
from armblocks.drawing.block_boxes import box_at_origin, box_at_placement
from armblocks.drawing.block_faces import face_size
from armblocks.drawing.diagram_drawing import (
    block_marks,
    block_picture,
    diagram_picture,
    diagram_svg,
)
from armblocks.drawing.diagram_layout import boxes
from armblocks.drawing.wire_names import name_position
from armblocks.drawing.wires import Obstacle
from armblocks.face.block_examples import example_block
from armblocks.pictures.picture import Curve, Group, Mark, Picture, Polyline, Raster, Text, text_marks
from armblocks.pictures.style import Tone
from armblocks.pictures.text_width import text_width

EXAMPLES = ("kr180model", "falling_pendulum", "puma560_computed_torque", "van_der_pol_pid")


def feedback_loop() -> Diagram:
    builder = DiagramBuilder("loop <&>")
    reference = builder.add("reference", Step())
    error = builder.add("error", Sum(signs="+-"), reference)
    control = builder.add("a controller with quite a long name", PID(), error)
    plant = builder.add(
        "plant", TransferFunction(numerator=(1.0, -2.5), denominator=(1.0, 0.0, 3.0, 1.0)), control
    )
    builder.connect(plant, error["u2"])
    builder.add("scope", Scope(inputs=2), reference, plant)
    builder.add("clock", Clock())
    return builder.build()


def many_kinds() -> Diagram:
    builder = DiagramBuilder("many kinds")
    a, b = builder.add("a", Constant(value=(1.0, 2.0))), builder.add("b", SineWave())
    mux = builder.add("mux", Mux(inputs=2), a, b)
    gain = builder.add("gain", Gain(gain=-12345.678), mux)
    parts = builder.add("demux", Demux(parts=3), gain)
    product = builder.add("ratio", Product(operators="*/*"), parts["y1"], parts["y2"], parts["y3"])
    total = builder.add("sum of four", Sum(signs="+-+-"), product, b, parts["y1"], parts["y2"])
    bounded = builder.add("bounded", Saturation(), total)
    sine = builder.add("sine", Trigonometry(function="cos"), bounded)
    square = builder.add("square", MathFunction(function="exp"), sine)
    memory = builder.add("memory", Integrator(), square)
    space = builder.add("space", StateSpace(), memory)
    builder.add("shown", Display(), space)
    return builder.build()


def without_layout(name: str) -> Diagram:
    return dataclasses.replace(ab.load_diagram(name), layout={})


CASES: dict[str, Callable[[], Diagram]] = {
    **{f"{name}-placed": partial(ab.load_diagram, name) for name in EXAMPLES},
    **{f"{name}-layered": partial(without_layout, name) for name in EXAMPLES},
    "feedback loop": feedback_loop,
    "many kinds": many_kinds,
}


@pytest.fixture(params=CASES.values(), ids=list(CASES), scope="module")
def diagram(request: pytest.FixtureRequest) -> Diagram:
    return request.param()


def test_blocks_do_not_overlap(diagram: Diagram) -> None:
    for a, b in itertools.combinations(boxes(diagram).values(), 2):
        disjoint = (
            a.x + a.width <= b.x or b.x + b.width <= a.x or a.y + a.height <= b.y or b.y + b.height <= a.y
        )
        assert disjoint, (a.name, b.name)


def test_the_connections_can_be_read_from_the_drawing(diagram: Diagram) -> None:
    """Every connection is drawn as a line, because these sheets have enough room."""
    inferred, expected = connections_in_the_drawing(diagram)
    assert inferred == expected
    assert all(drawn_lines(diagram).values())


def test_a_drawing_is_valid_and_repeatable(diagram: Diagram) -> None:
    text = diagram_svg(diagram)
    assert text == diagram_svg(diagram)
    root = ET.fromstring(text)
    width, height = float(root.get("width") or 0), float(root.get("height") or 0)
    assert width > 0 and height > 0
    for mark in text_marks(diagram_picture(diagram)):
        assert 0 <= mark.x <= width and 0 <= mark.y <= height
    names = {element.text for element in root.iter("{http://www.w3.org/2000/svg}title")}
    for name, block in diagram.blocks.items():
        assert f"{name} ({block.title})" in names


def test_every_shipped_block_has_a_face_of_suitable_size() -> None:
    for name in BLOCKS:
        kind = BLOCKS[name]
        if any(rule.required for rule in kind.parameters()):
            continue
        _, width, height = face_size(kind())
        assert 5 <= width <= 160 and 20 <= height <= 160


@pytest.mark.parametrize("kind", BLOCKS.values(), ids=BLOCKS)
def test_the_picture_of_a_single_block_contains_all_its_marks(kind: type[Block]) -> None:
    block = example_block(kind)
    picture = block_picture(block)
    ports = len(block.input_ports()) + len(block.output_ports())
    assert picture.title == f"Symbol of {block.title}"
    assert sum(isinstance(mark, Curve) for mark in picture.marks) >= ports
    for mark in text_marks(picture):
        assert -1 <= mark.x <= picture.width + 1
        assert 0 <= mark.y <= picture.height


@pytest.mark.parametrize("kind", BLOCKS.values(), ids=BLOCKS)
def test_all_text_of_a_face_is_readable(kind: type[Block]) -> None:
    """No text is cut, too small, outside the block, or overlaps another text."""
    block = example_block(kind)
    box = box_at_origin("", block)
    faces = [(block, box), (block, dataclasses.replace(box, flipped=True))]
    for _, drawn in faces[:1] if isinstance(block, Display) else faces:
        texts = text_marks(Picture(width=0, height=0, title="", marks=block_marks(drawn)))
        places: list[tuple[float, float, float, float]] = []
        for mark in texts:
            assert mark.size >= 8.0, mark.text
            assert "…" not in mark.text or isinstance(block, Display)
            wide = text_width(mark.text, mark.size, mono=mark.mono)
            left = mark.x - {"start": 0.0, "middle": 0.5, "end": 1.0}[mark.anchor] * wide
            assert box.x - 0.5 <= left and left + wide <= box.x + box.width + 0.5, mark.text
            assert box.y <= mark.y - 0.6 * mark.size and mark.y <= box.y + box.height, mark.text
            places.append((left + 0.5, left + wide - 0.5, mark.y - 0.6 * mark.size, mark.y))
        for (a, b, c, d), (e, f, g, h) in itertools.combinations(places, 2):
            assert b <= e or f <= a or d <= g or h <= c, [mark.text for mark in texts]


def test_the_face_of_a_masked_subsystem_shows_its_name() -> None:
    inner = DiagramBuilder("Servo")
    stiffness = inner.parameter("K", 3.0, doc="stiffness")
    inner.add("y", Outport(), inner.add("spring", Gain(gain=stiffness), inner.add("u", Inport())))
    masked = inner.build()
    for kind in (Subsystem, EnabledSubsystem):
        shown = {mark.text for mark in text_marks(block_picture(kind(diagram=masked)))}
        assert {"Servo", "u", "y"} <= shown


@pytest.mark.parametrize(
    "name", ["JointServo", "ServoWithGearAndBrake", "a servo with its gear", "two_words_more"]
)
def test_the_name_on_a_masked_subsystem_is_not_cut(name: str) -> None:
    inner = DiagramBuilder(name)
    stiffness = inner.parameter("K", 3.0, doc="stiffness")
    inner.add("y", Outport(), inner.add("spring", Gain(gain=stiffness), inner.add("u", Inport())))
    shown = [mark.text for mark in text_marks(block_picture(Subsystem(diagram=inner.build())))]
    assert name.replace("_", " ") in " ".join(shown)


def test_faces_show_short_formulas() -> None:
    for text, shown in (("1/K", "1/K"), ("K*K*K*K*K*K*K*K*K*K", "5.9e4")):
        block = Gain(gain=formula(text)).in_scope({"K": 3.0}, "spring")
        assert shown in {mark.text for mark in text_marks(block_picture(block))}
    constant = Constant(value=formula("[K 2]")).in_scope({"K": 3.0}, "spring")
    assert "[K 2]" in {mark.text for mark in text_marks(block_picture(constant))}


def test_faces_of_sinks_show_the_final_values_of_a_run() -> None:
    diagram = ab.load_diagram("kr180model")
    result = ab.simulate(diagram)
    texts = [mark.text for mark in text_marks(diagram_picture(diagram, result))]
    assert {"−2.9493", "1.2547", "2.3479"} <= set(texts)


def test_a_wire_without_room_has_labels_at_both_ends() -> None:
    """The source of a gain that lies under another block cannot be reached by a line."""
    builder = DiagramBuilder("covered")
    builder.add("gain", Gain(), builder.add("ramp", Clock()))
    for name, x in (("ramp", 0.0), ("gain", 200.0), ("lid", 20.0)):
        if name == "lid":
            builder.add(name, Gain())
        builder.place(name, x, 0.0)
    texts = [mark.text for mark in text_marks(diagram_picture(builder.draft()))]
    assert texts.count("ramp") == 3, "its name and two labels"


@pytest.mark.parametrize("kind", ["Gain", "Sum", "Fkine", "Scope", "Subsystem", "PID"])
def test_commented_blocks_are_grey_with_their_sign(kind: str) -> None:
    """Out: a percent sign; through: a line from each input to its output."""
    diagram = ab.block_example(kind)
    name = next(name for name, block in diagram.blocks.items() if block.type_name() == kind)
    box = boxes(diagram)[name]
    tones = {Tone.HAIRLINE, Tone.SUNKEN, Tone.MUTED, None}

    def mark_tones(marks: Iterable[Mark]) -> Iterator[Tone | None]:
        for mark in marks:
            if isinstance(mark, Group):
                yield from mark_tones(mark.marks)
            elif isinstance(mark, Text):
                yield mark.tone
            elif not isinstance(mark, Raster):
                yield from (mark.stroke, mark.fill)

    out = block_marks(box, comment="out")
    assert set(mark_tones(out)) <= tones
    assert isinstance(out[-1], Text)
    assert out[-1].text == "%"
    if kind in ("Fkine", "Scope"):
        return
    through = block_marks(box, comment="through")
    lines = through[len(out) - 1 :]
    assert set(mark_tones(through[: len(out) - 1])) <= tones
    assert [(*line.points[0], *line.points[-1]) for line in lines if isinstance(line, Polyline)] == [
        (box.inputs[0].x, box.inputs[0].y, box.outputs[0].x, box.outputs[0].y)
    ]
    svg = diagram_svg(dataclasses.replace(diagram, commented={name: "through"}))
    assert f"{name} ({box.block.title}, commented through)" in svg


def test_the_name_of_a_signal_covers_no_block() -> None:
    """The longest segment is used, unless a block is there; below the line, if there is no room above."""
    path = ((0.0, 0.0), (100.0, 0.0), (100.0, 60.0), (400.0, 60.0))
    far = Obstacle(500.0, 500.0, 1.0, 1.0, (500.0, 500.0, 1.0, 1.0))
    above = Obstacle(100.0, 20.0, 300.0, 38.0, (100.0, 58.0, 1.0, 1.0))
    both = Obstacle(100.0, 20.0, 300.0, 80.0, (100.0, 58.0, 1.0, 1.0))
    assert name_position("speed", [path], [far]) == (250.0, 56.0, "middle")
    assert name_position("speed", [path], [above]) == (250.0, 72.0, "middle")
    assert name_position("speed", [path], [both]) == (50.0, -4.0, "middle")
    assert name_position("speed", [path[1:3]], [far]) == (104.0, 33.6, "start")
    assert name_position("speed", [()], [far]) is name_position("", [path], [far]) is None


def test_an_empty_diagram_has_a_drawing() -> None:
    assert "0 blocks." in diagram_picture(Diagram(name="empty", blocks={})).description


# -- rotated blocks, notes ------------------------------------------------------


@pytest.mark.parametrize("rotation", [0, 90, 180, 270])
@pytest.mark.parametrize("flipped", [False, True])
def test_ports_of_every_rotated_block_are_on_its_edges(rotation: int, flipped: bool) -> None:
    for kind in BLOCKS.values():
        block = example_block(kind)
        upright = box_at_placement("b", block, Placement(x=30, y=40, flipped=flipped))
        box = box_at_placement("b", block, Placement(x=30, y=40, flipped=flipped, rotation=rotation))
        assert block_marks(box)
        for upright_port, port, direction in (
            *((upright_port, port, -1) for upright_port, port in zip(upright.inputs, box.inputs)),
            *((upright_port, port, 1) for upright_port, port in zip(upright.outputs, box.outputs)),
        ):
            dx, dy = upright_port.dx, upright_port.dy
            for _ in range(rotation // 90):
                dx, dy = -dy, dx
            assert (port.dx, port.dy) == (dx, dy)
            edge = {
                (-1, 0): port.x - box.x,
                (1, 0): box.x + box.width - port.x,
                (0, -1): port.y - box.y,
                (0, 1): box.y + box.height - port.y,
            }[direction * dx, direction * dy]
            assert abs(edge) < 1e-9


def test_notes_are_drawn_line_by_line() -> None:
    builder = DiagramBuilder("noted")
    builder.add("clock", BLOCKS["Clock"]())
    builder.place("clock", 0, 0)
    builder.note("/1", Note(x=0, y=120, text="what it shows\nand why"))
    texts = {mark.text: mark for mark in text_marks(diagram_picture(builder.draft()))}
    assert texts["and why"].y - texts["what it shows"].y == 17


def test_sheets_inside_commented_subsystems_are_grey() -> None:
    builder = DiagramBuilder("outer")
    builder.add("sub", Subsystem(diagram=feedback_loop()))
    plain = builder.build()

    def strokes(marks: Iterable[Mark]) -> Iterator[Tone | None]:
        for mark in marks:
            if isinstance(mark, Group):
                yield from strokes(mark.marks)
            elif isinstance(mark, Polyline | Curve):
                yield mark.stroke

    assert Tone.WIRE in set(strokes(diagram_picture(plain, sheet="sub").marks))
    commented = ab.with_comments(plain, {"sub": "out"})
    assert set(strokes(diagram_picture(commented, sheet="sub").marks)) <= {Tone.HAIRLINE, None}
    assert "sheet sub, commented out" in diagram_picture(commented, sheet="sub").title

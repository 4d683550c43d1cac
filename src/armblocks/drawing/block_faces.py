"""Faces of blocks: outline, size, and drawing.

Most blocks show the sign that they declare; this module draws the blocks with a special outline or drawing.
"""

from __future__ import annotations

import numpy as np

from armblocks import blocks as kinds
from armblocks.diagram import Block
from armblocks.diagram.signs import Outline, value_text
from armblocks.drawing.face_marks import FaceArea, min_face_size, sign_marks, words
from armblocks.drawing.sink_faces import Trend, display, scope, xy_graph
from armblocks.drawing.structure_faces import (
    BAR,
    branch_labels,
    bus_outline,
    control_ports,
    is_subsystem,
    lever_marks,
    mask_width,
    oval,
    port_number,
    stop_marks,
    subsystem_marks,
    tag_outline,
    tag_text,
    tag_width,
)
from armblocks.pictures.numbers import axis_number
from armblocks.pictures.picture import Curve, Disc, Group, Mark, Polyline, Rectangle, Text
from armblocks.pictures.style import Tone
from armblocks.pictures.text_width import text_width
from armblocks.rendering.camera import Camera
from armblocks.robot import Robot
from armblocks.robot.geometry import link_frames

_SIZES = {
    Outline.CIRCLE: (34.0, 34.0),
    Outline.TRIANGLE: (62.0, 52.0),
    Outline.BAR: (9.0, 48.0),
    Outline.BUS: (30.0, 48.0),
    Outline.OVAL: (44.0, 24.0),
}
"""Width and height, px."""


def face_size(block: Block) -> tuple[Outline, float, float]:
    """Outline, width and height (px) of a face; port names may widen it."""
    outline = block.face_outline()
    if isinstance(block, kinds.Goto | kinds.From):
        return outline, tag_width(block), 26.0
    if isinstance(block, kinds.Display):
        return outline, 104.0, max(40.0, 24.0 * block.inputs + 8)
    if outline in _SIZES:
        return outline, *_SIZES[outline]
    if block.card_size is not None:
        return outline, *block.card_size
    width, height = min_face_size(block.face_sign())
    return outline, max(68.0, width), max(50.0, height)


def face_width(block: Block) -> float:
    """Width that the drawing needs between the port names, px."""
    shape, width, _ = face_size(block)
    if shape is not Outline.CARD or isinstance(block, kinds.Display):
        return width
    if is_subsystem(block):
        return mask_width(block)
    if _has_special_drawing(block):
        return 0.62 * width
    return min_face_size(block.face_sign())[0]


def _has_special_drawing(block: Block) -> bool:
    return isinstance(
        block,
        kinds.Product | kinds.Scope | kinds.XYGraph | kinds.JTraj | kinds.RobotPlot | kinds.Fkine
        | kinds.ForwardDynamics | kinds.ArmPlant | kinds.PositionDrivenArm
        | kinds.AccelerationDrivenArm | kinds.Switch | kinds.ManualSwitch | kinds.MultiportSwitch
        | kinds.StopSimulation,
    )  # fmt: skip


def outline(block: Block, x: float, y: float, width: float, height: float, flipped: bool) -> Mark:
    """The outline of a block."""
    match face_size(block)[0]:
        case Outline.CIRCLE:
            radius = min(width, height) / 2
            return Disc(x + width / 2, y + height / 2, radius, Tone.SURFACE, Tone.WIRE, 1.2)
        case Outline.TRIANGLE:
            tip, back = (x, x + width) if flipped else (x + width, x)
            corners = [(back, y), (tip, y + height / 2), (back, y + height)]
            return Polyline(corners, stroke=Tone.WIRE, width=1.2, fill=Tone.SURFACE, closed=True)
        case Outline.BAR:
            return Rectangle(x, y, width, height, radius=1.5, fill=Tone.WIRE)
        case Outline.BUS:
            return Group(bus_outline(block, x, y, width, height, flipped))
        case Outline.OVAL:
            return oval(x, y, width, height)
        case Outline.TAG:
            return tag_outline(block, x, y, width, height, flipped)
        case Outline.CARD:
            return Rectangle(x, y, width, height, 5, Tone.SURFACE, Tone.WIRE, 1.2)


def face(block: Block, area: FaceArea, trend: Trend | None, *, flipped: bool = False) -> list[Mark]:
    """The drawing inside the block, except for subsystems and switches, see :func:`face_at_ports`."""
    match block:
        case kinds.Gain() | kinds.SliderGain():
            return _gain(block, area, flipped=flipped)
        case kinds.Sum() | kinds.BusCreator() | kinds.BusSelector() | kinds.BusAssignment():
            return []
        case kinds.Inport() | kinds.Outport():
            return port_number(block, area)
        case kinds.Goto() | kinds.From():
            return words(area.shrunk(6.0, 0.0), tag_text(block), size=11.0)
        case kinds.Product():
            # If all inputs are factors, one sign is drawn in the middle; else the signs are drawn at the
            # ports.
            return words(area, "×", size=20) if set(block.operators) == {"*"} else []
        case kinds.Scope():
            return scope(area, trend)
        case kinds.XYGraph():
            return xy_graph(area, trend)
        case kinds.Display():
            return display(area, block.inputs, trend)
        case kinds.StopSimulation():
            return stop_marks(area)
        case kinds.PositionDrivenArm():
            return _robot(area, block.robot, "given q")
        case kinds.AccelerationDrivenArm():
            return _robot(area, block.robot, "given qdd")
        case kinds.RobotPlot() | kinds.Fkine() | kinds.ForwardDynamics() | kinds.ArmPlant():
            caption = "" if isinstance(block, kinds.RobotPlot) else block.title
            return _robot(area, block.robot, caption)
        case _:
            return sign_marks(block.face_sign(), area)


def face_at_ports(
    block: Block,
    area: FaceArea,
    heights: tuple[float, ...],
    tops: tuple[tuple[str, float], ...],
    *,
    flipped: bool,
) -> list[Mark] | None:
    """The drawing of a block that depends on its ports; ``None`` for all others.

    ``heights``: positions (px) of the inputs at the side. ``tops``: names and positions (px) of the inputs on
    the upper edge.
    """
    if is_subsystem(block):
        return subsystem_marks(block, area, tops)
    if isinstance(block, kinds.Switch | kinds.ManualSwitch | kinds.MultiportSwitch):
        if isinstance(block, kinds.Switch):
            heights = (heights[0], heights[-1])
        elif isinstance(block, kinds.MultiportSwitch):
            heights = heights[1:]
        return lever_marks(block, area, heights, flipped)
    return None


def port_labels(block: Block) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The texts beside the ports: names if a side has several ports, signs for operators."""
    into = tuple(port.name for port in block.input_ports())
    out = tuple(port.name for port in block.output_ports())
    match block:
        case kinds.Product():
            several = set(block.operators) != {"*"}
            return tuple("×" if o == "*" else "÷" for o in block.operators) if several else (), ()
        case kinds.Display() if block.inputs > 2:
            return (), ()
        case kinds.If() | kinds.SwitchCase():
            return into if len(into) > 1 else (), branch_labels(block)
        case kinds.BusCreator():
            return into, ()
        case kinds.BusSelector():
            return (), out
        case kinds.Switch():
            return ("", f"{block.criterion} {value_text(block.threshold)}".replace(">=", "≥"), ""), ()
        case kinds.ManualSwitch():
            return (), ()
        case _ if is_subsystem(block):
            above = control_ports(block)
            return tuple("" if name in above else name for name in into), out
        case _ if block.frame_ports():
            return into, out
        case _:
            return into if len(into) > 1 else (), out if len(out) > 1 else ()


def frame_labels(block: Block) -> tuple[str, ...]:
    """The texts beside the frame ports: their names, unless the block has a single port."""
    frames = block.frame_ports()
    single = len(frames) == 1 and not block.input_ports() and not block.output_ports()
    return tuple("" if single else port.name for port in frames)


def bus_width(block: Block, size: float) -> float:
    """Width (px) of a bus block whose element names have this font size."""
    labels = [label for side in port_labels(block) for label in side]
    return max((text_width(label, size) for label in labels), default=0.0) + BAR + 14


def _with_exponent(gain: object) -> str:
    """A long number with a power of ten, such as 2.5e4; an empty text if that is too long."""
    array = np.asarray(gain, dtype=np.float64)
    if array.size != 1:
        return ""
    digits, _, power = f"{float(array.reshape(-1)[0]):.2e}".partition("e")
    text = f"{axis_number(float(digits))}e{axis_number(int(power))}"
    return text if len(text) <= 6 else ""


def _gain(block: kinds.Gain | kinds.SliderGain, area: FaceArea, *, flipped: bool) -> list[Mark]:
    """The formula of a gain, or its value, if one of them fits into the triangle; else the letter ``K``."""
    limit = 0.56 * area.width
    candidates = (block.stated_text("gain"), value_text(block.gain), _with_exponent(block.gain))
    text = next(
        (candidate for candidate in candidates if candidate and text_width(candidate, 9.5) <= limit), "K"
    )
    size = 12.0 if text_width(text, 12.0) < 0.52 * area.width else 9.5
    fraction = 0.64 if flipped else 0.36
    return [
        Text(area.x + fraction * area.width, area.middle[1] + 0.36 * size, text, size, Tone.INK, "middle")
    ]


def _robot(area: FaceArea, robot: Robot, caption: str) -> list[Mark]:
    """The joints and links of the robot as a small stick figure."""
    is_plot = not caption
    box = area.shrunk(7.0, 7.0)
    if caption:
        box = FaceArea(box.x, box.y + 8, box.width, box.height - 8)
    frames = link_frames(robot, [0.35 + 0.25 * k if k % 2 else 0.3 for k in range(robot.nq)])
    row = {link.name: k for k, link in enumerate(robot.links, start=1)}
    points = frames[:, :3, 3]
    camera = Camera.framing(points + 1e-6 * np.arange(3), box.width, box.height, margin=3.0)
    flat = camera.to_pixels(points) + np.array([box.x, box.y])
    marks: list[Mark] = []
    for k, link in enumerate(robot.links, start=1):
        a, b = flat[row[link.parent] if link.parent is not None else 0], flat[k]
        if float(np.hypot(*(b - a))) > 1.5:
            marks.append(Polyline(np.stack([a, b]), stroke=Tone.PAINT, width=5.0 if is_plot else 4.0))
    for k in range(len(robot.links)):
        x, y = flat[k].tolist()
        marks.append(Disc(x, y, 2.7 if is_plot else 2.3, fill=Tone.GRAPHITE))
    x, y = flat[0].tolist()
    base = (("M", x - 7, y + 5), ("L", x + 7, y + 5), ("L", x + 3.5, y), ("L", x - 3.5, y), ("Z",))
    if caption:
        marks.append(Text(area.x + 6, area.y + 13, caption, 9.5, Tone.MUTED))
    return [Curve(base, stroke=None, fill=Tone.GRAPHITE), *marks]

"""What a block shows on its face: a drawing that says what it does."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from armblocks import blocks as kinds
from armblocks.diagram import Block
from armblocks.report.camera import Camera
from armblocks.report.charts import thin_out
from armblocks.report.face_symbols import CURVES, TEXTS
from armblocks.report.numbers import axis_number
from armblocks.report.picture import Curve, Disc, Mark, Polyline, Rectangle, Text
from armblocks.report.style import Tone, trace_tone
from armblocks.report.text_width import shorten, text_width
from armblocks.robot import Robot
from armblocks.robot.geometry import link_frames

_Array = NDArray[np.float64]


class FaceShape(Enum):
    """The outline of a block."""

    CARD = "card"
    TRIANGLE = "triangle"
    CIRCLE = "circle"
    BAR = "bar"


@dataclass(frozen=True, eq=False, kw_only=True)
class Trend:
    """What a run gave a sink: ``time`` (N,) and for every input its values (N, k)."""

    time: _Array
    inputs: tuple[_Array, ...]


@dataclass(frozen=True)
class Room:
    """The part of a face that is free of port names."""

    x: float
    y: float
    width: float
    height: float

    @property
    def middle(self) -> tuple[float, float]:
        """Centre."""
        return self.x + self.width / 2, self.y + self.height / 2

    def shrunk(self, dx: float, dy: float) -> Room:
        """The same room less a border."""
        return Room(self.x + dx, self.y + dy, max(self.width - 2 * dx, 1.0), max(self.height - 2 * dy, 1.0))


def face_size(block: Block) -> tuple[FaceShape, float, float]:
    """Outline, width and height in px that suit the face; port names may widen it."""
    match block:
        case kinds.Sum() if len(block.signs) <= 3:
            return FaceShape.CIRCLE, 34.0, 34.0
        case kinds.Gain():
            return FaceShape.TRIANGLE, 62.0, 52.0
        case kinds.Mux() | kinds.Demux():
            return FaceShape.BAR, 9.0, 48.0
        case kinds.Product() | kinds.MatrixProduct():
            return FaceShape.CARD, 46.0, 46.0
        case kinds.Display():
            return FaceShape.CARD, 104.0, max(40.0, 24.0 * block.inputs + 8)
        case kinds.Scope() | kinds.XYGraph():
            return FaceShape.CARD, 72.0, 60.0
        case kinds.JTraj() | kinds.RobotPlot() | kinds.Fkine() | kinds.ForwardDynamics() | kinds.ArmPlant():
            return FaceShape.CARD, 84.0, 64.0
        case kinds.Terminator():
            return FaceShape.CARD, 34.0, 34.0
        case kinds.TransferFunction() | kinds.StateSpace() | kinds.PID():
            return FaceShape.CARD, 96.0, 52.0
        case _:
            return FaceShape.CARD, 68.0, 50.0


def outline(shape: FaceShape, x: float, y: float, width: float, height: float, flipped: bool) -> Mark:
    """The block's body."""
    match shape:
        case FaceShape.CIRCLE:
            radius = min(width, height) / 2
            return Disc(x + width / 2, y + height / 2, radius, Tone.SURFACE, Tone.WIRE, 1.2)
        case FaceShape.TRIANGLE:
            tip, back = (x, x + width) if flipped else (x + width, x)
            corners = [(back, y), (tip, y + height / 2), (back, y + height)]
            return Polyline(corners, stroke=Tone.WIRE, width=1.2, fill=Tone.SURFACE, closed=True)
        case FaceShape.BAR:
            return Rectangle(x, y, width, height, radius=1.5, fill=Tone.WIRE)
        case FaceShape.CARD:
            return Rectangle(x, y, width, height, 5, Tone.SURFACE, Tone.WIRE, 1.2)


def face(block: Block, room: Room, trend: Trend | None) -> list[Mark]:
    """The drawing inside the block."""
    match block:
        case kinds.Gain() | kinds.MatrixGain():
            return _gain(block, room)
        case kinds.Sum():
            return []
        case kinds.Product():
            # Where all inputs are factors one sign says it; else the signs stand at the ports.
            return _words(room, "×", size=20) if set(block.operators) == {"*"} else []
        case kinds.MatrixProduct():
            return _words(room, "A·B", size=13)
        case kinds.Integrator():
            return _fraction(room, "1", "s")
        case kinds.Derivative():
            return _fraction(room, "du", "dt")
        case kinds.TransferFunction():
            return _fraction(room, _polynomial(block.numerator), _polynomial(block.denominator))
        case kinds.StateSpace():
            return _lines(room, ["x' = A x + B u", "y = C x + D u"], size=9.5)
        case kinds.PID():
            return _words(room, "PID", size=15)
        case kinds.MathFunction() | kinds.Trigonometry():
            shown = _FUNCTION_TEXT.get(block.function, f"{block.function}(u)")
            return _words(room, shown, size=13, italic=True)
        case kinds.MinMax():
            return _words(room, block.function, size=13, italic=True)
        case kinds.Constant():
            return _words(room, _value_text(block.value), size=13)
        case kinds.Scope():
            return _scope(room, trend)
        case kinds.XYGraph():
            return _xy(room, trend)
        case kinds.Display():
            return _display(room, block.inputs, trend)
        case kinds.ToWorkspace():
            return _words(room, block.variable, size=11)
        case kinds.ToFile():
            return _words(room, block.file.rpartition("/")[2], size=11)
        case kinds.RobotPlot() | kinds.Fkine() | kinds.ForwardDynamics() | kinds.ArmPlant():
            caption = "" if isinstance(block, kinds.RobotPlot) else block.title
            return _robot(room, block.robot, caption)
        case _:
            curve = CURVES.get(block.type_name())
            if curve is not None:
                return _curve(room, curve)
            text = TEXTS.get(block.type_name(), block.title)
            words = text.split()
            if len(words) > 1 and text_width(text, 10.5) > room.width - 6:
                half = (len(words) + 1) // 2
                return _lines(room, [" ".join(words[:half]), " ".join(words[half:])], size=9.5)
            return _words(room, text, size=13 if len(text) < 8 else 10.5)


def port_labels(block: Block) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """What stands beside the inputs and the outputs: names where a side has several, signs for operators."""
    match block:
        case kinds.Product():
            several = set(block.operators) != {"*"}
            return tuple("×" if o == "*" else "÷" for o in block.operators) if several else (), ()
        case kinds.Display() if block.inputs > 2:
            return (), ()
        case _:
            into = tuple(port.name for port in block.input_ports())
            out = tuple(port.name for port in block.output_ports())
            return into if len(into) > 1 else (), out if len(out) > 1 else ()


_FUNCTION_TEXT = {
    "square": "u²",
    "reciprocal": "1/u",
    "sqrt": "√u",
    "abs": "|u|",
    "exp": "exp u",
    "log": "ln u",
    "log10": "log u",
}


def _words(room: Room, text: str, *, size: float, italic: bool = False) -> list[Mark]:
    x, y = room.middle
    shown = size
    while shown > 8 and text_width(text, shown) > room.width - 6:
        shown -= 0.5
    fitted = shorten(text, shown, room.width - 4)
    return [Text(x, y + 0.36 * shown, fitted, shown, Tone.INK, "middle", italic=italic)]


def _lines(room: Room, texts: Sequence[str], *, size: float) -> list[Mark]:
    x, y = room.middle
    top = y - (len(texts) - 1) * size * 0.7
    shown = [shorten(text, size, room.width - 4) for text in texts]
    return [
        Text(x, top + k * size * 1.4 + 0.36 * size, text, size, Tone.INK, "middle")
        for k, text in enumerate(shown)
    ]


def _gain(block: kinds.Gain | kinds.MatrixGain, room: Room) -> list[Mark]:
    text = _value_text(block.gain)
    size = 12.0 if text_width(text, 12.0) < 0.52 * room.width else 9.5
    if isinstance(block, kinds.MatrixGain):
        return _words(room, "K·u" if text == "K" else text, size=13)
    if text_width(text, size) > 0.56 * room.width:
        text = "K"
    return [Text(room.x + 0.36 * room.width, room.middle[1] + 0.36 * size, text, size, Tone.INK, "middle")]


def _value_text(value: object) -> str:
    """A scalar as it is, small vectors in brackets, larger things as their size."""
    array = np.asarray(value, dtype=np.float64)
    if array.size == 1:
        return axis_number(float(f"{float(array.reshape(-1)[0]):.4g}"))
    if array.ndim == 1 and array.size <= 4:
        return "[" + " ".join(axis_number(float(f"{float(v):.3g}")) for v in array) + "]"
    return "×".join(str(n) for n in array.shape) + (" vector" if array.ndim == 1 else "")


def _polynomial(coefficients: object) -> str:
    """``s² + 2s + 1``; a polynomial too long for a face becomes its degree."""
    values = np.asarray(coefficients, dtype=np.float64).reshape(-1).tolist()
    power = len(values) - 1
    terms: list[str] = []
    for k, value in enumerate(values):
        if value == 0 and len(values) > 1:
            continue
        degree = power - k
        symbol = "" if degree == 0 else "s" + ("" if degree == 1 else _superscript(degree))
        magnitude = axis_number(abs(float(f"{value:.3g}")))
        text = symbol if symbol and magnitude == "1" else magnitude + symbol
        sign = "−" if value < 0 else "+"
        terms.append(text if not terms and value >= 0 else f"{sign} {text}" if terms else f"−{text}")
    return " ".join(terms) or "0"


def _superscript(number: int) -> str:
    return "".join("⁰¹²³⁴⁵⁶⁷⁸⁹"[int(digit)] for digit in str(number))


def _fraction(room: Room, above: str, below: str) -> list[Mark]:
    x, y = room.middle
    size = 13.0
    while size > 8 and max(text_width(above, size), text_width(below, size)) > room.width - 10:
        size -= 0.5
    above, below = (shorten(text, size, room.width - 8) for text in (above, below))
    half = max(text_width(above, size), text_width(below, size)) / 2 + 3
    return [
        Text(x, y - 5, above, size, Tone.INK, "middle"),
        Polyline([(x - half, y), (x + half, y)], stroke=Tone.INK, width=1.1, sharp=True),
        Text(x, y + size, below, size, Tone.INK, "middle"),
    ]


def _curve(room: Room, points: Sequence[tuple[float, float]]) -> list[Mark]:
    box = room.shrunk(min(12.0, 0.18 * room.width), min(12.0, 0.22 * room.height))
    line = [(box.x + u * box.width, box.y + (1 - v) * box.height) for u, v in points]
    left, top, right, bottom = box.x - 3, box.y - 3, box.x + box.width + 3, box.y + box.height + 3
    axes = [(left, top), (left, bottom), (right, bottom)]
    return [
        Polyline(axes, stroke=Tone.HAIRLINE, width=1.0, sharp=True),
        Polyline(line, stroke=Tone.TRACE_0, width=1.8),
    ]


def _screen(room: Room) -> tuple[Room, Mark]:
    box = room.shrunk(6.0, 6.0)
    return box.shrunk(3.0, 4.0), Rectangle(
        box.x, box.y, box.width, box.height, 3, Tone.SUNKEN, Tone.HAIRLINE, 1.0
    )


def _scope(room: Room, trend: Trend | None) -> list[Mark]:
    box, screen = _screen(room)
    marks: list[Mark] = [screen]
    if trend is None or len(trend.time) < 2:
        points = [(u, 0.5 + 0.35 * math.sin(7 * u)) for u in (k / 24 for k in range(25))]
        line = [(box.x + u * box.width, box.y + (1 - v) * box.height) for u, v in points]
        return [screen, Polyline(line, stroke=Tone.MUTED, width=1.2)]
    several = len(trend.inputs) > 1
    columns = [
        (number if several and values.shape[1] == 1 else k, values[:, k])
        for number, values in enumerate(trend.inputs)
        for k in range(min(values.shape[1], 8))
    ]
    for index, values in columns:
        time, thin = thin_out(trend.time, values, round(box.width))
        marks.append(_mini(box, time, thin, [v for _, v in columns], index))
    return marks


def _mini(box: Room, x: _Array, y: _Array, together: Sequence[_Array], index: int) -> Mark:
    low, high = (float(f(np.concatenate(together))) for f in (np.nanmin, np.nanmax))
    left, right = float(np.nanmin(x)), float(np.nanmax(x))
    px = box.x + (x - left) / ((right - left) or 1.0) * box.width
    share = (y - low) / (high - low) if high > low else np.full(len(y), 0.5)
    py = box.y + (1 - share) * box.height
    return Polyline(np.column_stack([px, py]), stroke=trace_tone(index), width=1.3)


def _xy(room: Room, trend: Trend | None) -> list[Mark]:
    box, screen = _screen(room)
    if trend is None or len(trend.time) < 2:
        circle = [(math.cos(a), math.sin(2 * a)) for a in (2 * math.pi * k / 40 for k in range(41))]
        x, y = box.middle
        line = [(x + 0.45 * box.width * u, y + 0.45 * box.height * v) for u, v in circle]
        return [screen, Polyline(line, stroke=Tone.MUTED, width=1.2)]
    pick = np.unique(np.linspace(0, len(trend.time) - 1, 600).astype(int))
    x, y = trend.inputs[0][pick, 0], trend.inputs[1][pick, 0]
    return [screen, _mini(box, x, y, [y], 0)]


def _display(room: Room, count: int, trend: Trend | None) -> list[Mark]:
    marks: list[Mark] = []
    height = room.height / count
    for k in range(count):
        box = Room(room.x, room.y + k * height, room.width, height).shrunk(6.0, 3.5)
        marks.append(Rectangle(box.x, box.y, box.width, box.height, 3, Tone.SUNKEN, Tone.HAIRLINE, 1.0))
        text = "…"
        if trend is not None and len(trend.time):
            values = trend.inputs[k][-1]
            text = axis_number(float(f"{values[0]:.5g}")) if len(values) == 1 else f"{len(values)} values"
        size = min(11.0, box.height - 4)
        marks.append(
            Text(box.x + box.width - 5, box.middle[1] + 0.36 * size, text, size, Tone.INK, "end", mono=True)
        )
    return marks


def _robot(room: Room, robot: Robot, caption: str) -> list[Mark]:
    """The robot's own joints and links as a small figure of sticks."""
    heavy = not caption
    box = room.shrunk(7.0, 7.0)
    if caption:
        box = Room(box.x, box.y + 8, box.width, box.height - 8)
    frames = link_frames(robot, [0.35 + 0.25 * k if k % 2 else 0.3 for k in range(robot.n)])
    row = {link.name: k for k, link in enumerate(robot.links, start=1)}
    points = frames[:, :3, 3]
    camera = Camera.framing(points + 1e-6 * np.arange(3), box.width, box.height, margin=3.0)
    flat = camera.flat(points) + np.array([box.x, box.y])
    marks: list[Mark] = []
    for k, link in enumerate(robot.links, start=1):
        a, b = flat[row[link.parent] if link.parent is not None else 0], flat[k]
        if float(np.hypot(*(b - a))) > 1.5:
            marks.append(Polyline(np.stack([a, b]), stroke=Tone.PAINT, width=5.0 if heavy else 4.0))
    for k in range(len(robot.links)):
        x, y = flat[k].tolist()
        marks.append(Disc(x, y, 2.7 if heavy else 2.3, fill=Tone.GRAPHITE))
    x, y = flat[0].tolist()
    base = (("M", x - 7, y + 5), ("L", x + 7, y + 5), ("L", x + 3.5, y), ("L", x - 3.5, y), ("Z",))
    if caption:
        marks.append(Text(room.x + 6, room.y + 13, caption, 9.5, Tone.MUTED))
    return [Curve(base, stroke=None, fill=Tone.GRAPHITE), *marks]

"""The columns of the robot editor's tables, declared once for page and edits.

The tables are those of the paper: ``kinematics`` is its Table 1 (D-H row, ranges, speeds), ``dynamics`` its
Table 2 (mass, centre, inertia, motor), both in :mod:`armblocks.studio.robots.link_columns`; what a robot has
once, as base, tool and gravity, is here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import Generic, TypeVar

from armblocks.robot import FrictionModel, Link, Robot
from armblocks.spatial import Transform, transl, trotx, troty, trotz

Value = float | str | None
Owner = TypeVar("Owner", Link, Robot)


class Quantity(Enum):
    """What a cell holds, as far as reading and showing it goes. Values are SI, whatever the table shows."""

    NUMBER = "number"
    ANGLE = "angle"
    """rad; shown in degrees or radians."""
    COORDINATE = "coordinate"
    """Of a joint: rad where it turns, m where it slides."""
    RATE = "rate"
    """Of a joint: rad/s or m/s."""
    TEXT = "text"
    CHOICE = "choice"


@dataclass(frozen=True, kw_only=True)
class Column(Generic[Owner]):
    """One thing that can be typed: of every link, or of the robot.

    ``read`` gives the SI value, ``None`` where there is none; ``write`` a changed owner, and is given
    ``None`` only where the column is ``optional``. ``locked`` says why there is nothing to type, or ``""``.
    """

    name: str
    title: str
    doc: str
    read: Callable[[Owner], Value]
    write: Callable[[Owner, Value], Owner]
    quantity: Quantity = Quantity.NUMBER
    unit: str = ""
    optional: bool = False
    choices: tuple[str, ...] = ()
    group: str = ""
    """Columns of one group stand together under its heading."""
    locked: Callable[[Owner], str] = lambda _: ""


def number_of(value: Value) -> float:
    """The number of a cell; 0 where it is empty."""
    return float(value or 0.0)


# -- the robot -----------------------------------------------------------------------------------------------

_FRAME_DOCS = {
    "base": "the robot's base in the world",
    "tool": "the tool in the frame of the last link",
}


def _frame_column(frame: str, index: int) -> Column[Robot]:
    letter = ("x", "y", "z", "roll", "pitch", "yaw")[index]
    angular = index > 2

    def numbers(robot: Robot) -> list[float]:
        transform: Transform = getattr(robot, frame)
        return [*transform.translation, *transform.rpy]

    def write(robot: Robot, value: Value) -> Robot:
        six = numbers(robot)
        six[index] = number_of(value)
        x, y, z, roll, pitch, yaw = six
        made = transl(x, y, z) @ trotz(yaw) @ troty(pitch) @ trotx(roll)
        return replace(robot, base=made) if frame == "base" else replace(robot, tool=made)

    turn = "; R = Rz(yaw) Ry(pitch) Rx(roll)" if angular else ""
    return Column(
        name=f"{frame}_{letter}",
        title=letter,
        doc=f"{letter} of {_FRAME_DOCS[frame]}{turn}",
        quantity=Quantity.ANGLE if angular else Quantity.NUMBER,
        unit="rad" if angular else "m",
        group=frame.capitalize(),
        read=lambda robot: numbers(robot)[index],
        write=write,
    )


def _gravity_column(axis: int) -> Column[Robot]:
    def write(robot: Robot, value: Value) -> Robot:
        gravity = list(robot.gravity)
        gravity[axis] = number_of(value)
        return replace(robot, gravity=tuple(gravity))

    return Column(
        name=f"gravity_{'xyz'[axis]}",
        title="xyz"[axis],
        doc=f"{'xyz'[axis]} of the acceleration of a falling body, in the world frame",
        unit="m/s²",
        group="Gravity",
        read=lambda robot: robot.gravity[axis],
        write=write,
    )


def _text_column(name: str, doc: str) -> Column[Robot]:
    return Column(
        name=name,
        title=name,
        doc=doc,
        quantity=Quantity.TEXT,
        read=lambda robot: str(getattr(robot, name)),
        write=lambda robot, value: replace(robot, **{name: str(value or "")}),  # pyright: ignore[reportArgumentType]
    )


ROBOT: tuple[Column[Robot], ...] = (
    _text_column("name", "what the robot is called"),
    _text_column("manufacturer", "who makes it"),
    _text_column("comment", "where its numbers come from"),
    Column(
        name="friction_model",
        title="friction",
        doc="how motor friction comes through the gear, by release of the Robotics Toolbox",
        quantity=Quantity.CHOICE,
        choices=tuple(model.value for model in FrictionModel),
        read=lambda robot: robot.friction_model.value,
        write=lambda robot, value: replace(robot, friction_model=FrictionModel(str(value))),
    ),
    *(_frame_column("base", index) for index in range(6)),
    *(_frame_column("tool", index) for index in range(6)),
    *(_gravity_column(axis) for axis in range(3)),
)

ROBOT_COLUMNS: Mapping[str, Column[Robot]] = {column.name: column for column in ROBOT}

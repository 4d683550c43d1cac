"""The columns of the robot editor's tables, declared once for front end and edits.

``kinematics`` has the D-H row, ranges and speeds of each link; ``dynamics`` has its mass, centre of mass,
inertia and motor. Both are in :mod:`armblocks.studio.robots.link_columns`. This file has the properties of
the whole robot, such as base, tool and gravity.
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
    """Type of a cell, which determines how it is parsed and displayed. Values are SI."""

    NUMBER = "number"
    ANGLE = "angle"
    """rad; displayed in degrees or radians."""
    COORDINATE = "coordinate"
    """Joint coordinate: rad for a revolute joint, m for a prismatic joint."""
    RATE = "rate"
    """Joint speed: rad/s or m/s."""
    TEXT = "text"
    CHOICE = "choice"


@dataclass(frozen=True, kw_only=True)
class Column(Generic[Owner]):
    """One editable property, of every link or of the robot.

    ``read`` returns the SI value, ``None`` for an empty cell. ``write`` returns a changed owner; it receives
    ``None`` only if the column is ``optional``. ``locked`` returns why the cell cannot be edited, or ``""``.
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
    """Columns of one group are adjacent, under a common heading."""
    locked: Callable[[Owner], str] = lambda _: ""


def number_of(value: Value) -> float:
    """Return the number in a cell; 0 for an empty cell."""
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
        coordinates = numbers(robot)
        coordinates[index] = number_of(value)
        x, y, z, roll, pitch, yaw = coordinates
        transform = transl(x, y, z) @ trotz(yaw) @ troty(pitch) @ trotx(roll)
        return replace(robot, base=transform) if frame == "base" else replace(robot, tool=transform)

    convention = "; R = Rz(yaw) Ry(pitch) Rx(roll)" if angular else ""
    return Column(
        name=f"{frame}_{letter}",
        title=letter,
        doc=f"{letter} of {_FRAME_DOCS[frame]}{convention}",
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
    _text_column("name", "name of the robot"),
    _text_column("manufacturer", "manufacturer of the robot"),
    _text_column("comment", "source of the data"),
    Column(
        name="friction_model",
        title="friction",
        doc="model of motor friction at the joint, by release of the Robotics Toolbox",
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

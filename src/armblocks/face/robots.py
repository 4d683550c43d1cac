"""Robots by name or path."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from armblocks import formats
from armblocks.errors import check_type
from armblocks.face.arm import Arm
from armblocks.files import write_atomically
from armblocks.robot import FrictionModel, Robot


def load_robot(
    name_or_path: str | PathLike[str],
    *,
    name: str | None = None,
    friction_model: FrictionModel | str | None = None,
) -> Arm:
    """A shipped robot by name (``"kr180"``), or a robot from a file (``.json``, a toolbox script ``.m``).

    ``name`` selects one of several robots in a script. ``friction_model``: the formula of another toolbox
    release, see :class:`FrictionModel`; by default that of the file. Raises UnknownNameError for a name that
    is not shipped, FormatError for a file that cannot be read.
    """
    arm = Arm(formats.load_robot(name_or_path, name=name))
    return arm if friction_model is None else arm.with_friction_model(friction_model)


def save_robot(robot: Robot | Arm, path: str | PathLike[str]) -> Path:
    """Write a robot as canonical JSON, atomically; returns the path."""
    check_type(robot, (Robot, Arm), "a Robot or an Arm", where="save_robot")
    target = Path(path)
    write_atomically(target, formats.write_robot(robot.robot if isinstance(robot, Arm) else robot))
    return target


def list_robots() -> tuple[str, ...]:
    """Names of the shipped robots."""
    return formats.list_robots()

"""Robots by name or path."""

from __future__ import annotations

from collections.abc import Mapping
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
    tip: str | None = None,
    packages: Mapping[str, str | PathLike[str]] | None = None,
    arguments: Mapping[str, object] | None = None,
) -> Arm:
    """A shipped robot by name (``"kr180"``), or a robot from a file.

    Files: ``.json``, ``.urdf``, ``.xacro``, ``.sdf``, MJCF ``.xml``, toolbox scripts ``.m``, and the CAD
    exports of Simscape Multibody (``.xml``, ``_DataFile.m``).

    - ``name_or_path``: a text with a path separator or with the suffix of a robot file is a path, any other
      text is the name of a shipped robot.
    - ``name``: selects one of several robots of a script or a world.
    - ``friction_model``: the formula of another toolbox release, see :class:`FrictionModel`. By default the
      formula of the file.
    - ``tip``: the link that carries the tool. If the joint of this link moves, its coordinate is the last
      entry of q. By default, in URDF, SDF and MJCF files and in CAD exports, the end of the chain with the
      most degrees of freedom; in other files, the last link.
    - ``packages``: folders of ROS packages and Gazebo models by name, for ``package://`` and ``model://``.
      Other packages and models are searched for in the folders above the file.
    - ``arguments``: values of the arguments of a xacro file, which needs the extra ``xacro``.

    Raises UnknownNameError for a name that is not shipped and a tip that is not in the file, FormatError for
    a file that cannot be read.
    """
    arm = Arm(formats.load_robot(name_or_path, name=name, tip=tip, packages=packages, arguments=arguments))
    return arm if friction_model is None else arm.with_friction_model(friction_model)


def given_arm(arm: Arm | Robot | str | PathLike[str], where: str) -> Arm:
    """The arm of an argument of the function ``where``: an arm, a robot, the name of a shipped robot, or the
    path of a file."""
    if isinstance(arm, Arm):
        return arm
    if isinstance(arm, str | PathLike):
        return load_robot(arm)
    check_type(arm, Robot, "an Arm, a Robot, or the name or path of a robot", where=where)
    return Arm(arm)


def save_robot(robot: Robot | Arm | str | PathLike[str], path: str | PathLike[str]) -> Path:
    """Write a robot atomically; returns the path. ``robot`` is also the name or the path of a robot.

    The suffix selects the format: ``.urdf``, ``.sdf``, ``.xml`` or ``.mjcf`` (MJCF), else canonical JSON.
    JSON contains all data of a robot. Data that another format cannot store are omitted with a warning.
    Raises FormatError for joint types that the format does not have.
    """
    described = given_arm(robot, "save_robot").robot
    target = Path(path)
    write_atomically(target, formats.robot_bytes(described, target.name))
    return target


def list_robots() -> tuple[str, ...]:
    """Names of the shipped robots."""
    return formats.list_robots()

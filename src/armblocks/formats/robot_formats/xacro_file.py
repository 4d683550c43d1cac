"""URDF with the macros of xacro."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from armblocks.formats.robot_format import RobotFormat

if TYPE_CHECKING:
    from armblocks.formats.file_findings import FileContext
    from armblocks.robot import Robot


def _read(data: bytes, name: str, context: FileContext) -> Mapping[str, Robot]:
    from armblocks.formats.urdf.reader import robot_of
    from armblocks.formats.urdf.xacro_expansion import expanded

    robot = robot_of(expanded(data, name, context), context)
    return {robot.name: robot}


XACRO = RobotFormat(name="xacro", suffixes=(".xacro",), max_bytes=4 * 2**20, read_in_context=_read)

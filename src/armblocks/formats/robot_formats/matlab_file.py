"""Robot scripts of MATLAB's Robotics Toolbox."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from armblocks.formats.robot_format import RobotFormat

if TYPE_CHECKING:
    from armblocks.robot import Robot


def _read(data: bytes, name: str) -> Mapping[str, Robot]:
    from armblocks.formats.matlab_script import read_script

    return read_script(data, name).robots


MATLAB_SCRIPT = RobotFormat(name="MATLAB robot script", suffixes=(".m",), max_bytes=2**20, read=_read)

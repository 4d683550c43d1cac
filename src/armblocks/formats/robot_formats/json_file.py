"""The project's own format of robots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from armblocks.formats.robot_format import RobotFormat

if TYPE_CHECKING:
    from armblocks.formats.file_corrections import Correction
    from armblocks.formats.file_findings import FileFinding
    from armblocks.robot import Robot


def _read(data: bytes, name: str) -> Mapping[str, Robot]:
    from armblocks.formats.robot_json import read_robot

    robot = read_robot(data, name)
    return {robot.name: robot}


def _write(robot: Robot) -> bytes:
    from armblocks.formats.robot_json import write_robot

    return write_robot(robot)


def _correct(data: bytes, name: str, findings: Sequence[FileFinding]) -> Correction:
    from armblocks.formats.robot_json_corrections import corrected_json

    return corrected_json(data, name, findings)


ROBOT_JSON = RobotFormat(
    name="armblocks robot",
    suffixes=(".json",),
    max_bytes=16 * 2**20,
    read=_read,
    write=_write,
    correct=_correct,
)

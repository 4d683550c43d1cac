"""MJCF, the model format of MuJoCo."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from armblocks.formats.robot_format import RobotFormat

if TYPE_CHECKING:
    from armblocks.formats.file_corrections import Correction
    from armblocks.formats.file_findings import FileContext, FileFinding
    from armblocks.robot import Robot


def _read(data: bytes, name: str, context: FileContext) -> Mapping[str, Robot]:
    from armblocks.formats.mjcf.reader import read_mjcf

    robot = read_mjcf(data, name, context)
    return {robot.name: robot}


def _write(robot: Robot) -> bytes:
    from armblocks.formats.mjcf.writer import write_mjcf

    return write_mjcf(robot)


def _correct(data: bytes, name: str, findings: Sequence[FileFinding]) -> Correction:
    from armblocks.formats.mjcf.corrections import edits_of
    from armblocks.formats.xml_corrections import corrected_xml

    return corrected_xml(data, name, findings, edits_of)


MJCF = RobotFormat(
    name="MJCF",
    suffixes=(".xml", ".mjcf"),
    max_bytes=16 * 2**20,
    read_in_context=_read,
    write=_write,
    correct=_correct,
)

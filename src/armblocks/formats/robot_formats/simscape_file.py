"""CAD exports of Simscape Multibody: import XML, and data files of imported models."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING

from armblocks.formats.robot_format import RobotFormat

if TYPE_CHECKING:
    from armblocks.formats.file_findings import FileContext
    from armblocks.robot import Robot

_ROOT = re.compile(
    rb"<(?:\w+:)?(?:SimscapeMultibodyImportXML|SimMechanicsImportXML|PhysicalModelingXMLFile)\b"
)


def _is_import_xml(data: bytes) -> bool:
    return _ROOT.search(data[:20_000].replace(b"\0", b"")) is not None


def _is_data_file(data: bytes) -> bool:
    return b".RigidTransform(" in data


def _read_xml(data: bytes, name: str, context: FileContext) -> Mapping[str, Robot]:
    from armblocks.formats.simscape.reader import read_import_xml

    robot = read_import_xml(data, name, context)
    return {robot.name: robot}


def _read_data_file(data: bytes, name: str, context: FileContext) -> Mapping[str, Robot]:
    from armblocks.formats.simscape.reader import read_smi_data

    robot = read_smi_data(data, name, context)
    return {robot.name: robot}


SIMSCAPE_XML = RobotFormat(
    name="Simscape Multibody XML",
    suffixes=(".xml",),
    max_bytes=16 * 2**20,
    read_in_context=_read_xml,
    recognises=_is_import_xml,
)
SIMSCAPE_DATA = RobotFormat(
    name="Simscape Multibody data file",
    suffixes=(".m",),
    max_bytes=4 * 2**20,
    read_in_context=_read_data_file,
    recognises=_is_data_file,
)

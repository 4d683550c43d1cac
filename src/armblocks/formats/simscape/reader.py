"""Robots from the CAD exports of Simscape Multibody."""

from __future__ import annotations

from armblocks.formats.file_findings import FileContext
from armblocks.formats.simscape.assembly import robot_of
from armblocks.formats.simscape.data_file import read_data_file
from armblocks.formats.simscape.import_xml import read_assembly
from armblocks.robot import Robot


def read_import_xml(data: bytes, file: str, context: FileContext) -> Robot:
    """The robot of an import XML file. Raises ``FormatError`` for invalid content and closed loops."""
    return robot_of(read_assembly(data, file, context), file, context)


def read_smi_data(data: bytes, file: str, context: FileContext) -> Robot:
    """The robot of a data file. Raises ``FormatError`` for invalid content and closed loops."""
    return robot_of(read_data_file(data, file, context), file, context)

"""Reading and writing of robots and diagrams. Readers execute no code in files, except Python functions of
diagrams that the caller trusts."""

from typing import TYPE_CHECKING

from armblocks.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from armblocks.formats.diagram_files import (
        example_descriptions,
        load_diagram,
        load_library,
        read_diagram,
        write_diagram,
        write_library,
    )
    from armblocks.formats.diagram_json import diagram_from_bytes, diagram_to_bytes
    from armblocks.formats.diagram_python import diagram_to_python
    from armblocks.formats.document_kinds import DocumentKind, kind_of_data, kind_of_document
    from armblocks.formats.matlab_script import Script, read_script
    from armblocks.formats.robot_correction import CorrectedFile, correct_robot
    from armblocks.formats.robot_files import load_robot, read_robots, robot_bytes
    from armblocks.formats.robot_format import RobotFormat
    from armblocks.formats.robot_formats import ROBOT_FORMATS, ROBOT_SUFFIXES
    from armblocks.formats.robot_json import read_robot, write_robot
    from armblocks.formats.robot_lint import lint_robot
    from armblocks.formats.robot_references import ResolveRobot
    from armblocks.formats.shipped import list_examples, list_libraries, list_robots
    from armblocks.formats.table_files import load_table
else:
    __getattr__ = lazy_exports(
        __name__,
        {
            "CorrectedFile": "armblocks.formats.robot_correction",
            "DocumentKind": "armblocks.formats.document_kinds",
            "ROBOT_FORMATS": "armblocks.formats.robot_formats",
            "ROBOT_SUFFIXES": "armblocks.formats.robot_formats",
            "ResolveRobot": "armblocks.formats.robot_references",
            "RobotFormat": "armblocks.formats.robot_format",
            "Script": "armblocks.formats.matlab_script",
            "correct_robot": "armblocks.formats.robot_correction",
            "diagram_from_bytes": "armblocks.formats.diagram_json",
            "diagram_to_bytes": "armblocks.formats.diagram_json",
            "diagram_to_python": "armblocks.formats.diagram_python",
            "example_descriptions": "armblocks.formats.diagram_files",
            "kind_of_data": "armblocks.formats.document_kinds",
            "kind_of_document": "armblocks.formats.document_kinds",
            "lint_robot": "armblocks.formats.robot_lint",
            "list_examples": "armblocks.formats.shipped",
            "list_libraries": "armblocks.formats.shipped",
            "list_robots": "armblocks.formats.shipped",
            "load_diagram": "armblocks.formats.diagram_files",
            "load_library": "armblocks.formats.diagram_files",
            "load_robot": "armblocks.formats.robot_files",
            "load_table": "armblocks.formats.table_files",
            "read_diagram": "armblocks.formats.diagram_files",
            "read_robot": "armblocks.formats.robot_json",
            "read_robots": "armblocks.formats.robot_files",
            "read_script": "armblocks.formats.matlab_script",
            "robot_bytes": "armblocks.formats.robot_files",
            "write_diagram": "armblocks.formats.diagram_files",
            "write_library": "armblocks.formats.diagram_files",
            "write_robot": "armblocks.formats.robot_json",
        },
    )

__all__ = [
    "ROBOT_FORMATS",
    "ROBOT_SUFFIXES",
    "CorrectedFile",
    "DocumentKind",
    "ResolveRobot",
    "RobotFormat",
    "Script",
    "correct_robot",
    "diagram_from_bytes",
    "diagram_to_bytes",
    "diagram_to_python",
    "example_descriptions",
    "kind_of_data",
    "kind_of_document",
    "lint_robot",
    "list_examples",
    "list_libraries",
    "list_robots",
    "load_diagram",
    "load_library",
    "load_robot",
    "load_table",
    "read_diagram",
    "read_robot",
    "read_robots",
    "read_script",
    "robot_bytes",
    "write_diagram",
    "write_library",
    "write_robot",
]

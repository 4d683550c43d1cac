"""Files and descriptions: robots and diagrams, read and written. Nothing in a file is ever executed."""

from armblocks.formats.diagram_files import list_examples, load_diagram, read_diagram, write_diagram
from armblocks.formats.diagram_json import diagram_from_bytes, diagram_to_bytes
from armblocks.formats.matlab_script import Script, read_script
from armblocks.formats.robot_files import ROBOT_FORMATS, list_robots, load_robot
from armblocks.formats.robot_format import RobotFormat
from armblocks.formats.robot_json import read_robot, write_robot
from armblocks.formats.robot_references import ResolveRobot

__all__ = [
    "ROBOT_FORMATS",
    "ResolveRobot",
    "RobotFormat",
    "Script",
    "diagram_from_bytes",
    "diagram_to_bytes",
    "list_examples",
    "list_robots",
    "load_diagram",
    "load_robot",
    "read_diagram",
    "read_robot",
    "read_script",
    "write_diagram",
    "write_robot",
]

"""The file formats of robots: every ``RobotFormat`` in a file of this folder is read.

These files import nothing heavy before a file is read, so that the suffixes are known at once.
"""

from armblocks.formats.robot_format import RobotFormat
from armblocks.package_folder import values_in

ROBOT_FORMATS: tuple[RobotFormat, ...] = tuple(
    sorted(values_in(__name__, RobotFormat), key=lambda format: format.name.casefold())
)
"""Every format of robot files, by name."""

ROBOT_SUFFIXES: tuple[str, ...] = tuple(suffix for format in ROBOT_FORMATS for suffix in format.suffixes)
"""The suffixes of robot files, in lower case with the dot."""

"""The file formats of robots: every ``RobotFormat`` in a file of this folder is available.

These files import large modules only when a file is read, so that the suffixes are available quickly.
"""

from armblocks.formats.robot_format import RobotFormat
from armblocks.package_folder import values_in

ROBOT_FORMATS: tuple[RobotFormat, ...] = tuple(
    sorted(values_in(__name__, RobotFormat), key=lambda format: format.name.casefold())
)
"""All formats of robot files, by name."""

ROBOT_SUFFIXES: tuple[str, ...] = tuple(
    dict.fromkeys(suffix for format in ROBOT_FORMATS for suffix in format.suffixes)
)
"""The suffixes of robot files, in lower case with the dot."""

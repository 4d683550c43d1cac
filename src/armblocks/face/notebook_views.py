"""Notebook views of robots and diagrams, which their classes refer to by name."""

from __future__ import annotations

from armblocks.diagram import Diagram
from armblocks.face.robot_html import robot_html
from armblocks.robot import Robot


def diagram_svg(diagram: Diagram) -> str:
    """The top-level sheet, in the viewer's colour scheme."""
    from armblocks.drawing import drawing_bytes

    return drawing_bytes(diagram, "svg").decode()


def robot_view(robot: Robot) -> str:
    """The arm with all joints at zero, and its table."""
    from armblocks.rendering import arm_picture_svg

    return robot_html(robot, arm_picture_svg(robot, robot.neutral.tolist()))

"""Figures, the report page, and drawings of arms and diagrams: what people look at after a run."""

from armblocks.report.arm_picture import arm_picture, arm_picture_svg, moments_picture
from armblocks.report.diagram_drawing import block_picture, diagram_picture, diagram_svg
from armblocks.report.writing import ReportFiles, write_report

__all__ = [
    "ReportFiles",
    "arm_picture",
    "arm_picture_svg",
    "block_picture",
    "diagram_picture",
    "diagram_svg",
    "moments_picture",
    "write_report",
]

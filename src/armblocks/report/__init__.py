"""Figures, the report page, and drawings of arms and diagrams: what people look at after a run."""

from armblocks.report.arm_picture import arm_picture, arm_picture_svg, moments_picture
from armblocks.report.diagram_drawing import block_picture, diagram_picture, diagram_svg
from armblocks.report.diagram_file import DRAWING_FORMATS, draw_diagram, drawing_bytes
from armblocks.report.frequency_charts import bode_picture, nyquist_picture
from armblocks.report.linear_report import write_linear_report
from armblocks.report.response_charts import impulse_picture, step_picture
from armblocks.report.root_charts import pole_zero_picture, root_locus_picture
from armblocks.report.writing import ReportFiles, write_report

__all__ = [
    "DRAWING_FORMATS",
    "ReportFiles",
    "arm_picture",
    "arm_picture_svg",
    "block_picture",
    "bode_picture",
    "diagram_picture",
    "diagram_svg",
    "draw_diagram",
    "drawing_bytes",
    "impulse_picture",
    "moments_picture",
    "nyquist_picture",
    "pole_zero_picture",
    "root_locus_picture",
    "step_picture",
    "write_linear_report",
    "write_report",
]

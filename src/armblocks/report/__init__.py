"""Figures, the report page, and drawings of arms and diagrams: what people look at after a run."""

from typing import TYPE_CHECKING

from armblocks.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from armblocks.report.arm_drawing import arm_picture, arm_picture_svg, moments_picture
    from armblocks.report.diagram_drawing import block_picture, diagram_picture, diagram_svg
    from armblocks.report.diagram_file import DRAWING_FORMATS, draw_diagram, drawing_bytes
    from armblocks.report.frequency_charts import bode_picture, nyquist_picture
    from armblocks.report.linear_report import write_linear_report
    from armblocks.report.response_charts import impulse_picture, step_picture
    from armblocks.report.root_charts import pole_zero_picture, root_locus_picture
    from armblocks.report.writing import ReportFiles, write_report
else:
    __getattr__ = lazy_exports(
        __name__,
        {
            "DRAWING_FORMATS": "armblocks.report.diagram_file",
            "ReportFiles": "armblocks.report.writing",
            "arm_picture": "armblocks.report.arm_drawing",
            "arm_picture_svg": "armblocks.report.arm_drawing",
            "block_picture": "armblocks.report.diagram_drawing",
            "bode_picture": "armblocks.report.frequency_charts",
            "diagram_picture": "armblocks.report.diagram_drawing",
            "diagram_svg": "armblocks.report.diagram_drawing",
            "draw_diagram": "armblocks.report.diagram_file",
            "drawing_bytes": "armblocks.report.diagram_file",
            "impulse_picture": "armblocks.report.response_charts",
            "moments_picture": "armblocks.report.arm_drawing",
            "nyquist_picture": "armblocks.report.frequency_charts",
            "pole_zero_picture": "armblocks.report.root_charts",
            "root_locus_picture": "armblocks.report.root_charts",
            "step_picture": "armblocks.report.response_charts",
            "write_linear_report": "armblocks.report.linear_report",
            "write_report": "armblocks.report.writing",
        },
    )

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

"""Reports of runs and linear systems: figures, charts, tables, ``report.html`` and data files."""

from typing import TYPE_CHECKING

from armblocks.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from armblocks.report.charts.frequency_charts import bode_picture, nyquist_picture
    from armblocks.report.charts.response_charts import impulse_picture, step_picture
    from armblocks.report.charts.root_charts import pole_zero_picture, root_locus_picture
    from armblocks.report.linear_report import write_linear_report
    from armblocks.report.writing import ReportFiles, write_report
else:
    __getattr__ = lazy_exports(
        __name__,
        {
            "ReportFiles": "armblocks.report.writing",
            "bode_picture": "armblocks.report.charts.frequency_charts",
            "impulse_picture": "armblocks.report.charts.response_charts",
            "nyquist_picture": "armblocks.report.charts.frequency_charts",
            "pole_zero_picture": "armblocks.report.charts.root_charts",
            "root_locus_picture": "armblocks.report.charts.root_charts",
            "step_picture": "armblocks.report.charts.response_charts",
            "write_linear_report": "armblocks.report.linear_report",
            "write_report": "armblocks.report.writing",
        },
    )

__all__ = [
    "ReportFiles",
    "bode_picture",
    "impulse_picture",
    "nyquist_picture",
    "pole_zero_picture",
    "root_locus_picture",
    "step_picture",
    "write_linear_report",
    "write_report",
]

"""Errors of the studio when the process that writes a report fails."""

from __future__ import annotations

import pytest

from armblocks.errors import SimulationError
from armblocks.studio.runs import report as run_report

REMEDY = "shorten the run, or use 'armblocks run'"


@pytest.mark.parametrize(
    ("sent", "what"),
    [(b"", "the report exceeded its time or memory limit"), (b"Eno room", "no room")],
)
def test_a_failed_report_raises_an_error_with_reason_and_remedy(sent: bytes, what: str) -> None:
    with pytest.raises(SimulationError) as failed:
        run_report._page(sent)
    assert (failed.value.what, failed.value.where, failed.value.fix) == (what, "report", REMEDY)

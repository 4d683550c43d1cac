"""Errors of the studio when the process that writes a report fails."""

from __future__ import annotations

from multiprocessing import Pipe

import pytest

from armblocks.errors import SimulationError
from armblocks.studio.runs import report as run_report

WAY_OUT = "shorten the run, or use 'armblocks run'"


@pytest.mark.parametrize(
    ("sent", "what"),
    [(b"", "the report exceeded its time or memory limit"), (b"Eno room", "no room")],
)
def test_a_failed_report_raises_an_error_with_reason_and_remedy(sent: bytes, what: str) -> None:
    ours, theirs = Pipe(duplex=False)
    if sent:
        theirs.send_bytes(sent)
    theirs.close()
    with pytest.raises(SimulationError) as failed:
        run_report._received(ours)
    assert (failed.value.what, failed.value.where, failed.value.fix) == (what, "report", WAY_OUT)

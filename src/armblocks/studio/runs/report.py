"""The report of a run, as from the command line, written in a separate process.

The model is run again with the initial values of the run; the same steps give the same numbers. Parameter
changes during the run and its interruption are not repeated.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from armblocks.errors import ArmblocksError, SimulationError
from armblocks.studio.runs.worker import begin_run, limit_process
from armblocks.studio.runs.workers import process_reply

MAX_SECONDS = 300.0


async def report_of(job: Mapping[str, Any]) -> bytes:
    """Return the report as HTML, for the job of a run (see :mod:`armblocks.studio.runs.worker`).

    Raises ``SimulationError`` with the error of the run or of the report, or if the report exceeds its time
    or memory limit.
    """
    return _page(await process_reply(send_report, job, MAX_SECONDS))


def _page(reply: bytes) -> bytes:
    """The page in a reply of the process. Raises ``SimulationError``."""
    if not reply:
        raise SimulationError(
            "the report exceeded its time or memory limit",
            where="report",
            fix="shorten the run, or use 'armblocks run'",
        )
    if reply[:1] == b"E":
        raise SimulationError(
            reply[1:].decode(), where="report", fix="shorten the run, or use 'armblocks run'"
        )
    return reply[1:]


def send_report(pipe: Connection, job: dict[str, Any]) -> None:
    """Run the model, write the report and send it; executed in the separate process."""
    limit_process()
    from armblocks.report import write_report

    try:
        run = begin_run(job).run
        run.advance()
        diagram, result = run.diagram, run.result()
        with tempfile.TemporaryDirectory() as folder:
            page = write_report(Path(folder), diagram, result, formats=(), data=()).page
            pipe.send_bytes(b"H" + page.read_bytes())
    except ArmblocksError as error:
        pipe.send_bytes(b"E" + str(error).encode())
    except MemoryError:
        pass  # memory is freed on return; an empty pipe reports the failure
    except Exception as error:  # a defect is sent to the client, not printed to the terminal
        pipe.send_bytes(f"Earmblocks has a defect ({type(error).__name__})".encode())

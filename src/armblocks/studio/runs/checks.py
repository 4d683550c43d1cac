"""The background check of diagrams whose blocks name files.

Shapes downstream of a Python function follow from its code. This code runs in a separate process, so that an
endless loop or a crash does not affect the editor.
"""

from __future__ import annotations

import asyncio
from multiprocessing.connection import Connection
from typing import Any

from pydantic import TypeAdapter

from armblocks import formats
from armblocks.diagram import Diagram
from armblocks.errors import ArmblocksError
from armblocks.studio.documents.project_data import ProjectData, has_functions
from armblocks.studio.protocol.messages.sheets import Finding, WireKind
from armblocks.studio.runs.worker import diagram_of, limit_process
from armblocks.studio.runs.workers import process_reply
from armblocks.studio.sheet.check import check
from armblocks.studio.sheet.parameter_values import ResolveRobot

MAX_SECONDS = 20.0
Checked = tuple[list[Finding], dict[str, WireKind]]
_CHECKED: TypeAdapter[Checked] = TypeAdapter(Checked)


class Checks:
    """Checks diagrams, with the files that their blocks name."""

    def __init__(self, data: ProjectData, resolve_robot: ResolveRobot) -> None:
        self._data = data
        self._resolve_robot = resolve_robot

    async def check(self, diagram: Diagram) -> Checked:
        """Return the findings, and the known types of signals, as :func:`~.sheet.check.check` does."""
        faults = await asyncio.to_thread(self._faults, diagram)
        if faults or not await asyncio.to_thread(has_functions, diagram):
            findings, wires = await asyncio.to_thread(check, diagram)
            # With faults, the shapes downstream of these blocks are unknown: only unconnected inputs are
            # certain.
            return [*faults, *(finding for finding in findings if finding.port or not faults)], wires
        message = await process_reply(send_findings, self.job(diagram), MAX_SECONDS)
        if not message:
            return [_finding("", f"the Python functions did not return within {MAX_SECONDS:g} s", _FIX)], {}
        return _CHECKED.validate_json(message)

    def job(self, diagram: Diagram) -> dict[str, Any]:
        """Return the diagram and the files that it may read, for a worker process."""
        root = self._data.folder.root
        text = formats.diagram_to_bytes(diagram, self._resolve_robot, folder=root, project=root).decode()
        return {"diagram": text, "folder": str(root), "trusted": self._data.trusted.pairs}

    def _faults(self, diagram: Diagram) -> list[Finding]:
        try:
            return [
                _finding(
                    path,
                    error.what if error.where in error.what else f"{error.where}: {error.what}",
                    error.fix,
                )
                for path, error in self._data.faults(diagram)
            ]
        except ArmblocksError:  # subsystems are too deep, which the check reports
            return []


_FIX = "look for endless loops in them"


def _finding(block: str, what: str, fix: str) -> Finding:
    return Finding(severity="error", block=block, port="", what=what, fix=fix)


def send_findings(pipe: Connection, job: dict[str, Any]) -> None:
    """Check a diagram and send the result; executed in the separate process."""
    limit_process()
    checked: Checked
    try:
        checked = check(diagram_of(job))
    except ArmblocksError as error:
        checked = [_finding("", error.what, error.fix)], {}
    except Exception as error:  # a defect is sent to the client, not printed to the terminal
        checked = [_finding("", f"armblocks has a defect ({type(error).__name__})", "report it")], {}
    pipe.send_bytes(_CHECKED.dump_json(checked))

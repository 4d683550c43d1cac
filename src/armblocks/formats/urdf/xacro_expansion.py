"""Expansion of xacro macros, in a separate process (:mod:`armblocks.formats.urdf.xacro_process`)."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import PurePath

from armblocks.errors import FormatError
from armblocks.extras import require
from armblocks.formats.file_findings import FileContext
from armblocks.formats.xml_elements import Element, read_elements

SECONDS = 5.0
"""Maximum processor time of an expansion."""
_PATIENCE = 8.0
"""Maximum duration of an expansion, relative to its processor time, because other programs run as well."""
_SIGNALS = (-9, -24)
"""Return codes of a process that the limit of processor time has ended: SIGKILL, SIGXCPU."""


def uses_xacro(root: Element) -> bool:
    """Whether a file contains elements or expressions of xacro."""
    waiting = [root]
    while waiting:
        element = waiting.pop()
        if element.tag.startswith("xacro:"):
            return True
        values = (value for key, value in element.attributes.items() if key != "filename")
        if any("${" in value or "$(" in value for value in values):
            return True
        waiting += element.children
    return False


def expanded(data: bytes, file: str, context: FileContext) -> Element:
    """The root element of the expanded file. Line numbers in messages refer to the expanded text.

    Raises ``MissingLibraryError`` without the extra ``xacro``, ``FormatError`` where the file cannot be
    expanded.
    """
    read_elements(data, file)  # refuses document types, entities and deep nesting, with the line in the file
    require("xacro", "xacro files")
    request = {
        "text": data.decode("utf-8-sig", "replace"),
        "name": PurePath(file).name,
        "folder": str(context.folder or ""),
        "root": str(context.root or ""),
        "packages": {name: str(path) for name, path in context.packages.items()},
        "arguments": dict(context.arguments),
        "seconds": SECONDS,
    }
    command = [sys.executable, "-P", "-m", "armblocks.formats.urdf.xacro_process"]
    path = os.pathsep.join(entry for entry in sys.path if entry)
    try:
        completed = subprocess.run(
            command,
            input=json.dumps(request).encode(),
            capture_output=True,
            timeout=_PATIENCE * SECONDS,
            env={**os.environ, "PYTHONPATH": path, "PYTHONIOENCODING": "utf-8"},
        )
        reply = json.loads(completed.stdout or json.dumps({"error": _exit_reason(completed.returncode)}))
    except subprocess.TimeoutExpired:
        reply = {"error": f"the expansion takes more than {_PATIENCE * SECONDS:g} s"}
    if "text" not in reply:
        raise FormatError(
            f"xacro cannot expand the file: {reply['error']}",
            where=file,
            allowed="xacro macros whose files and arguments are known",
            fix="give packages={name: folder} and arguments={name: value}, or expand the file with xacro",
        )
    return read_elements(reply["text"].encode(), f"{file} (expanded)")


def _exit_reason(code: int) -> str:
    if code in _SIGNALS:
        return f"the expansion takes more than {SECONDS:g} s of processor time"
    return "the expansion ended without a result"

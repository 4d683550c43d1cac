"""Private files of the studio, outside the project folder, with access permissions for their user only.

There is one folder for each project folder. It contains the journals of unsaved documents, the list of recent
files, and the session secret with which clients reconnect after a restart of the server.
"""

from __future__ import annotations

import hashlib
import json
import os
import secrets
from dataclasses import asdict, dataclass
from pathlib import Path
from time import time
from typing import Any

from armblocks import user_folders
from armblocks.errors import FormatError
from armblocks.files import read_bounded, write_atomically

MAX_RECENT_FILES = 12
MAX_BYTES = 64 * 1024
SESSION_SECONDS = 12 * 3600.0
"""Age after which a session is not resumed, s."""


@dataclass(frozen=True)
class Session:
    """The port of the server and the session cookie with which clients reconnect after a restart."""

    port: int
    secret: str


class StateFolder:
    """The state files of the studio for one project folder."""

    def __init__(self, project: Path) -> None:
        name = hashlib.sha256(os.fsencode(project.resolve())).hexdigest()[:24]
        self.root = state_base() / name
        self.journals = self.root / "journals"

    def session(self) -> Session | None:
        """The session of the previous server; ``None`` if there was none or it has expired."""
        try:
            age = time() - self._session.stat().st_mtime
            stored = json.loads(read_bounded(self._session, MAX_BYTES))
            session = Session(port=int(stored["port"]), secret=str(stored["secret"]))
        except (OSError, FormatError, ValueError, KeyError, TypeError):
            return None
        return session if age < SESSION_SECONDS and len(session.secret) >= 32 else None

    def begin_session(self, port: int, *, new: bool = False) -> Session:
        """Return the session for this port: the previous session if its port is the same, unless ``new``."""
        last = self.session()
        resumed = last is not None and last.port == port and not new
        session = last if last is not None and resumed else Session(port, secrets.token_urlsafe(32))
        self._write(self._session, asdict(session))
        return session

    def recent(self) -> list[str]:
        """Recently opened or saved project files, the latest first."""
        try:
            stored: Any = json.loads(read_bounded(self._recent, MAX_BYTES))
            return [str(name) for name in stored["files"]][:MAX_RECENT_FILES]
        except (FormatError, ValueError, KeyError, TypeError):
            return []

    def add_recent(self, path: str) -> None:
        """Add a file to the recent files."""
        recent = self.recent()
        if recent[:1] != [path]:
            files = [path, *(other for other in recent if other != path)]
            self._write(self._recent, {"files": files[:MAX_RECENT_FILES]})

    @property
    def _session(self) -> Path:
        return self.root / "session.json"

    @property
    def _recent(self) -> Path:
        return self.root / "recent.json"

    def write_private(self, name: str, value: object) -> None:
        """Write a small file of this folder; write errors are ignored."""
        self._write(self.root / name, value)

    def _write(self, path: Path, value: object) -> None:
        """Write a small file of this folder; write errors are ignored."""
        try:
            self.root.mkdir(parents=True, exist_ok=True, mode=0o700)
            write_atomically(path, json.dumps(value).encode(), mode=0o600)
        except (OSError, FormatError):
            return


def state_base() -> Path:
    """The folder for per-user program state on this system; raises ``FormatError`` if there is none."""
    folder = user_folders.state_folder()
    if folder is None:
        raise FormatError(
            "the studio has no place for its journals: this user has no home folder",
            where="armblocks studio",
            allowed="a home folder, or a folder in XDG_STATE_HOME",
            fix="set XDG_STATE_HOME to a folder of this user",
        )
    return folder / "studio"

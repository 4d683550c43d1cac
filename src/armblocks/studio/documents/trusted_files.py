"""Python files whose code the user trusts: by path and content, so that a changed file is not trusted."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from typing import Any

from armblocks.errors import FormatError
from armblocks.files import read_bounded
from armblocks.studio.documents.state_folder import StateFolder

MAX_TRUSTED_FILES = 1000
MAX_BYTES = 1 << 20


def digest_of(source: bytes) -> str:
    """The SHA-256 of the content of a file, hexadecimal."""
    return hashlib.sha256(source).hexdigest()


class TrustedFiles:
    """Pairs of a path in the project and the digest of its content.

    The pairs are stored in the private folder of the user. Files of the project therefore cannot change them.
    """

    def __init__(self, state_folder: StateFolder | None = None, pairs: Iterable[Iterable[str]] = ()) -> None:
        self._state_folder = state_folder
        self._pairs: dict[tuple[str, str], None] = {}
        for pair in (*self._read(), *pairs):
            path, digest = pair
            self._pairs[str(path), str(digest)] = None

    @property
    def pairs(self) -> list[list[str]]:
        """The pairs, for a worker process."""
        return [list(pair) for pair in self._pairs]

    def __contains__(self, pair: object) -> bool:
        return pair in self._pairs

    def set(self, path: str, digest: str, *, trusted: bool) -> None:
        """Trust a file with the content of this digest, or withdraw the trust in all contents of the file."""
        if trusted:
            self._pairs[path, digest] = None
        else:
            self._pairs = {pair: None for pair in self._pairs if pair[0] != path}
        for pair in list(self._pairs)[:-MAX_TRUSTED_FILES]:
            del self._pairs[pair]
        if self._state_folder is not None:
            self._state_folder.write_private("trusted.json", {"files": self.pairs})

    def _read(self) -> list[tuple[str, str]]:
        if self._state_folder is None:
            return []
        try:
            stored: Any = json.loads(read_bounded(self._state_folder.root / "trusted.json", MAX_BYTES))
            return [(str(path), str(digest)) for path, digest in stored["files"]]
        except (FormatError, ValueError, KeyError, TypeError):
            return []

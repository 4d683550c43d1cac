"""The content of files that are dropped on the studio."""

from __future__ import annotations

import base64

from armblocks.errors import FormatError, InputError
from armblocks.studio.protocol.messages.documents import MAX_DROPPED_BYTES


def dropped_bytes(content: str, where: str) -> bytes:
    """Decode the content of a dropped file. Raises ``InputError`` and ``FormatError``."""
    try:
        data = base64.b64decode(content, validate=True)
    except ValueError:  # binascii.Error, or characters outside ASCII
        raise InputError(
            "the content is not base64", where=where, allowed="base64", fix="drop the file again"
        ) from None
    if len(data) > MAX_DROPPED_BYTES:
        raise FormatError(
            f"the file has {len(data)} bytes",
            where=where,
            allowed=f"at most {MAX_DROPPED_BYTES}",
            fix="choose a smaller file",
        )
    return data

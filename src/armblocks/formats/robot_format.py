"""The interface of a robot file format: name, suffixes, reader."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from armblocks.robot import Robot


@dataclass(frozen=True, kw_only=True)
class RobotFormat:
    """One file format of robots.

    ``suffixes``: in lower case with the dot. ``most_bytes``: the maximum size of a file. ``read``: a function
    of a file's bytes and its name for messages, which returns the robots by their names in the file and
    raises ``FormatError``.
    """

    name: str
    suffixes: tuple[str, ...]
    most_bytes: int
    read: Callable[[bytes, str], Mapping[str, Robot]]

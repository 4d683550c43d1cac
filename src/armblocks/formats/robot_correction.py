"""Corrected copies of robot files: the findings of :func:`lint_robot` whose remedy is unambiguous."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike, fspath
from pathlib import Path

from armblocks.errors import FormatError
from armblocks.formats.file_corrections import Change
from armblocks.formats.file_findings import FileFinding
from armblocks.formats.robot_files import (
    file_context,
    format_of,
    is_file,
    robot_file_bytes,
    robot_in_bytes,
)
from armblocks.formats.robot_lint import findings_of

_MAX_ROUNDS = 8
"""A correction can lead to another finding: limits that were reversed may also be in degrees."""


@dataclass(frozen=True, kw_only=True)
class CorrectedFile:
    """``data``: the content of the corrected file; ``changes`` that were made; ``remaining`` findings."""

    data: bytes
    changes: tuple[Change, ...]
    remaining: tuple[FileFinding, ...]


def correct_robot(
    path: str | PathLike[str],
    *,
    name: str | None = None,
    packages: Mapping[str, str | PathLike[str]] | None = None,
    arguments: Mapping[str, object] | None = None,
) -> CorrectedFile:
    """The content of a robot file in which the findings with an unambiguous remedy are corrected.

    Arguments as for ``load_robot``. The function writes no file. All other text of the file,
    including comments and spaces, is unchanged. Findings in included files, and in formats without
    corrections (xacro, MATLAB scripts), remain. Poses change only where the finding is about an angle;
    correcting the result again changes nothing.

    Raises ``FormatError`` for shipped robots and for files that cannot be read.
    """
    if not is_file(path):
        raise FormatError(
            f"'{fspath(path)}' is a shipped robot",
            where="corrections",
            allowed="the path of a robot file",
            fix="save it with armblocks convert, and correct the copy",
        )
    file = Path(path)
    data = robot_file_bytes(file)
    format = format_of(str(file), data)
    changes: list[Change] = []

    def findings() -> tuple[FileFinding, ...]:
        context = file_context(packages, arguments)
        return findings_of(lambda: robot_in_bytes(data, file, context, name=name), str(file), context)

    remaining = findings()
    for _ in range(_MAX_ROUNDS if format.correct is not None else 0):
        assert format.correct is not None
        data, made = format.correct(data, str(file), remaining)
        if not made:
            break
        changes += made
        remaining = findings()
    return CorrectedFile(data=data, changes=tuple(changes), remaining=remaining)

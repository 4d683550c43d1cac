"""Findings about robot files: parts that a reader omitted or changed, with file, line and a stable code."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from armblocks.errors import compose_message, warn


@dataclass(frozen=True, kw_only=True)
class Rule:
    """A rule that a finding refers to.

    ``code``: the stable identifier; ``allowed``: what a file should contain; ``remedy``: the correction.
    """

    code: str
    allowed: str
    remedy: str


@dataclass(frozen=True, kw_only=True)
class FileFinding:
    """One finding about a file.

    ``file`` and ``line`` (0 if unknown); ``element``: the named part of the robot, such as ``link 'a'``;
    ``what``: the value that was found and how it is read. ``index``: the index of the XML element among the
    start tags of the file, if the finding concerns an element; ``link``: the link that the finding concerns.
    """

    rule: Rule
    file: str
    line: int = 0
    element: str = ""
    what: str
    index: int | None = field(default=None, compare=False, repr=False)
    link: str = field(default="", compare=False, repr=False)

    @property
    def where(self) -> str:
        """File, line and element."""
        place = f"{self.file}:{self.line}" if self.line else self.file
        return f"{place}, {self.element}" if self.element else place

    def __str__(self) -> str:
        message = compose_message(self.what, self.where, self.rule.allowed, self.rule.remedy)
        return f"{message} [{self.rule.code}]"


@dataclass(kw_only=True)
class FileContext:
    """The resources that a reader may use besides the bytes of a file, and the findings of the reader.

    ``folder``: the file's folder, if it has one. ``root``: no files outside it are read; ``None`` permits
    all. ``packages``: the folders of ROS packages by name. ``arguments``: the arguments of a xacro file.
    The reader appends to ``findings``, and stores the line of each link in ``lines``.
    """

    folder: Path | None = None
    root: Path | None = None
    packages: Mapping[str, Path] = field(default_factory=dict[str, Path])
    arguments: Mapping[str, str] = field(default_factory=dict[str, str])
    findings: list[FileFinding] = field(default_factory=list[FileFinding])
    lines: dict[str, int] = field(default_factory=dict[str, int])


def warn_of_findings(findings: Sequence[FileFinding]) -> None:
    """Issue one ArmblocksWarning for each code: its first finding, and the number of further findings."""
    by_code: dict[str, list[FileFinding]] = {}
    for finding in findings:
        by_code.setdefault(finding.rule.code, []).append(finding)
    for first, *others in by_code.values():
        more = f" {len(others)} more of this kind; armblocks lint lists them." if others else ""
        warn(f"{first}{more}")

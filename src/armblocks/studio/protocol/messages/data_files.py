"""Files of the project that blocks name: tables of measurements and Python functions.

All paths are relative to the project folder.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from armblocks.studio.protocol.message import Fault, Message, Request
from armblocks.studio.protocol.messages.documents import MAX_DROPPED_BYTES

Path = Annotated[str, Field(max_length=1000)]
Name = Annotated[str, Field(max_length=1000)]


class DataFile(Message):
    """A file of the project; ``size`` in bytes."""

    path: str
    size: int


class DataFileList(Request[list[DataFile]]):
    """Return the files that a parameter of this kind may name."""

    kind: Literal["data_files"] = "data_files"
    holds: Literal["table", "function"]


class TableColumn(Message):
    """A column of a file. ``fault`` is the reason why it has no numbers; ``rows`` is then 0."""

    name: str
    unit: str
    kind: str
    rows: int
    fault: str


class TablePreview(Message):
    """The columns of a file, and the table of the chosen columns, or its ``fault``.

    ``time`` is the column of times, ``chosen`` are the columns of values. ``rows`` are the first rows of
    these columns as text. ``times`` (s) and ``curves`` are points for a plot: minimum and maximum of groups
    of rows. ``spacing`` has the minimum and the maximum difference of successive times, s.
    """

    columns: list[TableColumn]
    time: str
    chosen: list[str]
    rows: list[list[str]]
    count: int
    spacing: tuple[float, float]
    times: list[float]
    curves: list[list[float]]
    notes: list[str]
    fault: Fault | None


class PreviewTable(Request[TablePreview]):
    """Read a file; ``time`` and ``columns`` are empty where the file determines them."""

    kind: Literal["preview_table"] = "preview_table"
    file: Path
    time: Name = ""
    columns: Annotated[list[Name], Field(max_length=10_000)] = Field(default_factory=list[Name])


class StoredFile(Message):
    """The path of a dropped file; ``stored`` is false if a file with this name and another content exists."""

    path: str
    stored: bool


class StoreFile(Request[StoredFile]):
    """Store a dropped table file in the project folder; ``replace``: overwrite a file of the same name."""

    kind: Literal["store_file"] = "store_file"
    name: str = Field(max_length=255)
    content: str = Field(max_length=4 * MAX_DROPPED_BYTES // 3 + 4)
    """Content of the file, base64."""
    replace: bool = False


class SourceFunction(Message):
    """A function of a Python file; ``line`` is the line number of its definition."""

    name: str
    arguments: list[str]
    line: int
    doc: str


class FunctionSource(Message):
    """The content of a Python file, which has not been run; ``fault`` is the reason why it is not valid.

    ``digest`` identifies the content; ``trusted`` states whether its code may run. Invisible characters are
    written as ``\\\\u202e``; ``hidden`` is their number.
    """

    text: str
    digest: str
    trusted: bool
    hidden: int
    functions: list[SourceFunction]
    fault: Fault | None


class ReadSource(Request[FunctionSource]):
    """Return the content of a Python file."""

    kind: Literal["read_source"] = "read_source"
    file: Path


class TrustSource(Request[None]):
    """Trust a Python file with the content that the client has shown, or withdraw the trust.

    The request is refused if the content of the file no longer has this ``digest``.
    """

    kind: Literal["trust_source"] = "trust_source"
    file: Path
    digest: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
    trusted: bool

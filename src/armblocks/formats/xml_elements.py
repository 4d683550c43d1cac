"""XML as elements with line numbers, read without entities, DTDs and external files.

Names keep their prefixes (``drake:rotor_inertia``), which need not be declared: many URDF files use prefixes
without a declaration. Comments and processing instructions are skipped.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, cast
from xml.sax.handler import ContentHandler

from armblocks.errors import FormatError, counted
from armblocks.formats.file_findings import FileContext, FileFinding, Rule

if TYPE_CHECKING:
    from xml.sax.xmlreader import AttributesImpl, Locator, XMLReader

MAX_DEPTH = 64
"""Maximum nesting of elements."""
MAX_ELEMENTS = 200_000
"""Maximum number of elements of a file."""
MAX_NUMBER = 1e50
"""Maximum magnitude of a number, so that products of several numbers do not overflow."""

_NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")

_BEFORE_DECLARATION = re.compile(rb"\A((?:\s+|<!--(?:(?!-->).)*-->)+)(<\?xml[^>]*\?>)", re.DOTALL)


@dataclass(eq=False)
class Element:
    """An element of an XML file. Its readers raise ``FormatError`` with file and line.

    ``index``: its place among the start tags of the file, from 0.
    """

    file: str
    line: int
    tag: str
    attributes: dict[str, str]
    children: list[Element] = field(default_factory=list["Element"])
    texts: list[str] = field(default_factory=list[str])
    index: int = 0

    @property
    def text(self) -> str:
        """The text directly inside the element, without spaces at its ends."""
        return "".join(self.texts).strip()

    @property
    def label(self) -> str:
        """The tag with the name, if the element has one: ``link 'a'``."""
        name = self.attributes.get("name")
        return f"{self.tag} '{shortened(name)}'" if name else self.tag

    @property
    def where(self) -> str:
        """File, line and element."""
        return f"{self.file}:{self.line}, {self.label}"

    def error(self, what: str, *, allowed: str = "", fix: str = "") -> FormatError:
        """The error for this element, which the caller raises."""
        return FormatError(what, where=self.where, allowed=allowed, fix=fix or "correct this line")

    def all(self, tag: str) -> Iterator[Element]:
        """The children with a tag."""
        return (child for child in self.children if child.tag == tag)

    def first(self, tag: str) -> Element | None:
        """The first child with a tag, or ``None``."""
        return next(self.all(tag), None)

    def required(self, attribute: str, allowed: str) -> str:
        """The text of an attribute that must be present and not empty."""
        value = self.attributes.get(attribute, "").strip()
        if not value:
            raise self.error(
                f"the attribute '{attribute}' is missing or empty",
                allowed=allowed,
                fix=f'add {attribute}="…" to <{self.tag}>',
            )
        return value

    def number(self, attribute: str, default: float | None = None, *, limit: float = MAX_NUMBER) -> float:
        """The number of an attribute; ``default`` if it is absent. ``limit``: its maximum magnitude."""
        if attribute not in self.attributes and default is not None:
            return default
        text = self.required(attribute, "a number")
        (value,) = self._numbers(f"the attribute '{attribute}'", text, (1,), limit)
        return value

    def vector(self, attribute: str, default: tuple[float, float, float]) -> tuple[float, float, float]:
        """Three numbers of an attribute, separated by spaces; ``default`` if it is absent."""
        if attribute not in self.attributes:
            return default
        x, y, z = self.numbers(attribute, (3,))
        return x, y, z

    def numbers(self, attribute: str, counts: Collection[int]) -> list[float]:
        """The numbers of an attribute that is present; ``counts``: how many there may be."""
        return self._numbers(f"the attribute '{attribute}'", self.attributes[attribute], counts)

    def text_numbers(self, count: int, *, limit: float = MAX_NUMBER) -> list[float]:
        """``count`` numbers of the text inside the element, separated by spaces; ``limit``: their maximum."""
        return self._numbers(f"the element <{self.tag}>", self.text, (count,), limit)

    def _numbers(
        self, subject: str, text: str, counts: Collection[int], limit: float = MAX_NUMBER
    ) -> list[float]:
        words = re.split(r"\s*,\s+|\s+", text.strip())  # a comma before a space separates, as a space does
        if len(words) not in counts:
            allowed = f"{min(counts)} to " * (len(counts) > 1) + counted(max(counts), "number")
            raise self.error(
                f"{subject} has {counted(len(words), 'value')}: '{shortened(text)}'",
                allowed=f"{allowed}, separated by spaces",
            )
        values: list[float] = []
        for word in words:
            value = float(word) if _NUMBER.fullmatch(word) and len(word) <= 400 else math.nan
            if not math.isfinite(value):
                raise self.error(
                    f"{subject} contains '{shortened(word)}', which is not a number",
                    allowed="finite decimal numbers such as 0.25 or -1.5e-3",
                    fix=_hint(word),
                )
            if abs(value) > limit:
                raise self.error(
                    f"{subject} contains '{shortened(word)}', which is too large",
                    allowed=f"magnitudes up to {limit:g}",
                    fix="correct the number, or omit it where it means no limit",
                )
            values.append(value)
        return values


def note(context: FileContext, rule: Rule, element: Element, what: str, label: str = "") -> None:
    """Add a finding about an element."""
    context.findings.append(
        FileFinding(
            rule=rule,
            file=element.file,
            line=element.line,
            element=label or element.label,
            what=what,
            index=element.index,
        )
    )


def shortened(text: str) -> str:
    """At most 60 characters of a text, for messages."""
    return text if len(text) <= 60 else text[:57] + "…"


def _hint(word: str) -> str:
    return "write a decimal point" if "," in word else "write a number"


def _blanked_declaration(match: re.Match[bytes]) -> bytes:
    """Comments before ``<?xml …?>``, without that declaration: other readers permit this, XML does not."""
    return match[1] + b" " * len(match[2])


class _Elements(ContentHandler):
    """Builds the elements of a file, within the limits of depth and number."""

    def __init__(self, file: str, parser: XMLReader) -> None:
        super().__init__()
        self._file = file
        self._parser = cast("Locator", parser)  # readers that accept data in pieces are locators
        self._open: list[Element] = []
        self._count = 0
        self.root: Element | None = None

    @property
    def line(self) -> int:
        """The line that the parser has reached."""
        return self._parser.getLineNumber() or 1

    def startElement(self, name: str, attrs: AttributesImpl) -> None:
        attributes = {key: attrs[key] for key in attrs.getNames()}
        element = Element(self._file, self.line, name, attributes, index=self._count)
        self._count += 1
        if len(self._open) >= MAX_DEPTH or self._count > MAX_ELEMENTS:
            raise element.error(
                "the file has too many elements, or they are nested too deeply",
                allowed=f"{MAX_ELEMENTS} elements, {MAX_DEPTH} levels",
                fix="split the file",
            )
        if self._open:
            self._open[-1].children.append(element)
        else:
            self.root = element
        self._open.append(element)

    def endElement(self, name: str) -> None:
        self._open.pop()

    def characters(self, content: str) -> None:
        if self._open and content:
            self._open[-1].texts.append(content)


def read_elements(data: bytes, file: str) -> Element:
    """The root element of an XML file. ``file`` is its name in messages.

    Raises ``FormatError`` with the line for text that is not well-formed XML, for a DTD or entities, and
    beyond the limits.
    """
    data = _BEFORE_DECLARATION.sub(_blanked_declaration, data, count=1)
    if not data.startswith((b"\xff\xfe", b"\xfe\xff")):  # in UTF-16 every second byte may be 0
        data = data.rstrip(b"\0")
    from xml.sax import SAXException, SAXParseException

    from defusedxml.common import DefusedXmlException
    from defusedxml.sax import make_parser

    parser = make_parser()
    handler = _Elements(file, parser)
    parser.forbid_dtd = True
    parser.setContentHandler(handler)
    try:
        # The file is parsed in one piece, so that an attribute of many megabytes is scanned only once.
        parser.feed(data)
        parser.close()
    except DefusedXmlException:
        raise FormatError(
            "the file has a document type or entities (<!DOCTYPE …>, <!ENTITY …>)",
            where=f"{file}:{handler.line}",
            allowed="XML without a document type",
            fix="remove the declaration, and replace each entity by its text",
        ) from None
    except (SAXException, ValueError, LookupError) as error:
        if isinstance(error, FormatError):
            raise
        line = (error.getLineNumber() or 0) if isinstance(error, SAXParseException) else handler.line
        reason = error.getMessage() if isinstance(error, SAXException) else str(error)
        raise FormatError(
            f"this is not well-formed XML: {shortened(reason)}",
            where=f"{file}:{max(line, 1)}",
            allowed="an XML document",
            fix="correct the file at this line",
        ) from None
    if handler.root is None:
        raise FormatError(
            "the file has no XML element", where=file, allowed="<robot>…</robot>", fix="check the file"
        )
    return handler.root

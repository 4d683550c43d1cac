"""Corrections of XML files as changes of their text: comments, spaces and all other elements are kept."""

from __future__ import annotations

import codecs
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from xml.sax.saxutils import escape, quoteattr

from armblocks.formats.file_corrections import Change, Correction
from armblocks.formats.file_findings import FileFinding
from armblocks.formats.xml_elements import Element, read_elements

_TAG = re.compile(
    r"<!--.*?-->|<!\[CDATA\[.*?\]\]>|<\?.*?\?>"
    r"""|<(?P<slash>/?)(?P<name>[^\s/>]+)(?P<rest>(?:[^"'>]++|"[^"]*+"|'[^']*+')*+)>""",
    re.DOTALL,
)
_ATTRIBUTE = re.compile(r"""(\s+)([^\s=<>"'/]+)(\s*=\s*)("[^"]*"|'[^']*')""")
_ENCODING = re.compile(rb"""\A[^<]*<\?xml[^>]*?encoding\s*=\s*["']([A-Za-z0-9._-]+)["']""")
_BYTE_ORDER_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)


@dataclass(frozen=True, kw_only=True)
class Edit:
    """A change of one element. ``what`` describes it.

    ``attributes``: new texts by name, ``None`` removes the attribute; ``text``: the new text of an element
    without children; ``child``: XML that is added at the end of the element; ``removed``: the element is
    removed.
    """

    element: Element
    what: str
    attributes: Mapping[str, str | None] = field(default_factory=dict[str, "str | None"])
    text: str | None = None
    child: str = ""
    removed: bool = False


class XmlFile:
    """The elements of a file for the corrections of a format: its ``root``; ``elements`` in their order."""

    def __init__(self, data: bytes, name: str) -> None:
        self.root = read_elements(data, name)
        self.elements: list[Element] = []
        waiting = [self.root]
        while waiting:
            element = waiting.pop()
            self.elements.append(element)
            waiting += reversed(element.children)

    @cached_property
    def parents(self) -> dict[Element, Element]:
        """The parent of each element but the root."""
        return {child: element for element in self.elements for child in element.children}

    def all(self, tag: str) -> Iterator[Element]:
        """The elements with a tag, in the order of the file."""
        return (element for element in self.elements if element.tag == tag)


Edits = Callable[[FileFinding, Element, XmlFile], Sequence[Edit]]
"""The changes that remove a finding about an element, none if the remedy is ambiguous.

For findings about a link, which have no element of the file, the element is the root."""


def corrected_xml(data: bytes, name: str, findings: Sequence[FileFinding], edits: Edits) -> Correction:
    """The file with the changes for all findings about its own elements."""
    file = XmlFile(data, name)
    changes: list[Change] = []
    made: list[Edit] = []
    for finding in findings:
        if finding.file != name:
            continue  # in an included or expanded file
        element = file.root if finding.index is None else file.elements[finding.index]
        if finding.index is not None and element.line != finding.line:
            continue  # an included file with the same name
        for edit in edits(finding, element, file):
            if edit in made:
                continue
            made.append(edit)
            changes.append(Change(finding, edit.what))
            # The correction of a later finding uses the values of earlier corrections.
            for key, value in edit.attributes.items():
                edit.element.attributes.pop(key, None)
                if value is not None:
                    edit.element.attributes[key] = value
            if edit.text is not None:
                edit.element.texts[:] = [edit.text]
    return Correction(_rewritten(data, made) if made else data, tuple(changes))


def _rewritten(data: bytes, edits: Sequence[Edit]) -> bytes:
    mark, encoding = next(((m, e) for m, e in _BYTE_ORDER_MARKS if data.startswith(m)), (b"", "utf-8"))
    declared = _ENCODING.match(data)
    if not mark and declared is not None:
        encoding = declared[1].decode("ascii")
    text = data[len(mark) :].decode(encoding)
    spans = _spans(text)
    for edit in sorted(edits, key=lambda edit: edit.element.index, reverse=True):
        # From the end of the file to its beginning, so that positions before the change stay valid. Changes
        # inside an element move its end tag, so the end tag is searched for again.
        text = _changed(text, spans[edit.element.index], edit)
    return mark + text.encode(encoding, "xmlcharrefreplace")


def _spans(text: str) -> list[int]:
    """The position of each start tag."""
    return [match.start() for match in _TAG.finditer(text) if match["name"] and not match["slash"]]


def _changed(text: str, start: int, edit: Edit) -> str:
    tag = _TAG.match(text, start)
    assert tag is not None
    empty = tag["rest"].endswith("/")
    rest = tag["rest"].removesuffix("/")
    for name, value in edit.attributes.items():
        rest = _with_attribute(rest, name, value)
    if edit.text is None and not edit.child and not edit.removed:
        return f"{text[:start]}<{tag['name']}{rest}{'/' if empty else ''}>{text[tag.end() :]}"
    inner_end, end = (tag.end(), tag.end()) if empty else _end_of(text, tag.end())
    if edit.removed:
        before = text[:start].rstrip(" \t")
        return before + text[end:].removeprefix("\r").removeprefix("\n")
    inner = "" if empty else text[tag.end() : inner_end]
    if edit.text is not None:
        inner = escape(edit.text)
    inner += edit.child
    return f"{text[:start]}<{tag['name']}{rest.rstrip()}>{inner}</{tag['name']}>{text[end:]}"


def _end_of(text: str, position: int) -> tuple[int, int]:
    """The positions before and after the end tag of the element whose start tag ends at ``position``."""
    depth = 1
    for match in _TAG.finditer(text, position):
        if not match["name"]:
            continue
        if match["slash"]:
            depth -= 1
        elif not match["rest"].endswith("/"):
            depth += 1
        if depth == 0:
            return match.start(), match.end()
    raise AssertionError("the file is well-formed")


def _with_attribute(rest: str, name: str, value: str | None) -> str:
    """The attributes of a start tag with one of them changed, added or removed."""
    for match in _ATTRIBUTE.finditer(rest):
        if match[2] == name:
            new = "" if value is None else f"{match[1]}{name}{match[3]}{quoteattr(value)}"
            return rest[: match.start()] + new + rest[match.end() :]
    return rest if value is None else f"{rest.rstrip()} {name}={quoteattr(value)}"

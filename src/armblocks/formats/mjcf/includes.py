"""Files that an MJCF file includes, and its sections joined over all of these files."""

from __future__ import annotations

from armblocks.errors import FormatError
from armblocks.files import read_bounded
from armblocks.formats.file_findings import FileContext
from armblocks.formats.referenced_files import resolved
from armblocks.formats.xml_elements import MAX_ELEMENTS, Element, read_elements, shortened

MAX_FILES = 200
"""Maximum number of included files."""
MAX_BYTES = 16 * 2**20
"""Maximum size of an included file."""
_ROOTS = ("mujoco", "mujocoinclude")


def with_includes(root: Element, context: FileContext) -> Element:
    """The root element with each ``<include file=…>`` replaced by the children of the file's root.

    Paths are relative to the folder of the main file. Raises ``FormatError`` for files that are missing,
    that include each other, and beyond the limits.
    """
    return _Includes(context).expanded(root)


class _Includes:
    def __init__(self, context: FileContext) -> None:
        self._context = context
        self._open: list[str] = []
        self._files = 0
        self._elements = 0

    def expanded(self, element: Element) -> Element:
        """The element with its included files."""
        children: list[Element] = []
        for child in element.children:
            self._elements += 1
            if self._elements > MAX_ELEMENTS:
                raise child.error(
                    "the included files have too many elements",
                    allowed=f"{MAX_ELEMENTS}",
                    fix="split the file",
                )
            if child.tag == "include":
                children += self._included(child)
            else:
                children.append(self.expanded(child))
        element.children[:] = children
        return element

    def _included(self, include: Element) -> list[Element]:
        name = include.required("file", "the path of an MJCF file")
        path = resolved(name, self._context)
        self._files += 1
        if isinstance(path, str):
            raise include.error(
                f"the included file '{shortened(name)}' is not read: {path}",
                allowed="a path relative to the folder of the main file",
                fix="put the included files beside the main file",
            )
        if str(path) in self._open or self._files > MAX_FILES:
            raise include.error(
                f"the file '{shortened(name)}' includes itself, or there are too many includes",
                allowed=f"at most {MAX_FILES} files, without cycles",
                fix="remove this include",
            )
        root = read_elements(read_bounded(path, MAX_BYTES), name)
        if root.tag not in _ROOTS:
            raise FormatError(
                f"the root element of the included file is <{shortened(root.tag)}>",
                where=root.where,
                allowed="<mujoco> or <mujocoinclude>",
                fix="include an MJCF file",
            )
        self._open.append(str(path))
        children = self.expanded(root).children
        self._open.pop()
        return children

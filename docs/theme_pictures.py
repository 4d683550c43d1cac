"""Pictures of the pages in the light and in the dark theme.

The Markdown of a page has a ``<picture>`` with a dark source, which GitHub shows by the theme of the reader.
Sphinx copies only pictures of its own image directives, and the pages have a separate switch for the theme.
Therefore each ``<picture>`` becomes two images, and the theme hides one of them.
"""

from __future__ import annotations

import re

_PICTURE = re.compile(
    r'<picture>\s*<source media="\(prefers-color-scheme: dark\)" srcset="([^"]+)">\s*'
    r'<img alt="([^"]+)" src="([^"]+)">\s*</picture>'
)


def show_by_theme(_app: object, _page: str, source: list[str]) -> None:
    """Write each ``<picture>`` as two images; Sphinx calls it with the text of each page."""
    source[0] = _PICTURE.sub(_both, source[0])


def _both(match: re.Match[str]) -> str:
    dark, alternative, light = match.groups()
    return f"![{alternative}]({light}){{.only-light}}![{alternative}]({dark}){{.only-dark}}"

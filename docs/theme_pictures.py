"""Pictures of the pages in the light and in the dark theme.

In Markdown, a ``<picture>`` has a light and a dark source; GitHub selects one by the reader's theme. Sphinx
copies only the files of its image directives, and its pages have a switch for the theme. Therefore each
``<picture>`` becomes two image directives. The theme hides one of the images. Each image is a link to its
file, which the browser shows in full size; Sphinx copies all images into the folder ``_images``.
"""

from __future__ import annotations

import re
from pathlib import Path

_PICTURE = re.compile(
    r'<picture>\s*<source media="\(prefers-color-scheme: dark\)" srcset="([^"]+)">\s*'
    r'<img alt="([^"]+)" src="([^"]+)">\s*</picture>'
)


def show_by_theme(_app: object, _page: str, source: list[str]) -> None:
    """Replace each ``<picture>`` by two images. Sphinx calls this function with the text of each page."""
    source[0] = _PICTURE.sub(_two_images, source[0])


def _two_images(match: re.Match[str]) -> str:
    dark, alternative, light = match.groups()
    return "".join(
        f'<a class="only-{theme}" href="_images/{Path(file).name}">![{alternative}]({file})</a>'
        for theme, file in (("light", light), ("dark", dark))
    )

"""Places at which browsers break code in the cells of tables on small screens, such as after a dot.

The style sheet enables these places in the second column of tables with two columns. Without them, browsers
break the code at any letter.
"""

from __future__ import annotations

import re

_CELL = re.compile(r"<td\b.*?</td>", re.DOTALL)
_WORD = re.compile(r'(?<=<span class="pre">)[^<]+')
_LONG_NAME = re.compile(r"[A-Za-z]{27,}")
_CAPITAL = re.compile(r"(?<=[a-z])(?=[A-Z][a-z])")
_SEPARATOR = re.compile(r"(?<=\w[._(=/])(?=[A-Za-z])")


def break_code_in_tables(
    _app: object, _page: str, _template: str, context: dict[str, str], _doctree: object
) -> None:
    """Insert a ``<wbr>`` at each place. Sphinx calls this function with the data of each page."""
    if "body" in context:
        context["body"] = _CELL.sub(
            lambda cell: _WORD.sub(_with_breaks, cell[0]), context["body"]
        )


def _with_breaks(word: re.Match[str]) -> str:
    text = _SEPARATOR.sub("<wbr>", word[0])
    return _LONG_NAME.sub(lambda name: _CAPITAL.sub("<wbr>", name[0]), text)

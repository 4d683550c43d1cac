"""The frame of all reports: one self-contained page. No network, no script."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from armblocks.pictures.svg import escape
from armblocks.report.page_style import page_css

# The page loads and runs nothing: styles are in the page, pictures are data: URLs.
_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"

_ICONS = {
    "error": '<path d="M7.9 2.5h4.2L17.5 7.9v4.2L12.1 17.5H7.9L2.5 12.1V7.9z" fill="none" '
    'stroke="currentColor" stroke-width="1.6" stroke-linejoin="round"/>',
    "warning": '<path d="M10 2.8 18 16.8H2z" fill="none" stroke="currentColor" stroke-width="1.6" '
    'stroke-linejoin="round"/>',
}


class PageSection(NamedTuple):
    """A section of a page: its anchor, its heading and its content, both as HTML."""

    key: str
    heading: str
    body: str


def framed_page(name: str, lead: str, facts: str, notices: str, sections: Sequence[PageSection]) -> str:
    """The whole page as HTML text. All arguments are HTML, in which texts from a user are escaped."""
    links = "".join(f'<li><a href="#{key}">{heading}</a></li>' for key, heading, _ in sections)
    body = "".join(
        f'<section aria-labelledby="{key}"><h2 id="{key}">{heading}</h2>{text}</section>'
        for key, heading, text in sections
    )
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">'
        '<meta name="viewport" content="width=device-width,initial-scale=1">'
        f"<title>{name}: report</title><style>{page_css()}</style></head><body>"
        f'<header class="top"><h1>{name}</h1><p class="lead">{lead}</p>'
        f"{facts}{notices}"
        f'<nav aria-label="Sections"><ul>{links}</ul></nav></header>'
        f"<main>{body}<footer>Written by armblocks. All quantities in SI units unless a unit is given; "
        "angles in degrees.</footer></main></body></html>\n"
    )


def fact_list(facts: Sequence[tuple[str, str, str]]) -> str:
    """Facts (label, value, unit) as a list in the head of a page; all texts are HTML."""
    items = "".join(
        f"<div><dt>{label}</dt><dd>{value} <small>{unit}</small></dd></div>" for label, value, unit in facts
    )
    return f'<dl class="facts">{items}</dl>'


def notice_list(notices: Sequence[tuple[str, str]]) -> str:
    """Notices (``error`` or ``warning``, text) in the head of a page."""
    if not notices:
        return ""
    items = "".join(
        f'<li class="{kind}"><svg viewBox="0 0 20 20" role="img" aria-label="{kind}">{_ICONS[kind]}'
        '<path d="M10 7.2v4.2M10 13.6v.4" stroke="currentColor" stroke-width="1.8" stroke-linecap="round"/>'
        f"</svg><span>{escape(text)}</span></li>"
        for kind, text in notices
    )
    return f'<ul class="notes">{items}</ul>'

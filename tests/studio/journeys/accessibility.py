"""Accessibility check of a page with axe-core."""

from __future__ import annotations

from pathlib import Path

from browsers import IN_FIREFOX
from playwright.sync_api import Page

SCRIPT = Path(__file__).parents[3] / "frontend" / "node_modules" / "axe-core" / "axe.min.js"


RUN = """async ([inside, tags]) => {
    const { violations } = await axe.run(inside, {
        resultTypes: ['violations'],
        ...(tags && { runOnly: { type: 'tag', values: tags } }),
    })
    return violations
}"""


def axe(page: Page, inside: str = "html", *, tags: list[str] | None = None) -> None:
    """Fail if the page violates an accessibility rule in its present state.

    ``inside``: selector of the checked part. ``tags``: categories of rules; all by default. Only Chromium is
    checked: the rules do not depend on the browser, and they crash Firefox 153 while a context menu is open.
    """
    if IN_FIREFOX:
        return
    if not page.evaluate("'axe' in window"):
        page.evaluate(SCRIPT.read_text(encoding="utf-8"))
    violations = page.evaluate(RUN, [inside, tags])
    serious = [
        (rule["id"], rule["nodes"][0]["html"][:200])
        for rule in violations
        if rule["impact"] in ("serious", "critical")
    ]
    assert serious == []

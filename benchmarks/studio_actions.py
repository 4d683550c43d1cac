"""Number of mouse and keyboard actions that build the paper's Figure 9 in the studio.

The test `test_figure_nine_journeys.py` builds the figure from an empty sheet with the mouse and compares its
results with the shipped model. The browser counts the actions of this test up to the end of the run.
"""

# pyright: basic
from __future__ import annotations

import importlib
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

from playwright.sync_api import Browser
from studio_browser import page_of, served, verdict

TESTS = Path(__file__).resolve().parent.parent / "tests"
COUNT_ACTIONS = """
window.actions = { mouse: 0, keys: 0, search: 0, fields: 0 }
addEventListener('mousedown', ({ detail, target }) => {
    if (detail >= 2) return  // the second press of a double click
    if (target.closest('.palette [aria-label="Clear the search"]')) actions.search++
    else actions.mouse++
}, true)
addEventListener('keydown', ({ key }) => {
    if (!['Control', 'Shift', 'Alt', 'Meta'].includes(key)) actions.keys++
}, true)
addEventListener('input', ({ target }) => {
    if (target.matches('select')) return
    actions[target.closest('.palette') ? 'search' : 'fields']++
}, true)
addEventListener('change', ({ target }) => { if (target.matches('select')) actions.fields++ }, true)
"""


class Actions(NamedTuple):
    """Numbers of actions.

    A click, a double click, a drag, a key combination, a text in a field and a choice from a list are one
    action each. ``search`` are the texts in the search field of the library, and their removal.
    """

    mouse: int
    keys: int
    search: int
    fields: int


def figure_nine(browser: Browser) -> Actions:
    """Actions of the test that builds Figure 9 with the mouse, from "New diagram" to the end of the run."""
    sys.path[:0] = [str(TESTS / folder) for folder in ("studio/journeys", "studio", ".")]
    journeys = importlib.import_module("test_figure_nine_journeys")
    compare = journeys.save_and_compare
    counted: list[Actions] = []

    def count_and_compare(page, path) -> None:
        counted.append(Actions(**page.evaluate("actions")))
        compare(page, path)

    journeys.save_and_compare = count_and_compare
    try:
        with (
            tempfile.TemporaryDirectory() as folder,
            served(folder, "van_der_pol_pid") as (link, _),
            page_of(browser) as page,
        ):
            page.set_viewport_size({"width": 1920, "height": 1080})
            page.goto(link)
            page.locator(".react-flow__node").first.wait_for()
            page.locator(".dock .tab").get_by_text("Tune", exact=True).click()
            page.evaluate(COUNT_ACTIONS)
            journeys.test_figure_9_is_built_with_the_mouse(page, Path(folder))
    finally:
        journeys.save_and_compare = compare
    return counted[0]


def action_rows(browser: Browser) -> list[list[str]]:
    actions = figure_nine(browser)
    total = sum(actions)
    built = total - actions.search
    label = (
        f"Figure 9 by mouse: actions without searches in the library ({actions.mouse} by mouse, "
        f"{actions.fields} entries in fields, {actions.keys} key combination)"
    )
    return [
        [label, f"{built}", "", "40", verdict(built, 40)],
        [f"the same with {actions.search} actions to search the library", f"{total}", "", "", ""],
    ]

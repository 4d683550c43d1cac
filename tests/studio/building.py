"""How people build a model in the page: with the mouse, or with the keyboard."""

from __future__ import annotations

import re
from collections.abc import Callable

from playwright.sync_api import Locator, Page, expect

from conftest import PATIENCE_MS

DIALOG = "[role=dialog]"
"""The dialog on the page: to look for a role inside it is quicker than in the whole page."""
FRAMES_REQUESTED = """async () => {
    // How many animation frames the page requests while ten frames pass.
    const request = window.requestAnimationFrame
    let count = 0
    window.requestAnimationFrame = (called) => (count++, request.call(window, called))
    for (let k = 0; k < 10; k++) await new Promise((passed) => request.call(window, passed))
    window.requestAnimationFrame = request
    return count
}"""
UPPERMOST = """(element) => {
    const { x, y, width, height } = element.getBoundingClientRect()
    return document.elementFromPoint(x + width / 2, y + height / 2) === element
}"""


def block(page: Page, name: str) -> Locator:
    """A block on the sheet."""
    return page.locator(f'.react-flow__node[data-id="{name}"]')


def keep_view(page: Page) -> None:
    """Let the sheet stay where it is: until somebody touches it, it fits itself into its panel."""
    page.locator(".canvas").dispatch_event("wheel")


def new_diagram(page: Page) -> None:
    """Begin with an empty sheet."""
    page.get_by_role("button", name="Menu").click()
    page.get_by_role("menuitem", name="New diagram").click()
    expect(page.get_by_text("Type to add a block")).to_be_visible()


def add(page: Page, typed: str, *, by_key: bool = True) -> None:
    """Add a block by keyboard alone: letter by letter, or after the first letter all at once."""
    page.keyboard.press(typed[0])
    box = page.locator(DIALOG).get_by_role("textbox", name="Add a block")
    expect(box).to_be_focused()
    expect(box).to_have_value(typed[0])
    if by_key:
        box.press_sequentially(typed[1:])
    else:
        box.fill(typed)
    box.press("Enter")
    expect(box).to_be_hidden()


def drag_from_library(page: Page, kind: str, x: float, y: float) -> None:
    """Drop a block with the mouse at a place of the canvas, px."""
    library = page.locator(".palette")
    library.get_by_role("textbox", name="Search the library").fill(kind)
    target = page.locator(".canvas")  # an empty one has examples on it
    library.locator(f'.kind[data-type="{kind}"]').drag_to(target, target_position={"x": x, "y": y})
    library.get_by_role("button", name="Clear the search").click()


def wire(page: Page, source: str, target: str) -> None:
    """Draw a wire with the mouse, between two handles ``block/port``.

    The sheet pans while the mouse is near its edge: the mouse follows the target until the sheet shows that
    a wire would end there.
    """

    keep_view(page)

    def handle(port: str) -> Locator:
        name, _, end = port.partition("/")
        return block(page, name).locator(f'[data-handleid="{end}"]')

    def middle(port: str) -> tuple[float, float]:
        box = handle(port).bounding_box()
        assert box is not None
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def is_free(port: str) -> bool:
        """Whether the mouse would meet the handle: it lies on the sheet and nothing lies on it."""
        return handle(port).evaluate(UPPERMOST)

    if not (is_free(source) and is_free(target)):  # the sheet has panned while earlier wires were drawn
        page.get_by_role("button", name="Fit View").click()
        wait_until(page, lambda: is_free(source) and is_free(target))
    x, y = middle(source)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 4, y, steps=2)
    expect(handle(source)).to_have_class(re.compile(r"\bconnectingfrom\b"))
    reached = handle(target).and_(page.locator(".connectingto"))

    def reach() -> bool:
        page.mouse.move(*middle(target), steps=5)
        return reached.count() == 1

    wait_until(page, reach)
    page.mouse.up()


def wait_until(page: Page, true: Callable[[], bool]) -> None:
    """Wait for what no locator says: a state on this side of the line, or a relation of two numbers."""
    step = 50
    for _ in range(PATIENCE_MS // step):
        if true():
            return
        page.wait_for_timeout(step)  # the events of the browser are handled meanwhile
    raise AssertionError("it did not come")


def copied_text(page: Page, part: str) -> str:
    """Wait until the clipboard holds a text with this part; the text.

    Playwright's ``wait_for_function`` awaits no promise, and ``readText`` gives one.
    """
    text = ""

    def is_there() -> bool:
        nonlocal text
        text = page.evaluate("navigator.clipboard.readText()")
        return part in text

    wait_until(page, is_there)
    return text


def expect_focus_inside(found: Locator) -> None:
    """Wait until the keys go to a dialog: it takes the focus shortly after it is shown."""
    expect(found.locator(":focus")).to_have_count(1)


def expect_no_frames(page: Page) -> None:
    """Wait until the page requests no animation frames: a page that rests costs nothing."""
    wait_until(page, lambda: page.evaluate(FRAMES_REQUESTED) == 0)


def expect_no_faults(page: Page) -> None:
    """Wait until the check of the drawing finds nothing; the error says what it finds."""
    faults = page.locator(".block .fault")
    try:
        expect(faults).to_have_count(0)
    except AssertionError as error:
        found = faults.evaluate_all("(icons) => icons.map((icon) => icon.ariaLabel)")
        raise AssertionError(f"faults are shown: {found}") from error


def play_slowly(page: Page) -> None:
    """Let a playback last ten times as long as the run: it must not end before a busy machine shows it."""
    page.get_by_role("combobox", name="Playback rate").select_option("0.1 ×")


def run(page: Page) -> None:
    """Run the model to its end."""
    page.keyboard.press("Control+Enter")
    expect(page.locator(".run-state")).to_contain_text("done", ignore_case=True)

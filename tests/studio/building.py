"""How people build a model in the page: with the mouse, or with the keyboard."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import Locator, Page, expect

from conftest import PATIENCE_MS

MOST_PANS = 50


def block(page: Page, name: str) -> Locator:
    """A block on the sheet."""
    return page.locator(f'.react-flow__node[data-id="{name}"]')


def new_diagram(page: Page) -> None:
    """Begin with an empty sheet."""
    page.get_by_role("button", name="Menu").click()
    page.get_by_role("menuitem", name="New diagram").click()
    expect(page.get_by_text("Type to add a block")).to_be_visible()


def add(page: Page, typed: str) -> None:
    """Add a block by keyboard alone."""
    page.keyboard.press(typed[0])
    box = page.get_by_role("textbox", name="Add a block")
    expect(box).to_be_visible()
    box.press_sequentially(typed[1:])
    box.press("Enter")
    expect(box).to_be_hidden()


def drag_from_library(page: Page, kind: str, x: float, y: float) -> None:
    """Drop a block with the mouse at a place of the canvas, px."""
    page.get_by_role("textbox", name="Search the library").fill(kind)
    target = page.locator(".canvas")  # an empty one has examples on it
    page.locator(f'.kind[data-type="{kind}"]').drag_to(target, target_position={"x": x, "y": y})
    page.get_by_role("button", name="Clear the search").click()


def wire(page: Page, source: str, target: str) -> None:
    """Draw a wire with the mouse, between two handles ``block/port``.

    The sheet pans while the mouse is near its edge: the mouse follows the target until the sheet shows that
    a wire would end there.
    """

    def handle(port: str) -> Locator:
        name, _, end = port.partition("/")
        return block(page, name).locator(f'[data-handleid="{end}"]')

    def middle(port: str) -> tuple[float, float]:
        box = handle(port).bounding_box()
        assert box is not None
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    page.mouse.move(*middle(source))
    page.mouse.down()
    reached = handle(target).and_(page.locator(".connectingto"))
    for _ in range(MOST_PANS):
        page.mouse.move(*middle(target), steps=5)
        if reached.count():
            break
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


def play_slowly(page: Page) -> None:
    """Let a playback last ten times as long as the run: it must not end before a busy machine shows it."""
    page.get_by_role("combobox", name="Playback rate").select_option("0.1 ×")


def run(page: Page) -> None:
    """Run the model to its end."""
    page.keyboard.press("Control+Enter")
    expect(page.locator(".run-state")).to_contain_text("done", ignore_case=True)

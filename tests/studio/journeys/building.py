"""Actions that build a model in the page, with the mouse or the keyboard."""

from __future__ import annotations

import json
import re
from collections.abc import Callable

from browsers import IN_FIREFOX
from playwright.sync_api import Locator, Page, expect

from conftest import TIMEOUT_MS

DIALOG = "[role=dialog]"
"""The open dialog: searching a role inside it is faster than in the whole page."""
REQUESTED_FRAMES = """async () => {
    // Number of animation frames that the page requests during ten frames.
    const request = window.requestAnimationFrame
    let count = 0
    window.requestAnimationFrame = (callback) => (count++, request.call(window, callback))
    for (let k = 0; k < 10; k++) await new Promise((resolve) => request.call(window, resolve))
    window.requestAnimationFrame = request
    return count
}"""
VIEW_IS_STILL = """async () => {
    // Whether the view of the sheet is unchanged during three frames.
    const view = () => document.querySelector('.react-flow__viewport')?.style.transform
    const before = view()
    for (let k = 0; k < 3; k++) await new Promise((resolve) => requestAnimationFrame(resolve))
    return view() === before
}"""
DROP_ENTRY = """(entry, [target, x, y]) => {
    const dataTransfer = new DataTransfer()
    const { left, top } = target.getBoundingClientRect()
    const values = { dataTransfer, bubbles: true, cancelable: true, clientX: left + x, clientY: top + y }
    entry.dispatchEvent(new DragEvent('dragstart', values))
    const below = document.elementFromPoint(left + x, top + y)
    for (const kind of ['dragenter', 'dragover', 'drop']) below.dispatchEvent(new DragEvent(kind, values))
    entry.dispatchEvent(new DragEvent('dragend', values))
}"""
IS_UPPERMOST = """(element) => {
    const { x, y, width, height } = element.getBoundingClientRect()
    return document.elementFromPoint(x + width / 2, y + height / 2) === element
}"""


def block(page: Page, name: str) -> Locator:
    """A block on the sheet."""
    return page.locator(f'.react-flow__node[data-id="{name}"]')


def edge(page: Page, wire: str) -> Locator:
    """A wire on the sheet."""
    return page.locator(f'.react-flow__edge[data-id="{wire}"]')


def middle(element: Locator) -> tuple[float, float]:
    """The centre of an element after it is drawn; wires are drawn after their blocks."""
    box = None

    def is_drawn() -> bool:
        nonlocal box
        box = element.bounding_box()
        return box is not None

    wait_until(element.page, is_drawn)
    assert box is not None
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def keep_view(page: Page) -> None:
    """Fix the view of the sheet: without user input, the sheet fits itself into its panel.

    A fit that has begun ends first, so that positions can be measured one after the other.
    """
    page.locator(".canvas").dispatch_event("wheel")
    wait_until(page, lambda: page.evaluate(VIEW_IS_STILL))


def choose_in_menu(page: Page, entry: str | re.Pattern[str]) -> None:
    """Choose an entry of the main menu."""
    page.get_by_role("button", name="Menu").click()
    page.get_by_role("menuitem", name=entry).click()
    expect(page.get_by_role("menu")).to_be_hidden()


def new_diagram(page: Page) -> None:
    """Start with an empty sheet."""
    choose_in_menu(page, "New diagram")
    expect(page.get_by_text("Type to add a block")).to_be_visible()


def add(page: Page, typed: str, *, by_key: bool = True) -> None:
    """Add a block with the keyboard: key by key, or with the text filled in after the first letter."""
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


def drop_entry(entry: Locator, target: Locator, x: float, y: float) -> None:
    """Drop an entry of the library on an element, at a position relative to it, px."""
    if IN_FIREFOX:  # BiDi starts a drag, but does not end it
        entry.evaluate(DROP_ENTRY, [target.element_handle(), x, y])
    else:
        entry.drag_to(target, target_position={"x": x, "y": y})


def double_click(element: Locator, *, force: bool = False) -> None:
    """Click twice. ``force``: do not wait until the element is uppermost."""
    if IN_FIREFOX:  # counts the clicks within one command of BiDi only
        for _ in range(2):
            element.click(force=force)
        element.dispatch_event("dblclick", {"bubbles": True, "cancelable": True, "detail": 2})
    else:
        element.dblclick(force=force)


def drag_from_library(page: Page, kind: str, x: float, y: float) -> None:
    """Drop a block with the mouse at a position of the canvas, px."""
    library = page.locator(".palette")
    library.get_by_role("textbox", name="Search the library").fill(kind)
    target = page.locator(".canvas")  # the list of examples covers an empty sheet
    drop_entry(library.locator(f'.kind[data-type="{kind}"]'), target, x, y)
    library.get_by_role("button", name="Clear the search").click()


def wire(page: Page, source: str, target: str) -> None:
    """Draw a wire with the mouse, between two handles ``block/port``.

    The sheet pans while the mouse is near its edge, so the mouse follows the target until the sheet shows
    that the wire would end there. A frame port has two handles at one place, and the last one is uppermost.
    """

    keep_view(page)

    def handles(port: str, state: str = "") -> Locator:
        name, _, end = port.partition("/")
        return block(page, name).locator(f'[data-handleid="{end}"]{state}')

    def handle(port: str) -> Locator:
        return handles(port).last

    def is_free(port: str) -> bool:
        """Whether the mouse can reach the handle: it is on the sheet and not covered."""
        return handle(port).evaluate(IS_UPPERMOST)

    if not (is_free(source) and is_free(target)):  # the sheet has panned while earlier wires were drawn
        page.get_by_role("button", name="Fit View").click()
        wait_until(page, lambda: is_free(source) and is_free(target))
    x, y = middle(handle(source))
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 4, y, steps=2)
    expect(handles(source, ".connectingfrom")).to_have_count(1)
    reached = handles(target, ".connectingto")

    def reach() -> bool:
        page.mouse.move(*middle(handle(target)), steps=5)
        return reached.count() == 1

    wait_until(page, reach)
    page.mouse.up()


def wait_until(page: Page, condition: Callable[[], bool]) -> None:
    """Wait for a condition that no locator expresses: a state of the test, or a relation of two numbers."""
    step = 50
    for _ in range(TIMEOUT_MS // step):
        if condition():
            return
        page.wait_for_timeout(step)  # the events of the browser are handled meanwhile
    raise AssertionError("the condition did not become true")


def select_block(page: Page, name: str) -> None:
    """Click a block until it is selected: a click is lost while the sheet is fitted into its panel."""

    def is_selected() -> bool:
        element = block(page, name)
        element.click()
        return bool(element.evaluate("element => element.closest('.react-flow__node').matches('.selected')"))

    wait_until(page, is_selected)


def copied_names(page: Page, copy: Callable[[], None]) -> list[str]:
    """Names of the blocks that an action copies. The clipboard belongs to the browser, not to the page.

    Playwright's ``wait_for_function`` does not await promises, and ``readText`` returns one.
    """
    page.evaluate("navigator.clipboard.writeText('')")
    copy()
    text = ""

    def is_copied() -> bool:
        nonlocal text
        text = page.evaluate("navigator.clipboard.readText()")
        return bool(text)

    wait_until(page, is_copied)
    return list(json.loads(text)["blocks"])


def open_fresh_example(page: Page) -> None:
    """Show a new copy of the example with a PID controller.

    The title is not sufficient: the document of the previous test has the same title.
    """
    for _ in range(2):  # closes the list and the dialog that a failed test may have left open
        page.keyboard.press("Escape")
    before = page.evaluate("sessionStorage.getItem('armblocks-shown')")
    choose_in_menu(page, re.compile("^van_der_pol_pid PID control"))
    page.wait_for_function("before => sessionStorage.getItem('armblocks-shown') !== before", arg=before)
    expect(page.locator(".title")).to_have_text("van_der_pol_pid")
    expect(block(page, "PID")).to_be_visible()
    keep_view(page)


def expect_focus_inside(element: Locator) -> None:
    """Wait until a dialog has the focus, which it takes shortly after it is displayed."""
    expect(element.locator(":focus")).to_have_count(1)


def expect_no_frames(page: Page) -> None:
    """Wait until the page requests no animation frames: an idle page uses no processor time."""
    wait_until(page, lambda: page.evaluate(REQUESTED_FRAMES) == 0)


def expect_no_faults(page: Page) -> None:
    """Wait until the check of the drawing has no findings; on failure the error lists them."""
    faults = page.locator(".block .fault, .port.unconnected")
    try:
        expect(faults).to_have_count(0)
    except AssertionError as error:
        texts = faults.evaluate_all("(marks) => marks.map((mark) => mark.ariaLabel ?? mark.title)")
        raise AssertionError(f"faults are shown: {texts}") from error


def play_slowly(page: Page) -> None:
    """Extend a playback to ten times the run time, so that it does not end before a busy machine shows it."""
    page.get_by_role("combobox", name="Playback rate").select_option("0.1 ×")


def run(page: Page) -> None:
    """Run the model to its end."""
    page.keyboard.press("Control+Enter")
    expect(page.locator(".run-state")).to_contain_text("done", ignore_case=True)


def open_shipped_robot(page: Page, name: str) -> Locator:
    """Open a copy of a shipped robot; returns its editor."""
    page.get_by_role("button", name="Menu").click()
    page.get_by_role("menuitem", name=name, exact=True).click()
    editor = page.locator(".robot-editor")
    if not IN_FIREFOX:  # which has no WebGL without a graphics card
        expect(editor.locator("canvas")).to_be_visible()
    return editor

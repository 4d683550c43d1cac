"""Documents in a real browser: save, open, external changes, two pages, reload."""

from __future__ import annotations

import json
import re

import pytest
from building import add, block, new_diagram, select_block, wait_until
from document_files import edit_from_outside, names, save_as
from playwright.sync_api import Page, WebSocketRoute, expect

from conftest import Studio


@pytest.fixture
def page(shared: Page) -> Page:
    """The page that all tests in this file share, with an empty document."""
    new_diagram(shared)
    expect(shared.get_by_role("menu")).to_be_hidden()  # a closing menu still takes keys
    return shared


def test_save_as_asks_before_it_overwrites(page: Page, studio: Studio) -> None:
    folder = studio.folder
    add(page, "constant")
    expect(page).to_have_title("• untitled – armblocks")
    page.keyboard.press("Control+s")
    field = page.get_by_role("combobox", name="File")
    field.fill("a:b")
    page.get_by_role("button", name="Save", exact=True).click()
    expect(page.get_by_text("is not a path of the project")).to_be_visible()
    field.fill("models/one")
    field.press("Enter")
    expect(page.locator(".title")).to_have_text("one")
    expect(page).to_have_title("one – armblocks")
    expect(page).to_have_url(re.compile("#models/one.json$"))
    assert (folder / "models" / "one.json").is_file()
    (folder / "theirs.json").write_text("{}")
    page.keyboard.press("Control+Shift+S")
    page.get_by_role("combobox", name="File").fill("theirs.json")
    expect(page.get_by_text("theirs.json already exists")).to_be_visible()
    page.get_by_role("button", name="Cancel").click()
    assert (folder / "theirs.json").read_text() == "{}"
    page.keyboard.press("Control+Shift+S")
    page.get_by_role("combobox", name="File").fill("theirs.json")
    page.get_by_role("button", name="Overwrite").click()
    expect(page.locator(".title")).to_have_text("theirs")
    page.keyboard.press("Control+o")
    page.get_by_role("textbox", name="Search the files").fill("one")
    page.get_by_role("dialog").get_by_text("models/one.json").click()
    expect(page.locator(".title")).to_have_text("one")


def test_a_file_changed_on_disk_is_reported_and_the_user_chooses_a_version(
    page: Page, studio: Studio
) -> None:
    file = studio.folder / "shared.json"
    add(page, "constant")
    save_as(page, "shared.json")
    add(page, "gain")
    expect(block(page, "Gain")).to_be_visible()
    edit_from_outside(file)
    notice = page.get_by_text("shared.json has changed on the disk")
    expect(notice).to_be_visible()
    page.keyboard.press("Control+s")
    expect(page.get_by_text("the file has changed on the disk since it was opened")).to_be_visible()
    page.get_by_role("button", name="Dismiss").click()
    page.get_by_role("button", name="Reload").click()
    expect(notice).to_be_hidden()
    expect(block(page, "Gain")).to_have_count(0)
    page.locator(".react-flow__pane").click(position={"x": 5, "y": 5})
    page.keyboard.press("Control+z")
    expect(block(page, "Gain")).to_be_visible()
    file.write_text(file.read_text().replace("theirs", "theirs again"))
    expect(notice).to_be_visible()
    page.get_by_role("button", name="Keep mine").click()
    expect(notice).to_be_hidden()
    page.keyboard.press("Control+s")
    expect(page.locator(".title")).to_have_text("shared")
    expect(page).to_have_title("shared – armblocks")
    assert "Gain" in names(file)


class DelayedWebSocket:
    """The websocket of a page, on which messages of the server can be delayed.

    The replies to connection tests, which have the number 0, are not delayed: the page would connect again.
    """

    def __init__(self, page: Page) -> None:
        self.delayed = False
        self.waiting: list[str | bytes] = []
        page.route_web_socket("**/ws", self._connect)

    def _connect(self, socket: WebSocketRoute) -> None:
        self._page = socket
        server = socket.connect_to_server()
        socket.on_message(server.send)
        server.on_message(self._notify)

    def _notify(self, message: str | bytes) -> None:
        is_test = isinstance(message, str) and json.loads(message).get("number") == 0
        if self.delayed and not is_test:
            self.waiting.append(message)
        else:
            self._page.send(message)

    def release(self) -> None:
        self.delayed = False
        while self.waiting:
            self._page.send(self.waiting.pop(0))


def test_a_conflicting_edit_is_reported_and_both_pages_show_the_same_diagram(
    page: Page,
) -> None:
    add(page, "gain")
    add(page, "integrator")
    save_as(page, "two.json")
    other = page.context.new_page()
    socket = DelayedWebSocket(other)
    other.goto(page.url)
    expect(block(other, "Gain")).to_be_visible()
    select_block(other, "Gain")
    socket.delayed = True
    select_block(page, "Gain")
    page.keyboard.press("ArrowDown")
    expect(page.get_by_role("button", name="Undo move Gain (Ctrl+Z)")).to_be_enabled()
    other.keyboard.press("ArrowRight")  # moves Gain from its former position
    wait_until(page, lambda: any("change from another page" in str(message) for message in socket.waiting))
    socket.release()
    expect(other.get_by_text("your change conflicts with a change from another page")).to_be_visible()
    other.locator(".react-flow__pane").click(position={"x": 5, "y": 5})
    add(other, "sum")
    expect(block(page, "Sum")).to_be_visible()
    places = "nodes => nodes.map(node => [node.dataset.id, node.style.transform]).sort()"
    own_nodes, other_nodes = (shown.locator(".react-flow__node") for shown in (page, other))
    wait_until(page, lambda: own_nodes.evaluate_all(places) == other_nodes.evaluate_all(places))
    block(page, "Sum").click()
    page.keyboard.press("Delete")
    expect(block(other, "Sum")).to_have_count(0)
    other.locator(".react-flow__pane").click(position={"x": 5, "y": 5})
    other.keyboard.press("Control+z")
    expect(block(page, "Sum")).to_be_visible()
    new_diagram(other)  # the menu button keeps the focus
    socket.delayed = True
    add(other, "gain")
    other.keyboard.type("integrator")
    other.keyboard.press("Enter")
    socket.release()
    expect(block(other, "Integrator")).to_have_class(re.compile("selected"))
    left = "node => new DOMMatrix(node.style.transform).e"
    gain, integrator = (block(other, name).evaluate(left) for name in ("Gain", "Integrator"))
    assert integrator > gain + 60  # right of the block that was added before
    other.close()
    page.keyboard.press("Control+s")
    expect(page).to_have_title("two – armblocks")


def test_a_reloaded_page_shows_the_run_again(page: Page) -> None:
    add(page, "sine wave")
    page.keyboard.press("Control+Enter")
    state = page.locator(".run-state")
    expect(state).to_contain_text("done")
    page.reload()
    expect(state).to_contain_text("done")
    expect(state).to_contain_text("10.00 s")
    save_as(page, "run.json")  # so that the studio does not offer these edits to a later test

"""Documents in a real browser: saved, opened, changed from outside, found again after a crash."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from accessibility import axe
from building import wait_until
from playwright.sync_api import Browser, BrowserContext, Page, WebSocketRoute, expect

from conftest import Studio, new_context


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[list[Studio]]:
    """The studio of all tests here; who kills it puts the next one in its place."""
    # Not with the first example: its arm takes a browser without graphics long.
    servers = [Studio(tmp_path_factory.mktemp("project"), "van_der_pol_pid")]
    yield servers
    servers[-1].stop()


@pytest.fixture(scope="module")
def context(browser: Browser, server: list[Studio]) -> Iterator[BrowserContext]:
    context = new_context(browser)
    first = context.new_page()
    first.goto(server[0].link)
    first.locator(".react-flow__node").first.wait_for()
    first.close()
    yield context
    context.close()


@pytest.fixture
def page(context: BrowserContext, server: list[Studio]) -> Iterator[Page]:
    """A page with an empty document. An error that the lost line does not explain fails the test."""
    page = context.new_page()
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("console", lambda said: faults.append(said.text) if said.type == "error" else None)
    page.goto(server[-1].address)
    page.locator(".react-flow__pane").wait_for()
    page.get_by_role("button", name="Menu").click()
    page.get_by_role("menuitem", name="New diagram").click()
    expect(page.get_by_text("Type to add a block")).to_be_visible()
    expect(page.get_by_role("menu")).to_be_hidden()  # it takes keys as long as it closes
    yield page
    page.close()
    assert [said for said in faults if "ERR_CONNECTION_" not in said] == []


def block(page: Page, name: str):
    return page.locator(f'.react-flow__node[data-id="{name}"]')


def add(page: Page, typed: str) -> None:
    page.keyboard.press(typed[0])
    box = page.get_by_role("textbox", name="Add a block")
    box.press_sequentially(typed[1:])
    box.press("Enter")
    expect(box).to_be_hidden()


def save_as(page: Page, path: str) -> None:
    page.keyboard.press("Control+Shift+S")
    page.get_by_role("combobox", name="File").fill(path)
    page.get_by_role("button", name="Save", exact=True).click()
    expect(page.get_by_role("dialog")).to_be_hidden()


def names(path: Path) -> list[str]:
    return sorted(json.loads(path.read_text())["blocks"])


def edit_from_outside(path: Path) -> bytes:
    """What another program writes to a model's file."""
    path.write_text(json.dumps({**json.loads(path.read_text()), "description": "theirs"}))
    return path.read_bytes()


def test_save_as_asks_before_it_overwrites(page: Page, server: list[Studio]) -> None:
    folder = server[-1].folder
    add(page, "constant")
    expect(page).to_have_title("• untitled – armblocks")
    page.keyboard.press("Control+s")
    field = page.get_by_role("combobox", name="File")
    field.fill("a:b")
    page.get_by_role("button", name="Save", exact=True).click()
    expect(page.get_by_text("is no path of the project")).to_be_visible()
    field.fill("models/one")
    field.press("Enter")
    expect(page.locator(".title")).to_have_text("one")
    expect(page).to_have_title("one – armblocks")
    expect(page).to_have_url(re.compile("#models/one.json$"))
    assert (folder / "models" / "one.json").is_file()
    (folder / "theirs.json").write_text("{}")
    page.keyboard.press("Control+Shift+S")
    page.get_by_role("combobox", name="File").fill("theirs.json")
    expect(page.get_by_text("theirs.json is there already")).to_be_visible()
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


def test_a_file_that_changed_on_the_disk_is_told_and_chosen(page: Page, server: list[Studio]) -> None:
    file = server[-1].folder / "shared.json"
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


class Line:
    """The websocket of a page, on which the server's words can be held back."""

    def __init__(self, page: Page) -> None:
        self.held = False
        self.waiting: list[str | bytes] = []
        page.route_web_socket("**/ws", self._connect)

    def _connect(self, line: WebSocketRoute) -> None:
        self._page = line
        server = line.connect_to_server()
        line.on_message(server.send)
        server.on_message(self._tell)

    def _tell(self, said: str | bytes) -> None:
        if self.held:
            self.waiting.append(said)
        else:
            self._page.send(said)

    def release(self) -> None:
        self.held = False
        for said in self.waiting:
            self._page.send(said)


def test_an_edit_of_what_the_other_page_changed_is_told_and_both_agree(
    page: Page, context: BrowserContext
) -> None:
    add(page, "gain")
    add(page, "integrator")
    save_as(page, "two.json")
    other = context.new_page()
    line = Line(other)
    other.goto(page.url)
    expect(block(other, "Gain")).to_be_visible()
    block(other, "Gain").click()
    line.held = True
    block(page, "Gain").click()
    page.keyboard.press("ArrowDown")
    expect(page.get_by_role("button", name="Undo move Gain (Ctrl+Z)")).to_be_enabled()
    other.keyboard.press("ArrowRight")  # of the place where Gain is not any more
    wait_until(page, lambda: any("changed in another page" in str(said) for said in line.waiting))
    line.release()
    expect(other.get_by_text("what you changed was changed in another page meanwhile")).to_be_visible()
    other.locator(".react-flow__pane").click(position={"x": 5, "y": 5})
    add(other, "sum")
    expect(block(page, "Sum")).to_be_visible()
    places = "nodes => nodes.map(node => [node.dataset.id, node.style.transform]).sort()"
    here, there = (shown.locator(".react-flow__node") for shown in (page, other))
    wait_until(page, lambda: here.evaluate_all(places) == there.evaluate_all(places))
    other.close()
    page.keyboard.press("Control+s")
    expect(page).to_have_title("two – armblocks")


def test_a_run_is_shown_again_after_a_reload(page: Page) -> None:
    add(page, "sine wave")
    page.keyboard.press("Control+Enter")
    state = page.locator(".run-state")
    expect(state).to_contain_text("done")
    page.reload()
    expect(state).to_contain_text("done")
    expect(state).to_contain_text("10.00 s")
    save_as(page, "run.json")  # nothing that the page after a crash would be offered


def test_edits_survive_a_killed_server_and_go_on_in_the_same_page(page: Page, server: list[Studio]) -> None:
    old = server[-1]
    add(page, "sine wave")
    expect(block(page, "Sine Wave")).to_be_visible()
    old.kill()
    expect(page.get_by_text("The studio does not answer")).to_be_visible()
    axe(page)
    add(page, "gain")  # waits in the page
    server.append(Studio(old.folder))
    assert server[-1].address == old.address
    expect(block(page, "Gain")).to_be_visible()
    expect(page.get_by_text("The studio does not answer")).to_be_hidden()
    expect(block(page, "Sine Wave")).to_be_visible()
    page.reload()
    expect(page.locator(".react-flow__node")).to_have_count(2)
    page.locator(".react-flow__pane").click(position={"x": 5, "y": 5})
    page.keyboard.press("Control+z")
    expect(block(page, "Gain")).to_have_count(0)
    page.keyboard.press("Control+z")
    expect(page.locator(".react-flow__node")).to_have_count(0)
    save_as(page, "killed.json")


def test_robot_edits_survive_a_killed_server_and_a_reload(page: Page, server: list[Studio]) -> None:
    old = server[-1]
    page.get_by_role("button", name="Menu").click()
    page.get_by_role("menuitem", name="New robot").click()
    editor = page.locator(".robot-editor")
    length = editor.get_by_role("textbox", name="a of link1", exact=True)
    length.fill("0.75")
    length.press("Enter")
    expect(editor.get_by_label("changed", exact=True)).to_be_visible()
    old.kill()
    expect(page.get_by_text("The studio does not answer")).to_be_visible()
    other = editor.get_by_role("textbox", name="a of link2", exact=True)
    other.fill("0.25")  # waits in the page, and outlives it
    other.press("Enter")
    server.append(Studio(old.folder))
    page.reload()
    expect(length).to_have_value("0.75")
    expect(other).to_have_value("0.25")
    page.locator(".robot-editor .title").click()  # no cell has the keys
    page.keyboard.press("Escape")
    for value in ("0.5", "0.25"):
        page.get_by_role("button", name="Undo" if value == "0.5" else "Redo").click()
        expect(other).to_have_value(value)
    page.keyboard.press("Control+s")
    page.get_by_role("textbox", name="File in this folder").fill("arm.json")
    page.get_by_role("button", name="Save", exact=True).click()
    expect(editor.get_by_text("arm.json")).to_be_visible()
    assert [link["dh"]["a"] for link in json.loads((old.folder / "arm.json").read_text())["links"]] == [
        0.75,
        0.25,
    ]


def test_a_page_that_comes_after_the_crash_is_offered_what_was_drawn(
    page: Page, context: BrowserContext, server: list[Studio]
) -> None:
    folder = server[-1].folder
    add(page, "constant")
    save_as(page, "lost.json")
    add(page, "gain")
    expect(block(page, "Gain")).to_be_visible()
    page.goto("about:blank")
    server[-1].kill()
    file = folder / "lost.json"
    newer = edit_from_outside(file)
    server.append(Studio(folder, "van_der_pol_pid"))
    fresh = context.new_page()
    fresh.goto(server[-1].address)
    offer = fresh.get_by_role("group", name="lost.json")
    expect(offer).to_contain_text(re.compile("1 edit from .* to .*; 2 blocks"))
    expect(offer).to_contain_text("the file is newer")
    offer.get_by_role("button", name="Keep both").click()
    expect(offer).to_be_hidden()
    if fresh.get_by_role("dialog").count():
        fresh.keyboard.press("Escape")  # other tests have left something too
    expect(fresh.locator(".title")).to_have_text(re.compile("^lost recovered 20"))
    assert file.read_bytes() == newer
    (kept,) = folder.glob("lost recovered *.json")
    assert names(kept) == ["Constant", "Gain"]
    fresh.close()

"""Documents in a real browser, found again after the studio was killed."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator

import pytest
from accessibility import axe
from building import add, block
from document_files import edit_from_outside, names, save_as
from playwright.sync_api import Browser, BrowserContext, Page, expect

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

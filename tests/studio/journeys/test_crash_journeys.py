"""Recovery of documents in a real browser after the studio was killed."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass

import pytest
from accessibility import axe
from browsers import LOST_CONNECTION
from building import add, block, new_diagram
from document_files import edit_from_outside, names, save_as
from playwright.sync_api import Browser, Locator, Page, expect

from conftest import Studio, new_context


@dataclass(frozen=True, kw_only=True)
class Crash:
    """A studio after a crash, and the pages that were open during it."""

    studio: Studio
    """The restarted studio, in the same folder."""
    before: Studio
    drawing: Page
    """A page whose diagram has a sine wave from before the crash and a gain added during the outage."""
    robot: Page
    """A page whose robot has link1 of 0.75 m from before the crash and link2 of 0.25 m from the outage."""
    overwritten: bytes
    """Content that another program wrote after the crash into a file with unsaved edits in the studio.
    The page of that diagram was closed before the crash."""


@pytest.fixture(scope="module")
def crash(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Crash]:
    """One crash for all tests of the file. Errors other than the lost connection fail the last test."""
    # Not the first example: software rendering of its arm takes long.
    old = Studio(tmp_path_factory.mktemp("project"), "van_der_pol_pid")
    context = new_context(browser)
    context.request.get(old.link)
    faults: list[str] = []
    context.on("weberror", lambda error: faults.append(str(error.error)))
    context.on("console", lambda line: faults.append(line.text) if line.type == "error" else None)
    drawing, robot, closed = (context.new_page() for _ in range(3))
    for page in (drawing, robot, closed):
        page.goto(old.address)
        page.locator(".react-flow__node").first.wait_for()
    draw_and_leave(closed)
    drawing.bring_to_front()  # in Firefox only the page in front has the focus
    new_diagram(drawing)
    add(drawing, "sine wave")
    expect(block(drawing, "Sine Wave")).to_be_visible()
    robot.bring_to_front()
    robot.get_by_role("button", name="Menu").click()
    robot.get_by_role("menuitem", name="New robot").click()
    set_length(robot, "link1", "0.75")
    expect(robot.locator(".robot-editor").get_by_label("changed", exact=True)).to_be_visible()
    old.kill()
    overwritten = edit_from_outside(old.folder / "lost.json")
    for page in (drawing, robot):
        expect(outage_message(page)).to_be_visible()
    drawing.bring_to_front()
    axe(drawing)
    add(drawing, "gain")  # queued in the page
    robot.bring_to_front()
    set_length(robot, "link2", "0.25")  # queued in the page, and preserved across its reload
    studio = Studio(old.folder, "van_der_pol_pid")
    yield Crash(studio=studio, before=old, drawing=drawing, robot=robot, overwritten=overwritten)
    context.close()
    studio.stop()
    assert [line for line in faults if not LOST_CONNECTION.search(line)] == []


def draw_and_leave(page: Page) -> None:
    """Save a diagram, change it, and leave the page."""
    new_diagram(page)
    add(page, "constant")
    save_as(page, "lost.json")
    add(page, "gain")
    expect(block(page, "Gain")).to_be_visible()
    page.goto("about:blank")


def length(page: Page, link: str) -> Locator:
    """The field for the length of a link."""
    return page.locator(".robot-editor").get_by_role("textbox", name=f"a of {link}", exact=True)


def set_length(page: Page, link: str, value: str) -> None:
    length(page, link).fill(value)
    length(page, link).press("Enter")


def outage_message(page: Page) -> Locator:
    """The message that the page shows while the studio is unreachable."""
    return page.get_by_text("The studio does not answer")


def test_edits_survive_a_killed_server_and_continue_in_the_same_page(crash: Crash) -> None:
    page = crash.drawing
    page.bring_to_front()
    assert crash.studio.address == crash.before.address
    expect(block(page, "Gain")).to_be_visible()
    expect(outage_message(page)).to_be_hidden()
    expect(block(page, "Sine Wave")).to_be_visible()
    page.reload()
    expect(page.locator(".react-flow__node")).to_have_count(2)
    page.locator(".react-flow__pane").click(position={"x": 5, "y": 5})
    page.keyboard.press("Control+z")
    expect(block(page, "Gain")).to_have_count(0)
    page.keyboard.press("Control+z")
    expect(page.locator(".react-flow__node")).to_have_count(0)
    save_as(page, "killed.json")


def test_robot_edits_survive_a_killed_server_and_a_reload(crash: Crash) -> None:
    page = crash.robot
    page.bring_to_front()
    page.reload()
    expect(length(page, "link1")).to_have_value("0.75")
    expect(length(page, "link2")).to_have_value("0.25")
    page.locator(".robot-editor .title").click()  # no cell has the focus
    page.keyboard.press("Escape")
    for value in ("0.5", "0.25"):
        page.get_by_role("button", name="Undo" if value == "0.5" else "Redo").click()
        expect(length(page, "link2")).to_have_value(value)
    page.keyboard.press("Control+s")
    page.get_by_role("textbox", name="File in this folder").fill("arm.json")
    page.get_by_role("button", name="Save", exact=True).click()
    expect(page.locator(".robot-editor").get_by_text("arm.json")).to_be_visible()
    links = json.loads((crash.studio.folder / "arm.json").read_text())["links"]
    assert [link["dh"]["a"] for link in links] == [0.75, 0.25]


def test_a_new_page_after_the_crash_offers_the_unsaved_diagram(crash: Crash) -> None:
    folder = crash.studio.folder
    new_page = crash.drawing.context.new_page()
    new_page.goto(crash.studio.address)
    offer = new_page.get_by_role("group", name="lost.json")
    expect(offer).to_contain_text(re.compile("1 edit from .* to .*; 2 blocks"))
    expect(offer).to_contain_text("the file is newer")
    offer.get_by_role("button", name="Keep both").click()
    expect(offer).to_be_hidden()
    expect(new_page.locator(".title")).to_have_text(re.compile("^lost recovered 20"))
    assert (folder / "lost.json").read_bytes() == crash.overwritten
    (recovered,) = folder.glob("lost recovered *.json")
    assert names(recovered) == ["Constant", "Gain"]
    new_page.close()

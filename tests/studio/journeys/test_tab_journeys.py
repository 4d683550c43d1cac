"""Several documents in one page: tabs, views that return, closing with unsaved changes."""

from __future__ import annotations

import re

import pytest
from accessibility import axe
from building import (
    VIEW_IS_STILL,
    add,
    block,
    new_diagram,
    run,
    select_block,
    wait_until,
)
from document_files import names
from playwright.sync_api import Locator, Page, expect

from armblocks.formats import load_robot, write_robot
from conftest import Studio

VIEW = "document.querySelector('.react-flow__viewport').style.transform"


def tabs(page: Page) -> Locator:
    return page.get_by_role("tablist", name="Open documents").get_by_role("tab")


def tab_in_front(page: Page) -> Locator:
    return page.get_by_role("tablist", name="Open documents").locator("[aria-selected=true]")


@pytest.fixture
def two(sheet: Page) -> Page:
    """A page with two tabs: a copy of the example, and an empty diagram in front."""
    new_diagram(sheet)
    expect(tab_in_front(sheet)).to_contain_text("untitled")
    return sheet


def test_a_document_returns_with_its_view_selection_and_run(two: Page) -> None:
    two.keyboard.press("Alt+PageUp")
    expect(two.locator(".title")).to_have_text("van_der_pol_pid")
    run(two)
    select_block(two, "PID")
    two.keyboard.press("+")
    wait_until(two, lambda: two.evaluate(VIEW_IS_STILL))
    before = two.evaluate(VIEW)
    two.keyboard.press("Control+c")
    two.keyboard.press("Alt+PageDown")
    expect(two.locator(".title")).to_have_text("untitled")
    expect(two.locator(".run-state")).to_have_text("")
    two.keyboard.press("Control+v")  # the clipboard belongs to all tabs
    expect(block(two, "PID")).to_have_class(re.compile("selected"))
    expect(block(two, "u")).to_have_count(0)
    tabs(two).filter(has_text="van_der_pol_pid").last.click()
    expect(two.locator(".title")).to_have_text("van_der_pol_pid")
    expect(block(two, "PID")).to_have_class(re.compile("selected"))
    wait_until(two, lambda: two.evaluate(VIEW) == before)
    expect(two.locator(".run-state")).to_contain_text("100.00 s")
    expect(two.locator(".chart").first).to_be_visible()
    axe(two, ".document-tabs")


def test_the_keyboard_moves_through_the_tabs_and_closes_them(two: Page) -> None:
    tab_in_front(two).focus()
    two.keyboard.press("ArrowLeft")
    expect(two.locator(".title")).to_have_text("van_der_pol_pid")
    expect(tab_in_front(two)).to_be_focused()
    count = tabs(two).count()
    two.keyboard.press("Delete")
    expect(tabs(two)).to_have_count(count - 1)
    expect(tab_in_front(two)).to_be_focused()


def test_closing_a_document_with_unsaved_changes_asks(two: Page, studio: Studio) -> None:
    count = tabs(two).count()
    add(two, "gain")
    expect(tab_in_front(two).get_by_label("not saved")).to_be_visible()
    dialog = two.get_by_role("dialog", name="Close untitled")
    tab_in_front(two).locator(".close").click()
    dialog.get_by_role("button", name="Cancel").click()
    expect(block(two, "Gain")).to_be_visible()
    two.keyboard.press("Alt+w")
    dialog.get_by_role("textbox", name="File").fill("from_tab")
    dialog.get_by_role("button", name="Save and close").click()
    expect(tabs(two)).to_have_count(count - 1)
    assert names(studio.folder / "from_tab.json") == ["Gain"]
    new_diagram(two)
    add(two, "sine wave")
    tab_in_front(two).click(button="middle")
    dialog.get_by_role("button", name="Discard").click()
    expect(tabs(two)).to_have_count(count - 1)
    expect(two.locator(".title")).to_have_text("van_der_pol_pid")


def test_a_reload_keeps_the_tabs_and_their_unsaved_changes(two: Page) -> None:
    add(two, "gain")
    count = tabs(two).count()
    two.keyboard.press("Alt+PageUp")
    expect(two.locator(".title")).to_have_text("van_der_pol_pid")
    two.reload()
    expect(two.locator(".title")).to_have_text("van_der_pol_pid")
    expect(tabs(two)).to_have_count(count)
    expect(tabs(two).last.get_by_label("not saved")).to_be_visible()
    two.keyboard.press("Alt+PageDown")
    expect(block(two, "Gain")).to_be_visible()


def test_a_document_closed_in_one_page_stays_open_in_the_other(two: Page) -> None:
    add(two, "gain")
    other = two.context.new_page()
    other.goto(two.url.partition("#")[0])
    other.get_by_role("button", name="Menu").click()
    other.get_by_role("menuitem", name="untitled").last.click()
    expect(block(other, "Gain")).to_be_visible()
    count = tabs(two).count()
    two.keyboard.press("Alt+w")
    expect(tabs(two)).to_have_count(count - 1)
    add(other, "constant")
    expect(block(other, "Constant")).to_be_visible()
    other.close()


def test_search_finds_the_blocks_of_all_documents(two: Page) -> None:
    two.keyboard.press("Control+f")
    find = two.get_by_role("textbox", name="Find")
    find.fill("PID")
    listed = two.get_by_role("listbox", name="Found")
    group = listed.get_by_role("group", name=re.compile("van_der_pol_pid")).last
    expect(group.get_by_role("option").first).to_contain_text("PID")
    axe(two, "[role=dialog]")
    group.get_by_role("option").first.click()
    expect(two.locator(".title")).to_have_text("van_der_pol_pid")
    expect(block(two, "PID")).to_have_class(re.compile("selected"))


def test_search_finds_open_robots(two: Page, studio: Studio) -> None:
    file = studio.folder / "found arm.json"
    file.write_bytes(write_robot(load_robot("puma560")))
    two.keyboard.press("Control+o")
    dialog = two.get_by_role("dialog")
    dialog.get_by_role("textbox", name="Search the files").fill("found arm")
    dialog.get_by_text("found arm.json", exact=True).first.click()
    editor = two.locator(".robot-editor")
    expect(editor).to_be_visible()
    tabs(two).filter(has_text="untitled").last.click()
    expect(editor).to_have_count(0)
    two.keyboard.press("Control+f")
    two.get_by_role("textbox", name="Find").fill("found puma")
    expect(two.get_by_role("option", name="Puma 560 Robot")).to_be_visible()
    two.keyboard.press("Enter")
    expect(editor).to_be_visible()
    expect(tab_in_front(two)).to_contain_text("Puma 560")
    two.keyboard.press("Alt+w")
    expect(editor).to_have_count(0)
    file.unlink()

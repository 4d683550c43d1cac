"""Bookmarks of views in the browser: added, shown, renamed, updated and removed, by mouse and by keyboard."""

from __future__ import annotations

import json
import re

import pytest
from accessibility import axe
from building import DIALOG, block, keep_view, select_block, wait_until
from playwright.sync_api import Locator, Page, expect

from conftest import Studio

EMPTY_POINT = """(pane) => {
    // A point of the sheet in its lower half without a block or wire.
    const { x, y, width, height } = pane.getBoundingClientRect()
    for (let down = y + height - 20; down > y + height / 2; down -= 10)
        for (let right = x + 20; right < x + width; right += 10)
            if (document.elementFromPoint(right, down) === pane) return [right, down]
}"""

View = tuple[float, ...]


def view(page: Page) -> View:
    """Shift (px) and zoom of the sheet."""
    style = page.locator(".react-flow__viewport").evaluate("(element) => element.style.transform")
    return tuple(float(number) for number in re.findall(r"-?[\d.]+(?:e-?\d+)?", style))


def expect_view(page: Page, expected: View) -> None:
    """Wait until the sheet has a view; the stored view is rounded to whole pixels."""

    def is_shown() -> bool:
        x, y, zoom = view(page)
        return abs(x - expected[0]) < 3 and abs(y - expected[1]) < 3 and abs(zoom - expected[2]) < 0.01

    wait_until(page, is_shown)


def bookmarks(page: Page) -> Locator:
    return page.locator(DIALOG).get_by_role("list", name="Bookmarks").get_by_role("listitem")


def show_list(page: Page) -> None:
    page.keyboard.press("Control+Shift+b")
    expect(bookmarks(page).locator("button.show:focus")).to_have_count(1)


def bookmark(page: Page, proposed: str, name: str = "") -> None:
    """Bookmark the present view with the keyboard, under the proposed name or another one."""
    page.keyboard.press("Control+b")
    field = page.locator(DIALOG).get_by_role("textbox", name="Name of the present view")
    expect(field).to_be_focused()
    expect(field).to_have_value(proposed)
    if name:
        page.keyboard.type(name)  # the proposed name is selected
    page.keyboard.press("Enter")
    expect(page.locator(DIALOG)).to_have_count(0)


def zoom(page: Page, key: str, times: int) -> View:
    for _ in range(times):
        before = view(page)
        page.keyboard.press(key)
        wait_until(page, lambda before=before: view(page) != before)
    keep_view(page)
    return view(page)


def test_bookmarks_are_used_with_the_keyboard_alone(sheet: Page) -> None:
    keep_view(sheet)
    whole_view = view(sheet)
    title = sheet.locator(".title").inner_text().removesuffix(" •").strip()
    bookmark(sheet, title)
    near_view = zoom(sheet, "+", 3)
    bookmark(sheet, f"{title} 2", "near")

    select_block(sheet, "PID")
    sheet.keyboard.press("Control+g")
    select_block(sheet, "Subsystem")
    sheet.keyboard.press("Enter")
    expect(block(sheet, "PID")).to_be_visible()
    keep_view(sheet)
    inner_view = zoom(sheet, "-", 2)
    bookmark(sheet, "Subsystem")

    # The list shows views of other sheets.
    show_list(sheet)
    expect(bookmarks(sheet)).to_have_count(3)
    sheet.keyboard.press("Enter")
    expect(block(sheet, "Subsystem")).to_be_visible()
    expect_view(sheet, near_view)
    # The palette and the search find bookmarks by name.
    sheet.keyboard.press("Control+k")
    sheet.keyboard.type("subsys")
    expect(sheet.get_by_role("option", name="Subsystem Bookmark · in Subsystem")).to_be_visible()
    # The keys select the last option, the bookmark.
    sheet.keyboard.press("ArrowUp")
    for _ in range(sheet.get_by_role("option").count() - 1):
        sheet.keyboard.press("ArrowDown")
    sheet.keyboard.press("Enter")
    expect(block(sheet, "PID")).to_be_visible()
    expect_view(sheet, inner_view)
    sheet.keyboard.press("Control+f")
    sheet.keyboard.type("near")
    expect(sheet.get_by_role("option", name="near Bookmark").first).to_be_visible()
    sheet.keyboard.press("Enter")
    expect(block(sheet, "Subsystem")).to_be_visible()
    expect_view(sheet, near_view)

    # A renamed subsystem keeps its bookmarks.
    select_block(sheet, "Subsystem")
    sheet.keyboard.press("F2")
    sheet.keyboard.press("Control+a")
    sheet.keyboard.type("controller")
    sheet.keyboard.press("Enter")
    expect(block(sheet, "controller")).to_be_visible()
    show_list(sheet)
    sheet.keyboard.press("End")
    expect(bookmarks(sheet).last).to_contain_text("› controller")
    sheet.keyboard.press("F2")
    name = sheet.get_by_role("textbox", name="New name of Subsystem")
    expect(name).to_be_focused()
    sheet.keyboard.press("Escape")  # closes the field only
    expect(name).to_have_count(0)
    expect(bookmarks(sheet).last.locator("button.show")).to_be_focused()
    sheet.keyboard.press("F2")
    expect(name).to_be_focused()
    sheet.keyboard.type("law")
    sheet.keyboard.press("Enter")
    expect(bookmarks(sheet).last).to_contain_text("law")
    expect(bookmarks(sheet).last.locator("button.show")).to_be_focused()
    sheet.keyboard.press("Home")
    sheet.keyboard.press("Delete")
    expect(bookmarks(sheet)).to_have_count(2)
    sheet.keyboard.press("Escape")

    # The bookmarks of a removed subsystem are restored with it.
    sheet.get_by_role("textbox", name="Stop time, s").blur()
    select_block(sheet, "controller")
    sheet.keyboard.press("Delete")
    show_list(sheet)
    expect(bookmarks(sheet)).to_have_count(1)
    sheet.keyboard.press("Escape")
    expect(sheet.locator(DIALOG)).to_have_count(0)
    sheet.keyboard.press("Control+z")
    show_list(sheet)
    expect(bookmarks(sheet)).to_have_count(2)
    sheet.keyboard.press("Home")
    sheet.keyboard.press("Enter")
    expect_view(sheet, whole_view)


def test_bookmarks_are_used_with_the_mouse(sheet: Page, studio: Studio) -> None:
    keep_view(sheet)
    first = view(sheet)

    def choose_in_menu(entry: str) -> None:
        """Choose an entry of the menu of the sheet, which is longer than the room below the pointer."""
        expect(sheet.locator(DIALOG)).to_have_count(0)
        sheet.mouse.click(*sheet.locator(".react-flow__pane").evaluate(EMPTY_POINT), button="right")
        sheet.get_by_role("menuitem", name=entry).click()
        expect(sheet.locator(DIALOG)).to_be_visible()

    dialog = sheet.locator(DIALOG)
    choose_in_menu("Bookmark this view")
    dialog.get_by_role("textbox", name="Name of the present view").fill("loop")
    dialog.get_by_role("button", name="Add bookmark").click()
    expect(dialog).to_have_count(0)
    sheet.get_by_role("button", name="Zoom In").click()
    wait_until(sheet, lambda: view(sheet) != first)
    keep_view(sheet)
    second = view(sheet)

    choose_in_menu("Bookmarks of views")
    axe(sheet, DIALOG)
    bookmarks(sheet).get_by_role("button", name=re.compile("^loop")).click()
    expect(dialog).to_have_count(0)
    expect_view(sheet, first)
    sheet.get_by_role("button", name="Zoom In").click()
    expect_view(sheet, second)
    keep_view(sheet)
    second = view(sheet)

    def choose_command(entry: str) -> None:
        dialog.get_by_role("button", name="Commands for loop").click()
        sheet.get_by_role("menuitem", name=entry).click()

    choose_in_menu("Bookmarks of views")
    choose_command("Update to the present view")
    undo = sheet.get_by_role("button", name="Undo update the bookmark loop (Ctrl+Z)", include_hidden=True)
    expect(undo).to_have_count(1)
    sheet.keyboard.press("Escape")
    sheet.get_by_role("button", name="Fit View").click()
    wait_until(sheet, lambda: view(sheet) != second)
    keep_view(sheet)
    choose_in_menu("Bookmarks of views")
    bookmarks(sheet).get_by_role("button", name=re.compile("^loop")).click()
    expect_view(sheet, second)

    # The file of the diagram contains the bookmark.
    sheet.keyboard.press("Control+Shift+s")
    dialog.get_by_label("File", exact=True).fill("marked.json")
    sheet.keyboard.press("Enter")
    file = studio.folder / "marked.json"
    wait_until(sheet, file.exists)
    (stored,) = json.loads(file.read_text(encoding="utf-8"))["bookmarks"].items()
    assert stored[0] == "loop"
    x, y, scale = second
    assert stored[1]["x"] == pytest.approx(-x / scale, abs=1)
    assert stored[1]["y"] == pytest.approx(-y / scale, abs=1)
    file.unlink()

    choose_in_menu("Bookmarks of views")
    choose_command("Rename")
    sheet.get_by_role("textbox", name="New name of loop").fill("whole loop")
    sheet.keyboard.press("Enter")
    expect(bookmarks(sheet)).to_contain_text(["whole loop"])
    dialog.get_by_role("button", name="Commands for whole loop").click()
    sheet.get_by_role("menuitem", name="Remove").click()
    expect(bookmarks(sheet)).to_have_count(0)
    sheet.keyboard.press("Escape")
    expect(dialog).to_have_count(0)

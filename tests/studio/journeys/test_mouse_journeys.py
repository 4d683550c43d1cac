"""Mouse actions on a sheet: context menus, copies and branches by the right button, and guides."""

from __future__ import annotations

import re

from accessibility import axe
from browsers import IN_FIREFOX
from building import block, copied_names, edge, middle, run, select_block, wait_until
from playwright.sync_api import Locator, Page, expect


def entry(page: Page, name: str) -> Locator:
    """An entry of the open context menu."""
    return page.locator(".context-menu [role^=menuitem]", has_text=re.compile(f"^{re.escape(name)}"))


def right_drag(page: Page, start: tuple[float, float], end: tuple[float, float]) -> None:
    page.mouse.move(*start)
    page.mouse.down(button="right")
    page.mouse.move(start[0] + 5, start[1] + 5)
    page.mouse.move(*end, steps=4)
    page.mouse.up(button="right")


def test_the_right_button_copies_blocks_and_branches_from_lines(sheet: Page) -> None:
    x, y = middle(block(sheet, "PID").locator(".face"))
    right_drag(sheet, (x, y), (x + 20, y + 70))
    copy = block(sheet, "PID 2")
    expect(copy).to_have_class(re.compile("selected"))
    left, top = middle(copy.locator(".face"))
    assert abs(left - x - 20) <= 5  # half a step of the grid, at this zoom
    assert abs(top - y - 70) <= 5
    expect(sheet.locator(".drawn-copy")).to_have_count(0)
    line = middle(edge(sheet, "PID/y -> u/u1").locator(".segment").first)
    right_drag(sheet, line, middle(copy.locator('[data-handleid="u"]')))
    expect(edge(sheet, "PID/y -> PID 2/u")).to_have_count(1)
    sheet.keyboard.press("Control+z")
    expect(edge(sheet, "PID/y -> PID 2/u")).to_have_count(0)
    sheet.mouse.move(*line)
    sheet.keyboard.down("Control")
    sheet.mouse.down()
    sheet.mouse.move(line[0] + 5, line[1] + 8, steps=2)
    expect(sheet.locator(".drawn-branch")).to_have_count(1)
    sheet.keyboard.press("Escape")
    expect(sheet.locator(".drawn-branch")).to_have_count(0)
    sheet.mouse.up()
    sheet.mouse.move(*line)
    sheet.mouse.down()
    sheet.mouse.move(line[0], line[1] - 60, steps=3)
    sheet.mouse.up()
    sheet.keyboard.up("Control")
    field = sheet.get_by_role("textbox", name="Add a block")
    field.fill("gain")
    field.press("Enter")
    expect(edge(sheet, "PID/y -> Gain/u")).to_have_count(1)
    expect(sheet.get_by_role("menu")).to_have_count(0)


def test_blocks_are_selected_connected_copied_and_deleted_with_modifiers(sheet: Page) -> None:
    block(sheet, "damping").click()
    block(sheet, "one").click(modifiers=["Shift"])
    block(sheet, "x1").click(modifiers=["Shift"])
    selected = sheet.locator(".react-flow__node.selected")
    expect(selected).to_have_count(3)
    block(sheet, "x1").click(modifiers=["Shift"])
    expect(selected).to_have_count(2)
    # A drag with Ctrl copies the block at the pointer, not the selected blocks.
    x, y = middle(block(sheet, "PID").locator(".block"))
    sheet.keyboard.down("Control")
    sheet.mouse.move(x, y)
    sheet.mouse.down()
    sheet.mouse.move(x, y + 100, steps=4)
    sheet.mouse.up()
    sheet.keyboard.up("Control")
    expect(selected).to_have_count(1)
    expect(block(sheet, "PID 2")).to_have_class(re.compile("selected"))
    block(sheet, "one").click()
    block(sheet, "PID 2").click(modifiers=["Control"])
    expect(edge(sheet, "one/y -> PID 2/u")).to_have_count(1)
    expect(selected).to_have_count(1)
    # The end of the wire is moved to another input: the former input is free.
    sheet.keyboard.press("Control+z")
    start = block(sheet, "u").locator('[data-handleid="u1"]')
    end = block(sheet, "PID 2").locator('[data-handleid="u"]')
    expect(edge(sheet, "one/y -> PID 2/u")).to_have_count(0)
    sheet.mouse.move(*middle(start))
    sheet.mouse.down()
    sheet.mouse.move(*middle(end), steps=4)
    sheet.mouse.up()
    expect(edge(sheet, "PID/y -> PID 2/u")).to_have_count(1)
    expect(edge(sheet, "PID/y -> u/u1")).to_have_count(0)
    block(sheet, "damping").click()
    sheet.keyboard.press("Control+Delete")
    expect(edge(sheet, "x2/y -> u/u2")).to_have_count(1)
    expect(block(sheet, "damping")).to_have_count(0)


def test_context_menus_of_blocks_lines_ports_the_sheet_and_charts(sheet: Page) -> None:
    block(sheet, "PID").click(button="right")
    expect(sheet.get_by_role("menu", name="PID")).to_be_visible()
    axe(sheet)
    entry(sheet, "Rename").click()
    field = sheet.get_by_role("textbox", name="Name of PID")
    field.fill("controller")
    field.press("Enter")
    name = "controller"
    expect(block(sheet, name)).to_be_visible()
    select_block(sheet, name)
    if IN_FIREFOX:  # GTK handles the key, which BiDi does not pass to it
        block(sheet, name).click(button="right")
    else:
        sheet.keyboard.press("Shift+F10")
    assert copied_names(sheet, lambda: entry(sheet, "Copy").press("Enter")) == [name]
    expect(block(sheet, name)).to_be_focused()
    pane = sheet.locator(".react-flow__pane")
    pane.click(button="right", position={"x": 40, "y": 40})
    entry(sheet, "Paste here").click()
    pasted = block(sheet, f"{name} 2")
    expect(pasted).to_have_class(re.compile("selected"))
    corner, origin = pasted.locator(".face").bounding_box(), pane.bounding_box()
    assert corner is not None
    assert origin is not None
    assert abs(corner["x"] - origin["x"] - 40) <= 6
    sheet.mouse.click(*middle(edge(sheet, f"{name}/y -> u/u1").locator(".segment").first), button="right")
    entry(sheet, "Log the signal").click()
    expect(sheet.get_by_label(f"{name}/y is logged")).to_be_visible()
    block(sheet, name).locator('[data-handleid="u"]').click(button="right")
    entry(sheet, "Delete its wire").click()
    expect(edge(sheet, f"error/y -> {name}/u")).to_have_count(0)
    sheet.keyboard.press("Control+z")
    expect(edge(sheet, f"error/y -> {name}/u")).to_have_count(1)
    sheet.keyboard.press("Control+z")
    sheet.keyboard.press("Control+z")
    run(sheet)
    chart = sheet.locator('.chart[data-view="Scope"]')
    chart.locator(".u-over").click(button="right")
    entry(sheet, "Measuring cursors").click()
    expect(chart.locator(".between")).to_be_visible()
    chart.locator(".u-over").click(button="right")
    entry(sheet, "Measuring cursors").click()
    chart.locator(".u-over").click(button="right")
    entry(sheet, "Show the block on the sheet").click()
    expect(block(sheet, "Scope")).to_have_class(re.compile("selected"))


def test_the_menu_sets_the_colour_and_the_side_of_the_name(sheet: Page) -> None:
    face = block(sheet, "PID").locator(".face")

    def choose(submenu: str, title: str) -> None:
        face.click(button="right")
        entry(sheet, submenu).hover()
        entry(sheet, title).click()
        expect(sheet.get_by_role("menu")).to_have_count(0)

    choose("Colour", "Blue")
    expect(face.locator("[class*=tint-blue]").first).to_be_visible()
    name = block(sheet, "PID").locator(".name")
    choose("Name", "Above")
    expect(name).to_have_class(re.compile("above"))
    choose("Name", "Hidden")
    expect(name).to_be_hidden()
    sheet.keyboard.press("Control+z")
    expect(name).to_have_class(re.compile("above"))


def test_a_dragged_block_snaps_to_a_straight_line_and_alt_turns_it_off(sheet: Page) -> None:
    def levels() -> tuple[float, float]:
        return tuple(
            middle(block(sheet, name).locator(f'[data-handleid="{port}"]'))[1]
            for name, port in (("PID", "y"), ("damping", "u"))
        )  # type: ignore[return-value]

    output_y, input_y = levels()
    x, y = middle(block(sheet, "damping").locator(".face"))
    sheet.mouse.move(x, y)
    sheet.mouse.down()
    sheet.mouse.move(x, y + 10, steps=2)
    sheet.mouse.move(x, y + output_y - input_y + 3, steps=4)
    expect(sheet.locator(".guides path")).not_to_have_count(0)
    sheet.mouse.up()
    expect(sheet.locator(".guides")).to_have_count(0)
    wait_until(sheet, lambda: abs(levels()[0] - levels()[1]) < 0.1)
    expect(sheet.get_by_role("button", name="Undo move damping (Ctrl+Z)")).to_be_enabled()
    x, y = middle(block(sheet, "damping").locator(".face"))
    sheet.mouse.move(x, y)
    sheet.mouse.down()
    sheet.mouse.move(x, y + 40, steps=3)
    sheet.keyboard.down("Alt")
    sheet.mouse.move(x, y + 4, steps=3)
    expect(sheet.locator(".guides")).to_have_count(0)
    sheet.mouse.up()
    sheet.keyboard.up("Alt")
    wait_until(sheet, lambda: abs(levels()[0] - levels()[1]) > 1)


def test_a_subsystem_shows_a_picture_of_its_sheet_while_the_pointer_rests(sheet: Page) -> None:
    select_block(sheet, "PID")
    sheet.keyboard.press("Control+g")
    expect(block(sheet, "Subsystem")).to_be_visible()
    x, y = middle(block(sheet, "Subsystem"))
    preview = sheet.locator(".subsystem-preview")
    sheet.mouse.move(x, y, steps=2)
    picture = preview.locator("img")
    expect(picture).to_have_count(1)
    wait_until(sheet, lambda: picture.evaluate("picture => picture.complete"))
    expect(preview).to_have_css("opacity", "1")
    assert picture.evaluate("picture => picture.naturalWidth") > 0
    sheet.keyboard.press("Escape")
    expect(preview).to_be_hidden()
    expect(block(sheet, "Subsystem")).to_have_class(
        re.compile("selected")
    )  # Escape has closed the picture only
    sheet.mouse.move(5, 5)
    sheet.mouse.move(x, y, steps=2)
    expect(preview).to_be_visible()
    sheet.mouse.down()
    expect(preview).to_be_hidden()
    sheet.mouse.move(x + 40, y + 40, steps=4)
    sheet.mouse.up()
    expect(sheet.get_by_role("button", name="Undo move Subsystem (Ctrl+Z)")).to_be_enabled()


def test_a_subsystem_shows_a_picture_of_its_sheet_while_it_has_the_keyboard_focus(sheet: Page) -> None:
    select_block(sheet, "PID")
    sheet.keyboard.press("Control+g")
    expect(block(sheet, "Subsystem")).to_be_visible()
    sheet.mouse.move(5, 5)
    preview = sheet.locator(".subsystem-preview")

    def focus_subsystem() -> None:
        """Reach the subsystem with Tab, as the focus passes over the other blocks."""
        sheet.locator(".react-flow__node").first.focus()
        for _ in range(sheet.locator(".react-flow__node").count()):
            sheet.keyboard.press("Tab")
            if block(sheet, "Subsystem").evaluate("(node) => node === document.activeElement"):
                return
        raise AssertionError("Tab does not reach the subsystem")

    focus_subsystem()
    expect(preview).to_have_css("opacity", "1")
    expect(preview.locator("figcaption")).to_have_text("Subsystem")
    sheet.keyboard.press("Escape")
    expect(preview).to_be_hidden()
    expect(block(sheet, "Subsystem")).to_be_focused()
    expect(block(sheet, "Subsystem")).to_have_class(re.compile("selected"))

    # The picture closes when the focus moves to another block. Enter opens the displayed sheet.
    sheet.keyboard.press("Shift+Tab")
    focus_subsystem()
    expect(preview).to_be_visible()
    sheet.keyboard.press("Tab")
    expect(preview).to_be_hidden()
    focus_subsystem()
    expect(preview).to_be_visible()
    sheet.keyboard.press("Enter")
    expect(block(sheet, "PID")).to_be_visible()
    expect(preview).to_be_hidden()

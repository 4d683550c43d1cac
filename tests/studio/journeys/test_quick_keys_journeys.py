"""Keys pressed before the result of the previous edit arrives, cancelled drags, renames, proposed wires."""

from __future__ import annotations

import re

import pytest
from accessibility import axe
from browsers import IN_FIREFOX
from building import add, block, edge, keep_view, middle, new_diagram, run, select_block, wait_until
from playwright.sync_api import Page, expect


def selected_names(page: Page) -> list[str]:
    return page.locator(".react-flow__node.selected").evaluate_all("nodes => nodes.map(n => n.dataset.id)")


def position(page: Page, name: str) -> tuple[float, float]:
    """The position of a block on the sheet, px."""
    transform = block(page, name).evaluate("node => new DOMMatrix(node.style.transform)")
    return transform["e"], transform["f"]


def last_edit(page: Page, title: str) -> None:
    expect(page.get_by_role("button", name=f"Undo {title} (Ctrl+Z)")).to_be_enabled()


def test_each_of_several_quick_copies_is_made_and_none_hides_another(sheet: Page) -> None:
    select_block(sheet, "PID")
    sheet.keyboard.press("Control+c")
    for _ in range(3):
        sheet.keyboard.press("Control+v")
    for _ in range(2):
        sheet.keyboard.press("Control+d")
    names = ["PID"] + [f"PID {k}" for k in range(2, 7)]
    expect(block(sheet, names[-1])).to_have_class(re.compile("selected"))
    last_edit(sheet, "add PID 6")
    assert len({position(sheet, name) for name in names}) == len(names)


def test_keys_after_an_edit_act_on_its_result(sheet: Page) -> None:
    x, y = position(sheet, "damping")
    select_block(sheet, "damping")
    sheet.keyboard.press("F2")
    sheet.keyboard.press("Escape")
    expect(block(sheet, "damping")).to_be_focused()
    sheet.keyboard.press("F2")
    sheet.keyboard.type("friction")
    for key in ("Enter", "ArrowDown", "ArrowDown", "Control+d", "ArrowRight"):
        sheet.keyboard.press(key)
    copy = block(sheet, "friction 2")
    expect(copy).to_have_class(re.compile("selected"))
    last_edit(sheet, "move friction 2")
    expect(block(sheet, "friction")).to_be_focused()
    assert position(sheet, "friction") == (x, y + 10)
    assert position(sheet, "friction 2") == (x + 35, y + 40)
    for key in ("ArrowDown", "Control+z", "ArrowDown", "Control+r", "Control+r"):
        sheet.keyboard.press(key)
    last_edit(sheet, "move friction 2")
    wait_until(sheet, lambda: position(sheet, "friction 2") == (x + 35, y + 45))
    assert selected_names(sheet) == ["friction 2"]


def test_text_typed_directly_after_a_command_reaches_the_field_that_the_command_opens(sheet: Page) -> None:
    select_block(sheet, "PID")
    for key in ("Control+d", "F2", "c", "t", "l", "Backspace", "r", "Enter"):
        sheet.keyboard.press(key)
    expect(block(sheet, "ctr")).to_have_class(re.compile("selected"))
    sheet.keyboard.press('"')
    sheet.keyboard.type("hello")
    sheet.keyboard.press("Control+Enter")
    expect(sheet.locator(".note")).to_have_text("hello")
    expect(sheet.locator(".react-flow__node-note")).to_be_focused()
    expect(sheet.get_by_role("dialog")).to_have_count(0)


def test_a_dialog_that_is_opened_directly_after_a_search_keeps_the_focus(sheet: Page) -> None:
    """The search moves the view to the block later, and the block had the focus before the search."""
    select_block(sheet, "damping")
    sheet.keyboard.press("Control+f")
    sheet.get_by_role("textbox", name="Find").fill("damping")
    expect(sheet.get_by_role("listbox", name="Found").get_by_role("option").first).to_contain_text("damping")
    view = sheet.locator(".react-flow__viewport")
    before = view.get_attribute("style")
    sheet.keyboard.press("Enter")
    expect(block(sheet, "damping")).to_be_focused()
    sheet.keyboard.press("Enter")
    field = sheet.get_by_role("dialog").get_by_role("textbox", name=re.compile("^gain"))
    expect(field).to_be_focused()
    wait_until(sheet, lambda: view.get_attribute("style") != before)
    keep_view(sheet)
    sheet.keyboard.press("Control+a")
    sheet.keyboard.type("0.25")
    expect(field).to_have_value("0.25")
    expect(field).to_be_focused()
    sheet.keyboard.press("Enter")
    expect(sheet.get_by_role("dialog")).to_be_hidden()
    expect(block(sheet, "damping")).to_be_focused()


def test_escape_cancels_a_drag_of_a_block_a_wire_segment_a_new_wire_and_a_corner(sheet: Page) -> None:
    def drag(x: float, y: float, started: str) -> None:
        sheet.mouse.move(x, y)
        sheet.mouse.down()
        sheet.mouse.move(x + 10, y + 50, steps=4)
        expect(sheet.locator(started).first).to_be_attached()
        sheet.keyboard.press("Escape")
        sheet.mouse.move(x + 20, y + 60, steps=2)
        sheet.mouse.up()

    before = position(sheet, "damping")
    drag(*middle(block(sheet, "damping").locator(".face")), ".react-flow__node.dragging")
    wait_until(sheet, lambda: position(sheet, "damping") == before)
    wire = edge(sheet, "PID/y -> u/u1")
    line = wire.locator("path.line").first
    route = line.get_attribute("d") or ""
    x, y = middle(wire.locator(".segment").first)
    drag(x, y, f'.react-flow__edge[data-id="PID/y -> u/u1"] path.line:not([d="{route}"])')
    expect(line).to_have_attribute("d", route)
    drag(*middle(block(sheet, "reference").locator('[data-handleid="y"]')), ".react-flow__connection")
    expect(sheet.locator(".react-flow__connection")).to_have_count(0)
    select_block(sheet, "PID")
    drag(*middle(block(sheet, "PID").locator(".resize").last), ".resized")
    expect(sheet.locator(".resized")).to_have_count(0)
    expect(sheet.get_by_role("dialog")).to_have_count(0)
    expect(sheet.get_by_role("button", name="Nothing to undo")).to_be_disabled()


def test_keys_move_and_delete_blocks_that_are_selected_by_a_rectangle(sheet: Page) -> None:
    pane = sheet.locator(".react-flow__pane").bounding_box()
    assert pane is not None
    before, count = position(sheet, "PID"), sheet.locator(".react-flow__node").count()
    sheet.mouse.move(pane["x"] + 3, pane["y"] + 3)
    sheet.mouse.down()
    sheet.mouse.move(pane["x"] + pane["width"] - 20, pane["y"] + pane["height"] - 5, steps=6)
    sheet.mouse.up()
    expect(sheet.locator(".react-flow__node.selected")).to_have_count(count)
    sheet.keyboard.press("ArrowRight")
    wait_until(sheet, lambda: position(sheet, "PID") == (before[0] + 5, before[1]))
    sheet.keyboard.press("Delete")
    expect(sheet.locator(".react-flow__node")).to_have_count(0)


def test_the_run_key_in_a_dialog_runs_with_the_typed_value(sheet: Page) -> None:
    select_block(sheet, "PID")
    sheet.keyboard.press("Enter")
    dialog = sheet.get_by_role("dialog")
    field = dialog.get_by_role("textbox", name="P", exact=True)
    field.fill("3.5")
    sheet.mouse.click(5, 300)  # beside the dialog
    expect(field).to_have_value("3.5")
    field.press("Control+Enter")
    last_edit(sheet, "change PID")
    expect(sheet.locator(".run-state")).to_contain_text("done", ignore_case=True)


def test_scopes_values_and_tried_values_follow_renamed_blocks(sheet: Page) -> None:
    def charts() -> list[str]:
        return sheet.locator(".chart").evaluate_all("charts => charts.map(chart => chart.dataset.view)")

    def rename(name: str, to: str) -> None:
        select_block(sheet, name)
        sheet.keyboard.press("F2")
        field = sheet.get_by_role("textbox", name=f"Name of {name}")
        field.fill(to)
        field.press("Enter")
        expect(block(sheet, to)).to_have_class(re.compile("selected"))

    run(sheet)
    rename("Scope", "Plot")
    wait_until(sheet, lambda: charts() == ["Control", "Phase", "Plot"])
    rename("PID", "controller")
    wire = edge(sheet, "controller/y -> u/u1").locator(".segment").first
    sheet.mouse.move(*middle(wire))
    expect(sheet.locator('.wire-value[data-path="controller/y"]')).not_to_be_empty()
    sheet.get_by_role("tab", name="Tune").click()
    tried = sheet.get_by_role("textbox", name="controller.P", exact=True)
    tried.fill("7")
    tried.press("Enter")
    rename("controller", "C")
    expect(sheet.get_by_role("textbox", name="C.P", exact=True)).to_have_value("7")
    run(sheet)
    sheet.get_by_role("tab", name="Scopes").click()
    sheet.keyboard.press("Escape")
    for _ in range(3):
        sheet.keyboard.press("Control+z")
    expect(block(sheet, "Scope")).to_be_visible()
    wait_until(sheet, lambda: charts() == ["Control", "Phase", "Scope"])
    if not IN_FIREFOX:
        sheet.reload()
        wait_until(sheet, lambda: charts() == ["Control", "Phase", "Scope"])


def test_commands_accept_the_text_of_the_field_that_has_the_focus(sheet: Page) -> None:
    stop_time = sheet.get_by_role("textbox", name="Stop time, s")
    stop_time.fill("5")
    stop_time.press("Control+Enter")
    last_edit(sheet, "change the settings")
    expect(sheet.locator(".run-state")).to_contain_text("5.00 s")
    expect(sheet.locator(".run-state")).to_contain_text("done", ignore_case=True)
    stop_time.fill("12/2 s")
    stop_time.press("Enter")
    expect(stop_time).to_have_value("6 s")
    stop_time.fill("1,5")
    stop_time.press("Enter")
    expect(sheet.locator(".notices")).to_contain_text("',' is not allowed")
    expect(stop_time).to_have_value("6 s")
    sheet.locator(".notices").get_by_role("button", name="Dismiss").click()
    select_block(sheet, "PID")
    sheet.keyboard.press("F2")
    field = sheet.get_by_role("textbox", name="Name of PID")
    field.fill("controller")
    field.press("Control+Enter")
    expect(block(sheet, "controller")).to_be_visible()
    expect(sheet.locator(".run-state")).to_contain_text("6.00 s")
    sheet.keyboard.press('"')
    note = sheet.get_by_role("textbox", name="Note")
    note.fill("hello")
    note.press("Control+Shift+S")
    expect(sheet.get_by_role("dialog").get_by_role("combobox", name="File")).to_be_visible()
    sheet.keyboard.press("Escape")
    expect(sheet.locator(".note")).to_have_text("hello")


def test_a_click_beside_the_configuration_parameters_keeps_the_typed_values(sheet: Page) -> None:
    sheet.keyboard.press("Control+e")
    field = sheet.get_by_role("dialog").get_by_role("textbox").first
    field.fill("12")
    sheet.mouse.click(5, 300)
    expect(field).to_have_value("12")
    sheet.keyboard.press("Escape")
    expect(sheet.get_by_role("dialog")).to_have_count(0)


def test_without_access_to_the_clipboard_nothing_is_cut_and_a_notice_says_why(sheet: Page) -> None:
    sheet.evaluate("""() => {
        const denied = () => Promise.reject(new DOMException('Read permission denied.', 'NotAllowedError'))
        Object.assign(navigator.clipboard, { readText: denied, writeText: denied })
    }""")
    notice = sheet.get_by_text("the browser does not give this page access to the clipboard")
    for key in ("Control+x", "Control+v"):
        select_block(sheet, "PID")  # Firefox shows no focus by focus() after a click
        sheet.keyboard.press(key)
        expect(notice).to_be_visible()
        sheet.keyboard.press("Escape")
        expect(block(sheet, "PID")).to_have_count(1)
    sheet.evaluate("() => { delete navigator.clipboard.readText; delete navigator.clipboard.writeText }")


def test_a_proposed_wire_is_accepted_and_removed_with_the_keyboard(sheet: Page) -> None:
    new_diagram(sheet)
    add(sheet, "sine wave")
    add(sheet, "gain")
    proposed = sheet.get_by_role("button", name="Connect Sine Wave/y with Gain/u")
    announced = sheet.get_by_role("status").filter(has_text="Connect Sine Wave/y with Gain/u: press Tab")
    expect(proposed).to_have_count(1)
    expect(announced).to_have_count(1)
    axe(sheet)
    expect(block(sheet, "Gain")).to_be_focused()
    sheet.keyboard.press("Tab")
    expect(proposed).to_be_focused()
    sheet.keyboard.press("Shift+Tab")
    expect(block(sheet, "Gain")).to_be_focused()
    sheet.keyboard.press("Enter")  # opens the block, as without a proposed wire
    expect(sheet.get_by_role("dialog", name="Gain")).to_be_visible()
    sheet.keyboard.press("Escape")
    expect(sheet.get_by_role("dialog")).to_have_count(0)
    expect(block(sheet, "Gain")).to_be_focused()
    sheet.keyboard.press("Tab")
    expect(proposed).to_be_focused()
    sheet.keyboard.press("Enter")
    expect(edge(sheet, "Sine Wave/y -> Gain/u")).to_have_count(1)
    expect(proposed).to_have_count(0)
    expect(announced).to_have_count(0)
    expect(block(sheet, "Gain")).to_be_focused()
    add(sheet, "scope")
    expect(block(sheet, "Scope")).to_be_focused()
    for key in ("Tab", "Space"):
        sheet.keyboard.press(key)
    expect(edge(sheet, "Gain/y -> Scope/u")).to_have_count(1)
    sheet.keyboard.press("Control+z")
    proposed = sheet.get_by_role("button", name="Connect Gain/y with Scope/u")
    expect(proposed).to_have_count(1)
    sheet.keyboard.press("Escape")
    expect(proposed).to_have_count(0)
    expect(block(sheet, "Scope")).to_have_class(re.compile("selected"))  # until the next Escape
    sheet.keyboard.press("Escape")
    expect(sheet.locator(".react-flow__node.selected")).to_have_count(0)


def test_space_fits_the_sheet_and_a_drag_with_space_moves_it(sheet: Page) -> None:
    viewport = sheet.locator(".react-flow__viewport")

    def view() -> tuple[float, float, float]:
        matrix = viewport.evaluate("element => new DOMMatrix(element.style.transform)")
        return matrix["a"], matrix["e"], matrix["f"]

    select_block(sheet, "PID")
    sheet.keyboard.press("1")
    wait_until(sheet, lambda: view()[0] == 1)
    _, left, top = view()
    pane = sheet.locator(".react-flow__pane").bounding_box()
    assert pane is not None
    x, y = pane["x"] + 80, pane["y"] + 190  # no block or wire is there
    sheet.keyboard.down(" ")
    expect(sheet.locator(".react-flow__pane.draggable")).to_have_count(1)
    sheet.mouse.move(x, y)
    sheet.mouse.down()
    sheet.mouse.move(x + 40, y + 20, steps=4)
    sheet.mouse.up()
    sheet.keyboard.up(" ")
    wait_until(sheet, lambda: view() == pytest.approx((1, left + 40, top + 20), abs=1))
    keep_view(sheet)
    assert view()[0] == 1
    sheet.keyboard.press(" ")
    wait_until(sheet, lambda: view()[0] < 0.8)  # the whole model is wider than the panel

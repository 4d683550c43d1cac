"""Editing a sheet in the browser: routing wires, rotating blocks, notes, search, commands, export."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from accessibility import axe
from building import (
    block,
    choose_in_menu,
    copied_names,
    double_click,
    drop_entry,
    edge,
    middle,
    run,
    select_block,
    wait_until,
)
from playwright.sync_api import Page, expect

from armblocks.blocks import BLOCKS
from armblocks.diagram import DiagramBlock
from armblocks.formats import diagram_from_bytes, load_robot
from conftest import Studio


@pytest.fixture(scope="module")
def shared_folder(studio: Studio) -> Path:
    return studio.folder


def command(page: Page, typed: str) -> None:
    page.keyboard.press("Control+k")
    page.get_by_role("textbox", name="Command").fill(typed)
    page.get_by_role("textbox", name="Command").press("Enter")
    expect(page.get_by_role("dialog")).to_be_hidden()


def route_path(page: Page, wire: str) -> str | None:
    return edge(page, wire).locator("path.line").first.get_attribute("d")


SELECTED_LINE = ".wire.selected path.line"
AS_RGB = """(colour) => {
    const probe = document.createElement('i')
    probe.style.color = colour
    document.body.append(probe)
    const rgb = getComputedStyle(probe).color
    probe.remove()
    return rgb
}"""


def test_a_user_drawn_route_follows_its_block_and_can_be_reset(sheet: Page) -> None:
    wire = "PID/y -> u/u1"
    before = route_path(sheet, wire)
    x, y = middle(edge(sheet, wire).locator(".segment").first)
    sheet.mouse.move(x, y)
    sheet.mouse.down()
    sheet.mouse.move(x, y - 40, steps=4)
    sheet.mouse.up()
    expect(sheet.get_by_role("button", name="Undo bend 1 wire (Ctrl+Z)")).to_be_enabled()
    line = edge(sheet, wire).locator("path.line").first
    expect(line).not_to_have_attribute("d", before or "")
    routed = route_path(sheet, wire)
    block(sheet, "PID").click()
    sheet.keyboard.press("ArrowDown")
    expect(sheet.get_by_role("button", name="Undo move PID (Ctrl+Z)")).to_be_enabled()
    expect(line).not_to_have_attribute("d", routed or "")
    assert route_path(sheet, wire) != before
    sheet.keyboard.press("Control+z")
    expect(line).to_have_attribute("d", routed or "")
    edge(sheet, wire).locator(".segment").nth(2).click(force=True)
    accent = sheet.evaluate("getComputedStyle(document.documentElement).getPropertyValue('--accent')")
    stroke = f"getComputedStyle(document.querySelector('{SELECTED_LINE}')).stroke"
    assert sheet.evaluate(stroke) == sheet.evaluate(AS_RGB, accent.strip())
    sheet.get_by_role("button", name="Reset the route").click()
    expect(line).to_have_attribute("d", before or "")


def test_the_sheet_inside_a_commented_subsystem_is_grey(sheet: Page) -> None:
    select_block(sheet, "PID")
    sheet.keyboard.press("Control+g")
    select_block(sheet, "Subsystem")
    sheet.keyboard.press("Control+Shift+X")
    expect(block(sheet, "Subsystem")).to_have_accessible_name(re.compile("commented out$"))
    sheet.keyboard.press("Enter")
    notice = sheet.get_by_text("this sheet is not part of the model")
    expect(notice).to_contain_text("Subsystem is commented out")
    outline = block(sheet, "PID").locator(".face .s-ink, .face .s-wire").first
    grey = outline.evaluate("element => getComputedStyle(element).stroke")
    sheet.get_by_role("button", name="Uncomment").click()
    expect(notice).to_be_hidden()
    assert outline.evaluate("element => getComputedStyle(element).stroke") != grey


def test_blocks_are_commented_out_and_through_by_key(sheet: Page) -> None:
    select_block(sheet, "PID")
    sheet.keyboard.press("Control+Shift+X")
    expect(block(sheet, "PID")).to_have_accessible_name(re.compile("commented out$"))
    expect(block(sheet, "PID").locator(".face")).to_contain_text("%")
    run(sheet)
    expect(sheet.locator('.wire-value[data-path="PID/y"]')).to_have_count(0)
    edge(sheet, "PID/y -> u/u1").locator(".segment").first.hover(force=True)
    expect(sheet.locator('.wire-value[data-path="PID/y"]')).to_have_text("0")
    select_block(sheet, "PID")
    sheet.keyboard.press("Control+Shift+Y")
    expect(block(sheet, "PID")).to_have_accessible_name(re.compile("commented through$"))
    sheet.keyboard.press("Control+Shift+Y")
    expect(block(sheet, "PID")).not_to_have_accessible_name(re.compile("commented"))
    expect(sheet.get_by_role("button", name="Undo uncomment PID (Ctrl+Z)")).to_be_enabled()


def test_a_double_click_on_a_wire_names_its_signal(sheet: Page) -> None:
    wire = edge(sheet, "x2/y -> x1/u").locator(".segment").first
    double_click(wire, force=True)
    field = sheet.get_by_role("textbox", name="Name of the signal of x2/y")
    expect(field).to_be_focused()
    field.fill("PID")
    field.press("Enter")
    expect(sheet.locator(".notices")).to_contain_text("like the block 'PID'")
    double_click(wire, force=True)
    field.fill("velocity")
    field.press("Enter")
    expect(sheet.locator(".signal-name")).to_have_text("velocity")
    wire.click(force=True)
    sheet.get_by_role("toolbar", name="Wire from x2/y").get_by_role("button", name="Log").click()
    run(sheet)
    expect(sheet.locator('.chart[data-view="x2"] figcaption')).to_contain_text("velocity")
    wire.click(button="right", force=True)
    sheet.get_by_role("menuitem", name="Name the signal …").click()
    expect(field).to_have_value("velocity")
    field.press("Escape")
    expect(block(sheet, "x2")).to_be_focused()  # not the page: Tab continues on the sheet
    sheet.keyboard.press("Control+z")
    sheet.keyboard.press("Control+z")
    expect(sheet.locator(".signal-name")).to_have_count(0)


def test_unconnected_ports_are_grounded_and_terminated_in_one_step(sheet: Page) -> None:
    edge(sheet, "x2/y -> x1/u").locator(".segment").first.click(force=True)
    sheet.keyboard.press("Delete")
    expect(block(sheet, "x1").locator(".port.unconnected")).to_have_count(1)
    command(sheet, "Ground and terminate unconnected ports")
    expect(edge(sheet, "Ground/y -> x1/u")).to_have_count(1)
    expect(sheet.locator(".port.unconnected")).to_have_count(0)
    sheet.keyboard.press("Control+z")
    expect(block(sheet, "Ground")).to_have_count(0)


def test_a_block_dropped_on_a_wire_is_inserted_into_it(sheet: Page) -> None:
    wires = sheet.locator(".react-flow__edge")
    count = wires.count()
    sheet.get_by_role("textbox", name="Search the library").fill("Saturation")
    segment = edge(sheet, "x2/y -> x1/u").locator(".segment").first
    x, y = middle(segment)
    pane = sheet.locator(".canvas").bounding_box()
    assert pane is not None
    entry = sheet.locator('.kind[data-type="Saturation"]')
    drop_entry(entry, sheet.locator(".canvas"), x - pane["x"], y - pane["y"])
    expect(edge(sheet, "x2/y -> Saturation/u")).to_have_count(1)
    expect(edge(sheet, "Saturation/y -> x1/u")).to_have_count(1)
    expect(wires).to_have_count(count + 1)
    sheet.keyboard.press("Control+z")
    expect(wires).to_have_count(count)
    sheet.get_by_role("button", name="Clear the search").click()


def drag(page: Page, name: str, x: float, y: float, key: str = "") -> None:
    """Drag a block until its centre is at a point, with a key held if one is given."""
    left, top = middle(block(page, name).locator(".block"))
    page.mouse.move(left, top)
    if key:
        page.keyboard.down(key)
    page.mouse.down()
    page.mouse.move(left + 2, top)  # from here on the block follows the pointer
    page.mouse.move(x, y, steps=4)
    page.mouse.up()
    if key:
        page.keyboard.up(key)


def test_a_block_is_disconnected_from_a_wire_and_inserted_into_another(sheet: Page) -> None:
    wires = sheet.locator(".react-flow__edge")
    count = wires.count()
    x, y = middle(block(sheet, "damping").locator(".block"))
    drag(sheet, "damping", x, y + 60, key="Shift")
    expect(sheet.get_by_role("button", name="Undo disconnect damping (Ctrl+Z)")).to_be_enabled()
    expect(edge(sheet, "x2/y -> u/u2")).to_have_count(1)
    expect(wires).to_have_count(count - 1)
    drag(sheet, "damping", *middle(edge(sheet, "x2/y -> x1/u").locator(".segment").first))
    expect(sheet.get_by_role("button", name="Undo insert damping (Ctrl+Z)")).to_be_enabled()
    expect(edge(sheet, "x2/y -> damping/u")).to_have_count(1)
    expect(edge(sheet, "damping/y -> x1/u")).to_have_count(1)
    expect(edge(sheet, "x2/y -> x1/u")).to_have_count(0)
    left, right = (block(sheet, "damping").locator(f'[data-handleid="{port}"]') for port in "uy")
    expect(edge(sheet, "damping/y -> x1/u").locator("path.line").first).to_have_attribute(
        "d", re.compile(r"^M[\d.]+ [\d.]+L[\d.]+ [\d.]+$")
    )  # the block is mirrored, so that the wire is straight
    assert middle(left) < middle(right)
    sheet.keyboard.press("Control+z")
    sheet.keyboard.press("Control+z")
    expect(edge(sheet, "x2/y -> x1/u")).to_have_count(1)
    expect(wires).to_have_count(count)


def test_blocks_are_duplicated_resized_and_connected_by_drags(sheet: Page) -> None:
    x, y = middle(block(sheet, "PID").locator(".block"))
    before = position(sheet, "PID")
    drag(sheet, "PID", x, y - 90, key="Control")
    copy = block(sheet, "PID 2")
    expect(copy).to_have_class(re.compile("selected"))
    assert position(sheet, "PID") == before
    left, top = position(sheet, "PID 2")
    assert abs(left - before[0]) <= 5  # one step of the grid
    assert top < before[1] - 50
    width = (copy.locator(".face").get_attribute("width")) or ""
    corner_x, corner_y = middle(copy.locator(".resize").last)
    sheet.mouse.move(corner_x, corner_y)
    sheet.mouse.down()
    sheet.mouse.move(corner_x + 40, corner_y, steps=3)
    sheet.mouse.up()
    expect(copy.locator(".face")).not_to_have_attribute("width", width)
    assert position(sheet, "PID 2") == (left, top)
    from_x, from_y = middle(copy.locator('[data-handleid="y"]'))
    sheet.mouse.move(from_x, from_y)
    sheet.mouse.down()
    sheet.mouse.move(from_x + 60, from_y - 5, steps=3)
    sheet.mouse.up()
    sheet.get_by_role("textbox", name="Add a block").fill("gain")
    sheet.keyboard.press("Enter")
    expect(edge(sheet, "PID 2/y -> Gain/u")).to_have_count(1)


def test_copies_keep_routes_and_the_contents_of_subsystems(sheet: Page) -> None:
    x, y = middle(edge(sheet, "PID/y -> u/u1").locator(".segment").first)
    sheet.mouse.move(x, y)
    sheet.mouse.down()
    sheet.mouse.move(x, y - 40, steps=4)
    sheet.mouse.up()
    expect(sheet.get_by_role("button", name="Undo bend 1 wire (Ctrl+Z)")).to_be_enabled()
    block(sheet, "PID").click()
    block(sheet, "u").click(modifiers=["Control"])
    sheet.keyboard.press("Control+d")
    expect(block(sheet, "PID 2")).to_have_class(re.compile("selected"))
    # The copied route would run under the block "u": the wire is drawn straight until the copies are moved.
    edge(sheet, "PID 2/y -> u 2/u1").locator(".segment").first.click(force=True)
    expect(sheet.get_by_role("button", name="Reset the route")).to_be_visible()
    sheet.keyboard.press("Escape")
    block(sheet, "PID 2").click()
    sheet.keyboard.press("Control+g")
    expect(block(sheet, "Subsystem")).to_have_class(re.compile("selected"))
    assert copied_names(sheet, lambda: sheet.keyboard.press("Control+c")) == ["Subsystem"]
    sheet.keyboard.press("Control+v")
    expect(block(sheet, "Subsystem 2")).to_have_class(re.compile("selected"))
    sheet.keyboard.press("Enter")
    expect(block(sheet, "PID 2")).to_be_visible()
    sheet.keyboard.press("Escape")


def test_a_mask_is_created_used_renamed_and_undone(sheet: Page) -> None:
    block(sheet, "damping").click()
    sheet.keyboard.press("Control+g")
    subsystem = block(sheet, "Subsystem")
    expect(subsystem).to_have_class(re.compile("selected"))
    sheet.keyboard.press("Control+m")
    dialog = sheet.get_by_role("dialog")
    expect(dialog.get_by_role("button", name="Add a parameter")).to_be_focused()
    dialog.get_by_role("textbox", name="Text on the block").fill("Viscous damper")
    dialog.get_by_role("button", name="Add a parameter").click()
    for field, text in (("Default", "0.25"), ("Unit", "N s/m"), ("Range", "> 0"), ("Name", "d")):
        dialog.get_by_role("textbox", name=f"{field} of k").fill(text)
    dialog.get_by_role("textbox", name="Description of d").fill("damping coefficient")
    dialog.get_by_role("button", name="OK", exact=True).click()
    expect(dialog).to_be_hidden()
    expect(subsystem.locator("svg")).to_contain_text("Viscous")
    double_click(subsystem)
    field = dialog.get_by_role("textbox", name="d N s/m")
    expect(field).to_have_value("0.25")
    expect(dialog).to_contain_text("damping coefficient")
    field.fill("0.5")
    dialog.get_by_role("button", name="Apply").click()
    dialog.get_by_role("button", name="Look under the mask").click()
    double_click(block(sheet, "damping"))
    dialog.get_by_role("textbox", name="gain").fill("2*d")
    expect(dialog.get_by_text("= 1", exact=True)).to_be_visible()
    dialog.get_by_role("button", name="OK", exact=True).click()
    expect(dialog).to_be_hidden()
    gain = block(sheet, "damping").locator("svg")
    expect(gain).to_contain_text("2*d")
    sheet.keyboard.press("Escape")
    sheet.keyboard.press("Control+m")
    dialog.get_by_role("button", name="Remove d").click()
    dialog.get_by_role("button", name="OK", exact=True).click()
    expect(dialog.get_by_role("alert")).to_contain_text("the formula '2*d' reads it")
    dialog.get_by_role("button", name="Cancel").click()
    expect(dialog).to_be_hidden()
    sheet.keyboard.press("Control+m")
    dialog.get_by_role("textbox", name="Name of d").fill("D")
    axe(sheet)
    dialog.get_by_role("button", name="OK", exact=True).click()
    expect(gain).to_contain_text("2*D")
    expect(sheet.get_by_role("button", name="Undo mask Subsystem (Ctrl+Z)")).to_be_enabled()
    sheet.keyboard.press("Control+z")
    expect(gain).to_contain_text("2*d")


def test_blocks_are_rotated_and_aligned(sheet: Page) -> None:
    block(sheet, "damping").click()
    sheet.keyboard.press("Control+r")
    expect(sheet.get_by_role("button", name="Undo move damping (Ctrl+Z)")).to_be_enabled()
    expect(block(sheet, "damping").locator(".name")).to_have_class(re.compile("right"))
    sheet.keyboard.press("Control+z")
    sheet.keyboard.press("Control+a")
    bar = sheet.get_by_role("toolbar", name="Arrange the selected blocks")
    bar.get_by_role("button", name="Align top edges").click()
    expect(sheet.get_by_role("button", name=re.compile("Undo move"))).to_be_enabled()

    def tops() -> set[int]:
        boxes = [block(sheet, name).bounding_box() for name in ("PID", "x1", "one")]
        return {round(box["y"]) for box in boxes if box}

    wait_until(sheet, lambda: len(tops()) == 1)
    sheet.keyboard.press("Control+z")
    command(sheet, "equal gaps from left")
    expect(sheet.get_by_role("button", name=re.compile("Undo move"))).to_be_enabled()
    block(sheet, "x1").click()  # one of several selected blocks is then selected alone
    expect(sheet.locator(".react-flow__node.selected")).to_have_count(1)
    sheet.get_by_role("button", name="Menu").click()
    sheet.keyboard.press("Escape")
    expect(sheet.get_by_role("menu")).to_be_hidden()
    _, before = position(sheet, "x1")
    for _ in range(10):
        sheet.keyboard.press("ArrowDown")
    wait_until(sheet, lambda: position(sheet, "x1")[1] == before + 50)
    expect(sheet.get_by_role("button", name="Undo move x1 (Ctrl+Z)")).to_be_enabled()


def position(page: Page, name: str) -> tuple[float, float]:
    """The position of a block on the sheet."""
    x, y = re.findall(r"-?[\d.]+(?=px)", block(page, name).get_attribute("style") or "")[:2]
    return float(x), float(y)


def test_a_note_is_written_moved_saved_and_deleted(sheet: Page) -> None:
    sheet.locator(".react-flow__pane").click(position={"x": 5, "y": 5})
    sheet.keyboard.press('"')
    field = sheet.get_by_role("textbox", name="Note")
    expect(field).to_be_focused()
    field.fill("Van der Pol\nheld by a PID")
    field.press("Control+Enter")
    note = sheet.locator(".note")
    expect(note).to_have_text("Van der Pol\nheld by a PID")
    before = note.bounding_box()
    note.click()
    sheet.keyboard.press("ArrowUp")
    expect(sheet.get_by_role("button", name="Undo move 1 note (Ctrl+Z)")).to_be_enabled()
    assert before is not None
    wait_until(sheet, lambda: (note.bounding_box() or before)["y"] < before["y"])
    sheet.keyboard.press("Delete")
    expect(note).to_have_count(0)
    sheet.keyboard.press("Control+z")
    expect(note).to_have_count(1)
    answer = sheet.evaluate(EXPORTED)
    assert "held by a PID" in answer


EXPORTED = """async () => {
    const { shown } = JSON.parse(sessionStorage.getItem('armblocks-shown'))
    return await (await fetch(`drawing/${shown.document}.svg`)).text()
}"""


def test_search_opens_the_sheet_of_a_block_and_the_explorer_marks_it(sheet: Page) -> None:
    block(sheet, "PID").click()
    sheet.keyboard.press("Control+g")
    expect(block(sheet, "Subsystem")).to_be_visible()
    sheet.keyboard.press("Control+f")
    sheet.get_by_role("textbox", name="Find").fill("PID")
    matches = sheet.get_by_role("listbox", name="Found").get_by_role("option")
    expect(matches.first).to_contain_text("in Subsystem")
    sheet.get_by_role("textbox", name="Find").press("Enter")
    expect(block(sheet, "PID")).to_have_class(re.compile("selected"))
    expect(sheet.locator(".breadcrumbs")).to_contain_text("Subsystem")
    sheet.get_by_text("Model", exact=True).click()
    tree = sheet.get_by_role("tree", name="Subsystems of the model")
    expect(tree.locator(".here")).to_contain_text("Subsystem")
    tree.get_by_text("van_der_pol_pid").click()
    expect(block(sheet, "Subsystem")).to_be_visible()
    axe(sheet)
    sheet.get_by_text("Library", exact=True).click()


def test_an_empty_sheet_offers_examples_and_the_tour_completes(sheet: Page) -> None:
    choose_in_menu(sheet, "New diagram")
    cards = sheet.locator(".gallery button")
    expect(cards).not_to_have_count(0)
    picture = cards.first.locator("img")
    picture.evaluate("(image) => image.decode()")  # raises an error if the picture is missing
    axe(sheet)
    sheet.get_by_role("button", name="Take the tour").click()
    axe(sheet)
    done = sheet.get_by_role("button", name="Done")
    while not done.count():
        sheet.get_by_role("button", name="Next").click()
    done.click()
    expect(sheet.locator(".tour")).to_have_count(0)
    cards.filter(has_text="bouncing_ball").click()
    expect(sheet.locator(".title")).to_have_text("bouncing_ball")


def test_the_sheet_and_the_report_of_a_run_are_exported(sheet: Page) -> None:
    for kind, begins in (("SVG", b"<?xml"), ("PNG", b"\x89PNG"), ("PDF", b"%PDF")):
        with sheet.expect_download() as waiting:
            command(sheet, f"as {kind}")
        saved = waiting.value
        assert saved.suggested_filename == f"van_der_pol_pid.{kind.lower()}"
        data = Path(saved.path()).read_bytes()
        assert data.startswith(begins) or (kind == "SVG" and data.startswith(b"<svg"))
    sheet.keyboard.press("Control+Enter")
    expect(sheet.locator(".run-state")).to_contain_text("done", ignore_case=True)
    with sheet.context.expect_page() as opened:
        command(sheet, "report of this")
    report = opened.value
    expect(report.locator("h1")).to_contain_text("van_der_pol_pid")
    report.close()


def test_a_theme_is_chosen_by_button_or_command_and_remembered(sheet: Page) -> None:
    html = sheet.locator("html")
    sheet.get_by_role("button", name="Theme: system").click()
    sheet.get_by_role("menuitemradio", name="Dark").click()
    expect(html).to_have_attribute("data-mantine-color-scheme", "dark")
    sheet.reload()
    expect(sheet.get_by_role("button", name="Theme: dark")).to_be_visible()
    expect(html).to_have_attribute("data-mantine-color-scheme", "dark")
    command(sheet, "theme of the system")
    expect(html).to_have_attribute("data-mantine-color-scheme", "light")
    expect(sheet.get_by_role("button", name="Theme: system")).to_be_visible()
    # The page fills the window exactly: a focus at its lower edge scrolls nothing.
    assert sheet.evaluate("document.documentElement.scrollHeight - innerHeight") == 0


def picture(page: Page, title: str) -> str:
    """The exported SVG picture of a scope."""
    page.get_by_role("button", name=f"Export {title}").click()
    with page.expect_download() as waiting:
        page.get_by_role("menuitem", name="Picture as SVG").click()
    expect(page.get_by_role("menu")).to_be_hidden()
    return Path(waiting.value.path()).read_text()


def test_the_value_axis_of_a_scope_is_zoomed_panned_and_reset(sheet: Page) -> None:
    sheet.keyboard.press("Control+Enter")
    expect(sheet.locator(".run-state")).to_contain_text("done", ignore_case=True)
    chart = sheet.locator('.chart[data-view="Scope"]')
    double_click(block(sheet, "Scope"))
    expect(chart).to_have_class(re.compile("marked"))
    expect(sheet.get_by_role("dialog")).to_be_hidden()
    axis = sheet.locator(".chart .values-axis").first
    title = sheet.locator(".chart figcaption b").first.inner_text()
    show_all = sheet.get_by_role("button", name=f"Show all values of {title}")
    expect(show_all).to_have_count(0)
    whole = picture(sheet, title)
    x, y = middle(axis)
    sheet.mouse.move(x, y)
    sheet.mouse.wheel(0, -100)
    expect(show_all).to_be_visible()
    zoomed = picture(sheet, title)
    sheet.mouse.move(x, y)
    sheet.mouse.down()
    sheet.mouse.move(x, y + 12, steps=3)
    sheet.mouse.up()
    moved = picture(sheet, title)
    assert len({whole, zoomed, moved}) == 3
    expect(
        sheet.get_by_role("button", name="Show the whole run")
    ).to_be_disabled()  # the time axis is unchanged
    show_all.click()
    expect(show_all).to_have_count(0)
    assert picture(sheet, title) == whole
    sheet.mouse.move(x, y)
    sheet.mouse.wheel(0, 100)
    expect(show_all).to_be_visible()
    double_click(axis)
    expect(show_all).to_have_count(0)


DROPS = """async () => {
    // Each block type is dragged from its library entry and dropped on the sheet.
    const entries = [...document.querySelectorAll('.palette .kind')]
    const sheet = document.querySelector('.canvas')
    const box = document.querySelector('.react-flow__pane').getBoundingClientRect()
    const dispatch = (target, kind, dataTransfer, x, y) =>
        target.dispatchEvent(
            new DragEvent(kind, { bubbles: true, cancelable: true, dataTransfer, clientX: x, clientY: y })
        )
    entries.forEach((entry, k) => {
        const data = new DataTransfer()
        const [x, y] = [box.x + 10 + ((k % 20) / 21) * box.width, box.y + 10 + (k / 280) * box.height]
        dispatch(entry, 'dragstart', data, 0, 0)
        dispatch(sheet, 'dragover', data, x, y)
        dispatch(sheet, 'drop', data, x, y)
        dispatch(entry, 'dragend', data, x, y)
    })
    return entries.map((entry) => entry.dataset.type)
}"""
OPENINGS = """async () => {
    // Each block is opened by a double click; the labels of its dialog are read, and the dialog is closed.
    // Nothing waits for a painted frame: painting each dialog in software takes longer than creating it.
    // Overlays are siblings of the page's root element, so that few elements are searched after each change.
    const inOverlay = (selector) => {
        for (const part of document.body.children) {
            const element = part.id === 'root' ? null : part.querySelector(selector)
            if (element) return element
        }
        return null
    }
    const path = document.getElementsByClassName('breadcrumbs')
    const until = (search) =>
        new Promise((resolve) => {
            const check = (_, observer) => {
                const value = search()
                if (!value) return false
                observer.disconnect()
                resolve(value)
                return true
            }
            const observer = new MutationObserver(check)
            if (!check([], observer)) observer.observe(document, { subtree: true, childList: true })
        })
    const dialog = (name) => {
        const shown = inOverlay('[role=dialog]')
        return shown?.querySelector('h2')?.textContent.startsWith(name) ? shown : null
    }
    const firstWords = (element) => document.createTreeWalker(element, NodeFilter.SHOW_TEXT).nextNode().data
    const node = (name) => document.querySelector(`.react-flow__node[data-id="${CSS.escape(name)}"]`)
    const names = [...document.querySelectorAll('.react-flow__node')].map((node) => node.dataset.id)
    const labels = {}
    for (const name of names) {
        node(name).dispatchEvent(new MouseEvent('dblclick', { bubbles: true }))
        const shown = await until(() => dialog(name) ?? path[0])
        if (shown.matches('.breadcrumbs')) {
            shown.querySelector('button').click()
            await until(() => node(name))
            continue
        }
        labels[name] = [...shown.querySelectorAll('label')].map(firstWords)
        ;[...shown.querySelectorAll('button')].find((button) => button.textContent === 'Cancel').click()
        await until(() => !inOverlay('[role=dialog]'))
    }
    return labels
}"""


def test_every_block_of_the_library_is_dropped_opened_and_saved(sheet: Page, shared_folder: Path) -> None:
    choose_in_menu(sheet, "New diagram")
    expect(sheet.get_by_text("Type to add a block")).to_be_visible()
    for family in sheet.locator(".palette .family[aria-expanded=false]").all()[::-1]:
        family.click()
    entries = sheet.locator(".palette .kind")
    expect(entries).to_have_count(len(BLOCKS))
    # The first block with mouse input, all others with synthetic events.
    drop_entry(entries.first, sheet.locator(".canvas"), 300, 200)
    nodes = sheet.locator(".react-flow__node")
    expect(nodes).to_have_count(1)
    sheet.keyboard.press("Control+z")
    expect(nodes).to_have_count(0)
    sheet.get_by_text("Tune", exact=True).click()  # software rendering of an arm takes long
    assert sorted(sheet.evaluate(DROPS)) == sorted(BLOCKS)
    expect(nodes).to_have_count(len(BLOCKS))
    requested = sheet.evaluate(OPENINGS)
    sheet.keyboard.press("Control+s")
    sheet.get_by_role("combobox", name="File").fill("every block.json")
    sheet.get_by_role("button", name="Save", exact=True).click()
    expect(sheet.locator(".title")).to_have_text("every block")
    data = (shared_folder / "every block.json").read_bytes()
    saved = diagram_from_bytes(data, "every block.json", BLOCKS, load_robot, draft=True)
    assert sorted(loaded.type_name() for loaded in saved.blocks.values()) == sorted(BLOCKS)
    for name, loaded in saved.blocks.items():
        if isinstance(loaded, DiagramBlock):
            assert name not in requested
        else:
            assert requested[name] == [rule.name for rule in loaded.parameters()], name

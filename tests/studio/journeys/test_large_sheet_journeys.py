"""Panning and zooming of a large sheet in the browser: the view after a motion, and the map of the sheet."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from building import block, keep_view, middle, run, wait_until
from playwright.sync_api import FloatRect, Page, expect

import armblocks as ab
from armblocks import blocks
from conftest import Studio

CHAINS, PER_CHAIN = 16, 10
WHEEL = """(pane, [deltaX, deltaY, ctrlKey]) => {
    // A wheel event at the middle of the sheet.
    const { x, y, width, height } = pane.getBoundingClientRect()
    const values = { clientX: x + width / 2, clientY: y + height / 2, bubbles: true, cancelable: true }
    pane.dispatchEvent(new WheelEvent('wheel', { ...values, deltaX, deltaY, ctrlKey }))
}"""
LAYERS = """(pane) => {
    // Whether the sheet is a layer before a motion, in it, and after a press, in one task of the browser.
    const layer = () => getComputedStyle(document.querySelector('.react-flow__viewport')).willChange
    const before = layer()
    pane.dispatchEvent(new WheelEvent('wheel', { deltaX: 20, bubbles: true, cancelable: true }))
    const during = layer()
    pane.dispatchEvent(new PointerEvent('pointerdown', { button: 2, buttons: 2, bubbles: true }))
    return [before, during, layer()]
}"""
PICTURED = """() => new Promise((done) => {
    // The blocks whose middle the picture does not show, and the number of all blocks in view, in one task
    // with a change of the view.
    const pane = document.querySelector('.react-flow__pane')
    pane.dispatchEvent(new WheelEvent('wheel', { deltaX: 8, bubbles: true, cancelable: true }))
    const canvas = document.querySelector('.motion-picture canvas')
    const [box, panel] = [canvas, pane].map((element) => element.getBoundingClientRect())
    const matrix = (element) => new DOMMatrix(element.style.transform)
    const { a: zoom, e, f } = matrix(document.querySelector('.react-flow__viewport'))
    const scale = canvas.width / box.width
    const missing = []
    let count = 0
    for (const node of document.querySelectorAll('.react-flow__node')) {
        const { e: x, f: y } = matrix(node)
        const [width, height] = [parseFloat(node.style.width), parseFloat(node.style.height)]
        const at = [e + zoom * (x + width / 2), f + zoom * (y + height / 2)]
        if (at[0] < 0 || at[1] < 0 || at[0] > panel.width || at[1] > panel.height) continue
        count++
        const spot = [at[0] + panel.x - box.x, at[1] + panel.y - box.y].map((value) => scale * value)
        const pixel = canvas.getContext('2d').getImageData(spot[0], spot[1], 1, 1)
        if (pixel.data[3] < 250) missing.push(node.dataset.id)
    }
    done([missing, count])
})"""
MISSING_VALUES = """() => {
    // The values in view that the picture does not show, and the number of all values in view, in one task
    // with a change of the view.
    const pane = document.querySelector('.react-flow__pane')
    pane.dispatchEvent(new WheelEvent('wheel', { deltaX: 8, bubbles: true, cancelable: true }))
    const canvas = document.querySelector('.motion-picture canvas')
    const [box, panel] = [canvas, pane].map((element) => element.getBoundingClientRect())
    const { a: zoom, e, f } = new DOMMatrix(document.querySelector('.react-flow__viewport').style.transform)
    const missing = []
    let count = 0
    for (const { style, dataset } of document.querySelectorAll('.wire-value')) {
        const [x, y] = style.transform.match(/-?[\\d.]+/g).map(Number)
        const at = [e + zoom * (x + 2), f + zoom * (y + 3)]
        if (at[0] < 0 || at[1] < 0 || at[0] > panel.width || at[1] > panel.height) continue
        count++
        const spot = [at[0] + panel.x - box.x, at[1] + panel.y - box.y]
        const [left, top] = spot.map((pixels) => (canvas.width / box.width) * pixels)
        if (canvas.getContext('2d').getImageData(left, top, 1, 1).data[3] < 250) missing.push(dataset.path)
    }
    return [missing, count]
}"""
ZOOM_AT = """(pane, [clientX, clientY]) => {
    const values = { clientX, clientY, deltaY: -4, ctrlKey: true, bubbles: true, cancelable: true }
    pane.dispatchEvent(new WheelEvent('wheel', values))
}"""
TWO_FRAMES = "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"

View = tuple[float, ...]


def save_large_model(path: Path) -> None:
    """Save a model with so many blocks that the sheet is moved as one layer."""
    builder = ab.DiagramBuilder("large")
    for row in range(CHAINS):
        signal = builder.add(f"source {row}", blocks.SineWave())
        for column in range(PER_CHAIN - 2):
            kind = (blocks.Gain, blocks.FirstOrderLag, blocks.Saturation)[column % 3]
            signal = builder.add(f"b {row} {column}", kind(), signal)
        builder.add(f"end {row}", blocks.Terminator(), signal)
    ab.save_diagram(builder.build(), path)


@pytest.fixture(scope="module")
def shared_large(open_studio: Callable[[str], Page], studio: Studio) -> Page:
    save_large_model(studio.folder / "large.json")
    page = open_studio("van_der_pol_pid")
    page.keyboard.press("Control+o")
    page.get_by_role("dialog").get_by_text("large.json").click()
    block(page, "b 3 4").wait_for()
    return page


@pytest.fixture
def large(shared_large: Page) -> Page:
    """The large model, fitted into its panel, with a motion that has ended."""
    shared_large.bring_to_front()  # in Firefox only the page in front has the focus
    shared_large.get_by_role("button", name="Fit view").click()
    keep_view(shared_large)
    rest(shared_large)
    return shared_large


def view(page: Page) -> View:
    """Shift (px) and zoom of the sheet."""
    style = page.locator(".react-flow__viewport").evaluate("(element) => element.style.transform")
    return tuple(float(number) for number in re.findall(r"-?[\d.]+(?:e-?\d+)?", style))


def wheel(page: Page, across: float, down: float, *, zoom: bool = False) -> None:
    """Turn the wheel over the middle of the sheet, and wait until the view has changed."""
    before = view(page)
    page.locator(".react-flow__pane").evaluate(WHEEL, [across, down, zoom])
    wait_until(page, lambda: view(page) != before)


def rest(page: Page) -> None:
    """Wait until the motion has ended and its last view is drawn."""
    expect(page.locator(".canvas.moving")).to_have_count(0)
    page.evaluate(TWO_FRAMES)


def sheet_area(page: Page) -> FloatRect:
    """The sheet without the buttons and the map at its lower edge."""
    box = page.locator(".canvas").bounding_box()
    assert box is not None
    return {**box, "height": box["height"] - 140}


def picture(page: Page) -> bytes:
    page.mouse.move(5, 5)
    return page.screenshot(clip=sheet_area(page), animations="disabled")


def draw_afresh(page: Page) -> None:
    """Show another document and this one again: its sheet is created from its stored view."""
    tabs = page.get_by_role("tab")
    tabs.filter(has_text="van_der_pol_pid").click()
    block(page, "PID").wait_for()
    tabs.filter(has_text="large").click()
    block(page, "b 3 4").wait_for()
    page.evaluate(TWO_FRAMES)


@pytest.mark.parametrize("zoom", [False, True], ids=["pan", "zoom"])
def test_a_moved_view_is_the_same_picture_as_the_view_drawn_afresh(large: Page, zoom: bool) -> None:
    for down in (-8, -12, 3, -5):
        wheel(large, 30, down, zoom=zoom)
    rest(large)
    moved, moved_picture = view(large), picture(large)
    draw_afresh(large)
    assert view(large) == pytest.approx(moved)
    wait_until(large, lambda: picture(large) == moved_picture)


def test_the_sheet_moves_as_one_layer_until_it_is_pressed(large: Page) -> None:
    assert large.locator(".react-flow__pane").evaluate(LAYERS) == ["auto", "transform", "auto"]


def test_a_picture_shows_all_blocks_at_their_places_during_a_motion(large: Page) -> None:
    for down in (-6, 5):
        wheel(large, 25, down)
    missing, count = large.evaluate(PICTURED)
    assert missing == []
    assert count == CHAINS * PER_CHAIN
    rest(large)


def test_a_picture_shows_the_values_at_wires_during_a_motion(large: Page) -> None:
    run(large)
    button = large.get_by_role("button", name="Values on all wires")
    button.click()
    values = large.locator(".wire-value:not(:empty)")
    expect(values).to_have_count(CHAINS * (PER_CHAIN - 1))
    while view(large)[2] < 0.8:
        wheel(large, 0, -10, zoom=True)
    rest(large)
    wheel(large, 25, 5)
    missing, count = large.evaluate(MISSING_VALUES)
    assert missing == []
    assert count > PER_CHAIN
    rest(large)
    button.click()
    expect(values).to_have_count(0)


def test_a_motion_changes_neither_the_focus_nor_the_selection(large: Page) -> None:
    focused = block(large, "b 3 4")
    focused.focus()
    large.keyboard.press("Control+a")
    for down in (-6, 5):
        wheel(large, 25, down)
    rest(large)
    expect(focused).to_be_focused()
    expect(large.locator(".react-flow__node.selected")).to_have_count(CHAINS * PER_CHAIN)
    large.keyboard.type('"')
    note = large.get_by_role("textbox", name="Note", exact=True)
    expect(note).to_be_focused()
    for down in (-6, 5):
        wheel(large, 25, down)
    rest(large)
    large.keyboard.type("a remark")
    expect(note).to_have_value("a remark")
    note.press("Escape")
    large.keyboard.press("Control+z")
    expect(large.locator(".react-flow__node")).to_have_count(CHAINS * PER_CHAIN)


def test_a_press_during_a_motion_finds_the_block_below_the_picture(large: Page) -> None:
    name = block(large, "b 3 4")
    x, y = middle(name)
    large.mouse.move(x, y)
    rest(large)
    before = name.evaluate("(element) => element.style.transform")
    large.locator(".react-flow__pane").evaluate(ZOOM_AT, [x, y])
    large.mouse.down()
    large.mouse.move(x + 30, y + 10, steps=3)
    large.mouse.move(x + 60, y + 30, steps=3)
    large.mouse.up()
    assert name.evaluate("(element) => element.style.transform") != before
    large.keyboard.press("Control+z")
    wait_until(large, lambda: name.evaluate("(element) => element.style.transform") == before)


def test_a_drag_immediately_after_a_motion_follows_the_pointer(large: Page) -> None:
    name = block(large, "b 3 4")
    wheel(large, 0, -4, zoom=True)
    wheel(large, -40, 20)
    x, y = middle(name)
    large.mouse.move(x, y)
    large.mouse.down()
    large.mouse.move(x + 2, y)  # starts the drag
    large.mouse.move(x + 102, y + 40, steps=4)
    moved_x, moved_y = middle(name)
    large.mouse.up()
    zoom = view(large)[2]
    grid = 10 * zoom
    assert abs(moved_x - x - 100) <= grid
    assert abs(moved_y - y - 40) <= grid
    large.keyboard.press("Control+z")


def test_wheel_during_a_drag_is_shown_at_once(large: Page) -> None:
    x, y = middle(block(large, "b 3 4"))
    large.mouse.move(x, y)
    large.mouse.down()
    large.mouse.move(x + 30, y, steps=3)
    large.mouse.wheel(20, 10)
    expect(large.locator(".canvas.moving")).to_have_count(0)
    large.mouse.up()
    large.keyboard.press("Control+z")


def test_the_map_shows_and_moves_the_view(large: Page) -> None:
    sheet_map = large.get_by_role("img", name="Map of the sheet")
    expect(sheet_map).to_have_count(0)  # all blocks are visible
    while view(large)[2] < 1:
        wheel(large, 0, -10, zoom=True)
    expect(sheet_map).to_be_visible()
    frame = sheet_map.locator("div")
    before = frame.bounding_box()
    wheel(large, 200, 0)
    after = frame.bounding_box()
    assert before is not None
    assert after is not None
    assert after["x"] > before["x"]
    box = sheet_map.bounding_box()
    assert box is not None
    sheet_map.click(position={"x": box["width"] / 2, "y": box["height"] / 2})
    rest(large)
    centre = middle(frame)
    assert centre == pytest.approx(middle(sheet_map), abs=2.5)

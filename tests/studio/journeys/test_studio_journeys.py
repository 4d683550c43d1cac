"""Main workflows of the studio in a real browser against a real server."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from accessibility import axe
from browsers import IN_FIREFOX, needs_emulated_media
from building import (
    add,
    block,
    copied_names,
    double_click,
    drag_from_library,
    expect_no_frames,
    middle,
    new_diagram,
    play_slowly,
    run,
    select_block,
    wait_until,
    wire,
)
from playwright.sync_api import Page, expect

import armblocks as ab
from conftest import Studio


@pytest.fixture(scope="module")
def folder(studio: Studio) -> Path:
    return studio.folder


@pytest.fixture(scope="module")
def shared(open_studio: Callable[[str], Page]) -> Page:
    return open_studio("kr180model")


@pytest.fixture
def page(sheet: Page) -> Page:
    """The shared page with a model without an arm, because software rendering of an arm is slow."""
    return sheet


CHOOSE_THEME = """theme => {
    // As another page with the same storage chooses it; dialogs stay open.
    const [key, storageArea] = ['armblocks-theme', localStorage]
    localStorage.setItem(key, theme)
    dispatchEvent(new StorageEvent('storage', { key, storageArea, newValue: theme }))
}"""


def show_theme(page: Page, theme: Literal["light", "dark"]) -> None:
    """Show a theme: that of the system in Chromium; Firefox cannot emulate it."""
    if IN_FIREFOX:
        page.evaluate(CHOOSE_THEME, theme)
    else:
        page.emulate_media(color_scheme=theme)
    expect(page.locator("html")).to_have_attribute("data-mantine-color-scheme", theme)


COLOURS = ["cat.color"]
"""The rules whose result depends on the theme; all others are checked in one theme."""


def test_the_first_example_is_shown_run_and_played_back(shared: Page) -> None:
    page = shared
    if not IN_FIREFOX:  # which has no WebGL without a graphics card
        expect(page.locator(".robot canvas")).to_be_visible()
    run(page)
    expect(page.locator(".chart")).not_to_have_count(0)
    expect(page.locator(".timeline .instant")).to_have_text("10.000 s")
    slider = page.get_by_role("slider", name="Time")
    slider.focus()
    slider.press("Home")
    expect(page.locator(".timeline .instant")).to_have_text("0.000 s")
    play_slowly(page)
    page.get_by_role("button", name="Play the run").click()
    expect(page.get_by_role("button", name="Pause the playback")).to_be_visible()
    page.get_by_role("button", name="Pause the playback").click()
    expect_no_frames(page)
    show_theme(page, "dark")
    axe(page, tags=COLOURS)
    show_theme(page, "light")
    axe(page)


def test_a_diagram_is_built_with_the_mouse_run_and_saved(page: Page, folder: Path) -> None:
    new_diagram(page)
    drag_from_library(page, "SineWave", 150, 150)
    sheet = page.locator(".canvas").bounding_box()
    dropped = block(page, "Sine Wave").locator(".face").bounding_box()
    assert sheet is not None and dropped is not None
    centre = (dropped["x"] + dropped["width"] / 2, dropped["y"] + dropped["height"] / 2)
    assert centre == pytest.approx((sheet["x"] + 150, sheet["y"] + 150), abs=3)  # the grid has 5 px
    drag_from_library(page, "Gain", 250, 150)
    # In front of a free port a wire is proposed, which a click adds; the second click has no effect.
    proposed = page.get_by_role("button", name="Connect Sine Wave/y with Gain/u")
    page.mouse.dblclick(*middle(proposed.locator(".area")))
    expect(page.locator(".react-flow__edge")).to_have_count(1)
    expect(proposed).to_have_count(0)
    page.keyboard.press("Control+z")
    expect(page.locator(".react-flow__edge")).to_have_count(0)
    expect(proposed).to_have_count(1)
    page.keyboard.press("Escape")
    expect(proposed).to_have_count(0)
    expect(page.locator(".notices [role=alert]")).to_have_count(0)
    drag_from_library(page, "Scope", 450, 150)
    expect(page.locator(".react-flow__node")).to_have_count(3)
    expect(page.locator(".port.unconnected")).to_have_count(2)
    page.keyboard.press("Control+Enter")
    expect(page.locator(".block .fault")).to_have_count(2)  # errors only after a run was refused
    expect(page.locator(".notices [role=alert]")).to_have_count(1)
    wire(page, "Sine Wave/y", "Gain/u")
    wire(page, "Gain/y", "Scope/u")
    expect(page.locator(".react-flow__edge")).to_have_count(2)
    expect(page.locator(".block .fault, .port.unconnected")).to_have_count(0)
    double_click(block(page, "Gain"))
    field = page.get_by_role("textbox", name="gain")
    field.fill("import os")
    expect(page.get_by_text("'os' is not allowed here")).to_be_visible()
    expect(page.get_by_role("button", name="OK", exact=True)).to_be_disabled()
    field.fill("2*pi")
    expect(page.get_by_text("= 6.283185307179586")).to_be_visible()
    page.get_by_role("button", name="OK", exact=True).click()
    expect(page.get_by_role("dialog")).to_be_hidden()
    run(page)
    page.keyboard.press("Control+s")
    page.get_by_role("combobox", name="File").fill("made/by hand.json")
    page.get_by_role("button", name="Save", exact=True).click()
    expect(page.locator(".title")).to_have_text("by hand")
    saved = ab.load_diagram(folder / "made" / "by hand.json")
    assert saved.blocks["Gain"].parameter_value("gain") == 6.283185307179586
    assert [str(wire) for wire in saved.connections][1] == "Sine Wave/y -> Gain/u"


def test_a_diagram_is_built_with_the_keyboard_alone_and_undone_completely(page: Page) -> None:
    new_diagram(page)
    for typed in ("sine wave", "integrator", "scope"):
        add(page, typed)
    expect(page.locator(".react-flow__node")).to_have_count(3)
    ports = page.locator('[data-handleid="y"], .source, [data-id="Scope"] .target')
    expect(ports).to_have_count(3)
    # The wires between them are straight. All ports are measured together, because the sheet may be moving.
    # An unconnected input is smaller than the outputs.
    boxes = "ports.map((port) => port.getBoundingClientRect())"
    centres = f"(ports) => {boxes}.map(({{ y, height }}) => y + height / 2)"
    wait_until(page, lambda: np.ptp(ports.evaluate_all(centres)) < 0.01)
    for source, target in (("Sine", "Integrator"), ("Integrator", "Scope")):
        page.keyboard.press(">")
        for label, typed in (("From the output", source), ("To the input", target)):
            box = page.get_by_role("combobox", name=label)
            box.click()
            box.press("Escape")  # closes the list; the next key opens it
            expect(box).to_have_attribute("aria-expanded", "false")
            box.fill(typed)
            expect(page.get_by_role("option", name=typed)).to_have_attribute("data-combobox-selected", "true")
            box.press("Enter")
            expect(box).to_have_value(re.compile(f"^{typed}.*.[uy]"))
        page.get_by_role("button", name="Connect", exact=True).press("Enter")
        expect(page.get_by_role("dialog")).to_be_hidden()
    expect(page.locator(".react-flow__edge")).to_have_count(2)
    run(page)
    page.keyboard.press("Control+f")
    find = page.get_by_role("textbox", name="Find")
    find.fill("Scope")
    group = page.get_by_role("listbox", name="Found").get_by_role("group").first  # other tabs follow
    expect(group.get_by_role("option")).to_have_count(1)
    find.press("Enter")
    expect(find).to_be_hidden()
    expect(block(page, "Scope")).to_be_focused()
    block(page, "Scope").press("Enter")
    expect(page.locator('.chart[data-view="Scope"]')).to_have_class(re.compile("marked"))
    expect(page.get_by_role("dialog")).to_be_hidden()
    for _ in range(5):
        page.keyboard.press("Control+z")
    expect(page.locator(".react-flow__node")).to_have_count(0)
    for _ in range(5):
        page.keyboard.press("Control+y")
    expect(page.locator(".react-flow__edge")).to_have_count(2)


def test_blocks_are_grouped_and_the_subsystem_is_opened_and_left(page: Page) -> None:
    block(page, "damping").click()
    page.keyboard.press("Control+g")
    expect(block(page, "Subsystem")).to_have_class(re.compile("selected"))
    expect(block(page, "damping")).to_have_count(0)
    page.keyboard.press("Enter")
    expect(block(page, "damping")).to_be_visible()
    expect(page.locator(".breadcrumbs")).to_have_text(re.compile("van_der_pol_pid.*Subsystem"))
    page.keyboard.press("Escape")
    page.keyboard.press("Escape")
    expect(block(page, "Subsystem")).to_be_visible()
    run(page)
    page.keyboard.press("Control+z")
    expect(block(page, "damping")).to_be_visible()


def test_a_run_is_paused_stepped_resumed_and_stopped(page: Page) -> None:
    speed = page.get_by_role("combobox", name="Speed")
    speed.select_option("0.1 × real time")
    page.keyboard.press("Control+Enter")
    state = page.locator(".run-state")
    expect(state).to_contain_text("running")
    page.get_by_role("button", name="Pause").click()
    expect(state).to_contain_text("paused")
    before = page.locator(".run-state .numbers").first.inner_text()
    page.get_by_role("button", name="Step", exact=True).click()
    expect(page.locator(".run-state .numbers").first).not_to_have_text(before)
    page.get_by_role("button", name="Resume").click()
    expect(state).to_contain_text("running")
    page.get_by_role("button", name="Stop").click()
    expect(state).to_contain_text("stopped")
    speed.select_option("as fast as possible")


def test_blocks_are_copied_as_text(page: Page) -> None:
    select_block(page, "PID")
    assert copied_names(page, lambda: page.keyboard.press("Control+c")) == ["PID"]
    page.keyboard.press("Control+v")
    expect(block(page, "PID 2")).to_be_visible()


def test_axe_finds_no_violations_in_light_and_dark_themes(page: Page) -> None:
    dialog = page.locator("[role=dialog]")
    for key in ("", "Control+k", "?", "Enter"):
        if key:
            select_block(page, "PID")
            page.keyboard.press(key)
            expect(dialog).to_be_visible()
        axe(page)
        show_theme(page, "dark")
        # The colours of the page behind a dialog are checked without it.
        axe(page, "[role=dialog]" if key else "html", tags=COLOURS)
        show_theme(page, "light")
        if key:
            page.keyboard.press("Escape")
            expect(dialog).to_be_hidden()
            expect(block(page, "PID")).to_be_focused()  # the focus returns to the block


@needs_emulated_media
def test_the_list_of_keys_is_printed_black_on_white_without_the_page(page: Page) -> None:
    page.keyboard.press("Escape")
    page.keyboard.press("?")
    keys = page.get_by_role("group", name="Keys")
    expect(keys.get_by_role("heading", name="Commands of the sheet")).to_be_visible()
    page.emulate_media(media="print", color_scheme="dark")
    expect(page.locator(".top-bar")).to_be_hidden()
    expect(page.get_by_role("button", name="Print")).to_be_hidden()
    expect(keys.get_by_text("Run or continue")).to_have_css("color", "rgb(0, 0, 0)")
    expect(keys).to_have_css("column-count", "2")
    page.emulate_media(media="screen", color_scheme="light")
    page.keyboard.press("Escape")
    expect(keys).to_be_hidden()


TYPE_AT_ONCE = """keys => {
  const press = (key, more = {}) =>
    document.activeElement.dispatchEvent(
      new KeyboardEvent('keydown', { key, bubbles: true, cancelable: true, ...more }))
  press('k', { ctrlKey: true })
  keys.forEach(key => press(key))
}"""


def test_keys_typed_before_a_list_has_the_focus_belong_to_the_list(page: Page) -> None:
    """The keys arrive before the page can draw: none of them reaches the sheet."""
    select_block(page, "PID")
    page.evaluate(TYPE_AT_ONCE, [*"sh1", "Backspace", *"ow at 100", "Enter"])
    expect(page.get_by_role("dialog")).to_be_hidden()
    expect(page.locator(".react-flow__viewport")).to_have_attribute("style", re.compile(r"scale\(1\)"))
    expect(block(page, "PID")).to_have_class(re.compile("selected"))

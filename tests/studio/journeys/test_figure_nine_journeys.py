"""The paper's Figure 9, built from an empty sheet: with the mouse, and with the keyboard alone."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from building import (
    DIALOG,
    add,
    block,
    double_click,
    drag_from_library,
    expect_focus_inside,
    expect_no_faults,
    expect_no_frames,
    new_diagram,
    run,
    wait_until,
    wire,
)
from playwright.sync_api import Locator, Page, expect

import armblocks as ab
from conftest import Studio

BLOCKS = [
    ("JTraj", "jtraj", 60, 250),
    ("RobotPlot", "plot", 300, 40),
    ("Fkine", "fkine", 300, 160),
    ("Scope", "scope", 300, 280),
    ("Derivative", "derivative", 300, 400),
    ("T2xyz", "t2xyz", 540, 160),
    ("XYGraph", "xy graph", 800, 30),
    ("XYGraph", "xy graph", 800, 140),
    ("XYGraph", "xy graph", 800, 250),
    ("Display", "display", 1040, 100),
    ("Derivative", "derivative", 540, 480),
    ("Scope", "scope", 540, 360),
    ("Rne", "rne", 800, 400),
    ("Scope", "scope", 800, 530),
    ("Scope", "scope", 1040, 400),
]
"""Block type, search text, and drop position, px."""
WIRES = [
    ("jtraj/q", "plot/q"),
    ("jtraj/q", "fkine/q"),
    ("jtraj/q", "Scope/u"),
    ("jtraj/q", "Derivative/u"),
    ("jtraj/q", "rne/q"),
    ("fkine/T", "T2xyz/T"),
    ("T2xyz/x", "XY Graph/x"),
    ("T2xyz/y", "XY Graph/y"),
    ("T2xyz/x", "XY Graph 2/x"),
    ("T2xyz/z", "XY Graph 2/y"),
    ("T2xyz/y", "XY Graph 3/x"),
    ("T2xyz/z", "XY Graph 3/y"),
    ("T2xyz/x", "Display/u1"),
    ("T2xyz/y", "Display/u2"),
    ("T2xyz/z", "Display/u3"),
    ("Derivative/y", "Derivative 2/u"),
    ("Derivative/y", "Scope 2/u"),
    ("Derivative/y", "rne/qd"),
    ("Derivative 2/y", "rne/qdd"),
    ("Derivative 2/y", "Scope 3/u"),
    ("rne/tau", "Scope 4/u"),
]
VALUES = [
    ("jtraj", {"q0": "[0 0 0 0]", "qf": "[3.14 0 1.57 0]"}),
    ("Display", {"inputs": "3"}),
    *[(name, {"robot": "kr180"}) for name in ("plot", "fkine", "rne")],
]


@pytest.fixture(scope="module")
def folder(studio: Studio) -> Path:
    return studio.folder


@pytest.fixture(scope="module")
def page(open_studio: Callable[[str], Page]) -> Page:
    page = open_studio("van_der_pol_pid")
    page.set_viewport_size({"width": 1920, "height": 1080})
    page.locator(".dock .tab").get_by_text(
        "Tune", exact=True
    ).click()  # software rendering of the arm takes long
    return page


def save_and_compare(page: Page, path: Path) -> None:
    """The built model has the same torques and tool path as the shipped model."""
    page.keyboard.press("Control+s")
    page.get_by_role("combobox", name="File").fill(path.name)
    page.get_by_role("button", name="Save", exact=True).press("Enter")
    expect(page.locator(".title")).to_have_text(path.stem)
    built, shipped = ab.simulate(ab.load_diagram(path)), ab.simulate("kr180model")
    np.testing.assert_array_equal(built.time, shipped.time)
    for signal in ("rne/tau", "T2xyz/x", "T2xyz/y", "T2xyz/z"):
        np.testing.assert_allclose(built[signal], shipped[signal], rtol=1e-12, atol=1e-12)


def test_figure_9_is_built_with_the_mouse(page: Page, folder: Path) -> None:
    new_diagram(page)
    for kind, _, x, y in BLOCKS:
        drag_from_library(page, kind, x, y)
    expect(page.locator(".react-flow__node")).to_have_count(len(BLOCKS))
    for name, values in VALUES:
        double_click(block(page, name))
        dialog = page.locator(DIALOG)
        for parameter, text in values.items():
            if parameter == "robot":
                dialog.get_by_role("combobox", name="robot").select_option(text)
            else:
                dialog.get_by_role("textbox", name=re.compile(rf"^{parameter}\b")).fill(text)
        dialog.get_by_role("button", name="OK", exact=True).click()
        expect(dialog).to_be_hidden()
    expect(block(page, "Display").locator('[data-handleid="u3"]')).to_be_visible()
    for count, (source, target) in enumerate(WIRES, 1):
        wire(page, source, target)
        expect(page.locator(".react-flow__edge")).to_have_count(count)
    expect_no_faults(page)
    run(page)
    save_and_compare(page, folder / "by mouse.json")


def tab_to(page: Page, field: Locator) -> None:
    """Move the focus to a field of the dialog with the Tab key, at most once around."""
    expect_focus_inside(page.locator(DIALOG))
    for _ in range(40):
        if field.evaluate("(element) => element === document.activeElement"):
            return
        page.keyboard.press("Tab")
    raise AssertionError("Tab does not reach the field")


def enter(page: Page, text: str, *, by_key: bool) -> None:
    """Type into the focused field: key by key, or as one text if the key handling was tested before."""
    if by_key:
        page.keyboard.type(text)
    else:
        page.keyboard.insert_text(text)


def choose_by_keys(page: Page, field: Locator, entry: str) -> None:
    """Type an entry of a list; on a loaded machine again, because a pause of 1 s ends the typed word."""

    def is_chosen() -> bool:
        page.keyboard.type(entry)
        if field.input_value() == entry:
            return True
        page.wait_for_timeout(1500)
        return False

    wait_until(page, is_chosen)


def test_figure_9_is_built_with_the_keyboard_alone(page: Page, folder: Path) -> None:
    page.keyboard.press("Control+k")
    page.get_by_role("textbox", name="Command").press_sequentially("new diagram")
    page.keyboard.press("Enter")
    expect(page.get_by_text("Type to add a block")).to_be_visible()
    for count, (_, typed, _, _) in enumerate(BLOCKS, 1):
        add(page, typed, by_key=count == 1)
        expect(page.locator(".react-flow__node")).to_have_count(count)
    dialog = page.locator(DIALOG)
    for name, values in VALUES:
        page.keyboard.press("Control+f")
        expect_focus_inside(dialog)
        enter(page, name, by_key=name == "jtraj")
        expect(dialog.get_by_role("option").first).to_contain_text(name)
        page.keyboard.press("Enter")
        expect(block(page, name)).to_be_focused()
        page.keyboard.press("Enter")
        for parameter, text in values.items():
            role = "combobox" if parameter == "robot" else "textbox"
            field = dialog.get_by_role(role, name=re.compile(rf"^{parameter}\b"))
            tab_to(page, field)
            if role == "textbox":
                page.keyboard.press("Control+a")
                enter(page, text, by_key=name == "jtraj")
            else:
                choose_by_keys(page, field, text)
            expect(field).to_have_value(text)
        tab_to(page, dialog.get_by_role("button", name="OK", exact=True))
        page.keyboard.press("Enter")
        expect(dialog).to_be_hidden()
        expect(block(page, name)).to_be_focused()
    for count, (source, target) in enumerate(WIRES, 1):
        page.keyboard.press(">")
        for label, port in (("From the output", source), ("To the input", target)):
            box = dialog.get_by_role("combobox", name=label)
            expect(box).to_be_visible()
            if box.input_value() == port:  # already suggested: a port of the selected block
                continue
            tab_to(page, box)
            page.keyboard.press("Control+a")
            enter(page, port, by_key=count == 1)
            expect(page.locator(f'[role="option"][value="{port}"][data-combobox-selected]')).to_be_visible()
            page.keyboard.press("Enter")
            expect(box).to_have_value(port)
        tab_to(page, dialog.get_by_role("button", name="Connect", exact=True))
        page.keyboard.press("Enter")
        expect(page.locator(".react-flow__edge")).to_have_count(count)
    expect_no_faults(page)
    expect_no_frames(page)  # the lists of ports were scrolled and closed
    run(page)
    save_and_compare(page, folder / "by keyboard.json")

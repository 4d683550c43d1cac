"""A mechanism is drawn from an empty sheet with the mouse, and moves as its closed form demands."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
from building import (
    DIALOG,
    block,
    double_click,
    drag_from_library,
    expect_no_faults,
    new_diagram,
    run,
    wire,
)
from document_files import save_as
from playwright.sync_api import Page, expect

import armblocks as ab
from conftest import Studio

CRANK, ROD = 0.2, 0.6
"""Lengths of the crank and the connecting rod, m."""
BLOCKS = [
    ("WorldFrame", 60, 60),
    ("MechanismConfiguration", 60, 200),
    ("RevoluteJoint", 200, 60),
    ("CylindricalSolid", 200, 200),
    ("RigidTransform", 340, 60),
    ("RevoluteJoint", 480, 60),
    ("RigidTransform", 620, 60),
    ("BrickSolid", 620, 200),
    ("RigidTransform", 760, 60),
    ("RevoluteJoint", 760, 200),
    ("RigidTransform", 60, 340),
    ("PrismaticJoint", 200, 340),
    ("BrickSolid", 340, 340),
    ("RigidTransform", 480, 340),
    ("Scope", 340, 200),
]
VALUES = [
    (
        "Revolute Joint",
        {
            "position_target": "0.5",
            "position_priority": "high",
            "velocity_target": "6",
            "velocity_priority": "high",
            "sense_position": True,
        },
    ),
    ("Rigid Transform", {"translation": f"[{CRANK} 0 0]"}),
    ("Rigid Transform 2", {"translation": f"[{ROD / 2} 0 0]"}),
    ("Brick Solid", {"dimensions": f"[{ROD} 0.03 0.03]"}),
    ("Rigid Transform 3", {"translation": f"[{ROD / 2} 0 0]"}),
    ("Rigid Transform 4", {"rotation": "standard_axis", "axis": "y", "angle": "pi/2"}),
    ("Prismatic Joint", {"position_target": "0.7", "sense_position": True}),
    ("Rigid Transform 5", {"rotation": "standard_axis", "axis": "y", "angle": "-pi/2"}),
]
LINES = [
    ("World Frame/W", "Mechanism Configuration/C"),
    ("World Frame/W", "Revolute Joint/B"),
    ("Revolute Joint/F", "Cylindrical Solid/R"),
    ("Revolute Joint/F", "Rigid Transform/B"),
    ("Rigid Transform/F", "Revolute Joint 2/B"),
    ("Revolute Joint 2/F", "Rigid Transform 2/B"),
    ("Rigid Transform 2/F", "Brick Solid/R"),
    ("Rigid Transform 2/F", "Rigid Transform 3/B"),
    ("Rigid Transform 3/F", "Revolute Joint 3/B"),
    ("World Frame/W", "Rigid Transform 4/B"),
    ("Rigid Transform 4/F", "Prismatic Joint/B"),
    ("Prismatic Joint/F", "Brick Solid 2/R"),
    ("Prismatic Joint/F", "Rigid Transform 5/B"),
    ("Rigid Transform 5/F", "Revolute Joint 3/F"),
    ("Revolute Joint/q", "Scope/u"),
]


def set_values(page: Page, name: str, values: dict[str, str | bool]) -> None:
    """Set parameters of a block in its dialog."""
    double_click(block(page, name))
    dialog = page.locator(DIALOG)
    for parameter, value in values.items():
        if value is True:
            dialog.locator("label", has_text=parameter).first.click()
            continue
        field = dialog.get_by_label(re.compile(rf"^{parameter}\b")).first
        if field.evaluate("(element) => element.tagName") == "SELECT":
            field.select_option(value)
        else:
            field.fill(value)
    dialog.get_by_role("button", name="OK", exact=True).click()
    expect(dialog).to_be_hidden()


def test_a_slider_crank_is_built_with_the_mouse(open_studio: Callable[[str], Page], studio: Studio) -> None:
    page = open_studio("van_der_pol_pid")
    page.set_viewport_size({"width": 1920, "height": 1080})
    new_diagram(page)
    for kind, x, y in BLOCKS:
        drag_from_library(page, kind, x, y)
    expect(page.locator(".react-flow__node")).to_have_count(len(BLOCKS))
    for name, values in VALUES:
        set_values(page, name, values)
    for count, (source, target) in enumerate(LINES, 1):
        wire(page, source, target)
        expect(page.locator(".react-flow__edge")).to_have_count(count)
    expect_no_faults(page)
    run(page)
    expect(page.get_by_role("toolbar", name="Robot view")).to_be_visible()
    save_as(page, "slider-crank.json")
    result = ab.simulate(ab.load_diagram(studio.folder / "slider-crank.json"))
    angle, slider = result["Revolute Joint/q"], result["Prismatic Joint/q"]
    assert np.ptp(angle) > 2 * np.pi
    expected = CRANK * np.cos(angle) + np.sqrt(ROD**2 - (CRANK * np.sin(angle)) ** 2)
    np.testing.assert_allclose(slider, expected, atol=1e-9)

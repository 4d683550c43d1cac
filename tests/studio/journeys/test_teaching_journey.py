"""Teaching an arm in the studio: drag the tool, record four poses, run the motion, use it in a diagram."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from accessibility import axe
from browsers import needs_webgl
from building import block, open_shipped_robot
from playwright.sync_api import Locator, Page, expect

import armblocks as ab
from conftest import Studio


@pytest.fixture(scope="module")
def page(open_studio: Callable[[str], Page]) -> Page:
    return open_studio("van_der_pol_pid")


def value(field: Locator) -> float:
    return float(field.input_value())


def drag_handle(page: Page, canvas: Locator, right: float, down: float) -> None:
    """Drag the middle of the handle at the tool with the mouse."""
    expect(canvas).to_have_attribute("data-handle", re.compile(r"^[0-9.]+ [0-9.]+$"))
    place, box = canvas.get_attribute("data-handle"), canvas.bounding_box()
    assert place is not None and box is not None
    x, y = (float(part) for part in place.split())
    x, y = x + box["x"], y + box["y"]
    page.mouse.move(x, y)
    page.mouse.down()
    for k in range(1, 5):
        page.mouse.move(x + k / 4 * right, y + k / 4 * down)
    page.mouse.up()


@needs_webgl
def test_the_tool_is_dragged_four_poses_are_recorded_and_the_motion_runs(page: Page, studio: Studio) -> None:
    editor = open_shipped_robot(page, "puma560")
    editor.get_by_text("Teach", exact=True).click()
    tool, poses, motion = (editor.get_by_role("region", name=name) for name in ("Tool", "Poses", "Motion"))
    record = poses.get_by_role("button", name="Record")
    # The motion omits the named configurations of the robot.
    expect(poses.get_by_role("listitem")).to_have_count(4)
    expect(motion.get_by_role("button", name="Run")).to_be_disabled()
    for joint, angle in ((2, 60), (3, -165), (5, 45)):
        editor.get_by_role("textbox", name=f"q of link{joint} as a number").fill(str(angle))
    x, z = (tool.get_by_role("textbox", name=f"{axis} of the tool", exact=True) for axis in "xz")
    expect(editor.get_by_role("textbox", name="q of link5 as a number")).to_have_value("45")
    expect(x).not_to_have_value("0.4521")
    record.click()

    # The tool is dragged by its handle, moved by keys and buttons, and typed.
    tool.get_by_text("Move", exact=True).click()
    before = x.input_value(), z.input_value()
    drag_handle(page, editor.locator("canvas"), -30.0, 20.0)
    expect(z).not_to_have_value(before[1])
    expect(tool).to_have_attribute("aria-busy", "false")
    record.click()
    stage = editor.get_by_role("application")
    height = value(z)
    stage.focus()
    for _ in range(3):
        stage.press("Shift+PageDown")  # no step is lost, although the arm is still moving
    stage.press("Shift+PageUp")
    expect(z).to_have_value(f"{height - 0.02:.4f}")
    tool.get_by_role("button", name="Increase x").click()
    record.click()
    x.fill("0.45")
    x.press("Enter")
    expect(x).to_have_value("0.4500")
    record.click()
    expect(poses.get_by_role("listitem")).to_have_count(8)
    z.fill("9")
    z.press("Enter")
    expect(tool.get_by_role("list", name="Limits of the tool")).to_contain_text(
        re.compile("stops at the nearest pose: .* the target is [0-9.]+ m")
    )

    # The list of poses: names, order, undo.
    name = poses.get_by_role("textbox", name="Name of P4")
    name.fill("place")
    name.press("Enter")
    expect(poses.get_by_role("button", name="Go to place")).to_be_visible()
    poses.get_by_role("button", name="Delete P2").click()
    expect(poses.get_by_role("listitem")).to_have_count(7)
    page.keyboard.press("Control+z")
    expect(poses.get_by_role("listitem")).to_have_count(8)
    poses.get_by_role("button", name="Go to place").click()
    expect(x).to_have_value("0.4500")

    # After a reload of the page, only the configurations of the shipped robot are not selected.
    page.reload()
    editor.get_by_text("Teach", exact=True).click()
    for name_of_pose, is_selected in (("qz", False), ("P1", True), ("place", True)):
        passes = poses.get_by_role("checkbox", name=f"Motion passes {name_of_pose}", exact=True)
        expect(passes).to_be_checked(checked=is_selected)
    poses.get_by_role("button", name="Go to place").click()
    expect(x).to_have_value("0.4500")

    # The motion.
    motion.get_by_role("button", name="Run").click()
    expect(motion.get_by_role("alert")).to_contain_text("no limits of speed or torque")
    motion.get_by_role("textbox", name="Duration in s").fill("0.4")
    motion.get_by_role("button", name="Run").click()
    expect(motion.get_by_role("status", name="Duration of the motion")).to_have_text("0.40 / 0.40 s")
    peaks = motion.get_by_role("table", name="Peaks of the motion")
    expect(peaks.get_by_role("row")).to_have_count(8)
    heads, numbers = (
        row.locator("th, td").evaluate_all("cells => cells.map(cell => cell.getBoundingClientRect().right)")
        for row in (peaks.get_by_role("row").nth(k) for k in (0, 1))
    )
    assert heads == numbers  # the robot has no limits, so there are no shares beside the numbers
    assert len(heads) == 3
    poses.get_by_role("checkbox", name="Motion passes P3").uncheck()
    expect(peaks).to_have_count(0)  # the motion no longer passes the selected poses
    motion.get_by_role("button", name="Run").click()
    expect(peaks).to_be_visible()
    time = motion.get_by_role("slider", name="Time of the motion")
    time.press("Home")
    expect(editor.get_by_role("textbox", name="q of link2 as a number")).to_have_value("60")
    axe(page, ".teach")

    motion.get_by_role("button", name="Save the trajectory …").click()
    page.get_by_role("textbox", name="File in this folder").fill("taught")
    page.get_by_role("button", name="Save", exact=True).click()
    expect(page.get_by_role("dialog")).to_have_count(0)
    saved = ab.load_trajectory(studio.folder / "taught.csv")
    assert (saved.n, round(saved.duration, 9)) == (6, 0.4)
    motion.get_by_role("button", name="Insert into the diagram").click()
    expect(editor).to_have_count(0)
    inserted = block(page, "motion of Puma 560")
    expect(inserted).to_be_visible()
    page.keyboard.press("Control+z")
    expect(inserted).to_have_count(0)

"""Robot workflows of the studio in a real browser against a real server."""

from __future__ import annotations

import base64
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from accessibility import axe
from browsers import needs_webgl
from building import open_shipped_robot
from playwright.sync_api import Locator, Page, expect

import armblocks as ab
from armblocks.formats import load_robot, read_robots
from conftest import Studio

PRINTED = Path(__file__).parents[2] / "formats" / "kr180_as_printed.m"
DROP = """([name, content]) => {
    const bytes = Uint8Array.from(atob(content), (letter) => letter.charCodeAt(0))
    const data = new DataTransfer()
    data.items.add(new File([bytes], name))
    for (const kind of ['dragenter', 'drop'])
        document.body.dispatchEvent(
            new DragEvent(kind, { bubbles: true, cancelable: true, dataTransfer: data })
        )
}"""


@pytest.fixture(scope="module")
def folder(studio: Studio) -> Path:
    return studio.folder


@pytest.fixture(scope="module")
def page(open_studio: Callable[[str], Page]) -> Page:
    """One page for all tests; each test leaves it with a diagram without an arm."""
    return open_studio("van_der_pol_pid")


def drop(page: Page, name: str, content: bytes) -> None:
    """Drop a file on the page, as from the desktop."""
    page.evaluate(DROP, [name, base64.b64encode(content).decode()])


def tool_x(editor: Locator) -> Locator:
    return editor.get_by_role("region", name="Pose of the tool").locator("dd").first


def test_a_robot_is_edited_marked_undone_saved_and_reopened(page: Page, folder: Path) -> None:
    editor = open_shipped_robot(page, "puma560")
    expect(tool_x(editor)).to_have_text("0.4521 m")
    cell = editor.get_by_role("textbox", name="a of link2", exact=True)
    cell.fill("0.5318")
    expect(tool_x(editor)).to_have_text("0.5521 m")  # while it is typed
    cell.fill("half a metre")
    expect(cell).to_have_attribute("aria-invalid", "true")
    expect(page.get_by_role("tooltip")).to_contain_text("'a' is not allowed here, expected an operator")
    expect(tool_x(editor)).to_have_text("0.5521 m")  # an invalid text changes nothing
    cell.fill("1/2")
    expect(cell).to_have_attribute("aria-invalid", "false")
    cell.press("Enter")
    expect(editor.get_by_role("textbox", name="a of link3", exact=True)).to_be_focused()
    expect(cell).to_have_value("0.5")
    page.keyboard.press("Control+z")
    expect(cell).to_have_value("0.4318")  # the typed text is one step
    page.keyboard.press("Control+y")
    expect(cell).to_have_value("0.5")

    alpha = editor.get_by_role("textbox", name="α of link1", exact=True)
    expect(alpha).to_have_value("90")
    editor.get_by_text("rad", exact=True).click()
    expect(alpha).to_have_value("pi/2")

    editor.get_by_text("Dynamics", exact=True).click()
    warnings = editor.locator(".findings")
    expect(warnings).to_have_text("2 warnings")  # the published numbers of the Puma
    inertia = editor.get_by_role("textbox", name="zz of link2")
    inertia.fill("9")
    expect(warnings).to_have_text("3 warnings")
    expect(page.get_by_role("tooltip")).to_contain_text("exceeds the sum of the other two")
    inertia.press("Escape")
    expect(warnings).to_have_text("2 warnings")

    slider = editor.get_by_role("slider", name="q of link5")
    expect(editor.get_by_text("Singular: link4 and link6")).to_be_visible()
    slider.press("End")
    expect(editor.get_by_text("Singular:")).to_have_count(0)

    page.keyboard.press("Control+s")
    page.get_by_role("textbox", name="File in this folder").fill("arms/mine.json")
    page.get_by_role("button", name="Save", exact=True).click()
    expect(editor.get_by_text("arms/mine.json")).to_be_visible()
    (saved,) = read_robots((folder / "arms" / "mine.json").read_bytes(), "mine.json").values()
    assert saved.links[1].dh is not None
    assert saved.links[1].dh.a == 0.5
    assert saved.links[2:] == load_robot("puma560").links[2:]
    editor.get_by_role("button", name="van_der_pol_pid").click()
    expect(editor).to_have_count(0)
    expect(page.locator(".react-flow__node").first).to_be_visible()


@needs_webgl
def test_the_script_of_the_paper_is_dropped_viewed_and_exported(page: Page) -> None:
    drop(page, "kr180.m", PRINTED.read_bytes())
    editor = page.locator(".robot-editor")
    expect(editor.get_by_role("textbox", name="d of link4", exact=True)).to_have_value("2.6")
    expect(editor.get_by_text("split as on a printed page")).to_be_visible()
    page.get_by_role("button", name="Close the notes").click()
    expect(tool_x(editor)).to_have_text("1.9500 m")
    view = editor.get_by_role("toolbar", name="Robot view")
    for preset in ("From the front", "From above", "From the tool", "From a corner"):
        view.get_by_role("button", name="Camera").click()
        page.get_by_role("menuitem", name=preset).click()
    view.get_by_role("button", name="Display options").click()
    page.get_by_role("menuitemcheckbox", name="Ranges of the joints").click()
    page.keyboard.press("Escape")
    stage = editor.get_by_role("application")
    stage.focus()
    for key in ("ArrowLeft", "ArrowUp", "+", "Space"):
        stage.press(key)
    with page.expect_download() as picture:
        view.get_by_role("button", name="Save a picture (PNG)").click()
    assert picture.value.suggested_filename == "KR180.png"
    assert picture.value.path().read_bytes().startswith(b"\x89PNG")

    editor.get_by_role("button", name="standard D-H").click()
    page.get_by_role("menuitem", name="Write the same arm as modified D-H").click()
    expect(editor.get_by_role("textbox", name="a of link2", exact=True)).to_have_value("0.35")
    expect(tool_x(editor)).to_have_text("1.9500 m")

    drop(page, "evil.m", b"L{1} = link([0 1 0 0 0]);\nsystem('true')\n")
    expect(page.get_by_text(re.compile("evil.m:2"))).to_be_visible()
    drop(page, "arm.step", b"ISO-10303-21;")
    expect(page.get_by_text("is not a file type that can be dropped here")).to_be_visible()
    model = (Path(ab.__file__).parents[2] / "examples" / "van_der_pol_pid.json").read_bytes()
    drop(page, "pendulum.json", model)
    expect(editor).to_have_count(0)
    expect(page.locator(".react-flow__node").first).to_be_visible()


def test_the_robot_of_a_block_is_edited_and_axe_finds_no_violations(page: Page) -> None:
    page.get_by_role("button", name="Menu").click()
    page.get_by_role("menuitem", name=re.compile("^kr180model (?!not saved)[A-Za-z]")).click()
    page.get_by_role("button", name="Edit this robot").click()
    editor = page.locator(".robot-editor")
    expect(editor.get_by_role("region", name="Jacobian")).to_be_visible()
    axe(page, ".robot-editor")

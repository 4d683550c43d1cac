"""Lost connections and page reloads during edits and drags."""

from __future__ import annotations

import json
import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from browsers import LOST_CONNECTION
from building import add, block, keep_view, new_diagram
from playwright.sync_api import Browser, Locator, Page, expect

from conftest import Studio, new_context

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="SIGSTOP needs POSIX")
OUTAGE_MS = 1000 * float(os.environ.get("ARMBLOCKS_LINE_GONE", "0"))
"""Duration of the outage after the page reports it, ms; the environment variable has seconds.

In the long version it is 10 s, and the page reconnects."""


class Session:
    """A studio that is suspended, killed and restarted, and the page that stays open."""

    def __init__(self, browser: Browser, folder: Path) -> None:
        self.folder = folder
        self.studio = Studio(folder, "van_der_pol_pid")  # software rendering of an arm takes long
        self.context = new_context(browser)
        self.page = self.context.new_page()
        self.faults: list[str] = []
        self.page.on("pageerror", lambda error: self.faults.append(str(error)))
        self.page.goto(self.studio.link)
        self.page.locator(".react-flow__node").first.wait_for()

    def begin(self) -> Page:
        """Open an empty drawing and add a gain."""
        page = self.page
        new_diagram(page)
        add(page, "gain")
        expect(block(page, "Gain")).to_be_visible()
        return page

    def suspend(self) -> None:
        """Suspend the server: the connection stays open, but no message is answered."""
        self.studio.process.send_signal(signal.SIGSTOP)

    def resume(self) -> None:
        expect(outage_message(self.page)).to_be_visible()
        self.page.wait_for_timeout(OUTAGE_MS)
        self.studio.process.send_signal(signal.SIGCONT)
        expect(outage_message(self.page)).to_be_hidden()

    def kill(self) -> None:
        self.studio.kill()
        expect(outage_message(self.page)).to_be_visible()

    def restart(self) -> None:
        self.studio = Studio(self.folder, "van_der_pol_pid")

    def saved(self, name: str) -> dict[str, list[float]]:
        """The positions of the blocks in the file that the page saves."""
        page = self.page
        page.locator(".react-flow__pane").click(position={"x": 5, "y": 5})
        page.keyboard.press("Control+Shift+S")
        page.get_by_role("combobox", name="File").fill(name)
        page.get_by_role("button", name="Save", exact=True).click()
        expect(page.get_by_role("dialog")).to_be_hidden()
        expect(page.locator(".title")).to_have_text(name.partition(".")[0])
        document = json.loads((self.folder / name).read_text())
        assert document["layout"].keys() == document["blocks"].keys()
        return {name: [place["x"], place["y"]] for name, place in document["layout"].items()}


def outage_message(page: Page) -> Locator:
    return page.get_by_text("The studio does not answer")


def place(page: Page, name: str) -> tuple[float, float]:
    box = block(page, name).bounding_box()
    assert box is not None
    return box["x"], box["y"]


def begin_drag(page: Page, name: str) -> tuple[float, float]:
    """Press the mouse on a block and drag it a short distance; return the pointer position."""
    keep_view(page)
    box = block(page, name).bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 20, y + 10, steps=4)
    return x, y


@pytest.fixture(scope="module")
def session(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Session]:
    session = Session(browser, tmp_path_factory.mktemp("project"))
    yield session
    session.context.close()
    session.studio.stop()
    assert [fault for fault in session.faults if not LOST_CONNECTION.search(fault)] == []


def test_edits_during_an_outage_are_applied_after_it(session: Session) -> None:
    page = session.begin()
    session.suspend()
    add(page, "integrator")
    block(page, "Gain").click()
    page.keyboard.press("ArrowDown")
    session.resume()
    expect(block(page, "Integrator")).to_be_visible()
    places = session.saved("silence.json")
    assert places.keys() == {"Gain", "Integrator"}


def test_a_drag_across_a_server_restart_ends_where_the_block_is_released(
    session: Session,
) -> None:
    page = session.begin()
    before = place(page, "Gain")
    x, y = begin_drag(page, "Gain")
    session.kill()
    page.mouse.move(x + 60, y + 40, steps=4)
    session.restart()
    expect(outage_message(page)).to_be_hidden()
    page.mouse.move(x + 160, y + 80, steps=4)
    page.mouse.up()
    expect(page.locator(".title")).to_have_text("untitled •")
    after = place(page, "Gain")
    assert after[0] - before[0] > 120
    assert after[1] - before[1] > 50
    shown = session.saved("dragged.json")["Gain"]
    page.keyboard.press("Control+z")  # one step, in spite of the lost connection
    expect(page.locator(".title")).to_have_text("dragged •")
    back = session.saved("undone.json")["Gain"]
    zoom = page.locator(".react-flow__viewport").evaluate("it => new DOMMatrix(it.style.transform).a")
    moved = (zoom * (shown[0] - back[0]), zoom * (shown[1] - back[1]))
    assert moved == pytest.approx((after[0] - before[0], after[1] - before[1]), abs=0.5)


def test_a_reload_during_a_drag_leaves_the_block_at_its_position(session: Session) -> None:
    page = session.begin()
    start = session.saved("still.json")
    begin_drag(page, "Gain")
    page.reload()
    expect(block(page, "Gain")).to_be_visible()
    page.mouse.up()
    assert session.saved("reloaded.json") == start
    x, y = begin_drag(page, "Gain")
    page.mouse.move(x + 100, y, steps=4)
    page.mouse.up()
    expect(page.locator(".title")).to_have_text("reloaded •")
    moved = session.saved("moved.json")["Gain"]
    assert moved[0] > start["Gain"][0] + 50


def test_queued_edits_survive_a_reload_and_are_applied_once(session: Session) -> None:
    page = session.begin()
    session.kill()
    add(page, "integrator")
    block(page, "Gain").click()
    page.keyboard.press("Delete")
    session.restart()
    page.reload()
    expect(block(page, "Integrator")).to_be_visible()
    expect(block(page, "Gain")).to_have_count(0)
    page.reload()
    expect(page.locator(".react-flow__node")).to_have_count(1)
    assert session.saved("waited.json").keys() == {"Integrator"}

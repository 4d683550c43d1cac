"""Pages of ``Arm.teach`` and ``Arm.animate`` in a browser."""

from __future__ import annotations

import webbrowser
from collections.abc import Iterator

import numpy as np
import pytest
from browsers import needs_webgl
from building import wait_until
from playwright.sync_api import APIResponse, Browser, ConsoleMessage, Page, Route, expect

import armblocks as ab
from conftest import NO_RENDERING, TIMEOUT_MS

Q = [0.1, 0.4, -2.0, 0.3, 0.5, 0.0]


@pytest.fixture
def page(browser: Browser, monkeypatch: pytest.MonkeyPatch) -> Iterator[Page]:
    """A page that may report no error."""
    monkeypatch.setattr(webbrowser, "open", lambda link: True)
    page = browser.new_page(viewport={"width": 1000, "height": 640}, color_scheme="light")
    page.set_default_timeout(TIMEOUT_MS)
    page.add_init_script(NO_RENDERING)
    faults: list[str] = []

    def on_console(message: ConsoleMessage) -> None:
        if message.type == "error":
            faults.append(message.text)

    page.on("console", on_console)
    page.on("pageerror", lambda error: faults.append(str(error)))
    yield page
    page.close()
    assert not faults


def position(point: np.ndarray) -> str:
    texts = (f"{axis} {value:z.3f}" for axis, value in zip("xyz", point, strict=True))
    return "   ".join(texts).replace("-", "−") + " m"


@needs_webgl
def test_sliders_and_python_move_the_same_arm(page: Page) -> None:
    arm = ab.load_robot("puma560")
    view = arm.teach(Q)
    page.goto(view.link)
    frame = page.frame_locator("iframe")
    tool = frame.get_by_label("Position of the tool")
    expect(tool).to_have_text(position(arm.fkine(Q)[:3, 3]))
    slider = frame.get_by_role("slider", name="link2")
    slider.focus()
    slider.press("ArrowRight")
    wait_until(page, lambda: view.q[1] > 0.4)
    expect(tool).to_have_text(position(arm.fkine(view.q)[:3, 3]))
    # The reply to a movement arrives after coordinates that Python has set meanwhile.
    late: list[tuple[Route, APIResponse]] = []
    page.route("**/joints", lambda route: late.append((route, route.fetch())))
    field = frame.get_by_label("link1 as a number")
    field.fill("30")
    field.press("Enter")
    wait_until(page, lambda: bool(late) and abs(view.q[0] - np.pi / 6) < 1e-12)
    view.q = Q
    expect(tool).to_have_text(position(arm.fkine(Q)[:3, 3]))
    ((route, reply),) = late
    with page.expect_response("**/joints"):
        route.fulfill(response=reply)
    page.unroute("**/joints")
    slider.press("ArrowRight")
    wait_until(page, lambda: view.q[1] > 0.4)
    assert view.q[0] == 0.1
    expect(tool).to_have_text(position(arm.fkine(view.q)[:3, 3]))
    expect(field).to_have_value("5.73")
    view.close()
    expect(field).to_be_disabled()
    expect(frame.get_by_text("The Python program has ended")).to_be_visible()


@needs_webgl
def test_a_motion_plays_in_a_loop_until_the_page_is_closed(page: Page) -> None:
    arm = ab.load_robot("puma560")
    q = np.linspace(np.zeros(6), Q, 5)
    view = arm.animate(q, 0.1, theme="dark")
    page.goto(view.link)
    frame = page.frame_locator("iframe")
    expect(frame.locator("html")).to_have_attribute("data-mantine-color-scheme", "dark")
    expect(frame.get_by_role("button", name="Loop")).to_have_attribute("aria-pressed", "true")
    expect(frame.get_by_role("button", name="Pause the playback")).to_be_visible()
    frame.get_by_role("button", name="Pause the playback").click()
    slider = frame.get_by_role("slider", name="Time")
    slider.focus()
    slider.press("End")
    expect(frame.get_by_label("Position of the tool")).to_have_text(position(arm.fkine(Q)[:3, 3]))
    wait_until(page, lambda: view.open)
    page.goto("about:blank")
    view.wait(60)
    assert not view.open

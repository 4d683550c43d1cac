"""Notebook widgets, displayed through the protocol of anywidget in a real browser without a network."""

from __future__ import annotations

import base64
import io
import sys
from collections.abc import Iterator

import numpy as np
import pytest
from browsers import needs_webgl
from building import wait_until
from PIL import Image
from playwright.sync_api import Browser, ConsoleMessage, FrameLocator, Page, Route, expect

import armblocks as ab
from armblocks.errors import InputError, MissingLibraryError
from conftest import NO_RENDERING, TIMEOUT_MS

ORIGIN = "http://notebook.test/"
SHOW = """async ([esm, states]) => {
    const file = URL.createObjectURL(new Blob([esm], { type: 'text/javascript' }))
    const { default: widget } = await import(file)
    window.models = states.map((state) => {
        const listeners = {}
        const bytes = Uint8Array.from(atob(state._frame), (letter) => letter.charCodeAt(0))
        const values = { ...state, _frame: new DataView(bytes.buffer) }
        const model = {
            get: (name) => values[name],
            set: (name, value) => {
                values[name] = value
                listeners['change:' + name]?.forEach((listener) => listener())
            },
            save_changes: () => { model.saved = values.time },
            on: (name, listener) => (listeners[name] ??= []).push(listener),
            off: (name, listener) => { listeners[name] = listeners[name].filter((one) => one !== listener) },
        }
        const el = document.body.appendChild(document.createElement('div'))
        model.close = widget.render({ model, el })
        return model
    })
}"""
SYNCED = ("title", "height", "time", "_page", "_shown", "_frame")


@pytest.fixture
def notebook(browser: Browser) -> Iterator[Page]:
    """An empty page that may send no request after the first and report no error."""
    page = browser.new_page(viewport={"width": 1280, "height": 1100}, color_scheme="light")
    page.set_default_timeout(TIMEOUT_MS)
    faults: list[str] = []

    def answer(route: Route) -> None:
        if route.request.url == ORIGIN:
            route.fulfill(body="<!doctype html><body></body>", content_type="text/html")
        else:
            faults.append(f"requested {route.request.url}")
            route.abort()

    def on_console(message: ConsoleMessage) -> None:
        if message.type == "error":
            faults.append(message.text)

    page.route("http*://**", answer)
    page.on("console", on_console)
    page.on("pageerror", lambda error: faults.append(str(error)))
    yield page
    page.close()
    assert not faults


def show(page: Page, *widgets: object) -> list[FrameLocator]:
    """Render widgets one below the other, as a notebook does."""
    states = []
    for widget in widgets:
        state = widget.get_state(SYNCED)  # type: ignore[attr-defined]
        state["_frame"] = base64.b64encode(state["_frame"]).decode()
        states.append(state)
    page.goto(ORIGIN)
    page.evaluate(SHOW, [str(widgets[0]._esm), states])  # type: ignore[attr-defined]
    return [page.frame_locator("iframe").nth(k) for k in range(len(widgets))]


def colours(picture: bytes) -> int:
    """Number of colours in a PNG file."""
    return len(Image.open(io.BytesIO(picture)).convert("RGB").getcolors(1 << 24) or ())


def shown(point: np.ndarray) -> str:
    texts = (f"{axis} {value:z.3f}" for axis, value in zip("xyz", point, strict=True))
    return "   ".join(texts).replace("-", "−") + " m"


@needs_webgl
def test_the_widgets_of_a_result_share_their_time_cursor(notebook: Page) -> None:
    notebook.add_init_script(NO_RENDERING)
    diagram = ab.load_diagram("kr180model")
    result = ab.simulate(diagram)
    tool = result["plot/poses"][:, -1, :3, 3]
    scopes, arm = show(
        notebook, ab.run_widget(diagram, result, show="scopes"), ab.run_widget(diagram, result, show="robot")
    )
    expect(scopes.locator(".chart")).to_have_count(7)
    expect(scopes.locator(".robot")).to_have_count(0)
    expect(arm.locator(".chart")).to_have_count(0)
    expect(arm.get_by_label("Position of the tool")).to_have_text(shown(tool[-1]))
    slider = scopes.get_by_role("slider", name="Time")
    slider.focus()
    slider.press("Home")
    expect(arm.get_by_label("Position of the tool")).to_have_text(shown(tool[0]))
    slider.press("ArrowRight")
    expect(arm.get_by_label("Position of the tool")).to_have_text(shown(tool[1]))
    notebook.wait_for_function("models[0].saved === 0.01")  # sent to Python when the cursor stops
    notebook.evaluate("models[1].set('time', 5)")  # as if set in Python
    expect(arm.get_by_label("Position of the tool")).to_have_text(shown(tool[500]))
    inked = """(canvas) => {
        const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height)
        return new Set(new Uint32Array(data.buffer)).size
    }"""
    assert scopes.locator(".chart canvas").first.evaluate(inked) > 8
    in_grid_tone = """(canvas) => {
        const tone = getComputedStyle(document.documentElement).getPropertyValue('--grid').trim()
        const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height)
        const hex = (k) => '#' + [0, 1, 2].map((n) => data[k + n].toString(16).padStart(2, '0')).join('')
        for (let k = 0; k < data.length; k += 4) if (data[k + 3] === 255 && hex(k) === tone) return true
        return false
    }"""
    pages = [frame.locator("html") for frame in (scopes, arm)]
    notebook.emulate_media(color_scheme="dark")
    for page in pages:
        expect(page).to_have_attribute("data-mantine-color-scheme", "dark")
    wait_until(notebook, lambda: scopes.locator(".chart canvas").first.evaluate(in_grid_tone))
    notebook.evaluate("document.body.dataset.jpThemeLight = 'true'")  # as JupyterLab sets its theme
    for page in pages:
        expect(page).to_have_attribute("data-mantine-color-scheme", "light")


@needs_webgl
def test_a_robot_widget_shows_the_given_configuration(notebook: Page) -> None:
    notebook.set_viewport_size({"width": 240, "height": 240})  # software rendering
    puma = ab.load_robot("puma560")
    q = [0.1, 0.4, -2.0, 0.3, 0.5, 0.0]
    (arm,) = show(notebook, ab.robot_widget(puma, q))
    expect(arm.get_by_label("Position of the tool")).to_have_text(shown(puma.fkine(q)[:3, 3]))
    expect(arm.get_by_role("slider", name="Time")).to_have_count(0)
    canvas = arm.locator(".robot canvas")
    expect(canvas).to_be_visible()
    # Journeys of the studio do not draw the arm (NO_RENDERING); this test does, with many shades.
    wait_until(notebook, lambda: colours(canvas.screenshot()) > 500)


def test_widgets_that_cannot_be_shown_raise_errors_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    builder = ab.DiagramBuilder("bare")
    builder.add("sink", ab.blocks.Terminator(), builder.add("one", ab.blocks.Constant()))
    diagram_without_views = builder.build()
    result = ab.simulate(diagram_without_views, stop_time=1.0)
    with pytest.raises(InputError, match=r"diagram 'bare' has nothing to show here"):
        ab.run_widget(diagram_without_views, result)
    with pytest.raises(InputError, match=r"show is 'arms'.*'scopes', 'robot', or None"):
        ab.run_widget(diagram_without_views, result, show="arms")
    with pytest.raises(InputError, match="5 joint coordinates were given"):
        ab.robot_widget(ab.load_robot("puma560"), [0.0] * 5)
    from armblocks.studio import notebook

    monkeypatch.setitem(sys.modules, "anywidget", None)
    notebook._widget_class.cache_clear()
    with pytest.raises(MissingLibraryError, match=r"'anywidget' is not installed.*armblocks\[notebook\]"):
        ab.robot_widget(ab.load_robot("puma560"))
    notebook._widget_class.cache_clear()


def test_legends_name_signals_by_their_blocks_as_in_the_studio(notebook: Page) -> None:
    diagram = ab.load_diagram("van_der_pol_pid")
    (widget,) = show(notebook, ab.run_widget(diagram, ab.simulate(diagram, stop_time=1.0)))
    entries = widget.locator('.chart[data-view="Scope"] .legend button')
    expect(entries).to_have_text(["reference", "x1"])

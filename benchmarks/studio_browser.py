"""Start of a studio and a browser for the measurements, and rows of their table."""

# pyright: basic
from __future__ import annotations

import os
import re
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager

from playwright.sync_api import Browser, Page, sync_playwright

FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
RECORD_MESSAGES = """
window.messages = []
const record = (event) => {
    const binary = event.data instanceof ArrayBuffer
    const length = binary ? new DataView(event.data).getUint32(0, true) : 0
    const text = binary ? new TextDecoder().decode(new Uint8Array(event.data, 4, length)) : event.data
    const { kind = 'samples', state, count } = JSON.parse(text)
    messages.push({ at: performance.now(), kind, state, count })
}
window.WebSocket = class extends WebSocket {
    constructor(...given) { super(...given); this.addEventListener('message', record) }
    send(data) { messages.push({ at: performance.now(), kind: 'sent' }); super.send(data) }
}
"""
NEXT_FRAME = """() => new Promise((done) =>
    requestAnimationFrame(() => requestAnimationFrame(() => done(performance.now()))))"""


@contextmanager
def running_browser() -> Iterator[Browser]:
    """Headless Chromium with the software renderer."""
    path = shutil.which("chromium") or shutil.which("google-chrome")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
        yield browser
        browser.close()


@contextmanager
def served(
    folder: str, model: str, variables: Mapping[str, str] | None = None
) -> Iterator[tuple[str, float]]:
    """Start a studio; yield its login link and the seconds until it was printed."""
    start_time = time.perf_counter()
    environment = {**os.environ, "COLUMNS": "300", **(variables or {})}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)  # installed packages have bytecode files
    process = subprocess.Popen(
        [sys.executable, "-m", "armblocks", "studio", model, "--no-browser", "--folder", folder],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=environment,
    )
    assert process.stdout is not None
    try:
        for line in process.stdout:
            if match := re.search(r"http://\S+", line):
                yield match.group(), time.perf_counter() - start_time
                return
        raise SystemExit("the studio did not start")
    finally:
        process.send_signal(signal.SIGINT)
        process.wait()


@contextmanager
def page_of(browser: Browser) -> Iterator[Page]:
    context = browser.new_context(viewport={"width": 1440, "height": 860})
    page = context.new_page()
    page.set_default_timeout(120_000)
    page.add_init_script(
        RECORD_MESSAGES
        + "if (location.protocol === 'http:') localStorage.setItem('armblocks-tour-seen', 'yes')"
    )
    yield page
    context.close()


def until(page: Page, expression: str) -> None:
    """Wait until a JavaScript expression is true. The browser evaluates it in every animation frame."""
    check = f"() => (({expression}) ? done() : requestAnimationFrame(check))"
    page.evaluate(f"() => new Promise((done) => {{ const check = {check}; check() }})")


@contextmanager
def opened(browser: Browser, model: str, on_response: Callable | None = None) -> Iterator[Page]:
    """Open a shipped model in a new studio; ``on_response`` receives every HTTP response."""
    with (
        tempfile.TemporaryDirectory() as folder,
        served(folder, model) as (link, _),
        page_of(browser) as page,
    ):
        if on_response:
            page.on("response", on_response)
        page.goto(link)
        page.locator(".react-flow__node").first.wait_for()
        yield page


def verdict(value: float, target: float) -> str:
    return "met" if value <= target else "missed"


def median_row(label: str, times: Sequence[float], target: float) -> list[str]:
    """Row of durations in seconds, of which the shortest is the best."""
    middle = statistics.median(times)
    return [label, f"{middle:.3f} s", f"{min(times):.3f} s", f"{target:g} s", verdict(middle, target)]


def rate_row(label: str, rates: Sequence[float], target: float) -> list[str]:
    """Row of frames per second, of which the largest number is the best."""
    middle = statistics.median(rates)
    return [
        label,
        f"{middle:.1f} frames/s",
        f"{max(rates):.1f} frames/s",
        f"{target:g} frames/s",
        verdict(target, middle),
    ]

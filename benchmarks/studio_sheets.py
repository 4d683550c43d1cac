"""Times of the studio with 100, 1000 and 3000 blocks: opening, nudging, dragging, panning, zooming, running.

The view shows the whole model, or as much of it as the smallest zoom of the studio allows.
"""

# pyright: basic
from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from playwright.sync_api import Browser, Locator, Page
from studio_browser import NEXT_FRAME, median_row, page_of, rate_row, served, until

import armblocks as ab
from armblocks import blocks

PER_CHAIN = 25
SCROLL_SECONDS = 2.0
DRAG = (200, 60)
"""Path of a drag, px: to the empty area beside the blocks."""
NUDGE_TARGETS = {100: 0.016, 1000: 0.04, 3000: 0.1}
"""Time from the key to the picture for each number of blocks, s."""
SCROLL_TARGETS = {1000: 50, 3000: 30}
"""Frames per second during panning and zooming for each number of blocks."""
MODEL_SHOWN = "document.querySelector('.react-flow__node[data-id^=\"b \"]')"
OBSERVE_KEYS = """
window.keyEvents = []
new PerformanceObserver((list) => keyEvents.push(...list.getEntries()))
    .observe({ type: 'event', durationThreshold: 16 })
"""
AWAIT_PICTURE = """(name) => {
    // Promise of the time of the next key press, ms, and of the time until a frame shows the moved block.
    const place = () => document.querySelector(`.react-flow__node[data-id="${name}"]`).style.transform
    const before = place()
    window.picture = new Promise((done) => addEventListener('keydown', ({ timeStamp }) => {
        let frames = 0
        const check = () => {
            frames++
            if (place() === before) requestAnimationFrame(check)
            else requestAnimationFrame((next) => done({ timeStamp, frames, delay: next - timeStamp }))
        }
        requestAnimationFrame(check)
    }, { capture: true, once: true }))
}"""
SCROLL = """({ seconds, zoom }) => new Promise((done) => {
    // Frames per second that show a new view, with one wheel event in each animation frame.
    const pane = document.querySelector('.react-flow__pane')
    const { x, y, width, height } = pane.getBoundingClientRect()
    const centre = { clientX: x + width / 2, clientY: y + height / 2, bubbles: true, cancelable: true }
    const view = () => document.querySelector('.react-flow__viewport').style.transform
    const from = performance.now()
    let last = view()
    let changed = 0
    const step = () => {
        const now = view()
        if (now !== last) changed++
        last = now
        const elapsed = performance.now() - from
        if (elapsed > 1000 * seconds) return done((1000 * changed) / elapsed)
        const sign = Math.floor(elapsed / 500) % 2 ? 1 : -1
        const wheel = zoom ? { deltaY: 10 * sign, ctrlKey: true } : { deltaX: 20 * sign, deltaY: 12 * sign }
        pane.dispatchEvent(new WheelEvent('wheel', { ...centre, ...wheel }))
        requestAnimationFrame(step)
    }
    requestAnimationFrame(step)
})"""
RECORD_FRAMES = """() => {
    window.longestFrame = 0
    window.recordsFrames = true
    let last = performance.now()
    const next = () => {
        const now = performance.now()
        longestFrame = Math.max(longestFrame, now - last)
        last = now
        if (recordsFrames) requestAnimationFrame(next)
    }
    requestAnimationFrame(next)
}"""


class Nudge(NamedTuple):
    """One press of an arrow key: seconds until a frame shows the moved block, and until the reply."""

    picture: float
    reply: float


def many_blocks(folder: str, count: int) -> str:
    """Save a model of ``count`` blocks in chains of 25; return its path. Its layout is automatic."""
    builder = ab.DiagramBuilder(f"{count} blocks")
    for row in range(count // PER_CHAIN):
        signal = builder.add(f"source {row}", blocks.SineWave())
        for column in range(1, PER_CHAIN - 1):
            kind = (blocks.Gain, blocks.FirstOrderLag, blocks.Saturation)[column % 3]
            signal = builder.add(f"b {row} {column}", kind(), signal)
        builder.add(f"scope {row}", blocks.Terminator(), signal)
    path = Path(folder) / f"{count} blocks.json"
    ab.save_diagram(builder.build(), path)
    return str(path)


def middle_block(page: Page, count: int) -> tuple[str, Locator]:
    """Name of a block in the middle of the model, and its element."""
    name = f"b {count // PER_CHAIN // 2} 12"
    return name, page.locator(f'.react-flow__node[data-id="{name}"]')


def first_tab(browser: Browser, count: int) -> float:
    """Seconds from a started studio to the first drawing of a model with ``count`` blocks."""
    with (
        tempfile.TemporaryDirectory() as folder,
        served(folder, many_blocks(folder, count)) as (link, _),
        page_of(browser) as page,
    ):
        start_time = time.perf_counter()
        page.goto(link, wait_until="commit")
        until(page, MODEL_SHOWN)
        page.evaluate(NEXT_FRAME)
        return time.perf_counter() - start_time


@contextmanager
def sheet(browser: Browser, count: int) -> Iterator[tuple[Page, float]]:
    """Open a model of ``count`` blocks in an open tab; yield the page and the seconds until it was drawn.

    The cache of compiled models is empty.
    """
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as cache:
        many_blocks(folder, count)
        with (
            served(folder, "van_der_pol_pid", {"ARMBLOCKS_CACHE_DIR": cache}) as (link, _),
            page_of(browser) as page,
        ):
            page.goto(link)
            page.locator(".react-flow__node").first.wait_for()
            page.evaluate(OBSERVE_KEYS)
            page.keyboard.press("Control+o")
            file = page.get_by_role("dialog").get_by_text(f"{count} blocks.json")
            file.wait_for()
            page.wait_for_timeout(3000)  # deferred parts of the front end load meanwhile
            start_time = time.perf_counter()
            file.click()
            until(page, MODEL_SHOWN)
            page.evaluate(NEXT_FRAME)
            seconds = time.perf_counter() - start_time
            page.wait_for_timeout(2000)
            yield page, seconds


def nudges(page: Page, count: int, repeats: int) -> list[Nudge]:
    """Move a block by arrow keys, to and fro."""
    name, element = middle_block(page, count)
    element.click()
    page.wait_for_timeout(500)
    return [nudge(page, name, ("ArrowRight", "ArrowLeft")[k % 2]) for k in range(2 * repeats)]


def nudge(page: Page, name: str, key: str) -> Nudge:
    """Press an arrow key.

    If the first frame after the key shows the moved block, its time is the browser's Event Timing: from the
    key to the presentation of the frame, in steps of 8 ms, and at least 16 ms. Otherwise it is the start of
    the frame after the one that shows the block.
    """
    page.evaluate("messages.length = 0; keyEvents.length = 0")
    page.evaluate(AWAIT_PICTURE, name)
    page.keyboard.press(key)
    picture = page.evaluate("picture")
    until(page, "messages.some(({ kind }) => kind === 'changed')")
    page.wait_for_timeout(300)
    delay = picture["delay"]
    if picture["frames"] == 1:
        # The browser reports events of at least 16 ms.
        delay = page.evaluate(
            "(time) => keyEvents.find(({ name, startTime }) => "
            "name === 'keydown' && Math.abs(startTime - time) < 1)?.duration ?? 16",
            picture["timeStamp"],
        )
    sent, received = page.evaluate(
        "['sent', 'changed'].map((wanted) => messages.find(({ kind }) => kind === wanted).at)"
    )
    return Nudge(delay / 1e3, (received - sent) / 1e3)


def scroll_rates(page: Page, repeats: int, *, zoom: bool) -> list[float]:
    """Frames per second while the view pans or zooms to and fro."""
    rates = []
    for _ in range(repeats):
        rates.append(page.evaluate(SCROLL, {"seconds": SCROLL_SECONDS, "zoom": zoom}))
        page.wait_for_timeout(500)
    return rates


def longest_frames(page: Page, count: int, repeats: int) -> list[float]:
    """Longest time between two animation frames during a drag of one block, s."""
    _, element = middle_block(page, count)
    longest = []
    for k in range(repeats):
        before = element.evaluate("(node) => node.style.transform")
        box = element.bounding_box()
        assert box is not None
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        page.evaluate(RECORD_FRAMES)
        page.mouse.move(x, y)
        page.mouse.down()
        sign = (1, -1)[k % 2]
        page.mouse.move(x + DRAG[0] * sign, y + DRAG[1] * sign, steps=30)
        page.mouse.up()
        page.evaluate(NEXT_FRAME)
        longest.append(page.evaluate("() => { recordsFrames = false; return longestFrame }") / 1e3)
        page.wait_for_timeout(1000)
        if element.evaluate("(node) => node.style.transform") == before:
            raise SystemExit("the drag did not move the block")
    return longest


def run_seconds(page: Page) -> float:
    """Seconds from Ctrl+Enter to the end of the first run, which includes its compilation."""
    page.evaluate("messages.length = 0")
    start_time = time.perf_counter()
    page.keyboard.press("Control+Enter")
    until(page, "messages.some(({ state }) => state === 'done' || state === 'failed')")
    page.evaluate(NEXT_FRAME)
    seconds = time.perf_counter() - start_time
    if page.evaluate("messages.some(({ state }) => state === 'failed')"):
        raise SystemExit("the run failed")
    return seconds


def sheet_rows(browser: Browser, count: int, repeats: int) -> list[list[str]]:
    """Rows of one number of blocks. Only the numbers with a target have all rows."""
    rows = []
    with sheet(browser, count) as (page, load):
        if count >= 1000:
            rows.append(median_row(f"load of a model with {count} blocks in an open tab", [load], 2))
        pictures, replies = zip(*nudges(page, count, repeats))
        target = NUDGE_TARGETS[count]
        rows.append(median_row(f"nudge of a block at {count} blocks: key → picture", pictures, target))
        if count == 1000:
            rows.append(median_row("edit at 1000 blocks → reply", replies, 0.05))
            worst = longest_frames(page, count, repeats)
            rows.append(median_row("drag of a block at 1000 blocks: longest frame of each drag", worst, 0.06))
        if count in SCROLL_TARGETS:
            for label, zoom in (("panning", False), ("zooming", True)):
                rates = scroll_rates(page, max(2, repeats // 2), zoom=zoom)
                rows.append(rate_row(f"{label} at {count} blocks", rates, SCROLL_TARGETS[count]))
        if count == 3000:
            seconds = run_seconds(page)
            rows.append(median_row("run of 3000 blocks for 10 s, not cached → done", [seconds], 5))
    return rows

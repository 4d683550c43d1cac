"""The studio measured end to end: a real server and a real headless browser.

Measured: start of the command to a page with its model; Ctrl+Enter to the first samples on the screen and to
all of them; loading and editing 1000 blocks; typing while 16 channels arrive at 10 kHz; size of the first
download; and 20 sessions on one server. Times inside the page are measured by the page.

Chromium renders in software here, on the same cores that simulate.
"""

# pyright: basic
from __future__ import annotations

import asyncio
import gzip
import json
import os
import re
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import httpx
import websockets
from playwright.sync_api import Browser, Page, sync_playwright

import armblocks as ab
from armblocks import blocks as kinds

FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
SESSIONS = 20
CHANNELS, RATE, SECONDS = 16, 10_000, 5.0
BLOCKS = 1000
HEAR = """
window.heard = []
const hear = (event) => {
    const binary = event.data instanceof ArrayBuffer
    const length = binary ? new DataView(event.data).getUint32(0, true) : 0
    const text = binary ? new TextDecoder().decode(new Uint8Array(event.data, 4, length)) : event.data
    const { kind = 'samples', state, count } = JSON.parse(text)
    heard.push({ at: performance.now(), kind, state, count })
}
window.WebSocket = class extends WebSocket {
    constructor(...given) { super(...given); this.addEventListener('message', hear) }
    send(data) { heard.push({ at: performance.now(), kind: 'sent' }); super.send(data) }
}
"""
DRAWN = """() => new Promise((done) =>
    requestAnimationFrame(() => requestAnimationFrame(() => done(performance.now()))))"""
THOUSAND_SHOWN = f"document.querySelectorAll('.react-flow__node').length >= {BLOCKS}"
FIRST_AND_LAST = """() => new Promise((done) => {
    const from = performance.now()
    heard.length = 0
    let first = 0
    const check = () => {
        if (!first && heard.some((one) => one.kind === 'samples')) first = performance.now()
        const ended = heard.some(({ state }) => state === 'done' || state === 'failed')
        const came = () => heard.find((one) => one.kind === 'samples').at - from
        const times = () => [first - from, performance.now() - from, came()]
        if (first && ended) requestAnimationFrame(() => done(times()))
        else requestAnimationFrame(check)
    }
    requestAnimationFrame(check)
    dispatchEvent(new KeyboardEvent('keydown', { key: 'Enter', ctrlKey: true }))
})"""


@contextmanager
def served(folder: str, model: str) -> Iterator[tuple[str, float]]:
    """Yield the login link of a studio, and the seconds until it was printed."""
    start_time = time.perf_counter()
    environment = {**os.environ, "COLUMNS": "300"}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)  # an installed package has bytecode
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
        HEAR + "if (location.protocol === 'http:') localStorage.setItem('armblocks-tour-seen', 'yes')"
    )
    yield page
    context.close()


def until(page: Page, expression: str) -> None:
    """Wait until a JavaScript expression is true; it is evaluated in every animation frame."""
    check = f"() => (({expression}) ? done() : requestAnimationFrame(check))"
    page.evaluate(f"() => new Promise((done) => {{ const check = {check}; check() }})")


@contextmanager
def opened(browser: Browser, model: str, hear: Callable | None = None) -> Iterator[Page]:
    """Open a page of a separate studio with a shipped model; ``hear`` receives every reply."""
    with (
        tempfile.TemporaryDirectory() as folder,
        served(folder, model) as (link, _),
        page_of(browser) as page,
    ):
        if hear:
            page.on("response", hear)
        page.goto(link)
        page.locator(".react-flow__node").first.wait_for()
        yield page


def start(browser: Browser) -> float:
    """Seconds from the command to the page with its model, in an open browser."""
    with tempfile.TemporaryDirectory() as folder, page_of(browser) as page:
        start_time = time.perf_counter()
        with served(folder, "kr180model") as (link, _):
            page.goto(link, wait_until="commit")
            page.locator(".react-flow__node").first.wait_for()
            page.evaluate(DRAWN)
            return time.perf_counter() - start_time


def run_times(browser: Browser, repeats: int) -> list[tuple[float, float, float]]:
    """Seconds to the first samples on the screen, to all of them, and to the arrival of the first ones.

    Repeated runs in one page; the first run is discarded.
    """
    with opened(browser, "kr180model") as page:
        page.locator(".robot canvas").wait_for()
        seconds = []
        for _ in range(repeats + 1):
            page.wait_for_timeout(1500)  # the next worker starts, as between two runs of a user
            seconds.append(tuple(milliseconds / 1e3 for milliseconds in page.evaluate(FIRST_AND_LAST)))
        return seconds[1:]


def many_blocks(folder: str) -> str:
    """A model of 1000 blocks in chains of 25, with automatic layout."""
    builder = ab.DiagramBuilder("thousand")
    for row in range(BLOCKS // 25):
        signal_ = builder.add(f"source {row}", kinds.SineWave())
        for column in range(1, 24):
            kind = (kinds.Gain, kinds.FirstOrderLag, kinds.Saturation)[column % 3]
            signal_ = builder.add(f"b {row} {column}", kind(), signal_)
        builder.add(f"scope {row}", kinds.Terminator(), signal_)
    ab.save_diagram(builder.build(), Path(folder) / "thousand.json")
    return str(Path(folder) / "thousand.json")


def first_thousand(browser: Browser) -> float:
    """Seconds from a started studio to its first page, with 1000 blocks."""
    with (
        tempfile.TemporaryDirectory() as folder,
        served(folder, many_blocks(folder)) as (link, _),
        page_of(browser) as page,
    ):
        start_time = time.perf_counter()
        page.goto(link, wait_until="commit")
        until(page, THOUSAND_SHOWN)
        page.evaluate(DRAWN)
        return time.perf_counter() - start_time


def thousand(browser: Browser, repeats: int) -> tuple[float, list[float], list[float]]:
    """Seconds to open 1000 blocks in an open page, to the reply to an edit, and to its drawing."""
    with tempfile.TemporaryDirectory() as folder:
        many_blocks(folder)
        with served(folder, "kr180model") as (link, _), page_of(browser) as page:
            page.goto(link)
            page.locator(".robot canvas").wait_for()
            page.keyboard.press("Control+o")
            file = page.get_by_role("dialog").get_by_text("thousand.json")
            file.wait_for()
            page.wait_for_timeout(3000)
            start_time = time.perf_counter()
            file.click()
            until(page, THOUSAND_SHOWN)
            page.evaluate(DRAWN)
            load = time.perf_counter() - start_time
            page.wait_for_timeout(3000)
            page.locator('.react-flow__node[data-id="b 20 12"]').click()
            answers, pictures = [], []
            for k in range(2 * repeats):
                # Moving one block and its wires, and the undo of it.
                key = ["ArrowRight", "Control+z"][k % 2]
                page.evaluate("heard.length = 0; window.pressed = 0")
                page.evaluate(
                    "addEventListener('keydown', (event) => { window.pressed = event.timeStamp }, "
                    "{ capture: true, once: true })"
                )
                page.keyboard.press(key)
                until(page, "heard.some(({ kind }) => kind === 'changed')")
                drawn = page.evaluate(DRAWN)
                sent, received = page.evaluate(
                    "['sent', 'changed'].map((wanted) => heard.find(({ kind }) => kind === wanted).at)"
                )
                answers.append((received - sent) / 1e3)
                pictures.append((drawn - page.evaluate("window.pressed")) / 1e3)
                page.wait_for_timeout(300)
            return load, answers, pictures


def live(browser: Browser) -> tuple[int, int, list[float]]:
    """Numbers of received and expected samples, and seconds from key presses to the next frame meanwhile."""
    builder = ab.DiagramBuilder(
        "live", settings=ab.SimulationOptions(stop_time=SECONDS, solver="rk4", sample_time=1 / RATE)
    )
    sines = [
        builder.add(f"sine {k}", kinds.SineWave(frequency=2.0 + k, phase=0.2 * k)) for k in range(CHANNELS)
    ]
    builder.add("scope", kinds.Scope(inputs=CHANNELS), *sines)
    with tempfile.TemporaryDirectory() as folder:
        ab.save_diagram(builder.build(), Path(folder) / "live.json")
        with served(folder, str(Path(folder) / "live.json")) as (link, _), page_of(browser) as page:
            page.goto(link)
            page.locator(".react-flow__node").first.wait_for()
            page.wait_for_timeout(1500)
            page.evaluate(
                "window.latency = []; new PerformanceObserver((list) => latency.push(...list.getEntries()))"
                ".observe({ type: 'event', durationThreshold: 16 })"
            )
            page.get_by_role("combobox", name="Speed").select_option("1 × real time")
            page.evaluate("heard.length = 0")
            page.keyboard.press("Control+Enter")
            until(page, "heard.some(({ kind }) => kind === 'samples')")
            page.evaluate("latency.length = 0")
            field = page.get_by_role("textbox", name="Search the library")
            field.click()
            typed = 0
            while not page.evaluate("heard.some(({ state }) => state === 'done' || state === 'failed')"):
                page.keyboard.type("abcdefgh"[typed % 8])
                typed += 1
                page.wait_for_timeout(150)
            received = page.evaluate("heard.reduce((sum, { count = 0 }) => sum + count, 0)")
            # Events are recorded from 16 ms on; unrecorded key presses were faster.
            keys = "latency.filter(({ name }) => name === 'keydown').map(({ duration }) => duration)"
            slow = page.evaluate(keys)
            delays = [duration / 1e3 for duration in slow]
            return received, round(SECONDS * RATE) + 1, delays + [0.016] * (typed - len(delays))


def download(browser: Browser) -> tuple[float, float, float]:
    """Compressed kB: code of the first page, its fonts, and deferred parts (3-D, dialogs, scopes)."""
    weights: dict[str, float] = {}

    def weigh(answer) -> None:
        if answer.status == 200:
            name = urlsplit(answer.url).path.rsplit("/", 1)[1] or "index.html"
            weights[name] = len(gzip.compress(answer.body(), 9)) / 1000

    with opened(browser, "kr180model", weigh) as page:
        page.locator(".robot canvas").wait_for()
        page.wait_for_timeout(1000)
    html = (Path(ab.__file__).parent / "studio" / "web" / "index.html").read_text(encoding="utf-8")
    fonts = sum(size for name, size in weights.items() if name.endswith("woff2"))
    first = sum(size for name, size in weights.items() if name in html or name == "index.html")
    later = sum(weights.values()) - first - fonts
    return first, fonts, later


async def session(uri: str, cookie: str, origin: str, ended: list[str], waits: list[float]) -> None:
    """One user: opens a separate model, runs it in real time, and edits it during the run."""
    async with websockets.connect(
        uri, additional_headers={"Cookie": cookie}, origin=origin, max_size=None
    ) as socket:
        numbers = iter(range(1, 10**6))
        requested: dict[int, tuple[float, asyncio.Future]] = {}
        document: dict[str, object] = {}
        over = asyncio.Event()

        async def listen() -> None:
            async for message in socket:
                if isinstance(message, bytes):
                    continue
                reply = json.loads(message)
                if reply["kind"] == "reply":
                    start_time, answer = requested.pop(reply["number"])
                    if reply.get("fault"):
                        answer.set_exception(RuntimeError(reply["fault"]["what"]))
                    else:
                        answer.set_result(time.perf_counter() - start_time)
                elif reply["kind"] in ("opened", "changed"):
                    document.update(reply["state"])
                elif reply["kind"] == "run_progress" and reply["state"] in ("done", "failed", "stopped"):
                    ended.append(reply["state"])
                    over.set()

        async def ask(request: dict[str, object]) -> float:
            number = next(numbers)
            requested[number] = (time.perf_counter(), asyncio.get_running_loop().create_future())
            await socket.send(json.dumps({"number": number, "request": request}))
            return await requested[number][1]

        listening = asyncio.create_task(listen())
        await ask({"kind": "open_shipped", "document_kind": "diagram", "name": "van_der_pol_pid"})
        await ask({"kind": "run", "document": document["document"], "speed": 5.0})
        k = 0
        block = document.get("title")
        while not over.is_set():
            k += 1
            edit = {"kind": "describe", "text": f"{block} {k}"}
            change = {
                "kind": "change",
                "document": document["document"],
                "base": document["version"],
                "key": f"{id(socket)}-{k}",
                "author": f"{id(socket)}",
                "edit": edit,
            }
            waits.append(await ask(change))
            await asyncio.sleep(0.5)
        listening.cancel()


def sessions() -> tuple[list[str], list[float]]:
    """The final states of the runs of 20 sessions, and the seconds of each reply to an edit."""
    ended: list[str] = []
    waits: list[float] = []

    async def all_of(uri: str, cookie: str, origin: str) -> None:
        await asyncio.wait_for(
            asyncio.gather(*(session(uri, cookie, origin, ended, waits) for _ in range(SESSIONS))), 400
        )

    with tempfile.TemporaryDirectory() as folder, served(folder, "kr180model") as (link, _):
        answer = httpx.get(link.partition("#")[0], follow_redirects=False)
        cookie = answer.headers["set-cookie"].split(";")[0]
        origin = link.split("/login")[0]
        asyncio.run(all_of(origin.replace("http", "ws", 1) + "/ws", cookie, origin))
    return ended, waits


def verdict(value: float, target: float) -> str:
    return "met" if value <= target else "missed"


def median_row(what: str, times: list[float], target: float) -> list[str]:
    middle = statistics.median(times)
    return [what, f"{middle:.3f} s", f"{min(times):.3f} s", f"{target:g} s", verdict(middle, target)]


def studio_part(repeats: int) -> list[str]:
    path = shutil.which("chromium") or shutil.which("google-chrome")
    rows: list[list[str]] = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
        few = max(3, repeats // 3)
        measures: list[Callable[[], list[list[str]]]] = [
            lambda: [median_row("`armblocks studio` → page usable", [start(browser) for _ in range(few)], 2)],
            lambda: run_rows(browser, few),
            lambda: thousand_rows(browser, few),
            lambda: live_rows(browser),
            lambda: download_rows(browser),
        ]
        for measure in measures:
            measured_rows = measure()
            rows += measured_rows
            print(*measured_rows, sep="\n", flush=True)
        browser.close()
    ended, waits = sessions()
    good = ended.count("done")
    rows.append(
        [
            f"{SESSIONS} sessions on one server, each running: runs that ended without an error",
            f"{good}",
            "",
            f"{SESSIONS}",
            verdict(SESSIONS, good),
        ]
    )
    late = sorted(waits)[int(0.95 * len(waits))]
    rows.append(
        [
            f"the same: reply to an edit, 95th percentile of {len(waits)} (largest {max(waits):.3f} s)",
            f"{late:.3f} s",
            f"{min(waits):.3f} s",
            "0.2 s",
            verdict(late, 0.2),
        ]
    )
    head = ["what", "median", "best", "target", ""]
    table = ["| " + " | ".join(row) + " |" for row in (head, ["---"] * len(head), *rows)]
    return ["## The studio", "", *table, "", *(__doc__ or "").strip().splitlines()[2:]]


def run_rows(browser: Browser, repeats: int) -> list[list[str]]:
    firsts, lasts, arrivals = zip(*run_times(browser, repeats))
    return [
        median_row("Run on `kr180model`, cached → first samples drawn", list(firsts), 0.3),
        median_row("of that, until their arrival in the page", list(arrivals), 0.3),
        median_row("the same → whole 10 s run streamed and drawn", list(lasts), 1.5),
    ]


def thousand_rows(browser: Browser, repeats: int) -> list[list[str]]:
    first = first_thousand(browser)
    load, answers, pictures = thousand(browser, repeats)
    return [
        median_row(f"load of a model with {BLOCKS} blocks in an open page", [load], 2),
        median_row("the same in the first page of a studio that has just started", [first], 2),
        median_row(f"an edit with {BLOCKS} blocks answered", answers, 0.05),
        median_row("the same, from the key to the drawn page", pictures, 0.05),
    ]


def live_rows(browser: Browser) -> list[list[str]]:
    received, expected, waits = live(browser)
    what = f"{CHANNELS} channels at {RATE // 1000} kHz live, {SECONDS:g} s"
    label = f"{what}: samples lost of {expected:,}"
    return [
        [label, f"{expected - received:,}", "", "0", verdict(expected - received, 0)],
        median_row(f"the same: key → next picture (largest {max(waits):.3f} s)", waits, 0.1),
    ]


def download_rows(browser: Browser) -> list[list[str]]:
    first, fonts, later = download(browser)
    whole = first + fonts
    return [
        [
            f"first download: code and styles {first:.0f} kB, fonts {fonts:.0f} kB",
            f"{whole:.0f} kB",
            "",
            "400 kB",
            verdict(whole, 400),
        ],
        ["later: 3-D, dialogs, scopes", f"{later:.0f} kB", "", "", ""],
    ]


if __name__ == "__main__":
    print("\n".join(studio_part(6)))

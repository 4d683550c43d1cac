"""Times of the studio from end to end, with a server and a headless browser.

The measurements are:

- time from the command to a drawn model, and at a cold start (no compiled functions in the cache) until the
  canvas of the robot view is present and the command palette answers a key;
- time from Ctrl+Enter to the first and to all drawn samples; the first run is that of a new studio;
- models of 100, 1000 and 3000 blocks (`studio_sheets.py`). The view shows the whole model, or as much of it
  as the smallest zoom (10 %) allows. A block is nudged by an arrow key and dragged by the mouse. The view is
  panned and zoomed with one wheel event in each animation frame. The longest frame of a drag is the longest
  time between two animation frames;
- response to keys while 16 channels arrive at 10 kHz;
- mouse and keyboard actions that build Figure 9 in a test of the studio (`studio_actions.py`);
- size of the first download; 20 sessions on one server.

Times inside the front end come from the browser's clock. Chromium renders in software, on the cores that
also run the simulation.
"""

# pyright: basic
from __future__ import annotations

import asyncio
import gzip
import json
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from urllib.parse import urlsplit

import httpx
import websockets
from playwright.sync_api import Browser
from studio_actions import action_rows
from studio_browser import NEXT_FRAME, median_row, opened, page_of, running_browser, served, until, verdict
from studio_sheets import first_tab, sheet_rows

import armblocks as ab
from armblocks import blocks

SESSIONS = 20
CHANNELS, RATE, SECONDS = 16, 10_000, 5.0
NEW_STUDIOS = 3
"""Number of studios that are started to measure a first run or a cold start."""
FIRST_AND_LAST = """() => new Promise((done) => {
    const from = performance.now()
    messages.length = 0
    let first = 0
    const check = () => {
        if (!first && messages.some((one) => one.kind === 'samples')) first = performance.now()
        const ended = messages.some(({ state }) => state === 'done' || state === 'failed')
        const came = () => messages.find((one) => one.kind === 'samples').at - from
        const times = () => [first - from, performance.now() - from, came()]
        if (first && ended) requestAnimationFrame(() => done(times()))
        else requestAnimationFrame(check)
    }
    requestAnimationFrame(check)
    dispatchEvent(new KeyboardEvent('keydown', { key: 'Enter', ctrlKey: true }))
})"""


def start(browser: Browser) -> float:
    """Seconds from the command to the drawn model, in a running browser."""
    with tempfile.TemporaryDirectory() as folder, page_of(browser) as page:
        start_time = time.perf_counter()
        with served(folder, "kr180model") as (link, _):
            page.goto(link, wait_until="commit")
            page.locator(".react-flow__node").first.wait_for()
            page.evaluate(NEXT_FRAME)
            return time.perf_counter() - start_time


def cold_start(browser: Browser) -> float:
    """Seconds of a start without cached functions until the robot view is present and a key is answered."""
    with (
        tempfile.TemporaryDirectory() as folder,
        tempfile.TemporaryDirectory() as cache,
        page_of(browser) as page,
    ):
        start_time = time.perf_counter()
        with served(folder, "kr180model", {"ARMBLOCKS_CACHE_DIR": cache}) as (link, _):
            page.goto(link, wait_until="commit")
            page.locator(".react-flow__node").first.wait_for()
            page.locator(".robot canvas").wait_for()
            page.keyboard.press("Control+k")
            page.get_by_role("textbox", name="Command").wait_for()
            page.evaluate(NEXT_FRAME)
            return time.perf_counter() - start_time


def run_times(browser: Browser, repeats: int) -> list[list[float]]:
    """Times of consecutive runs of a new studio with cached functions.

    They are the seconds from Ctrl+Enter to the first drawn samples, to all drawn samples, and to the first
    arrival.
    """
    with opened(browser, "kr180model") as page:
        page.locator(".robot canvas").wait_for()
        times = []
        for _ in range(repeats + 1):
            # The next worker starts, as between two runs of a user.
            page.wait_for_timeout(1500)
            times.append([milliseconds / 1e3 for milliseconds in page.evaluate(FIRST_AND_LAST)])
        return times


def live(browser: Browser) -> tuple[int, int, list[float]]:
    """Numbers of received and expected samples, and delays from key presses to the next frame, s."""
    builder = ab.DiagramBuilder(
        "live", settings=ab.SimulationOptions(stop_time=SECONDS, solver="rk4", sample_time=1 / RATE)
    )
    sines = [
        builder.add(f"sine {k}", blocks.SineWave(frequency=2.0 + k, phase=0.2 * k)) for k in range(CHANNELS)
    ]
    builder.add("scope", blocks.Scope(inputs=CHANNELS), *sines)
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
            page.evaluate("messages.length = 0")
            page.keyboard.press("Control+Enter")
            until(page, "messages.some(({ kind }) => kind === 'samples')")
            page.evaluate("latency.length = 0")
            field = page.get_by_role("textbox", name="Search the library")
            field.click()
            typed = 0
            while not page.evaluate("messages.some(({ state }) => state === 'done' || state === 'failed')"):
                page.keyboard.type("abcdefgh"[typed % 8])
                typed += 1
                page.wait_for_timeout(150)
            received = page.evaluate("messages.reduce((sum, { count = 0 }) => sum + count, 0)")
            # The browser reports events of at least 16 ms. Key presses without a report were faster.
            keys = "latency.filter(({ name }) => name === 'keydown').map(({ duration }) => duration)"
            slow = page.evaluate(keys)
            delays = [duration / 1e3 for duration in slow]
            return received, round(SECONDS * RATE) + 1, delays + [0.016] * (typed - len(delays))


def download(browser: Browser) -> tuple[float, float, float]:
    """Compressed kB of the first download (code, then fonts) and of deferred parts (3-D, dialogs, scopes)."""
    sizes: dict[str, float] = {}

    def record_size(answer) -> None:
        if answer.status == 200:
            name = urlsplit(answer.url).path.rsplit("/", 1)[1] or "index.html"
            sizes[name] = len(gzip.compress(answer.body(), 9)) / 1000

    with opened(browser, "kr180model", record_size) as page:
        page.locator(".robot canvas").wait_for()
        page.wait_for_timeout(1000)
    html = (Path(ab.__file__).parent / "studio" / "web" / "index.html").read_text(encoding="utf-8")
    fonts = sum(size for name, size in sizes.items() if name.endswith("woff2"))
    first = sum(size for name, size in sizes.items() if name in html or name == "index.html")
    later = sum(sizes.values()) - first - fonts
    return first, fonts, later


async def session(uri: str, cookie: str, origin: str, ended: list[str], waits: list[float]) -> None:
    """One user, who opens a model, runs it at 5 times real time, and edits it during the run."""
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


def studio_section(repeats: int) -> list[str]:
    rows: list[list[str]] = []
    few = max(2, repeats // 3)
    with running_browser() as browser:
        measures: list[Callable[[], list[list[str]]]] = [
            lambda: start_rows(browser, few),
            lambda: run_rows(browser, few),
            lambda: sheet_rows(browser, 100, few),
            lambda: sheet_rows(browser, 1000, few),
            lambda: [
                median_row(
                    "load of 1000 blocks in the first tab of a new studio", [first_tab(browser, 1000)], 2
                )
            ],
            lambda: sheet_rows(browser, 3000, few),
            lambda: live_rows(browser),
            lambda: action_rows(browser),
            lambda: download_rows(browser),
        ]
        for measure in measures:
            measured_rows = measure()
            rows += measured_rows
            print(*measured_rows, sep="\n", flush=True)
    rows += session_rows()
    head = ["measurement", "median", "best", "target", ""]
    table = ["| " + " | ".join(row) + " |" for row in (head, ["---"] * len(head), *rows)]
    return ["## The studio", "", *table, "", *(__doc__ or "").strip().splitlines()[2:]]


def start_rows(browser: Browser, repeats: int) -> list[list[str]]:
    times = [start(browser) for _ in range(repeats)]
    cold = [cold_start(browser) for _ in range(NEW_STUDIOS)]
    return [
        median_row("start of `armblocks studio` → drawn model", times, 2),
        median_row("cold start → robot view present, and a key is answered", cold, 2),
    ]


def run_rows(browser: Browser, repeats: int) -> list[list[str]]:
    run_times(browser, 0)  # compiles the functions
    studios = [run_times(browser, max(1, repeats // 2)) for _ in range(NEW_STUDIOS)]
    first = [studio[0][0] for studio in studios]
    firsts, lasts, arrivals = zip(*(run for studio in studios for run in studio[1:]))
    return [
        median_row("first Run of a new studio on `kr180model`, cached → first samples drawn", first, 0.6),
        median_row("later Run → first samples drawn", firsts, 0.25),
        median_row("later Run → samples arrived in the browser", arrivals, 0.25),
        median_row("later Run → all samples of 10 s drawn", lasts, 1.5),
    ]


def live_rows(browser: Browser) -> list[list[str]]:
    received, expected, waits = live(browser)
    condition = f"{CHANNELS} channels at {RATE // 1000} kHz during the run, {SECONDS:g} s"
    label = f"{condition}: lost samples of {expected:,}"
    return [
        [label, f"{expected - received:,}", "", "0", verdict(expected - received, 0)],
        median_row(f"16 channels at 10 kHz: key → next frame (largest {max(waits):.3f} s)", waits, 0.1),
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
        ["later downloads: 3-D, dialogs, scopes", f"{later:.0f} kB", "", "", ""],
    ]


def session_rows() -> list[list[str]]:
    ended, waits = sessions()
    completed = ended.count("done")
    late = sorted(waits)[int(0.95 * len(waits))]
    return [
        [
            f"{SESSIONS} sessions with a run each on one server: runs without an error",
            f"{completed}",
            "",
            f"{SESSIONS}",
            verdict(SESSIONS, completed),
        ],
        [
            f"20 sessions: edit → reply, 95th percentile of {len(waits)} (largest {max(waits):.3f} s)",
            f"{late:.3f} s",
            f"{min(waits):.3f} s",
            "0.2 s",
            verdict(late, 0.2),
        ],
    ]


if __name__ == "__main__":
    print("\n".join(studio_section(6)))

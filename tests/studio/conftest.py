"""A real server and a real browser. Any error on the console of a page fails the test."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Generator, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
from browsers import FIREFOX_NAMES, SCRIPTS, SharedBrowser, allow_clipboard, installed
from crashed_disk import Disk
from playwright._impl._api_structures import SetCookieParam
from playwright.sync_api import Browser, BrowserContext, ConsoleMessage, Page, expect

from interruptible import start_interruptible

TOUR_SEEN = "if (location.protocol === 'http:') localStorage.setItem('armblocks-tour-seen', 'yes')"
"""Disables the tour; pages outside the studio (about:blank) have no local storage."""
NO_RENDERING = """
for (const draw of ['drawArrays', 'drawElements', 'drawArraysInstanced', 'drawElementsInstanced'])
    WebGL2RenderingContext.prototype[draw] = () => {}
"""
"""Three-dimensional scenes are set up but not drawn, because software rendering takes longer than all other
work. Shaders are compiled, and a shader error is reported on the console."""
TIMEOUT_MS = 180_000
"""Time limit of waiting for the page, ms; sufficient for a busy computer."""
expect.set_options(timeout=TIMEOUT_MS)


class Studio:
    """A studio process, started as a user starts it."""

    def __init__(self, folder: Path, *arguments: str) -> None:
        self.folder = folder
        self.process = start_interruptible(
            [
                sys.executable,
                "-m",
                "armblocks",
                "studio",
                "--no-browser",
                "--folder",
                str(folder),
                *arguments,
            ],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env={**os.environ, "COLUMNS": "300"},
        )
        assert self.process.stdout is not None
        text = ""
        for line in self.process.stdout:
            text += line
            if match := re.search(r"http://127\.0\.0\.1:\d+/login\?key=\S+", line):
                self.link = match.group()
                self.address = self.link.partition("login")[0]
                return
        self.kill()
        raise AssertionError(f"the studio did not start: {text}")

    def kill(self) -> None:
        """Kill the process, as in a crash."""
        self.process.kill()
        self.process.wait()
        assert self.process.stdout is not None
        self.process.stdout.close()

    def stop(self) -> None:
        """Stop the process with Ctrl-C, as a user does."""
        self.process.send_signal(signal.SIGINT)
        try:
            self.process.wait(timeout=TIMEOUT_MS / 1000)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            raise
        finally:
            assert self.process.stdout is not None
            self.process.stdout.close()


SHARED_BROWSER = SharedBrowser()


class SharedStudio:
    """One studio for all journeys of a process that do not kill it, because a start takes seconds."""

    def __init__(self) -> None:
        self._studio: Studio | None = None
        self._cookies: list[SetCookieParam] = []

    def opened(self, folder: Callable[[str], Path]) -> Studio:
        """Return the studio; start it in a new folder if it is not running."""
        if self._studio is None:
            self._studio = Studio(folder("project"), "van_der_pol_pid")
        return self._studio

    def log_in(self, context: BrowserContext) -> None:
        """Log in a context: the printed link is valid once, its cookie can be reused."""
        assert self._studio is not None
        if not self._cookies:
            context.request.get(self._studio.link)
            (cookie,) = context.cookies()
            self._cookies = [
                {
                    "name": cookie.get("name", ""),
                    "value": cookie.get("value", ""),
                    "url": self._studio.address,
                }
            ]
        context.add_cookies(self._cookies)

    def close(self) -> None:
        """Stop the studio with Ctrl-C."""
        if self._studio is not None:
            studio, self._studio, self._cookies = self._studio, None, []
            studio.stop()


SHARED_STUDIO = SharedStudio()


@pytest.fixture
def disk(tmp_path: Path) -> Disk:
    """A project folder and its state folder, before the first start of a studio."""
    (tmp_path / "first" / "project").mkdir(parents=True)
    return Disk(tmp_path / "first")


@pytest.fixture(scope="module")
def browser() -> Browser:
    """The shared browser; each test or file creates its own contexts."""
    return SHARED_BROWSER.opened()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> Generator[None]:
    """Close the browser before a file that does not use it: Playwright's event loop permits no other one."""
    try:
        return (yield)
    finally:
        fixtures = getattr(nextitem, "fixturenames", ())
        if nextitem is None or (nextitem.path != item.path and "browser" not in fixtures):
            SHARED_BROWSER.close()
            SHARED_STUDIO.close()


@pytest.fixture(scope="module")
def studio(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Studio:
    """The studio shared by the journeys of a process. Each file or test creates its own pages in it."""
    return SHARED_STUDIO.opened(tmp_path_factory.mktemp)


def new_context(browser: Browser) -> BrowserContext:
    """A browser context that shares no cookies or storage with others."""
    context = browser.new_context(
        viewport={"width": 1280, "height": 720}, color_scheme="light", reduced_motion="reduce"
    )
    context.set_default_timeout(TIMEOUT_MS)
    for script in (TOUR_SEEN, NO_RENDERING, *SCRIPTS):
        context.add_init_script(script)
    return context


@contextmanager
def watched(browser: Browser, address: str) -> Generator[Page]:
    """A page of the shared studio whose console must not report errors."""
    context = new_context(browser)
    SHARED_STUDIO.log_in(context)
    allow_clipboard(context)
    page = context.new_page()
    faults: list[str] = []

    def on_console(message: ConsoleMessage) -> None:
        if message.type == "error":
            faults.append(message.text)

    page.on("console", on_console)
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.goto(address)
    page.locator(".react-flow__node").first.wait_for()
    yield page
    context.close()
    assert not faults


@pytest.fixture(scope="module")
def open_studio(browser: Browser, studio: Studio) -> Iterator[Callable[[str], Page]]:
    """Open pages of the shared studio until the file ends; the argument is the example to open.

    A model without an arm draws none; software rendering of an arm takes long.
    """
    with ExitStack() as stack:

        def opened(example: str) -> Page:
            return stack.enter_context(watched(browser, f"{studio.address}#{example}"))

        yield opened


@pytest.fixture(scope="module")
def shared(open_studio: Callable[[str], Page]) -> Page:
    """A page with an example, for all tests of a file."""
    return open_studio("van_der_pol_pid")


@pytest.fixture
def sheet(shared: Page) -> Page:
    """The shared page with a fresh copy of the example."""
    from building import open_fresh_example

    shared.bring_to_front()  # in Firefox only the page in front has the focus
    open_fresh_example(shared)
    return shared


@pytest.hookimpl(trylast=True)  # after the fixtures of an interrupted run
def pytest_sessionfinish() -> None:
    """Close the browser when the tests end for any reason."""
    SHARED_BROWSER.close()
    SHARED_STUDIO.close()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Firefox is optional, but the summary reports that its tests were skipped."""
    if installed(FIREFOX_NAMES) is None:
        terminalreporter.write_line("Firefox is not installed: its tests were skipped.", yellow=True)

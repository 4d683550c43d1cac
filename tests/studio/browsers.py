"""The browsers that journeys can run in: Chromium, or Firefox as Debian and Mozilla distribute it.

``ARMBLOCKS_BROWSER=firefox`` runs all journeys in Firefox. Playwright controls it by WebDriver BiDi.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path

import pytest
from playwright.sync_api import Browser, BrowserContext, Playwright, sync_playwright

CHROMIUM_NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
FIREFOX_NAMES = ("firefox-esr", "firefox")
IN_FIREFOX = os.environ.get("ARMBLOCKS_BROWSER", "chromium") == "firefox"
"""Whether all journeys run in Firefox."""
DISABLED_FEATURES = (
    # The browser's own address bar: Chromium loads two pages for its suggestions into every new window, which
    # takes as much processor time as the front end of the studio.
    "WebUIOmniboxPopup",
    "WebUIOmniboxAimPopup",
    # The features that Playwright disables; Chromium reads only the last of two lists.
    "AvoidUnnecessaryBeforeUnloadCheckSync",
    "DestroyProfileOnBrowserClose",
    "HttpsUpgrades",
    "HttpsFirstBalancedModeAutoEnable",
    "LensOverlay",
    "MediaRouter",
    "PaintHolding",
    "ThirdPartyStoragePartitioning",
    "AvoidCorsURLLoaderRestartOnRedirect",
    "OptimizationHints",
    "NetworkTimeServiceQuerying",
    "AimEnabled",
    "PreconnectToSearch",
)
"""Features of Chromium that no journey needs."""
FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    f"--disable-features={','.join(DISABLED_FEATURES)}",
]
PREFERENCES: dict[str, str | float | bool] = {
    "layout.css.prefers-color-scheme.content-override": 1,  # light
    "ui.prefersReducedMotion": 1,
    "browser.download.alwaysOpenPanel": False,  # the panel takes the focus
    "dom.events.testing.asyncClipboard": True,  # reads the clipboard without a question to the user
}
"""Preferences of Firefox in place of the commands of BiDi that Firefox does not have."""

INSERT_TEXT = """
Object.defineProperty(window, '__pw_bidiInsertText', {
    get: () => (text) => { document.execCommand('insertText', false, text) },
    set: () => {},
})
"""
"""Inserts text by a command of Firefox: React does not detect text that Playwright inserts.
"""
LOST_CONNECTION = re.compile("ERR_CONNECTION_|ERR_CONTENT_LENGTH_MISMATCH|(connection to|server at) ws://")
"""Messages of Chromium and Firefox about a studio that has ended."""
SCRIPTS = (INSERT_TEXT,) if IN_FIREFOX else ()
"""Scripts that pages need at their start."""

needs_webgl = pytest.mark.skipif(IN_FIREFOX, reason="Firefox has no WebGL without a graphics card")
needs_emulated_media = pytest.mark.skipif(IN_FIREFOX, reason="Firefox cannot emulate other media")


def installed(names: tuple[str, ...]) -> str | None:
    """The path of the first installed program, or ``None``."""
    return next((path for name in names if (path := shutil.which(name))), None)


def launch_chromium(playwright: Playwright) -> Browser:
    path = installed(CHROMIUM_NAMES)
    assert path is not None, f"install one of {', '.join(CHROMIUM_NAMES)} (apt-get install chromium)"
    return playwright.chromium.launch(executable_path=path, args=FLAGS)


def launch_firefox(playwright: Playwright, stack: ExitStack) -> Browser:
    """Start Firefox behind ``firefox_proxy.py``. ``stack`` removes the start script at its end."""
    path = installed(FIREFOX_NAMES)
    assert path is not None, f"install one of {', '.join(FIREFOX_NAMES)} (apt-get install firefox-esr)"
    folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
    proxy = Path(__file__).with_name("firefox_proxy.py")
    script = folder / "firefox"
    script.write_text(f'#!/bin/sh\nexec {shlex.join([sys.executable, str(proxy), path])} "$@"\n')
    script.chmod(0o700)
    return playwright.firefox.launch(
        executable_path=script, channel="moz-firefox", firefox_user_prefs=PREFERENCES
    )


class SharedBrowser:
    """One browser for all journeys of a process, because a start takes seconds."""

    def __init__(self) -> None:
        self._browser: Browser | None = None
        self._stack = ExitStack()

    def opened(self) -> Browser:
        """Return the browser; start it if it is not running."""
        if self._browser is None:
            playwright = self._stack.enter_context(sync_playwright())
            self._browser = (
                launch_firefox(playwright, self._stack) if IN_FIREFOX else launch_chromium(playwright)
            )
            self._stack.callback(self._browser.close)
        return self._browser

    def close(self) -> None:
        """Close the browser and its event loop."""
        self._browser = None
        self._stack.close()


def allow_clipboard(context: BrowserContext) -> None:
    """Let pages read and write the clipboard; ``PREFERENCES`` do this in Firefox."""
    if not IN_FIREFOX:
        context.grant_permissions(["clipboard-read", "clipboard-write"])

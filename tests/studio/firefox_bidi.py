"""Control of Firefox by WebDriver BiDi over its own websocket, without a driver program.

Playwright needs a patched Firefox; stock Firefox lacks a command that Playwright sends to every page.
The protocol: https://w3c.github.io/webdriver-bidi/.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import tempfile
import time
from contextlib import ExitStack
from itertools import count
from typing import Any

from websockets.sync.client import connect

NAMES = ("firefox-esr", "firefox")
KEYS = {"Control": "\ue009", "Enter": "\ue007", "Delete": "\ue017"}
TIMEOUT_SECONDS = 180.0


def firefox_path() -> str | None:
    """The path of Firefox, or ``None`` if it is not installed."""
    return next((path for name in NAMES if (path := shutil.which(name))), None)


class Firefox:
    """One headless Firefox window with its own profile."""

    def __init__(self, path: str) -> None:
        self._profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        self._process = subprocess.Popen(
            [
                path,
                "--headless",
                "--profile",
                self._profile.name,
                "--remote-debugging-port",
                "0",
                "--no-remote",
            ],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self._process.stderr is not None
        for line in self._process.stderr:
            if match := re.search(r"WebDriver BiDi listening on (ws://\S+)", line):
                break
        else:
            raise AssertionError("Firefox ended without printing its address")
        self._stack = ExitStack()
        self._socket = self._stack.enter_context(connect(f"{match.group(1)}/session", max_size=None))
        self._numbers = count(1)
        self.errors: list[str] = []
        """Errors and uncaught exceptions on the consoles of pages."""
        self._ask("session.new", capabilities={})
        self._ask("session.subscribe", events=["log.entryAdded"])
        self._page = self._ask("browsingContext.create", type="tab")["context"]
        self._ask("browsingContext.setViewport", context=self._page, viewport={"width": 1280, "height": 720})

    def _ask(self, method: str, **params: Any) -> Any:
        number = next(self._numbers)
        self._socket.send(json.dumps({"id": number, "method": method, "params": params}))
        while True:
            message = json.loads(self._socket.recv(timeout=TIMEOUT_SECONDS))
            if message.get("method") == "log.entryAdded" and message["params"]["level"] == "error":
                self.errors.append(message["params"]["text"])
            if message.get("id") == number:
                assert message["type"] == "success", message
                return message["result"]

    def open(self, url: str) -> None:
        self._ask("browsingContext.navigate", context=self._page, url=url, wait="complete")

    def value(self, expression: str) -> Any:
        """Return the value of a JavaScript expression: a text, a number or a boolean."""
        reply = self._ask(
            "script.evaluate", expression=expression, target={"context": self._page}, awaitPromise=True
        )
        assert reply["type"] == "success", reply
        return reply["result"].get("value")

    def wait(self, expression: str) -> None:
        """Wait until a JavaScript expression is true."""
        end = time.monotonic() + TIMEOUT_SECONDS
        while not self.value(f"Boolean({expression})"):
            assert time.monotonic() < end, f"not true in time: {expression}; errors: {self.errors}"
            time.sleep(0.1)

    def press(self, *keys: str) -> None:
        """Press keys together and release them in reverse order."""
        codes = [KEYS.get(key, key) for key in keys]
        strokes = [{"type": "keyDown", "value": code} for code in codes]
        strokes += [{"type": "keyUp", "value": code} for code in reversed(codes)]
        self._ask(
            "input.performActions",
            context=self._page,
            actions=[{"type": "key", "id": "k", "actions": strokes}],
        )

    def close(self) -> None:
        self._stack.close()
        self._process.kill()
        self._process.wait()
        assert self._process.stderr is not None
        self._process.stderr.close()
        self._profile.cleanup()

"""Firefox behind a proxy of its WebDriver BiDi websocket, so that Playwright controls a stock Firefox.

Usage: ``firefox_proxy.py FIREFOX [ARGUMENTS]``. Playwright starts this program in place of Firefox, and reads
the address of the websocket from the standard error. All messages are passed on, except the commands of
``UNSUPPORTED``: Firefox does not have them yet, and Playwright cannot open a page without them.
The protocol: https://w3c.github.io/webdriver-bidi/.
"""

from __future__ import annotations

import asyncio
import json
import re
import sys

from websockets.asyncio.client import connect
from websockets.asyncio.server import ServerConnection, serve

UNSUPPORTED = ("emulation.setMediaFeaturesOverride",)
"""Commands that are confirmed without an effect. ``browsers.PREFERENCES`` sets the media features."""


DOWNLOAD_EVENTS = ("browsingContext.downloadWillBegin", "browsingContext.downloadEnd")


def with_download_identifier(text: str) -> str:
    """Add the identifier of a download, which Firefox does not send yet: its URL."""
    if not any(event in text for event in DOWNLOAD_EVENTS):
        return text
    message = json.loads(text)
    if message.get("method") in DOWNLOAD_EVENTS:
        message["params"].setdefault("download", message["params"]["url"])
    return json.dumps(message)


async def pass_messages(playwright: ServerConnection, address: str) -> None:
    """Pass messages between Playwright and Firefox until one of them closes its connection."""
    async with connect(f"{address}{playwright.request.path}", max_size=None) as firefox:  # type: ignore[union-attr]

        async def pass_commands() -> None:
            async for text in playwright:
                command = json.loads(text)
                if command["method"] in UNSUPPORTED:
                    await playwright.send(json.dumps({"id": command["id"], "type": "success", "result": {}}))
                else:
                    await firefox.send(text)
            await firefox.close()

        commands = asyncio.create_task(pass_commands())
        async for text in firefox:
            await playwright.send(with_download_identifier(text))
        await commands


async def main(path: str, *arguments: str) -> int:
    """Run Firefox; return its exit code."""
    process = await asyncio.create_subprocess_exec(path, *arguments, stderr=asyncio.subprocess.PIPE)
    assert process.stderr is not None
    async for line in process.stderr:
        if match := re.search(rb"WebDriver BiDi listening on (ws://\S+)", line):
            break
    else:
        return await process.wait()
    address = match.group(1).decode()

    async def drain() -> None:
        assert process.stderr is not None
        async for _ in process.stderr:
            pass

    drained = asyncio.create_task(drain())
    server = await serve(lambda playwright: pass_messages(playwright, address), "127.0.0.1", 0, max_size=None)
    port = server.sockets[0].getsockname()[1]
    print(f"WebDriver BiDi listening on ws://127.0.0.1:{port}", file=sys.stderr, flush=True)
    code = await process.wait()
    server.close()
    await drained
    return code


if __name__ == "__main__":
    sys.exit(asyncio.run(main(*sys.argv[1:])))

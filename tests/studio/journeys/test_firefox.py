"""The main workflow of the studio in Firefox; without Firefox the test summary reports the skipped test."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

import pytest
from browsers import FIREFOX_NAMES, installed, launch_firefox
from building import block, run
from playwright.sync_api import ConsoleMessage, expect, sync_playwright

from conftest import Studio, new_context


@pytest.mark.skipif(
    installed(FIREFOX_NAMES) is None, reason="Firefox is not installed (apt-get install firefox-esr)"
)
def test_the_model_of_the_paper_is_run_and_edited_in_firefox(tmp_path: Path) -> None:
    with ExitStack() as stack:
        studio = Studio(tmp_path)
        stack.callback(studio.stop)
        firefox = launch_firefox(stack.enter_context(sync_playwright()), stack)
        stack.callback(firefox.close)
        page = new_context(firefox).new_page()
        faults: list[str] = []

        def on_console(message: ConsoleMessage) -> None:
            if message.type == "error":
                faults.append(message.text)

        page.on("console", on_console)
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.goto(studio.link)
        blocks = page.locator(".react-flow__node")
        expect(blocks).to_have_count(15)
        expect(page.locator(".robot")).to_be_visible()
        run(page)
        expect(page.locator(".chart canvas")).to_have_count(7)
        block(page, "kuka").focus()
        page.keyboard.press("Delete")
        expect(blocks).to_have_count(14)
        page.keyboard.press("Control+z")
        expect(blocks).to_have_count(15)
        assert not faults

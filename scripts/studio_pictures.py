"""Take the pictures of the studio that README and docs show: ``python3 scripts/studio_pictures.py``."""

from __future__ import annotations

import re
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import sync_playwright

PICTURES = Path(__file__).resolve().parent.parent / "docs" / "pictures"
FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


def take(link: str, theme: str) -> None:
    """The paper's model after its run, in one theme."""
    browser_path = shutil.which("chromium") or shutil.which("google-chrome")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path, args=FLAGS)
        page = browser.new_page(viewport={"width": 1440, "height": 860}, color_scheme=theme)  # pyright: ignore
        page.goto(link)
        page.locator(".robot canvas").wait_for(timeout=60_000)
        page.keyboard.press("Control+Enter")
        page.get_by_text("done", exact=True).wait_for(timeout=60_000)
        slider = page.get_by_role("slider", name="Time")
        slider.focus()
        for _ in range(35):
            slider.press("PageDown")
        page.wait_for_timeout(2000)
        page.screenshot(path=PICTURES / f"studio-{theme}.png")
        browser.close()


def main() -> None:
    """Start a studio for each theme, as a user does."""
    for theme in ("light", "dark"):
        with tempfile.TemporaryDirectory() as folder:
            command = [
                sys.executable,
                "-m",
                "armblocks",
                "studio",
                "kr180model",
                "--no-browser",
                "--folder",
                folder,
            ]
            studio = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            assert studio.stdout is not None
            said = ""
            while not (found := re.search(r"http://\S+", said)):
                said += studio.stdout.readline().strip()
            take(found.group(), theme)
            studio.send_signal(signal.SIGINT)
            studio.wait()


if __name__ == "__main__":
    main()

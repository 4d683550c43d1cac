"""Take the pictures of the studio that README and docs show: ``python3 scripts/studio_pictures.py``."""

from __future__ import annotations

import re
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import Page, sync_playwright

PICTURES = Path(__file__).resolve().parent.parent / "docs" / "pictures"
FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


def take(link: str, theme: str) -> None:
    """The paper's model after its run, in one theme."""
    browser_path = shutil.which("chromium") or shutil.which("google-chrome")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path, args=FLAGS)
        page = browser.new_page(viewport={"width": 1440, "height": 860}, color_scheme=theme)  # pyright: ignore
        page.add_init_script("localStorage.setItem('armblocks-tour-seen', 'yes')")
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
        take_editor(page, theme)
        browser.close()


def take_editor(page: Page, theme: str) -> None:
    """The robot editor with the Puma, its dynamics, and a joint that was moved."""
    page.get_by_role("button", name="Menu").click()
    page.get_by_role("menuitem", name="puma560", exact=True).click()
    editor = page.locator(".robot-editor")
    editor.get_by_text("Dynamics", exact=True).click()
    for joint, value in (("link2", "40"), ("link3", "-150"), ("link5", "50")):
        editor.get_by_role("textbox", name=f"q of {joint} as a number").fill(value)
    editor.get_by_role("region", name="Jacobian").wait_for(timeout=60_000)
    editor.get_by_role("button", name="Show all of the arm").click()
    page.mouse.move(5, 850)
    page.wait_for_timeout(3000)
    page.screenshot(path=PICTURES / f"robot-editor-{theme}.png")


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

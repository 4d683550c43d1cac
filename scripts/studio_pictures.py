"""Take the pictures of the studio that README and docs show: ``python3 scripts/studio_pictures.py [NAME …]``.

The script starts a studio and operates it in Chromium. Each function below takes one picture or several.
Names on the command line select functions. It needs ``playwright`` (in the extra ``test``) and
Chromium or Chrome.
"""

from __future__ import annotations

import base64
import io
import math
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Literal

from PIL import Image
from playwright.sync_api import Browser, FloatRect, Locator, Page, sync_playwright

import armblocks as ab

ROOT = Path(__file__).resolve().parent.parent
PICTURES = ROOT / "docs" / "pictures"
SCRIPT = ROOT / "tests" / "formats" / "kr180_as_printed.m"
"""The script of the paper as printed."""
FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
TIMEOUT_MS = 180_000
THEMES: tuple[Literal["light", "dark"], ...] = ("light", "dark")
THEME_MS = 2000
"""Time to draw all views after a change of the theme, ms."""
POSE_TIMES = (0, 2.5, 5, 10)
"""Times of the motion at which the arm is shown, s."""
DROP = """([name, content]) => {
    const data = new DataTransfer()
    const bytes = Uint8Array.from(atob(content), (letter) => letter.charCodeAt(0))
    data.items.add(new File([bytes], name))
    for (const kind of ['dragenter', 'drop'])
        document.body.dispatchEvent(
            new DragEvent(kind, { bubbles: true, cancelable: true, dataTransfer: data })
        )
}"""

NOTEBOOK = '<!doctype html><meta name="color-scheme" content="light dark"><body></body>'
SHOW_WIDGET = """async ([script, state, samples]) => {
    const file = URL.createObjectURL(new Blob([script], { type: 'text/javascript' }))
    const { default: widget } = await import(file)
    const bytes = Uint8Array.from(atob(samples), (letter) => letter.charCodeAt(0))
    const values = { ...state, _frame: new DataView(bytes.buffer) }
    const model = { get: (name) => values[name], set: () => {}, on: () => {}, save_changes: () => {} }
    widget.render({ model, el: document.body.appendChild(document.createElement('div')) })
}"""


@contextmanager
def studio(model: str) -> Generator[str]:
    """Start a studio in a temporary folder; return its login link."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "armblocks", "studio", model, "--no-browser", "--folder", folder]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        assert process.stdout is not None
        message = ""
        try:
            while not (match := re.search(r"http://\S+", message)):
                line = process.stdout.readline()
                if not line:
                    raise SystemExit(f"the studio did not start: {message}")
                message += line.strip()
            yield match.group()
        finally:
            process.send_signal(signal.SIGINT)
            process.wait()


@contextmanager
def open_page(browser: Browser, size: tuple[int, int], model: str = "kr180model") -> Generator[Page]:
    """Open a page of a studio that shows a model with its arm."""
    with studio(model) as link:
        page = browser.new_page(
            viewport={"width": size[0], "height": size[1]},
            device_scale_factor=1.5,
            reduced_motion="reduce",
        )
        page.set_default_timeout(TIMEOUT_MS)
        page.add_init_script(
            "if (location.protocol === 'http:') localStorage.setItem('armblocks-tour-seen', 'yes')"
        )
        page.goto(link)
        page.locator(".react-flow__node").first.wait_for()
        page.locator(".robot canvas").wait_for()
        yield page
        page.close()


def run(page: Page) -> None:
    """Run the model to its end."""
    page.keyboard.press("Control+Enter")
    page.locator(".run-state").filter(has_text=re.compile("done", re.IGNORECASE)).wait_for()


def set_time(page: Page, seconds: float, stop: float = 10.0) -> None:
    """Move the time cursor with the keys; the step of the slider is a thousandth of the run."""
    slider = page.get_by_role("slider", name="Time")
    slider.focus()
    slider.press("Home")
    for _ in range(round(seconds / stop * 1000 / 10)):
        slider.press("Shift+ArrowRight")  # ten samples of 10 ms
    page.wait_for_timeout(800)


def enlarge_scopes(page: Page, by: int) -> None:
    """Drag the upper edge of the scopes upwards by ``by`` px."""
    top = page.locator(".scopes-panel, .dock .empty").last.bounding_box()
    assert top is not None
    edges = [sash.bounding_box() for sash in page.locator(".dv-sash").all()]
    horizontal = [e for e in edges if e and e["width"] > e["height"] and e["x"] <= top["x"] + 9]
    edge = min(horizontal, key=lambda e: abs(e["y"] - top["y"] + 30))
    drag(page, edge, up=by)


def enlarge_library(page: Page, by: int) -> None:
    """Drag the right edge of the library to the right by ``by`` px."""
    library = page.locator(".palette").bounding_box()
    assert library is not None
    edges = [sash.bounding_box() for sash in page.locator(".dv-sash").all()]
    vertical = [e for e in edges if e and e["height"] > e["width"]]
    right = library["x"] + library["width"]
    edge = min(vertical, key=lambda e: abs(e["x"] - right))
    drag(page, edge, right=by)


def drag(page: Page, edge: FloatRect, *, right: int = 0, up: int = 0) -> None:
    """Drag an edge between two panels by ``right`` and ``up`` px."""
    x, y = edge["x"] + edge["width"] / 2, edge["y"] + edge["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + right, y - up, steps=8)
    page.mouse.up()


def save_picture(page: Page, name: str, part: Locator | None = None) -> None:
    """Write a picture of the page, or of one element, in each theme, with 1.5 pixels per CSS pixel."""
    for theme in THEMES:
        page.emulate_media(color_scheme=theme, reduced_motion="reduce")
        page.wait_for_timeout(THEME_MS)
        screenshot = page.screenshot(animations="disabled", clip=part and inner_area(part))
        image = Image.open(io.BytesIO(screenshot)).convert("RGB")
        path = PICTURES / f"{name}-{theme}.webp"
        path.write_bytes(min(_lossless(image), _lossy(image), key=len))  # the pictures are part of the wheel
        print(f"{path.relative_to(ROOT)}: {path.stat().st_size / 1000:.0f} kB", flush=True)


def inner_area(part: Locator) -> FloatRect:
    """The area of an element without its border, in whole pixels; a dialog starts at a fraction of one."""
    box = part.bounding_box()
    assert box is not None
    left, top = math.ceil(box["x"]) + 1, math.ceil(box["y"]) + 1
    right, bottom = math.floor(box["x"] + box["width"]) - 1, math.floor(box["y"] + box["height"]) - 1
    return FloatRect(x=left, y=top, width=right - left, height=bottom - top)


def _lossless(picture: Image.Image) -> bytes:
    """The picture with 256 colours as WebP: the smaller file for pictures without a robot view."""
    data = io.BytesIO()
    picture.quantize(256).convert("RGB").save(data, "WEBP", lossless=True, method=6)
    return data.getvalue()


def _lossy(picture: Image.Image) -> bytes:
    """The picture as lossy WebP: the smaller file for pictures with a robot view."""
    data = io.BytesIO()
    picture.save(data, "WEBP", quality=90, method=6, use_sharp_yuv=True)
    return data.getvalue()


def studio_with_run(browser: Browser) -> None:
    """The model of the paper after its run, with canvas, arm and scopes."""
    with open_page(browser, (1440, 860)) as page:
        run(page)
        set_time(page, 4.5)
        page.mouse.move(2, 2)
        save_picture(page, "studio")


def script(browser: Browser) -> None:
    """Figures 5 and 6: the script of the paper dropped on the page, and the window of the new model."""
    with open_page(browser, (1440, 820)) as page:
        page.evaluate(DROP, ["kr180.m", base64.b64encode(SCRIPT.read_bytes()).decode()])
        editor = page.locator(".robot-editor")
        editor.locator("canvas").wait_for()
        page.wait_for_timeout(1500)
        save_picture(page, "paper-5-script")
        page.get_by_role("button", name="Close the notes").click()
        editor.get_by_text("Dynamics", exact=True).click()
        page.wait_for_timeout(1500)
        save_picture(page, "paper-6-model")


def robot_editor(browser: Browser) -> None:
    """The robot editor with the dynamics of the Puma and moved joints."""
    with open_page(browser, (1440, 860)) as page:
        page.get_by_role("button", name="Menu").click()
        page.get_by_role("menuitem", name="puma560", exact=True).click()
        editor = page.locator(".robot-editor")
        editor.get_by_text("Dynamics", exact=True).click()
        for joint, value in (("link2", "40"), ("link3", "-150"), ("link5", "50")):
            editor.get_by_role("textbox", name=f"q of {joint} as a number").fill(value)
        editor.get_by_role("region", name="Jacobian").wait_for()
        editor.get_by_role("button", name="Show the whole arm").click()
        page.mouse.move(5, 850)
        page.wait_for_timeout(3000)
        save_picture(page, "robot-editor")


def library(browser: Browser) -> None:
    """Figure 7: the blocks of the library roblocks, in the palette."""
    with open_page(browser, (1440, 720)) as page:
        enlarge_library(page, 420)
        page.get_by_role("textbox", name="Search the library").fill("robot")
        page.wait_for_timeout(400)
        save_picture(page, "paper-7-library", page.locator(".palette"))


def dialog(browser: Browser) -> None:
    """Figure 8: the parameters of jtraj, and the configuration parameters of a slide of the paper."""
    with open_page(browser, (1280, 900)) as page:
        # Rounded corners would show the background.
        page.add_style_tag(content="[role=dialog] { border-radius: 0 !important }")
        page.locator('.react-flow__node[data-id="jtraj"]').dblclick()
        opened = page.get_by_role("dialog")
        opened.wait_for()
        page.wait_for_timeout(600)
        save_picture(page, "paper-8-jtraj", opened)
        page.keyboard.press("Escape")
        opened.wait_for(state="hidden")
        page.keyboard.press("Control+e")
        opened.wait_for()
        page.wait_for_timeout(600)
        save_picture(page, "paper-configuration", opened)


def model(browser: Browser) -> None:
    """Figure 9: the sheet with the model."""
    with open_page(browser, (1440, 860)) as page:
        page.locator(".react-flow__controls-fitview").click()
        page.wait_for_timeout(600)
        save_picture(page, "paper-9-model", page.locator(".react-flow"))


def poses(browser: Browser) -> None:
    """Figure 10: the robot view at ``POSE_TIMES``."""
    with open_page(browser, (1440, 860)) as page:
        run(page)
        for seconds in POSE_TIMES:
            set_time(page, seconds)
            save_picture(page, f"paper-10-{seconds:g}s", page.locator(".robot"))


def scopes(browser: Browser) -> None:
    """Figure 11: the three projections of the path, angles, speeds, accelerations, torques."""
    with open_page(browser, (1745, 1300)) as page:
        enlarge_scopes(page, 440)
        run(page)
        set_time(page, 5)
        page.mouse.move(2, 2)
        save_picture(page, "paper-11-scopes", page.locator(".scopes-panel"))


def notebook(browser: Browser) -> None:
    """The widget of a run, as a notebook displays it."""
    diagram = ab.load_diagram("kr180model")
    widget = ab.run_widget(diagram, ab.simulate(diagram), height=520)
    state = widget.get_state(("title", "height", "_page", "_shown"))
    samples = base64.b64encode(widget.get_state("_frame")["_frame"]).decode()
    with tempfile.TemporaryDirectory() as folder:
        # A local file, because the widgets need no server.
        (Path(folder) / "notebook.html").write_text(NOTEBOOK, encoding="utf-8")
        page = browser.new_page(
            viewport={"width": 1160, "height": 560},
            device_scale_factor=1.5,
        )
        page.set_default_timeout(TIMEOUT_MS)
        page.goto((Path(folder) / "notebook.html").as_uri())
        page.evaluate(SHOW_WIDGET, [str(widget._esm), {**state, "time": 4.5}, samples])
        page.frame_locator("iframe").locator(".robot canvas").wait_for()
        page.wait_for_timeout(3000)
        save_picture(page, "notebook")
        page.close()


SHOTS = {
    "studio": studio_with_run,
    "editor": robot_editor,
    "script": script,
    "library": library,
    "dialog": dialog,
    "model": model,
    "poses": poses,
    "scopes": scopes,
    "notebook": notebook,
}


def main(names: Sequence[str]) -> None:
    """Take the named pictures, or all, in both themes."""
    path = shutil.which("chromium") or shutil.which("google-chrome")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
        for name in names or SHOTS:
            SHOTS[name](browser)
        browser.close()


if __name__ == "__main__":
    main(sys.argv[1:])

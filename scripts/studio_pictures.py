"""Take the pictures of the studio that README and docs show: ``python3 scripts/studio_pictures.py [NAME …]``.

A real studio is started and operated in Chromium. Each function below takes one picture; names select some of
them. Needs ``playwright`` (in the extra ``test``) and Chromium or Chrome.
"""

from __future__ import annotations

import base64
import io
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, Locator, Page, sync_playwright

import armblocks as ab

ROOT = Path(__file__).resolve().parent.parent
PICTURES = ROOT / "docs" / "pictures"
SCRIPT = ROOT / "tests" / "formats" / "kr180_as_printed.m"
"""The script of the paper as printed."""
FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
PATIENCE_MS = 180_000
MOMENTS = (0, 2.5, 5, 10)
"""Instants of the motion at which the arm is shown, s."""
DROP = """([name, content]) => {
    const brought = new DataTransfer()
    const bytes = Uint8Array.from(atob(content), (letter) => letter.charCodeAt(0))
    brought.items.add(new File([bytes], name))
    for (const kind of ['dragenter', 'drop'])
        document.body.dispatchEvent(
            new DragEvent(kind, { bubbles: true, cancelable: true, dataTransfer: brought })
        )
}"""

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
        said = ""
        try:
            while not (found := re.search(r"http://\S+", said)):
                line = process.stdout.readline()
                if not line:
                    raise SystemExit(f"the studio did not start: {said}")
                said += line.strip()
            yield found.group()
        finally:
            process.send_signal(signal.SIGINT)
            process.wait()


@contextmanager
def shown(browser: Browser, theme: str, size: tuple[int, int], model: str = "kr180model") -> Generator[Page]:
    """Open a page of a studio that shows a model with its arm."""
    with studio(model) as link:
        page = browser.new_page(
            viewport={"width": size[0], "height": size[1]},
            color_scheme=theme,  # pyright: ignore[reportArgumentType]
            device_scale_factor=1.5,
            reduced_motion="reduce",
        )
        page.set_default_timeout(PATIENCE_MS)
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


def at(page: Page, seconds: float, stop: float = 10.0) -> None:
    """Move the time cursor to an instant with the keys; the step of the slider is a thousandth of the run."""
    slider = page.get_by_role("slider", name="Time")
    slider.focus()
    slider.press("Home")
    for _ in range(round(seconds / stop * 1000 / 10)):
        slider.press("Shift+ArrowRight")  # ten recorded instants of 10 ms
    page.wait_for_timeout(800)


def taller(page: Page, by: int) -> None:
    """Drag the upper edge of the scopes upwards by some pixels."""
    top = page.locator(".scopes-panel, .dock .empty").last.bounding_box()
    assert top is not None
    edges = [one.bounding_box() for one in page.locator(".dv-sash").all()]
    flat = [one for one in edges if one and one["width"] > one["height"] and one["x"] <= top["x"] + 9]
    edge = min(flat, key=lambda one: abs(one["y"] - top["y"] + 30))
    x, y = edge["x"] + edge["width"] / 2, edge["y"] + edge["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x, y - by, steps=8)
    page.mouse.up()


def keep(shot: Page | Locator, name: str) -> None:
    """Write a picture with 256 colours, in double resolution."""
    PICTURES.mkdir(exist_ok=True)
    shown = Image.open(io.BytesIO(shot.screenshot(animations="disabled"))).convert("RGB")
    # 256 colours look the same, and the file, which is part of the wheel, is half as large.
    shown.quantize(256).save(PICTURES / f"{name}.png", optimize=True)
    print(f"docs/pictures/{name}.png")


def whole(browser: Browser, theme: str) -> None:
    """The model of the paper after its run, with canvas, arm and scopes."""
    with shown(browser, theme, (1440, 860)) as page:
        run(page)
        at(page, 4.5)
        page.mouse.move(2, 2)
        keep(page, f"studio-{theme}")


def script(browser: Browser) -> None:
    """Figures 5 and 6: the script of the paper dropped on the page, and the window of the new model."""
    with shown(browser, "light", (1440, 820)) as page:
        page.evaluate(DROP, ["kr180.m", base64.b64encode(SCRIPT.read_bytes()).decode()])
        editor = page.locator(".robot-editor")
        editor.locator("canvas").wait_for()
        page.wait_for_timeout(1500)
        keep(page, "paper-5-script")
        page.get_by_role("button", name="Close the notes").click()
        editor.get_by_text("Dynamics", exact=True).click()
        page.wait_for_timeout(1500)
        keep(page, "paper-6-model")


def robot_editor(browser: Browser, theme: str) -> None:
    """The robot editor with the dynamics of the Puma and moved joints."""
    with shown(browser, theme, (1440, 860)) as page:
        page.get_by_role("button", name="Menu").click()
        page.get_by_role("menuitem", name="puma560", exact=True).click()
        editor = page.locator(".robot-editor")
        editor.get_by_text("Dynamics", exact=True).click()
        for joint, value in (("link2", "40"), ("link3", "-150"), ("link5", "50")):
            editor.get_by_role("textbox", name=f"q of {joint} as a number").fill(value)
        editor.get_by_role("region", name="Jacobian").wait_for()
        editor.get_by_role("button", name="Show all of the arm").click()
        page.mouse.move(5, 850)
        page.wait_for_timeout(3000)
        keep(page, f"robot-editor-{theme}")


def library(browser: Browser) -> None:
    """Figure 7: the blocks of the library roblocks, in the palette."""
    with shown(browser, "light", (1440, 860)) as page:
        page.get_by_role("textbox", name="Search the library").fill("robot")
        page.wait_for_timeout(400)
        keep(page.locator(".palette"), "paper-7-library")


def dialog(browser: Browser) -> None:
    """Figure 8: the parameters of jtraj, and the configuration parameters of a slide of the paper."""
    with shown(browser, "light", (1280, 900)) as page:
        page.locator('.react-flow__node[data-id="jtraj"]').dblclick()
        opened = page.get_by_role("dialog")
        opened.wait_for()
        page.wait_for_timeout(600)
        keep(opened, "paper-8-jtraj")
        page.keyboard.press("Escape")
        opened.wait_for(state="hidden")
        page.keyboard.press("Control+e")
        opened.wait_for()
        page.wait_for_timeout(600)
        keep(opened, "paper-configuration")


def model(browser: Browser, theme: str) -> None:
    """Figure 9: the model, alone on the sheet."""
    with shown(browser, theme, (1440, 860)) as page:
        page.locator(".react-flow__controls-fitview").click()
        page.wait_for_timeout(600)
        keep(page.locator(".react-flow"), f"paper-9-model-{theme}")


def moments(browser: Browser) -> None:
    """Figure 10: the robot view at some instants of the motion."""
    with shown(browser, "light", (1440, 860)) as page:
        run(page)
        for seconds in MOMENTS:
            at(page, seconds)
            keep(page.locator(".robot"), f"paper-10-{seconds:g}s")


def scopes(browser: Browser) -> None:
    """Figure 11: the three projections of the path, angles, speeds, accelerations, torques."""
    with shown(browser, "light", (1900, 1100)) as page:
        taller(page, 220)
        run(page)
        at(page, 5)
        page.mouse.move(2, 2)
        keep(page.locator(".scopes-panel"), "paper-11-scopes")


def notebook(browser: Browser) -> None:
    """The widget of a run, as a notebook displays it."""
    diagram = ab.load_diagram("kr180model")
    widget = ab.run_widget(diagram, ab.simulate(diagram), height=520)
    state = widget.get_state(("title", "height", "_page", "_shown"))
    samples = base64.b64encode(widget.get_state("_frame")["_frame"]).decode()
    with tempfile.TemporaryDirectory() as folder:
        # A local file, because the widgets need no server.
        (Path(folder) / "notebook.html").write_text("<!doctype html><body></body>", encoding="utf-8")
        page = browser.new_page(viewport={"width": 1160, "height": 560}, device_scale_factor=1.5)
        page.set_default_timeout(PATIENCE_MS)
        page.goto((Path(folder) / "notebook.html").as_uri())
        page.evaluate(SHOW_WIDGET, [str(widget._esm), {**state, "time": 4.5}, samples])
        page.frame_locator("iframe").locator(".robot canvas").wait_for()
        page.wait_for_timeout(3000)
        keep(page, "notebook")
        page.close()


SHOTS: dict[str, Callable[[Browser], None]] = {
    "light": lambda browser: whole(browser, "light"),
    "dark": lambda browser: whole(browser, "dark"),
    "editor light": lambda browser: robot_editor(browser, "light"),
    "editor dark": lambda browser: robot_editor(browser, "dark"),
    "script": script,
    "library": library,
    "dialog": dialog,
    "model light": lambda browser: model(browser, "light"),
    "model dark": lambda browser: model(browser, "dark"),
    "moments": moments,
    "scopes": scopes,
    "notebook": notebook,
}


def main(names: Sequence[str]) -> None:
    """Take the named pictures, or all."""
    path = shutil.which("chromium") or shutil.which("google-chrome")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
        for name in names or SHOTS:
            SHOTS[name](browser)
        browser.close()


if __name__ == "__main__":
    main(sys.argv[1:])

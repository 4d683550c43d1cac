"""Running a model in the browser: tuning, stepping, measurements, comparison, logging."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from building import DIALOG, keep_view, play_slowly, select_block, wait_until
from playwright.sync_api import Locator, Page, expect

import armblocks as ab
from conftest import Studio

Opened = Callable[[ab.Diagram], Page]
GAIN, LAG = 2.0, 1.0


def lag_model(name: str) -> ab.Diagram:
    """A step at 1 s of height 2 through a lag of 1 s, in a Scope of two inputs."""
    builder = ab.DiagramBuilder(name, settings=ab.SimulationOptions(stop_time=10.0))
    step = builder.add("step", ab.blocks.Step(time=1.0))
    gain = builder.add("gain", ab.blocks.Gain(gain=GAIN), step["y"])
    lag = builder.add("lag", ab.blocks.FirstOrderLag(time_constant=LAG), gain["y"])
    builder.add("scope", ab.blocks.Scope(inputs=2), gain["y"], lag["y"])
    builder.add("display", ab.blocks.Display(), lag["y"])
    return builder.build()


@pytest.fixture(scope="module")
def opened(open_studio: Callable[[str], Page], studio: Studio) -> Opened:
    """One page for all tests; each test opens its own model."""
    page = open_studio("van_der_pol_pid")

    def opening(diagram: ab.Diagram) -> Page:
        file = f"{diagram.name}.json"
        ab.save_diagram(diagram, studio.folder / file)
        page.bring_to_front()
        page.keyboard.press("Escape")
        page.keyboard.press("Control+o")
        dialog = page.locator(DIALOG)
        dialog.get_by_role("textbox", name="Search the files").fill(file)
        dialog.get_by_text(file, exact=True).first.click()
        expect(page.locator(".title")).to_have_text(diagram.name)
        page.locator(".react-flow__node").first.wait_for()
        tab(page, "Scopes")
        return page

    return opening


def run(page: Page) -> None:
    page.keyboard.press("Control+Enter")
    expect(page.locator(".run-state")).to_contain_text("done", ignore_case=True)


def run_slowly(page: Page, speed: str) -> None:
    page.get_by_role("combobox", name="Speed").select_option(f"{speed} × real time")
    page.keyboard.press("Control+Enter")
    expect(page.locator(".run-state")).to_contain_text("running", ignore_case=True)


def tab(page: Page, title: str) -> None:
    page.locator(".dock .tab").get_by_text(title, exact=True).click()


def select(page: Page, block: str) -> None:
    page.locator(f'.react-flow__node[data-id="{block}"]').click()


def shown_time(page: Page) -> float:
    return float(page.locator(".timeline .instant").inner_text().removesuffix(" s"))


def number(text: str) -> float:
    return float(text.replace("−", "-").split()[0])


def test_a_run_is_tuned_and_rewound_and_the_tuned_value_kept(opened: Opened) -> None:
    page = opened(lag_model("tuned"))
    tab(page, "Tune")
    select(page, "gain")
    run_slowly(page, "0.1")
    field = page.get_by_role("textbox", name="gain.gain", exact=True)
    wait_until(page, lambda: shown_time(page) > 0.05)
    field.fill("3")
    field.press("Enter")
    page.get_by_role("button", name="Pause").click()
    expect(page.locator(".run-state")).to_contain_text("paused", ignore_case=True)
    before = shown_time(page)
    assert float(page.locator(".run-state").inner_text().split("×")[0].split()[-1]) <= 0.1
    page.get_by_role("button", name="Step back").click()
    wait_until(page, lambda: shown_time(page) < before)
    page.get_by_role("slider", name="Time").focus()
    page.keyboard.press("Home")
    page.keyboard.press("ArrowRight")
    expect(page.locator(".timeline .instant")).to_have_text("0.010 s")
    page.get_by_role("button", name="Return to this time").click()
    expect(page.get_by_role("button", name="Return to this time")).to_be_hidden()
    wait_until(page, lambda: shown_time(page) <= 0.02)
    page.get_by_role("combobox", name="Speed").select_option("as fast as possible")
    page.get_by_role("button", name="Resume").click()
    expect(page.locator(".run-state")).to_contain_text("done", ignore_case=True)
    # The tuned value applies from the time to which the run has returned.
    expect(page.locator(".display-value")).to_have_text(re.compile(r"^(3\.000|2\.999)$"))
    page.get_by_role("button", name="Keep in the model").click()
    expect(page.get_by_text("not in the model")).to_be_hidden()
    undo = page.get_by_role("button", name="Undo keep 1 tuned value (Ctrl+Z)")
    expect(undo).to_be_enabled()
    undo.click()
    expect(field).to_have_value("2")


def test_two_runs_are_compared(opened: Opened) -> None:
    page = opened(lag_model("compared"))
    run(page)
    tab(page, "Tune")
    select(page, "lag")
    field = page.get_by_role("textbox", name="lag.time_constant", exact=True)
    field.fill("0.5")
    field.press("Enter")
    run(page)
    tab(page, "Signals")
    expect(page.locator(".stored-run")).to_have_count(2)
    expect(page.locator(".stored-run").first).to_contain_text("lag.time_constant = 0.5")
    expect(page.locator(".stored-run").last).not_to_contain_text("time_constant")
    page.get_by_role("combobox", name="View").select_option("Side by side")
    charts = page.locator(".signal-inspector .chart")
    expect(charts).to_have_count(2)
    expect(charts.locator("figcaption b")).to_have_text([re.compile("Run"), re.compile("Run")])
    one, other = (axis_numbers(page, chart) for chart in charts.all())
    assert one == other, "both charts have the same axes"
    page.get_by_role("combobox", name="View").select_option("Difference")
    model = lag_model("compared")
    one, other = ab.simulate(model), ab.simulate(model, parameters={"lag.time_constant": 0.5})
    deviation = np.abs(other["lag/y"] - one["lag/y"])
    row = page.locator(".signals label", has_text="lag")
    message = row.locator(".deviation")
    expect(message).to_contain_text("✗")
    numbers = re.findall(r"[\d.]+", message.inner_text())
    np.testing.assert_allclose(float(numbers[0]), deviation.max(), rtol=5e-3)
    np.testing.assert_allclose(float(numbers[1]), one.time[deviation.argmax()], rtol=5e-3)
    expect(page.locator(".signals label", has_text="gain").locator(".deviation")).to_contain_text("✓ 0")
    page.get_by_role("textbox", name="Tolerance").fill("1")
    expect(message).to_contain_text("✓")
    page.get_by_role("textbox", name="Search the signals").fill("LAG")
    expect(page.locator(".signals label")).to_have_count(1)
    name = page.locator(".stored-run").last.get_by_role("textbox", name="Name of Run")
    name.fill("slow")
    name.press("Enter")
    page.get_by_role("button", name="Delete slow").click()
    expect(page.locator(".stored-run")).to_have_count(1)


def test_parameter_sets_are_saved_applied_and_compared(opened: Opened, studio: Studio) -> None:
    page = opened(lag_model("varied"))
    tab(page, "Tune")

    def chosen_set(name: str) -> None:
        page.get_by_role("button", name="Parameter set:").click()
        page.get_by_role("menuitemcheckbox", name=name, exact=True).click()

    def save_as(name: str) -> None:
        page.get_by_role("button", name="Parameter set:").click()
        page.get_by_role("menuitem", name=re.compile("sets? …")).click()
        dialog = page.locator(DIALOG)
        dialog.get_by_role("textbox", name="Name of a new set").fill(name)
        page.keyboard.press("Enter")
        expect(dialog.get_by_role("columnheader", name=name)).to_be_visible()
        page.keyboard.press("Escape")
        expect(dialog).to_have_count(0)

    select(page, "gain")
    field = page.get_by_role("textbox", name="gain.gain", exact=True)
    field.fill("6")
    field.press("Enter")
    save_as("large")
    chosen_set("Values of the model")
    expect(field).to_have_value("2")
    select(page, "lag")
    lag = page.get_by_role("textbox", name="lag.time_constant", exact=True)
    lag.fill("0.1")
    lag.press("Enter")
    save_as("fast")
    chosen_set("large")
    run(page)
    value = page.locator(".display-value", has_text=re.compile(r"\d")).first
    assert number(value.inner_text()) == pytest.approx(6 * (1 - math.exp(-9)), rel=1e-3)

    # A set becomes part of the model in one step, and the file contains all sets.
    page.keyboard.press("Control+k")
    page.keyboard.type("parameter sets")
    page.keyboard.press("Enter")
    dialog = page.locator(DIALOG)
    expect(dialog.get_by_role("textbox", name="Name of a new set")).to_be_focused()
    row = dialog.get_by_role("row", name="gain.gain")
    expect(row.get_by_role("cell")).to_have_text(["2", "2", "6", ""])
    dialog.get_by_role("button", name="Commands for fast").click()
    page.get_by_role("menuitem", name="Put into the model").click()
    expect(dialog.get_by_role("row", name="lag.time_constant").get_by_role("cell").first).to_have_text("0.1")
    page.keyboard.press("Escape")
    page.keyboard.press("Control+s")
    expect(page.get_by_role("button", name="Undo apply the parameter set fast (Ctrl+Z)")).to_be_visible()
    file = studio.folder / "varied.json"
    wait_until(page, lambda: "parameter_sets" in file.read_text(encoding="utf-8"))
    saved_diagram = ab.load_diagram(file)
    assert dict(saved_diagram.parameter_sets["fast"]) == {"gain.gain": 2.0, "lag.time_constant": 0.1}
    assert dict(saved_diagram.parameter_sets["large"]) == {"gain.gain": 6.0}
    assert saved_diagram.blocks["lag"].parameter_value("time_constant") == 0.1


def test_parameter_sets_are_updated_renamed_and_removed_in_their_dialog(opened: Opened) -> None:
    page = opened(lag_model("edited sets"))
    tab(page, "Tune")
    select(page, "gain")
    field = page.get_by_role("textbox", name="gain.gain", exact=True)
    dialog = page.locator(DIALOG)

    def show_sets(*, tried: str = "") -> None:
        if tried:
            field.fill(tried)
            field.press("Enter")
        page.keyboard.press("Control+k")
        page.get_by_role("textbox", name="Command").fill("parameter sets")
        page.keyboard.press("Enter")
        expect(dialog.get_by_role("textbox", name="Name of a new set")).to_be_visible()

    def command(name: str, entry: str) -> None:
        dialog.get_by_role("button", name=f"Commands for {name}", exact=True).click()
        page.get_by_role("menuitem", name=entry).click()

    show_sets(tried="6")
    dialog.get_by_role("textbox", name="Name of a new set").fill("large")
    page.keyboard.press("Enter")
    row = dialog.get_by_role("row", name="gain.gain")
    expect(row.get_by_role("cell")).to_have_text(["2", "6", ""])
    page.keyboard.press("Escape")
    expect(dialog).to_have_count(0)

    show_sets(tried="7")
    command("large", "Update with the tried values")
    expect(row.get_by_role("cell")).to_have_text(["2", "7", ""])
    expect(dialog.get_by_role("button", name="Try large")).to_have_attribute("aria-pressed", "true")

    # A name that is not valid leaves the field open; Escape closes the field, not the dialog.
    command("large", "Rename")
    name = dialog.get_by_role("textbox", name="New name of large")
    expect(name).to_be_focused()
    name.fill("other")
    page.keyboard.press("Escape")
    expect(name).to_have_count(0)
    expect(dialog.get_by_role("button", name="Try large")).to_be_visible()
    command("large", "Rename")
    name.fill("very large")
    page.keyboard.press("Enter")
    expect(dialog.get_by_role("button", name="Try very large")).to_have_attribute("aria-pressed", "true")

    command("very large", "Remove")
    expect(dialog.get_by_role("table")).to_have_count(0)
    page.keyboard.press("Escape")
    expect(dialog).to_have_count(0)
    page.keyboard.press("Control+z")
    show_sets()
    expect(row.get_by_role("cell")).to_have_text(["2", "7", ""])
    page.keyboard.press("Escape")
    expect(dialog).to_have_count(0)


def axis_numbers(page: Page, chart: Locator) -> list[str]:
    """The numbers at the axes of a chart, from its exported SVG file."""
    with page.expect_download() as downloading:
        chart.get_by_role("button", name=re.compile("^Export")).click()
        page.get_by_role("menuitem", name="Picture as SVG").click()
    svg = ElementTree.fromstring(Path(downloading.value.path()).read_bytes())
    return [text for text in svg.itertext() if re.fullmatch(r"[−\d.]+", text)]


def saved(page: Page, scope: str, entry: str) -> bytes:
    """The exported file of a scope."""
    page.get_by_role("button", name=f"Export {scope}", exact=True).click()
    with page.expect_download() as download:
        page.get_by_role("menuitem", name=entry).click()
    return Path(download.value.path()).read_bytes()


def measured(table: Locator, signal: str) -> dict[str, str]:
    row = table.locator("tbody tr", has=table.page.locator("th", has_text=re.compile(f"^{signal}")))
    expect(row).to_be_visible()
    heads = table.locator("thead th").all_inner_texts()
    return dict(zip(heads[1:], row.locator("td").all_inner_texts()))


def test_scope_measurements_equal_the_closed_form(opened: Opened) -> None:
    page = opened(lag_model("measured"))
    run(page)
    page.get_by_role("button", name="Measures of the visible range").click()
    table = page.locator(".measures table")
    lag = measured(table, "lag")
    assert number(lag["min"]) == 0.0
    np.testing.assert_allclose(number(lag["max"]), GAIN, rtol=1e-3)
    # The step is at 1 s: over 10 s the mean of K (1 - exp(-t/T)) is K (9 - T (1 - exp(-9/T))) / 10.
    left = 9.0 - LAG * (1.0 - np.exp(-9.0 / LAG))
    np.testing.assert_allclose(number(lag["mean"]), GAIN * left / 10.0, rtol=1e-3)
    square = GAIN**2 * (9.0 - 2.0 * LAG * (1.0 - np.exp(-9.0)) + LAG / 2.0 * (1.0 - np.exp(-18.0))) / 10.0
    np.testing.assert_allclose(number(lag["RMS"]), np.sqrt(square), rtol=1e-3)
    np.testing.assert_allclose(number(lag["rise"]), np.log(9.0) * LAG, rtol=1e-3)
    assert number(lag["over"]) == 0.0
    page.get_by_role("button", name="Measuring cursors").click()
    between = page.locator(".measures .between")
    expect(between).to_contain_text("Δt 3.3333 s")
    expect(between).to_contain_text("1/Δt 300.00 mHz")
    at = {head: number(text) for head, text in measured(table, "lag").items() if head in ("A", "B", "Δ")}
    a, b = (GAIN * (1.0 - np.exp(-(time - 1.0) / LAG)) for time in (10 / 3, 20 / 3))
    np.testing.assert_allclose([at["A"], at["B"], at["Δ"]], [a, b, b - a], rtol=2e-3)
    page.get_by_role("button", name="lag", exact=True).click()
    expect(table.locator("tbody tr")).to_have_count(1)


def test_a_triggered_scope_shows_the_window_about_each_crossing(opened: Opened) -> None:
    builder = ab.DiagramBuilder("triggered", settings=ab.SimulationOptions(stop_time=10.0))
    pulse = builder.add("pulse", ab.blocks.PulseGenerator(period=4.0, delay=1.003))
    builder.add("scope", ab.blocks.Scope(), builder.add("lag", ab.blocks.FirstOrderLag(), pulse))
    page = opened(builder.build())
    run(page)
    page.get_by_role("button", name="Trigger", exact=True).click()
    bar = page.get_by_role("group", name="Trigger")
    bar.get_by_role("combobox", name="Trigger on").select_option(label="pulse")
    for field, text in (("Level", "0.5"), ("Window", "0.5"), ("Trigger at", "25")):
        bar.get_by_role("textbox", name=field).fill(text)
    # Each jump across the level is one trigger, at the exact time of the jump.
    expect(bar.locator(".shown-trigger")).to_contain_text("3 of 3 at 9.00300 s")
    bar.get_by_role("button", name="Previous trigger").click()
    expect(bar.locator(".shown-trigger")).to_contain_text("2 of 3 at 5.00300 s")
    svg = ElementTree.fromstring(saved(page, "scope", "Picture as SVG"))
    ticks = [number(text) for text in svg.itertext() if re.fullmatch(r"[\d.]+", text) and "." in text]
    assert min(tick for tick in ticks if tick > 2) >= 4.878
    assert max(ticks) <= 5.378
    # The first order lag reaches 0.3 a known time after the step.
    bar.get_by_role("combobox", name="Trigger on").select_option(label="lag")
    bar.get_by_role("textbox", name="Level").fill("0.3")
    bar.get_by_role("combobox", name="Mode").select_option("single")
    expect(bar.locator(".shown-trigger")).to_contain_text(f"Trigger at {1.003 - math.log(0.7):.4f}"[:-1])
    bar.get_by_role("textbox", name="Window").fill("0")
    assert bar.get_by_role("textbox", name="Window").get_attribute("aria-invalid") == "true"
    page.get_by_role("button", name="Trigger", exact=True).click()
    expect(bar).to_have_count(0)


def test_the_trigger_is_saved_with_its_model_and_can_be_undone(opened: Opened, studio: Studio) -> None:
    page = opened(lag_model("untriggered"))
    page = opened(lag_model("with trigger"))
    run(page)
    page.get_by_role("button", name="Trigger", exact=True).click()
    bar = page.get_by_role("group", name="Trigger")
    bar.get_by_role("combobox", name="Trigger on").select_option(label="lag")
    for field, text in (("Level", "0.5"), ("Window", "0.25"), ("Trigger at", "25"), ("Hold-off", "2")):
        bar.get_by_role("textbox", name=field).fill(text)
    bar.get_by_role("combobox", name="Edge").select_option("either")
    bar.get_by_role("combobox", name="Mode").select_option("auto")
    at = f"1 of 1 at {1 - math.log(0.75):.5f}"[:-2]  # the lag reaches a quarter of its final value
    expect(bar.locator(".shown-trigger")).to_contain_text(at)

    # Beside the library and the inspector the settings are in one row.
    tops = bar.locator("input, select").evaluate_all("all => all.map((one) => one.getBoundingClientRect().y)")
    assert len(tops) == 7
    assert max(tops) - min(tops) < 1

    strip = page.get_by_role("tablist", name="Open documents")
    strip.get_by_role("tab", name="untriggered").click()
    expect(page.locator(".title")).to_have_text("untriggered")
    expect(bar).to_have_count(0)
    strip.get_by_role("tab", name="with trigger").click()
    expect(bar.get_by_role("textbox", name="Level")).to_have_value("0.5")

    page.reload()
    page.locator(".react-flow__node").first.wait_for()
    tab(page, "Scopes")
    for field, text in (("Level", "0.5"), ("Window", "0.25"), ("Trigger at", "25"), ("Hold-off", "2")):
        expect(bar.get_by_role("textbox", name=field)).to_have_value(text)
    expect(bar.get_by_role("combobox", name="Edge")).to_have_value("either")
    expect(bar.get_by_role("combobox", name="Mode")).to_have_value("auto")
    expect(bar.locator(".shown-trigger")).to_contain_text(at)

    # The letters typed into a field are one undo step, and undo restores the field.
    bar.get_by_role("textbox", name="Level").fill("0.5")
    bar.get_by_role("textbox", name="Level").press_sequentially("625")
    page.locator(".react-flow__node").first.focus()
    page.keyboard.press("Control+z")
    expect(bar.get_by_role("textbox", name="Level")).to_have_value("0.5")
    page.keyboard.press("Control+s")

    def stored() -> ab.diagram.ScopeTrigger | None:
        return ab.load_diagram(studio.folder / "with trigger.json").scope_trigger

    expected = ab.diagram.ScopeTrigger(
        signal="lag/y", edge="either", level=0.5, mode="auto", span=0.25, position=0.25, hold_off=2.0
    )
    wait_until(page, lambda: stored() == expected)
    # Renamed blocks do not lose the trigger.
    select_block(page, "lag")  # focus() selects a block in Firefox only if the last input was a key
    page.keyboard.press("F2")
    page.keyboard.type("slow")
    page.keyboard.press("Enter")
    expect(bar.locator(".shown-trigger")).to_contain_text(at)
    page.get_by_role("button", name="Trigger", exact=True).click()
    expect(bar).to_have_count(0)


def test_scope_exports_contain_all_samples_and_jumps(opened: Opened) -> None:
    page = opened(lag_model("exported"))
    run(page)
    rows = list(csv.reader(io.StringIO(saved(page, "scope", "Samples as CSV").decode())))
    assert rows[0] == ["time [s]", "gain", "lag"]
    result = ab.simulate(lag_model("exported")).with_jumps()
    expected = np.column_stack([result.time, result["gain/y"], result["lag/y"]])
    np.testing.assert_array_equal(np.array(rows[1:], dtype=float), expected)
    picture = ElementTree.fromstring(saved(page, "scope", "Picture as SVG"))
    assert {"scope", "gain", "lag", "Time, s"} <= {text.text for text in picture.iter() if text.text}
    assert saved(page, "scope", "Picture as PNG").startswith(b"\x89PNG")
    # After a zoom, and with a hidden trace, the part that is shown can be saved.
    page.get_by_role("button", name="Zoom in (wheel)").click()
    page.get_by_role("button", name="gain", exact=True).click()
    rows = list(csv.reader(io.StringIO(saved(page, "scope", "Shown samples as CSV").decode())))
    assert rows[0] == ["time [s]", "lag"]
    np.testing.assert_array_equal(np.array(rows[1:], dtype=float), expected[expected[:, 0] >= 5.0][:, [0, 2]])
    picture = ElementTree.fromstring(saved(page, "scope", "Picture as SVG"))
    texts = {text.text for text in picture.iter() if text.text}
    assert "gain" not in texts
    assert "0" not in texts, "the time axis begins at 5 s"
    page.get_by_role("button", name="Show the whole run").click()


def test_a_click_logs_a_wire_and_pins_its_value(opened: Opened) -> None:
    page = opened(lag_model("logged"))
    ends = [page.locator(f'.react-flow__handle[data-nodeid="{node}"]') for node in ("gain", "lag")]
    expect(ends[1].first).to_be_in_viewport()
    keep_view(page)
    right, left = ends[0].last.bounding_box(), ends[1].first.bounding_box()
    assert right and left
    page.mouse.click((right["x"] + left["x"] + left["width"]) / 2, right["y"] + right["height"] / 2)
    page.get_by_role("button", name="Log", exact=True).click()
    expect(page.locator(".logged-badge")).to_have_count(1)
    page.get_by_role("button", name="Pin the value").click()
    run(page)
    expect(page.locator(".wire-value")).to_have_text("2.000")
    expect(page.locator(".chart figcaption b").get_by_text("gain/y", exact=True)).to_have_count(1)
    play_slowly(page)
    page.get_by_role("slider", name="Time").focus()
    page.keyboard.press("Home")
    expect(page.locator(".wire-value")).to_have_text("0")
    page.keyboard.press("Space")
    expect(page.get_by_role("button", name="Pause the playback")).to_be_visible()
    page.keyboard.press("Space")
    page.keyboard.press("Control+s")
    expect(page.locator(".title")).to_have_text("logged")


def test_configuration_parameters_are_checked_while_typed_and_saved(opened: Opened) -> None:
    page = opened(lag_model("configured"))
    page.keyboard.press("Control+e")
    step = page.get_by_role("textbox", name="Fixed step")
    step.fill("20")
    expect(page.get_by_text("at most the stop time 10 s")).to_be_visible()
    expect(page.get_by_role("button", name="OK", exact=True)).to_be_disabled()
    step.fill("1/100")
    page.get_by_role("combobox", name="Solver").select_option("rk4")
    expect(page.get_by_role("button", name="OK", exact=True)).to_be_enabled()
    page.get_by_role("button", name="OK", exact=True).click()
    expect(page.get_by_role("dialog")).to_be_hidden()
    run(page)
    page.keyboard.press("Control+e")
    expect(page.get_by_text("The last run used rk4")).to_be_visible()
    expect(step).to_have_value("0.01")
    page.keyboard.press("Escape")


def test_all_samples_of_16_channels_at_10_khz_arrive(opened: Opened) -> None:
    builder = ab.DiagramBuilder("channels", settings=ab.SimulationOptions(stop_time=1.0, sample_time=1e-4))
    for k in range(16):
        wave = builder.add(f"wave {k}", ab.blocks.SineWave(frequency=5.0 + k, amplitude=1.0 + k))
        builder.add(f"scope {k}", ab.blocks.Scope(), wave["y"])
    diagram = builder.build()
    page = opened(diagram)
    page.get_by_role("combobox", name="Speed").select_option("1 × real time")
    page.keyboard.press("Control+Enter")
    expect(page.locator(".run-state")).to_contain_text("done", ignore_case=True)
    result = ab.simulate(diagram)
    for k in (0, 15):
        table = io.StringIO(saved(page, f"scope {k}", "Samples as CSV").decode())
        rows = np.loadtxt(table, delimiter=",", skiprows=1)
        np.testing.assert_array_equal(rows, np.column_stack([result.time, result[f"wave {k}/y"]]))

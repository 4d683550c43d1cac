"""The report folder: complete, self-contained, escaped; incomplete runs and errors are marked."""

import dataclasses
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import (
    Constant,
    Display,
    FirstOrderLag,
    Fkine,
    Gain,
    Inport,
    Integrator,
    JTraj,
    Outport,
    Rne,
    RobotPlot,
    Scope,
    SineWave,
    Subsystem,
    T2xyz,
    XYGraph,
)
from armblocks.diagram import DiagramBuilder
from armblocks.equations import SimulationOptions
from armblocks.errors import FormatError, LimitWarning, UnknownNameError
from armblocks.report import write_report
from armblocks.report.figures import file_name, in_display_unit
from armblocks.robot import JointLimits, Robot, serial_chain, standard_dh

VOID_TAGS = {"meta", "br", "img", "link", "rect", "path", "circle", "image"}


class Outline(HTMLParser):
    """The structure of a page: tags, headings, table heads without scope, and unclosed tags."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.tags: list[str] = []
        self.open_tags: list[str] = []
        self.attributes: list[tuple[str, str, str | None]] = []
        self.wrong_end_tags: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += [(tag, name, value) for name, value in attrs]
        if tag not in VOID_TAGS:
            self.open_tags.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += [(tag, name, value) for name, value in attrs]

    def handle_endtag(self, tag: str) -> None:
        if not self.open_tags or self.open_tags.pop() != tag:
            self.wrong_end_tags.append(tag)


def outline(page: Path) -> Outline:
    parsed = Outline()
    parsed.feed(page.read_text(encoding="utf-8"))
    return parsed


def small_run(block_name: str = "wave") -> tuple[ab.Diagram, ab.SimulationResult]:
    builder = DiagramBuilder(block_name, settings=SimulationOptions(stop_time=1.0, sample_time=0.05))
    wave = builder.add(f"{block_name} source", SineWave(amplitude=(1.0, 2.0)))
    total = builder.add("total", Integrator(initial=(0.0, 0.0)), wave)
    builder.add("Scope", Scope(inputs=2), wave, total)
    level = builder.add("level", Constant(value=0.25))
    builder.add("Graph", XYGraph(), level, level)
    builder.add("Display", Display(inputs=2), total, level)
    diagram = builder.build()
    return diagram, ab.simulate(diagram)


@pytest.fixture(scope="module")
def paper(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("paper")
    diagram = ab.load_diagram("kr180model")
    write_report(folder, diagram, ab.simulate(diagram))
    return folder


def test_both_axes_of_an_xy_graph_of_lengths_have_the_same_unit(tmp_path: Path) -> None:
    """0.5 m and 2 m are both shown in m; 0.5 m alone would be shown as 500 mm."""
    arm = serial_chain([standard_dh("reach", a=0.5, d=2.0)])
    builder = ab.DiagramBuilder("reach")
    q = builder.add("q", Constant(value=(0.0,)))
    pose = builder.add("pose", Fkine(robot=Robot(name="reach", links=arm)), q)
    place = builder.add("place", T2xyz(), pose)
    builder.name_signal(place["z"], "height")
    builder.add("Side", XYGraph(), place["x"], place["z"])
    diagram = builder.build()
    write_report(tmp_path, diagram, ab.simulate(diagram))
    figure = (tmp_path / "figures" / "xy-side.svg").read_text()
    assert "place/x, m<" in figure
    assert "height, m<" in figure  # the name of the signal


def test_the_papers_report_is_complete(paper: Path) -> None:
    figures = {path.name for path in (paper / "figures").iterdir()}
    sinks = ("xy-xy-graph", "xy-xz-graph", "xy-yz-graph", "scope-joint-angles", "scope-joint-torques")
    for name in ("moments", "tool-path", "joints", *sinks):
        assert {f"{name}.svg", f"{name}.png"} <= figures
    for name in ("report.html", "diagram.svg", "data.csv", "data.parquet"):
        assert (paper / name).stat().st_size > 1000
    assert (paper / "report.html").stat().st_size < 3_000_000


def test_the_page_contains_the_results_of_the_paper(paper: Path) -> None:
    text = (paper / "report.html").read_text(encoding="utf-8")
    for piece in (
        "33.73",
        "16.87",
        "−2.94927874",
        "1.25469877",
        "2.34792904",
        "No rigid body has this inertia",
    ):
        assert piece in text


def test_the_page_needs_no_network_and_no_script(paper: Path) -> None:
    parsed = outline(paper / "report.html")
    assert not {"script", "iframe", "object", "embed", "base"} & set(parsed.tags)
    assert ("meta", "http-equiv", "Content-Security-Policy") in parsed.attributes
    for tag, name, value in parsed.attributes:
        if name in ("src", "href") and value is not None:
            assert value.startswith(("data:image/png;base64,", "#")), (tag, value[:60])
        assert not name.startswith("on")
    assert not re.search(r"https?://(?!www\.w3\.org/2000/svg)", (paper / "report.html").read_text("utf-8"))


def test_the_page_is_well_formed_and_accessible(paper: Path) -> None:
    parsed = outline(paper / "report.html")
    assert parsed.wrong_end_tags == [] and parsed.open_tags == []
    headings = [tag for tag in parsed.tags if re.fullmatch("h[1-6]", tag)]
    assert headings[0] == "h1" and headings.count("h1") == 1 and "h3" in headings
    identifiers = [value for _, name, value in parsed.attributes if name == "id"]
    assert len(identifiers) == len(set(identifiers))
    for _, name, value in parsed.attributes:
        if name in ("aria-labelledby", "aria-describedby"):
            assert value in identifiers
    assert parsed.tags.count("th") == sum(name == "scope" for _, name, _ in parsed.attributes)


def test_the_same_run_gives_the_same_bytes(tmp_path: Path) -> None:
    diagram, result = small_run()
    for name in ("a", "b"):
        write_report(tmp_path / name, diagram, result)
    for path in sorted((tmp_path / "a").rglob("*")):
        if path.is_file() and path.suffix != ".parquet":
            assert path.read_bytes() == (tmp_path / "b" / path.relative_to(tmp_path / "a")).read_bytes()


def test_user_defined_names_are_escaped(tmp_path: Path) -> None:
    diagram, result = small_run("<img src=x onerror=alert(1)>")
    files = write_report(tmp_path, diagram, result)
    parsed = outline(files.page)
    assert "img" not in parsed.tags
    for path in (files.page, files.diagram, *(p for p in files.figures if p.suffix == ".svg")):
        assert "<img" not in path.read_text(encoding="utf-8")


def test_only_the_requested_formats_are_written(tmp_path: Path) -> None:
    diagram, result = small_run()
    files = write_report(tmp_path, diagram, result, formats=("svg",), data=("npz",))
    assert {path.suffix for path in files.figures} == {".svg"}
    assert [path.name for path in files.data] == ["data.npz"]
    assert {path.name for path in tmp_path.iterdir()} == {"figures", "diagram.svg", "data.npz", "report.html"}
    assert not list(tmp_path.rglob("*.tmp"))


def test_unknown_formats_are_refused_before_anything_is_written(tmp_path: Path) -> None:
    diagram, result = small_run()
    with pytest.raises(UnknownNameError, match="there is no figure format named 'pdf'"):
        write_report(tmp_path / "out", diagram, result, formats=("pdf",))
    with pytest.raises(UnknownNameError, match="there is no data format named 'xlsx'"):
        write_report(tmp_path / "out", diagram, result, data=("xlsx",))
    assert not (tmp_path / "out").exists()


def test_the_error_for_an_unwritable_folder_names_it(tmp_path: Path) -> None:
    diagram, result = small_run()
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(FormatError, match="the report cannot be written") as caught:
        write_report(tmp_path / "file" / "report", diagram, result)
    assert "file" in str(caught.value) and "give another folder or change its permissions" in str(
        caught.value
    )
    (tmp_path / "out" / "report.html").mkdir(parents=True)
    with pytest.raises(FormatError, match="the path is an existing folder"):
        write_report(tmp_path / "out", diagram, result)


def test_a_run_that_stopped_early_is_marked(tmp_path: Path) -> None:
    diagram, result = small_run()
    stopped = dataclasses.replace(result.run, complete=False, message="Stopped by Ctrl-C.")
    files = write_report(tmp_path, diagram, dataclasses.replace(result, run=stopped))
    text = files.page.read_text(encoding="utf-8")
    assert "Incomplete: the run stopped at t = 1 s" in text and "Stopped by Ctrl-C." in text


def test_a_run_of_one_instant_has_a_report(tmp_path: Path) -> None:
    diagram, result = small_run()
    first = dataclasses.replace(
        result, time=result.time[:1], signals=result.signals[:, :1], states=result.states[:1]
    )
    files = write_report(tmp_path, diagram, first)
    assert files.figures == () and files.page.exists()


@pytest.mark.parametrize("amplitude", [1.7e308, 1e-320])
def test_signals_of_any_size_have_a_report(tmp_path: Path, amplitude: float) -> None:
    builder = DiagramBuilder("sizes")
    wave = builder.add("wave", SineWave(frequency=2.0))
    scaled = builder.add("scaled", Gain(gain=amplitude), wave)
    builder.add("scope", Scope(), scaled)
    builder.add("xy", XYGraph(), wave, scaled)
    model = builder.build()
    files = write_report(tmp_path, model, ab.simulate(model, stop_time=5.0), formats=["svg"])
    assert re.search(r"[ ,\"](nan|inf)", files.page.read_text()) is None


def test_an_exceeded_limit_is_described_and_highlighted(tmp_path: Path, puma560: Robot) -> None:
    limited_robot = puma560.with_link(
        "link1", joint=dataclasses.replace(puma560.links[0].joint, limits=JointLimits(position=(-0.1, 0.2)))
    )
    builder = DiagramBuilder("tight", settings=SimulationOptions(stop_time=1.0, sample_time=0.02))
    plan = builder.add("plan", JTraj(q0=(0.0,) * 6, qf=(0.5,) * 6, tmax=1.0))
    builder.add("plot", RobotPlot(robot=limited_robot), plan["q"])
    builder.add("rne", Rne(robot=limited_robot), plan["q"], plan["qd"], plan["qdd"])
    diagram = builder.build()
    with pytest.warns(LimitWarning, match="joint 'link1' leaves its range"):
        result = ab.simulate(diagram)
    files = write_report(tmp_path, diagram, result, formats=("svg",))
    text = files.page.read_text(encoding="utf-8")
    assert "Limit exceeded: joint &#39;link1&#39; leaves its range" in text
    assert 'class="bad"' in text and "over limit from" in text


def test_sinks_with_similar_names_have_separate_files(tmp_path: Path) -> None:
    builder = DiagramBuilder("twins", settings=SimulationOptions(stop_time=1.0, sample_time=0.1))
    wave = builder.add("wave", SineWave())
    for name in ("view 1", "view-1", "view_1"):
        builder.add(name, Scope(), wave)
    diagram = builder.build()
    files = write_report(tmp_path, diagram, ab.simulate(diagram), formats=("svg",))
    names = [path.name for path in files.figures]
    assert names == ["scope-view-1.svg", "scope-view-1-2.svg", "scope-view-1-3.svg"]


@pytest.mark.parametrize(
    ("name", "expected"),
    [("Joint angles", "joint-angles"), ("../etc", "etc"), ("機械", "unnamed"), ("", "unnamed")],
)
def test_file_names_of_figures_are_sanitised(name: str, expected: str) -> None:
    assert file_name(name) == expected


@pytest.mark.parametrize(
    ("value", "unit", "shown", "shown_unit"),
    [
        (np.pi, "rad", 180.0, "deg"),
        (2000.0, "N m", 2.0, "kN m"),
        (2000.0, "", 2000.0, ""),
        (1.0, "rad/s2", 57.3, "deg/s²"),
    ],
)
def test_quantities_are_shown_in_display_units(
    value: float, unit: str, shown: float, shown_unit: str
) -> None:
    values, unit_text = in_display_unit(np.array([value]), unit)
    assert (values[0], unit_text) == (pytest.approx(shown, rel=1e-3), shown_unit)


def nested_run() -> tuple[ab.Diagram, ab.SimulationResult]:
    """Two subsystems with equal diagrams, and one with a different diagram."""
    filtered = DiagramBuilder("axis")
    entering = filtered.add("u", Inport(port=1))
    filtered.add("y", Outport(port=1), filtered.add("first-order <lag>", FirstOrderLag(), entering))
    scaled = DiagramBuilder("axis")
    scaled.add("y", Outport(port=1), scaled.add("twice", Gain(gain=2.0), scaled.add("u", Inport(port=1))))
    builder = DiagramBuilder("cell", settings=SimulationOptions(stop_time=1.0, sample_time=0.1))
    wave = builder.add("wave", SineWave())
    axes = [
        builder.add(f"axis {number}", Subsystem(diagram=part.build()), wave)
        for number, part in enumerate((filtered, filtered, scaled), start=1)
    ]
    builder.add("scope", Scope(inputs=3), *axes)
    diagram = builder.build()
    return diagram, ab.simulate(diagram)


def test_every_different_sheet_is_in_the_report(tmp_path: Path) -> None:
    write_report(tmp_path, *nested_run())
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert re.findall(r"<summary>(.*?)</summary>", text) == ["axis 1", "axis 3"]
    assert "The following subsystems have the same content: axis 2." in text
    assert "first-order &lt;lag&gt;" in text and "twice (Gain)" in text
    assert not outline(tmp_path / "report.html").wrong_end_tags


def test_a_report_of_a_thinned_log_states_the_number_of_shown_rows(tmp_path: Path) -> None:
    builder = DiagramBuilder("long", settings=SimulationOptions(stop_time=40.0, sample_time=1e-3))
    builder.add("scope", Scope(), builder.add("wave", SineWave()))
    diagram = builder.build()
    result = ab.simulate(diagram, log=tmp_path / "all.parquet")
    assert result.time.size < 40_001
    write_report(tmp_path, diagram, result, formats=(), data=())
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "of 40 001 samples" in text.replace("\u202f", " ").replace("\u00a0", " ")

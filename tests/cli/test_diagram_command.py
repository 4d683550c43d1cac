"""``armblocks diagram``: drawings of sheets as files, and rejected arguments."""

from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import Result

import armblocks as ab
from armblocks.blocks import Gain, Inport, Outport, Scope, SineWave
from armblocks.diagram import Connection, Diagram, DiagramBuilder, PortRef, Subsystem
from armblocks.drawing import DRAWING_FORMATS, drawing_bytes

Invoke = Callable[..., Result]
FIRST_BYTES = {"svg": b"<?xml", "png": b"\x89PNG", "pdf": b"%PDF-"}


def nested_diagram() -> Diagram:
    inner = DiagramBuilder("amplifier")
    inner.add("Out1", Outport(), inner.add("twice", Gain(gain=2.0), inner.add("In1", Inport())))
    builder = DiagramBuilder("outer")
    builder.add(
        "scope",
        Scope(),
        builder.add("amplifier", Subsystem(diagram=inner.build()), builder.add("a", SineWave())),
    )
    return builder.build()


@pytest.mark.parametrize("kind", DRAWING_FORMATS)
def test_every_format_is_written_and_two_drawings_are_equal(
    invoke: Invoke, tmp_path: Path, kind: str
) -> None:
    result = invoke("diagram", "van_der_pol_pid", "-o", f"drawn.{kind}")
    assert result.exit_code == 0, result.output
    assert result.stdout == f"wrote drawn.{kind}\n"
    written = (tmp_path / f"drawn.{kind}").read_bytes()
    assert written.startswith(FIRST_BYTES[kind])
    assert written == drawing_bytes(ab.load_diagram("van_der_pol_pid"), kind)


def test_the_sheet_option_draws_the_blocks_of_a_subsystem(invoke: Invoke, tmp_path: Path) -> None:
    ab.save_diagram(nested_diagram(), tmp_path / "outer.json")
    assert invoke("diagram", "outer.json", "--sheet", "amplifier", "--dark").exit_code == 0
    text = (tmp_path / "outer-amplifier.svg").read_text(encoding="utf-8")
    assert "twice (Gain)" in text and "scope (Scope)" not in text
    assert "prefers-color-scheme" not in text


def test_drawings_in_dark_and_light_differ(tmp_path: Path) -> None:
    diagram = nested_diagram()
    for kind in DRAWING_FORMATS:
        assert drawing_bytes(diagram, kind, theme="light") != drawing_bytes(diagram, kind, theme="dark")


def test_unknown_sheets_and_suffixes_are_refused(invoke: Invoke, tmp_path: Path) -> None:
    ab.save_diagram(nested_diagram(), tmp_path / "outer.json")
    result = invoke("diagram", "outer.json", "--sheet", "amplifer")
    assert result.exit_code == 2
    assert "sheet" in result.stderr and "amplifier" in result.stderr
    result = invoke("diagram", "outer.json", "-o", "out.bmp")
    assert result.exit_code == 2
    assert "drawing format" in result.stderr and "pdf, png, svg" in result.stderr
    assert not (tmp_path / "out.bmp").exists()


def test_an_unfinished_diagram_is_drawn() -> None:
    """The inputs are not connected yet, so that the types of the signals are unknown."""
    wire = Connection(PortRef("gain", "y"), PortRef("scope", "u1"))
    draft = Diagram(name="draft", blocks={"gain": Gain(), "scope": Scope(inputs=2)}, connections=(wire,))
    assert b"gain (Gain)" in drawing_bytes(draft, "svg")


def test_rates_have_colours_and_a_legend(invoke: Invoke, tmp_path: Path) -> None:
    """The example has a 10 kHz and a 1 kHz loop."""
    assert invoke("diagram", "puma560_multirate", "--rates", "-o", "rates.svg").exit_code == 0
    text = (tmp_path / "rates.svg").read_text(encoding="utf-8")
    assert ">D1: 100 µs<" in text and ">D2: 1 ms<" in text
    assert ">D1<" in text and ">D2<" in text
    assert ">D1<" not in drawing_bytes(ab.load_diagram("puma560_multirate"), "svg").decode()

"""``armblocks blocks`` lists and documents the blocks, and saves their worked examples."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import Result

import armblocks as ab
from armblocks.blocks import BLOCKS
from armblocks.diagram import Block
from armblocks.formats import diagram_to_python
from armblocks.studio.sheet.drawing_data import library
from worked_examples import worked_example

Invoke = Callable[..., Result]


def test_the_documentation_of_a_block_has_equation_ports_units_and_parameters(invoke: Invoke) -> None:
    text = invoke("blocks", "Chirp").stdout
    assert "Chirp  (Chirp Signal; sources)" in text
    assert "y = sin(2 pi (f1 t + (f2 - f1) t^2 / (2 T)))" in " ".join(text.split())
    for words in ("initial_frequency", "Hz", "(tunable)", "outputs", "builder.add("):
        assert words in text


def test_lists_of_a_documentation_stay_lists(invoke: Invoke) -> None:
    text = invoke("blocks", "PID").stdout
    assert "\n\n- clamping stops the integral" in text
    assert "\n- back_calculation adds" in text
    (pid,) = (entry for entry in library() if entry.type == "PID")
    assert "\n\n• clamping stops the integral while it drives the output further beyond a limit.\n•" in (
        pid.documentation
    )
    # Paragraphs are refilled, and formulas keep their lines.
    for kind in BLOCKS.values():
        for paragraph in kind.documentation():
            assert paragraph.startswith("    ") or all(
                line.startswith("- ") for line in paragraph.splitlines()[1:]
            )


def test_a_block_is_found_by_its_title_and_in_any_case(invoke: Invoke) -> None:
    assert invoke("blocks", "xy graph").stdout == invoke("blocks", "XYGraph").stdout


def test_an_unknown_block_is_refused_with_the_nearest_name(invoke: Invoke) -> None:
    result = invoke("blocks", "Intergrator")
    assert result.exit_code == 2
    assert "there is no block named 'Intergrator'" in result.stderr
    assert "did you mean 'Integrator'?" in result.stderr


def test_without_a_name_all_blocks_are_listed(invoke: Invoke) -> None:
    text = invoke("blocks").stdout
    assert all(f"\n{name} " in text for name in BLOCKS)
    assert all(f"\n{family}" in text for family in BLOCKS.families)
    assert f"{len(BLOCKS)} blocks" in text


def test_a_search_lists_the_blocks_whose_documentation_has_the_words(invoke: Invoke) -> None:
    text = invoke("blocks", "--search", "hysteresis").stdout
    assert "Relay" in text
    assert "Gain" not in text
    for line in text.splitlines()[4:-2]:
        kind = BLOCKS.get(line.split()[0]) if line[:1].isalpha() else None
        assert kind is None or "hysteresis" in (kind.__doc__ or "").casefold()


def test_a_search_without_a_match_is_reported(invoke: Invoke) -> None:
    result = invoke("blocks", "--search", "xyzzy")
    assert result.exit_code == 2
    assert "no block's documentation contains 'xyzzy'" in result.stderr


def test_options_that_exclude_each_other_are_refused(invoke: Invoke) -> None:
    both = invoke("blocks", "Gain", "--search", "gain")
    assert both.exit_code == 2
    assert "the block 'Gain' and the search 'gain' are both given" in both.stderr
    without_name = invoke("blocks", "--save", "gain.json")
    assert without_name.exit_code == 2
    assert "--save needs a block" in without_name.stderr


def test_a_saved_example_is_a_diagram_that_runs(invoke: Invoke, tmp_path: Path) -> None:
    path = tmp_path / "relay.json"
    result = invoke("blocks", "Relay", "--save", str(path))
    assert result.exit_code == 0, result.output
    assert ab.load_diagram(path) == ab.block_example("Relay")
    assert f"armblocks run {path}" in result.stdout


@pytest.mark.parametrize("kind", BLOCKS.values(), ids=BLOCKS)
def test_every_block_is_shown_with_its_example(kind: type[Block], invoke: Invoke) -> None:
    result = invoke("blocks", kind.type_name())
    assert result.exit_code == 0, result.output
    assert kind.summary().split(":")[0] in " ".join(result.stdout.split())
    code = "".join(
        f"    {line}".rstrip() + "\n" for line in diagram_to_python(worked_example(kind)).splitlines()
    )
    assert code in result.stdout

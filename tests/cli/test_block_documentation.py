"""``armblocks blocks NAME`` documents every block, and its examples are Python that makes a diagram."""

from __future__ import annotations

import ast
from collections.abc import Callable

import pytest
from typer.testing import Result

import armblocks as ab
from armblocks.blocks import BLOCKS
from armblocks.cli.blocks import example
from armblocks.diagram import Block, DiagramBuilder, trace_diagram

PUMA = ab.load_robot("puma560").robot
Invoke = Callable[..., Result]


def test_a_block_is_told_with_equation_ports_units_and_parameters(invoke: Invoke) -> None:
    text = invoke("blocks", "Chirp").stdout
    assert "Chirp  (Chirp Signal; sources)" in text
    assert "y = sin(2 pi (f1 t + (f2 - f1) t^2 / (2 T)))" in " ".join(text.split())
    for words in ("initial_frequency", "Hz", "(tunable)", "outputs", "builder.add("):
        assert words in text


def test_a_block_is_found_by_its_title_and_in_any_case(invoke: Invoke) -> None:
    assert invoke("blocks", "xy graph").stdout == invoke("blocks", "XYGraph").stdout


def test_a_wrong_name_is_met_with_the_nearest(invoke: Invoke) -> None:
    result = invoke("blocks", "Intergrator")
    assert result.exit_code == 2
    assert "there is no block named 'Intergrator'" in result.stderr
    assert "did you mean 'Integrator'?" in result.stderr


@pytest.mark.parametrize("kind", BLOCKS.values(), ids=BLOCKS)
def test_every_block_has_documentation_and_an_example(kind: type[Block], invoke: Invoke) -> None:
    result = invoke("blocks", kind.type_name())
    assert result.exit_code == 0, result.output
    assert kind.summary().split(":")[0] in " ".join(result.stdout.split())
    tree = ast.parse("\n".join(line.removeprefix("    ") for line in example(kind).splitlines()))
    builder, added = DiagramBuilder("example"), {}
    for node in tree.body:  # the lines that add blocks, done by hand: tests evaluate no text either
        if isinstance(node, ast.Assign) and "builder.add" in ast.unparse(node):
            call = node.value
            assert isinstance(call, ast.Call)
            name, block, *sources = call.args
            assert isinstance(block, ast.Call)
            values = {entry.arg: entry.value for entry in block.keywords}
            made = {key: PUMA if key == "robot" else ast.literal_eval(value) for key, value in values.items()}
            added[ast.unparse(node.targets[0])] = builder.add(
                ast.literal_eval(name),
                BLOCKS[ast.unparse(block.func)](**made),
                *(added[ast.unparse(source)] for source in sources),
            )
    trace_diagram(builder.build())

"""A worker refuses an invalid model with the same error as opening its file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from armblocks import blocks as kinds
from armblocks.blocks import BLOCKS
from armblocks.diagram import Diagram, DiagramBuilder
from armblocks.errors import ArmblocksError
from armblocks.formats import diagram_from_bytes, diagram_to_bytes, load_robot
from armblocks.studio.runs.worker import begin_run


def open_input() -> Diagram:
    builder = DiagramBuilder("open")
    builder.add("gain", kinds.Gain())
    return builder.draft()


def widths() -> Diagram:
    builder = DiagramBuilder("widths")
    three = builder.add("three", kinds.Constant(value=(1.0, 2.0, 3.0)))
    two = builder.add("two", kinds.Constant(value=(1.0, 2.0)))
    builder.add("sum", kinds.Sum(signs="++"), three, two)
    return builder.draft()


@pytest.mark.parametrize("build", [open_input, widths])
def test_a_worker_and_a_file_give_the_same_error_for_an_invalid_model(
    build: Callable[[], Diagram], tmp_path: Path
) -> None:
    source = diagram_to_bytes(build(), load_robot)
    with pytest.raises(ArmblocksError) as of_file:
        diagram_from_bytes(source, "model", BLOCKS, load_robot)
    with pytest.raises(ArmblocksError) as of_run:
        begin_run({"diagram": source.decode(), "folder": str(tmp_path), "tuned": {}})
    assert type(of_run.value) is type(of_file.value)
    assert of_run.value.what == of_file.value.what
    assert of_run.value.fix == of_file.value.fix

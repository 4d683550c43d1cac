"""Every block has a worked example that runs as a diagram and as its generated Python code."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import BLOCKS
from armblocks.diagram import Block, diagram_views
from armblocks.errors import FormatError, UnknownNameError
from armblocks.face.block_examples import caption
from armblocks.formats import diagram_to_python
from worked_examples import worked_example

WITH_OWN_ROBOT = ("falling_pendulum", "four_bar_spring", "slider_crank")
"""Examples whose robot is a part of the diagram's file."""


def run_as_typed(code: str) -> dict[str, object]:
    """Execute the lines of an example and return the variables."""
    namespace: dict[str, object] = {}
    exec(compile(code, "example", "exec"), namespace)  # noqa: S102
    return namespace


@pytest.mark.filterwarnings("ignore::armblocks.errors.LimitWarning")
@pytest.mark.parametrize("kind", BLOCKS.values(), ids=BLOCKS)
def test_the_worked_example_runs_and_its_python_code_gives_the_same_diagram(kind: type[Block]) -> None:
    diagram = worked_example(kind)
    assert kind in map(type, diagram.blocks.values())
    assert diagram_views(diagram) or kind.type_name() == "Terminator", "the diagram has a view"
    assert caption(kind).endswith((".", "…"))
    typed = run_as_typed(diagram_to_python(diagram))
    assert typed["diagram"] == dataclasses.replace(diagram, description="", settings=ab.SimulationOptions())
    result = typed["result"]
    assert isinstance(result, ab.SimulationResult)
    assert result.run.complete
    assert result.time[-1] == diagram.settings.stop_time or kind.type_name() == "StopSimulation"
    assert all(np.isfinite(result[name]).all() for name in result.names)


@pytest.mark.parametrize("name", [name for name in ab.list_examples() if name not in WITH_OWN_ROBOT])
def test_the_python_code_of_a_shipped_example_gives_the_same_diagram(name: str) -> None:
    diagram = dataclasses.replace(
        ab.load_diagram(name), layout={}, description="", settings=ab.SimulationOptions()
    )
    code, _, run = diagram_to_python(ab.load_diagram(name)).rpartition("\n\n")
    assert run_as_typed(code)["diagram"] == diagram
    assert f"stop_time={ab.load_diagram(name).settings.stop_time}" in run


@pytest.mark.parametrize("name", WITH_OWN_ROBOT)
def test_a_robot_without_name_or_file_cannot_be_written_as_python(name: str) -> None:
    with pytest.raises(
        FormatError, match=r"neither shipped nor loaded from a file.*write the diagram as JSON"
    ):
        diagram_to_python(ab.load_diagram(name))


def test_an_unknown_block_has_no_example() -> None:
    with pytest.raises(UnknownNameError, match="there is no block type named 'Gian'"):
        ab.block_example("Gian")

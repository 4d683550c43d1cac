"""Contract tests of blocks in diagrams: files, runs with changed parameters, refused values.

The diagrams are the worked examples of the blocks, so that a new block is tested automatically.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import BLOCKS
from armblocks.diagram import Block, Diagram, Parameter, ParameterKind
from armblocks.errors import InputError, UnknownNameError
from armblocks.face.block_examples import example_block
from armblocks.formats import diagram_from_bytes, diagram_to_bytes, load_robot
from worked_examples import worked_example

pytestmark = pytest.mark.filterwarnings("ignore::armblocks.errors.LimitWarning")
each_kind = pytest.mark.parametrize("kind", BLOCKS.values(), ids=BLOCKS)

STOP_TIME = 2.0
SI_UNIT = re.compile(
    r"(?:1|(?:kg|g|m|s|rad|deg|A|V|N|J|W|Hz|ohm|K|mol|%|H|Pa|C|F)[2-9]?)"
    r"(?:[ /](?:kg|m|s|rad|A|V|N|J|W|K|mol|H)[2-9]?)*"
)


def changed_value(rule: Parameter, value: object) -> np.ndarray:
    """Return a slightly changed value within the bounds of a tunable parameter; infinity is not changed."""
    array = np.asarray(value, dtype=np.float64)
    finite = np.where(np.isfinite(array), array, 0.0)
    return np.where(
        np.isfinite(array), np.clip(array + 1e-3 * (1.0 + np.abs(finite)), rule.minimum, rule.maximum), array
    )


def test_units_of_ports_and_parameters_are_si_units() -> None:
    for kind in BLOCKS.values():
        block = example_block(kind)
        ports = (*block.input_ports(), *block.output_ports(), *block.record_ports())
        for unit in (*(port.unit for port in ports), *(rule.unit for rule in kind.parameters())):
            assert not unit or SI_UNIT.fullmatch(unit), (kind, unit)


@each_kind
def test_a_file_keeps_the_worked_example(kind: type[Block]) -> None:
    diagram = worked_example(kind)
    data = diagram_to_bytes(diagram, load_robot)
    reread = diagram_from_bytes(data, "example", BLOCKS, load_robot)
    assert reread == diagram
    assert diagram_to_bytes(reread, load_robot) == data


@each_kind
def test_a_run_with_changed_parameters_equals_that_of_the_rebuilt_diagram(kind: type[Block]) -> None:
    diagram = worked_example(kind)
    block = diagram.blocks[diagram.name]
    values = {
        f"{diagram.name}.{rule.name}": changed_value(rule, block.parameter_value(rule.name))
        for rule in kind.parameters()
        if rule.tunable
    }
    if not values:
        return
    retuned = ab.simulate(diagram, parameters=values, stop_time=STOP_TIME, sample_time=0.1)
    rebuilt = ab.simulate(rebuilt_with(diagram, values), stop_time=STOP_TIME, sample_time=0.1)
    for name in rebuilt.names:
        np.testing.assert_array_equal(retuned[name], rebuilt[name], err_msg=name)


def rebuilt_with(diagram: Diagram, values: dict[str, np.ndarray]) -> Diagram:
    """The diagram with its block rebuilt with the given parameter values."""
    block = diagram.blocks[diagram.name]
    own = {path.rpartition(".")[2]: value for path, value in values.items()}
    return dataclasses.replace(
        diagram, blocks={**diagram.blocks, diagram.name: dataclasses.replace(block, **own)}
    )


def wrong_values(rule: Parameter) -> Iterator[object]:
    """Yield values that the rule of a parameter forbids, one for each part of the rule."""
    numeric = rule.kind in (ParameterKind.NUMBER, ParameterKind.ARRAY, ParameterKind.INTEGER)
    yield object()
    if numeric:
        yield from (
            "text",
            None,
            True if rule.kind is not ParameterKind.ARRAY else [[1.0], [1.0, 2.0]],
            float("nan"),
        )
        bounds = [rule.minimum - 1.0, rule.maximum + 1.0] + ([] if rule.above is None else [rule.above])
        yield from (bound for bound in bounds if np.isfinite(bound))
    if numeric and rule.finite:
        yield float("inf")
    if rule.kind is ParameterKind.INTEGER:
        yield 1.5
    if rule.kind is ParameterKind.ARRAY:
        yield np.zeros((1,) * (max(rule.dimensions) + 1))
        if not rule.roots:  # a list of roots may be empty
            yield []
    if rule.kind is ParameterKind.CHOICE:
        yield "no such choice"
    if rule.kind is ParameterKind.BOOLEAN:
        yield 1


@each_kind
def test_a_wrong_value_is_refused_with_the_name_of_the_parameter(kind: type[Block]) -> None:
    block = example_block(kind)
    for rule in kind.parameters():
        for value in wrong_values(rule):
            with pytest.raises((InputError, UnknownNameError)) as caught:
                dataclasses.replace(block, **{rule.name: value})
            assert f"{kind.type_name()}.{rule.name}" in str(caught.value), f"{rule.name} = {value!r}"

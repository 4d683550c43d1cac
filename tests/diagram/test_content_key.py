"""The content key of the disk cache: it changes with everything that the equations depend on."""

from __future__ import annotations

import copy
import dataclasses
import math
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from typing import Any

import casadi
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import armblocks as ab
from armblocks.blocks import BLOCKS, Constant, FromFile, Gain, PythonFunction, Scope, Sum
from armblocks.diagram import (
    Block,
    Diagram,
    Outport,
    Parameter,
    ParameterKind,
    Placement,
    Subsystem,
    content_key,
)
from armblocks.errors import ArmblocksError
from armblocks.robot import Robot
from worked_examples import worked_example


def line(*blocks: Block) -> Diagram:
    """Build a chain of blocks after a Constant."""
    builder = ab.DiagramBuilder("line")
    last = builder.add("start", Constant(value=1.0))
    for k, block in enumerate(blocks):
        last = builder.add(f"b{k}", block, last)
    builder.add("end", Scope(), last)
    return builder.build()


def key_of(*blocks: Block) -> str:
    key = content_key(line(*blocks))
    assert key is not None
    return key


def other_values(rule: Parameter, value: Any) -> Iterator[object]:
    """Yield other values for a parameter; not every value is valid for every block."""
    match rule.kind:
        case ParameterKind.NUMBER | ParameterKind.ARRAY:
            array = np.asarray(value, dtype=np.float64)
            finite = np.where(np.isfinite(array), array, 7.0)
            for changed in (finite * (1 + 2.0**-50), finite + 1.0, finite * 0.5, finite - 1.0, finite * 2.0):
                yield changed if changed.ndim else float(changed)
            if array.ndim == 1:
                yield np.append(finite, finite[-1:] + 1.0)
        case ParameterKind.INTEGER:
            yield from (value + 1, value + 2, value - 1, value * 2)
        case ParameterKind.CHOICE:
            yield from rule.choices
        case ParameterKind.STRING:
            yield from (f"{value}x", f"{value} + 1", f"{value}, more", "other", "u[1]", "++", "-")
        case ParameterKind.BOOLEAN:
            yield not value
        case ParameterKind.ROBOT:
            robot: Robot = value
            yield dataclasses.replace(robot, gravity=(0.0, 0.0, -1.6))
        case ParameterKind.TABLE:
            rows = np.array(value, dtype=np.float64)
            rows[-1, -1] += 1e-9
            yield rows
        case ParameterKind.FUNCTION:
            yield gain_by_default
        case ParameterKind.DIAGRAM:
            yield line(Gain(gain=7.0))


@pytest.mark.parametrize("name", sorted(BLOCKS))
def test_the_key_contains_every_parameter_of_every_block(name: str) -> None:
    diagram = worked_example(BLOCKS[name])
    for path in [path for path, block in diagram.blocks.items() if type(block) is BLOCKS[name]][:1]:
        block = diagram.blocks[path]
        keys: dict[Block, str | None] = {block: content_key(diagram)}
        for rule in block.parameters():
            before = len(keys)
            for value in other_values(rule, block.parameter_value(rule.name)):
                try:
                    checked = rule.check(value, "here")
                except ArmblocksError:
                    continue
                # The key is also defined if the changed block or diagram is invalid.
                changed = copy.copy(block)
                object.__setattr__(changed, rule.name, checked)
                blocks = {**diagram.blocks, path: changed}
                keys.setdefault(changed, content_key(dataclasses.replace(diagram, blocks=blocks)))
            assert len(keys) > before, f"no other value for {rule.name}"
        assert None not in keys.values()
        assert len(set(keys.values())) == len(keys)


values = st.floats(allow_nan=False, allow_infinity=False)


@given(first=st.lists(values, min_size=1, max_size=3), second=st.lists(values, min_size=1, max_size=3))
def test_keys_are_equal_if_and_only_if_all_numbers_are_equal_bit_for_bit(
    first: list[float], second: list[float]
) -> None:
    same = len(first) == len(second) and all(
        a == b and math.copysign(1.0, a) == math.copysign(1.0, b) for a, b in zip(first, second)
    )
    keys = [key_of(*(Gain(gain=value) for value in gains)) for gains in (first, second)]
    assert (keys[0] == keys[1]) == same


def test_the_key_contains_connections_names_and_inner_diagrams() -> None:
    def key_with(swap: bool, name: str, inner: float) -> str | None:
        builder = ab.DiagramBuilder(name)
        one, other = builder.add("one", Constant(value=1.0)), builder.add("other", Constant(value=2.0))
        builder.add("sum", Sum(signs="+-"), *((other, one) if swap else (one, other)))
        inside = ab.DiagramBuilder("inside")
        inside.add("out", Outport(), inside.add("k", Constant(value=inner)))
        builder.add("part", Subsystem(diagram=inside.build()))
        return content_key(builder.build())

    keys = [
        key_with(False, "d", 1.0),
        key_with(True, "d", 1.0),
        key_with(False, "e", 1.0),
        key_with(False, "d", 2.0),
    ]
    assert None not in keys and len(set(keys)) == 4


def test_the_key_ignores_layout_settings_and_the_source_of_a_robot() -> None:
    diagram = ab.load_diagram("kr180model")
    arms = {
        name: dataclasses.replace(block, robot=dataclasses.replace(block.robot, source="elsewhere.json"))  # pyright: ignore[reportAttributeAccessIssue, reportUnknownArgumentType, reportUnknownMemberType]
        for name, block in diagram.blocks.items()
        if hasattr(block, "robot")
    }
    assert arms
    other = dataclasses.replace(
        diagram,
        blocks={**diagram.blocks, **arms},
        description="another",
        layout={"fkine": Placement(x=1.0, y=2.0)},
        settings=dataclasses.replace(diagram.settings, stop_time=3.0),
        extras={"": {"colour": "green"}},
    )
    assert content_key(other) == content_key(diagram)


def test_the_key_contains_the_content_of_a_table() -> None:
    rows = np.array([[0.0, 1.0], [1.0, 3.0], [2.0, -1.0]])

    def key_with(rows: np.ndarray[Any, Any]) -> str | None:
        builder = ab.DiagramBuilder("table")
        builder.add("end", Scope(), builder.add("table", FromFile(data=rows)))
        return content_key(builder.build())

    changed = rows.copy()
    changed[1, 1] = np.nextafter(3.0, 4.0)
    assert key_with(rows) == key_with(rows.copy()) is not None
    assert key_with(rows) != key_with(changed)


STIFFNESS = 3.0


def spring(u: Any) -> Any:
    return -STIFFNESS * u


def spring_by_call(u: Any) -> Any:
    return spring(u) + 1.0


def closure_with_factor(factor: float) -> Callable[[Any], Any]:
    return lambda u: factor * u


def gain_by_default(u: Any, factor: float = 2.0) -> Any:
    return factor * u


def function_of_modules(u: Any) -> Any:
    return casadi.fmax(np.sin(u), math.pi) + sum(value for value in (1.0, 2.0))


def test_the_key_contains_the_code_of_a_function_and_of_all_names_it_uses(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def key_with(function: Callable[..., Any]) -> str:
        return key_of(PythonFunction(function=function))

    functions: list[Callable[..., Any]] = [
        spring,
        spring_by_call,
        gain_by_default,
        function_of_modules,
        closure_with_factor(2.0),
        closure_with_factor(3.0),
    ]
    keys = [key_with(function) for function in functions]
    assert len(set(keys)) == len(keys)
    assert keys == [key_with(function) for function in functions]
    assert key_with(closure_with_factor(2.0)) == keys[4]
    monkeypatch.setattr(sys.modules[__name__], "STIFFNESS", 3.5)
    assert key_with(spring) != keys[0] and key_with(spring_by_call) != keys[1]
    monkeypatch.undo()
    assert key_with(spring) == keys[0]
    monkeypatch.setattr(gain_by_default, "__defaults__", (2.5,))
    assert key_with(gain_by_default) != keys[2]


class Law:
    """A class whose content the key cannot represent."""

    factor = 2.0


def with_an_object(u: Any) -> Any:
    return Law.factor * u


def with_an_import(u: Any) -> Any:
    import statistics

    return statistics.mean([1.0, 2.0]) * u


def with_a_file(u: Any) -> Any:
    return np.loadtxt([b"3.0"]).item() * u


def with_random_numbers(u: Any) -> Any:
    return u * np.random.default_rng(1).normal()


@pytest.mark.parametrize("function", [with_an_object, with_an_import, with_a_file, with_random_numbers])
def test_a_function_with_an_unknown_dependency_has_no_key(function: Callable[[Any], Any]) -> None:
    assert content_key(line(PythonFunction(function=function))) is None


def test_a_block_class_outside_the_package_has_no_key() -> None:
    class Doubled(Gain):
        """A block class outside the package."""

    assert content_key(line(Doubled(gain=2.0))) is None


def test_the_key_is_the_same_in_another_process() -> None:
    code = "import armblocks as ab; from armblocks.diagram import content_key as k; " + (
        "print(k(ab.load_diagram('puma560_payload_drop')))"
    )
    key = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONHASHSEED": "1"},
        capture_output=True,
        text=True,
        check=True,
    ).stdout.strip()
    assert key == content_key(ab.load_diagram("puma560_payload_drop"))

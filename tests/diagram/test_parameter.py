"""Values of parameters: checks in the constructor of a block, and conversion to comparable values."""

from __future__ import annotations

import math

import numpy as np
import pytest

from armblocks.blocks import Constant, Fkine, Gain, Integrator, JTraj, MathFunction, MinMax, Step, ToWorkspace
from armblocks.diagram import Block, ParameterKind, parameter
from armblocks.errors import InputError


@pytest.mark.parametrize("value", [3, 3.0, np.float32(3), np.int64(3), np.array(3.0)])
def test_equal_numbers_of_any_type_become_equal_floats(value: object) -> None:
    assert Step(time=value) == Step(time=3.0)
    assert isinstance(Step(time=value).time, float)


def test_arrays_become_tuples_and_blocks_compare_by_content() -> None:
    one, other = Gain(gain=np.array([[1, 2], [3, 4]])), Gain(gain=[[1.0, 2.0], [3.0, 4.0]])
    assert one == other
    assert hash(one) == hash(other)
    assert one.gain == ((1.0, 2.0), (3.0, 4.0))
    assert one != Gain(gain=[1.0, 2.0])


@pytest.mark.parametrize("value", [math.nan, math.inf, "1", None, True, 1j, [1.0]])
def test_a_value_that_is_not_a_finite_number_is_refused(value: object) -> None:
    with pytest.raises(InputError, match=r"Step\.time: the value is .*Allowed: a number, finite"):
        Step(time=value)


@pytest.mark.parametrize("value", [[1.0, math.nan], [[1], [2, 3]], [], "abc", [[[1.0]]], [True], [1j]])
def test_a_value_that_is_not_an_array_of_finite_numbers_is_refused(value: object) -> None:
    with pytest.raises(InputError, match=r"Constant\.value: the value is .*numbers with 0 or 1 or 2 axes"):
        Constant(value=value)


def test_values_outside_the_bounds_are_refused_with_the_bounds() -> None:
    with pytest.raises(InputError, match=r"JTraj\.tmax: the value is 0\. Allowed: a number, > 0"):
        JTraj(tmax=0)
    with pytest.raises(InputError, match=r"MinMax\.inputs: the value is 0\. Allowed: an integer, >= 1"):
        MinMax(inputs=0)


@pytest.mark.parametrize("value", [2.0, True, "2"])
def test_a_value_that_is_not_an_integer_is_refused(value: object) -> None:
    with pytest.raises(InputError, match=r"MinMax\.inputs: the value is"):
        MinMax(inputs=value)


def test_an_unknown_choice_is_refused_with_the_allowed_choices() -> None:
    with pytest.raises(InputError, match=r"the value is 'cosine'\. Allowed: one of 10\^u, abs, "):
        MathFunction(function="cosine")


def test_wrong_types_for_text_and_robot_parameters_are_refused() -> None:
    with pytest.raises(InputError, match=r"ToWorkspace\.variable: the value is 7\. Allowed: text"):
        ToWorkspace(variable=7)
    with pytest.raises(InputError, match=r"Fkine\.robot: the value is 'kr180'\. Allowed: a Robot"):
        Fkine(robot="kr180")


def test_a_value_that_is_not_a_boolean_is_refused() -> None:
    rule = parameter(True, doc="whether").metadata["parameter"]
    assert rule.kind is ParameterKind.BOOLEAN
    assert rule.check(False, "here") is False
    with pytest.raises(InputError, match=r"here: the value is 1. Allowed: true or false"):
        rule.check(1, "here")


def test_a_long_value_is_shortened_in_the_message() -> None:
    with pytest.raises(InputError) as caught:
        Step(time="9" * 10_000)
    assert len(str(caught.value)) < 400


def test_the_kind_of_a_parameter_follows_from_its_default() -> None:
    kinds = {rule.name: rule.kind for rule in JTraj.parameters()}
    assert kinds == {"q0": ParameterKind.ARRAY, "qf": ParameterKind.ARRAY, "tmax": ParameterKind.NUMBER}
    assert all(rule.tunable for rule in JTraj.parameters())
    assert {rule.name: rule.required for rule in Fkine.parameters()} == {"robot": True, "frame": False}
    assert Integrator.parameters()[0].default == 0.0


def test_a_block_field_that_is_not_a_parameter_raises_a_type_error() -> None:
    from dataclasses import dataclass

    @dataclass(frozen=True, kw_only=True)
    class Careless(Block):
        """A block with a plain field."""

        count: int = 3

    with pytest.raises(TypeError, match="field 'count' of a block must be declared with parameter"):
        Careless()

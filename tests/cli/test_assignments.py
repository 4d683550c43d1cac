"""The grammar of ``--set``: accepted values, and the messages for others."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from armblocks.cli.assignments import parse_assignments, parse_value
from armblocks.errors import InputError


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("5", 5.0),
        ("true", True),
        ("-2.5e-3", -2.5e-3),
        (".5", 0.5),
        ("+3.", 3.0),
        ("pi", math.pi),
        ("-pi/2", -math.pi / 2),
        ("3*pi/4", 3 * math.pi / 4),
        ("[1 2 3]", [1.0, 2.0, 3.0]),
        ("[1, -2,  pi]", [1.0, -2.0, math.pi]),
        ("1,2,3", [1.0, 2.0, 3.0]),
        ("[7]", [7.0]),
        ("45*deg", math.pi / 4),
        ("1+1", 2.0),
        ("max(1, 3)", 3.0),
        ("[pi/2 -1]", [math.pi / 2, -1.0]),
        ("1/4,-2", [0.25, -2.0]),
        ("[1 2; 3 4]", [[1.0, 2.0], [3.0, 4.0]]),
        ("puma560", "puma560"),
        ("squared-gear", "squared-gear"),
        ('"two words"', "two words"),
        ("'5'", "5"),
        ('""', ""),
    ],
)
def test_values_of_the_grammar_are_parsed(text: str, value: object) -> None:
    parsed = parse_value(text)
    assert parsed == value
    assert isinstance(parsed, type(value) | int)


def test_a_whole_number_is_parsed_as_an_integer() -> None:
    # A block refuses 2.0 as a count, such as the number of inputs of a Mux.
    assert isinstance(parse_value("2"), int)
    assert isinstance(parse_value("2.0"), float)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_is_parsed_to_the_last_bit(number: float) -> None:
    assert parse_value(repr(number)) == number


@given(st.text())
def test_any_text_gives_a_value_or_an_input_error(text: str) -> None:
    try:
        parse_value(text)
    except InputError as error:
        assert error.allowed


def test_nan_is_parsed_and_left_to_the_check_of_the_parameter() -> None:
    # The block refuses NaN with a message that states the allowed values of the parameter.
    value = parse_value("nan")
    assert isinstance(value, float)
    assert math.isnan(value)


@pytest.mark.parametrize("text", ["__import__('os')", "٣", "2pi", "", "{}", "a b", "2*k", "u.v*2"])
def test_text_outside_the_grammar_is_refused(text: str) -> None:
    with pytest.raises(
        InputError, match=r"--set: .*Allowed: a number, a vector.*correct it, or put quotes around a string"
    ):
        parse_value(text)


def test_the_message_names_the_entry_of_a_vector_that_is_not_a_number() -> None:
    with pytest.raises(InputError, match="there is no name named 'x'"):
        parse_value("[1 x 3]")


def test_a_vector_with_a_missing_number_is_refused() -> None:
    with pytest.raises(InputError, match=r"',' is not allowed here, .* in column 4: \[1,»,3\]"):
        parse_value("1,,3")


def test_matrix_rows_of_different_lengths_are_refused() -> None:
    with pytest.raises(InputError, match="the rows of an array have 2, 1 numbers"):
        parse_value("[1 2; 3]")


def test_assignments_are_collected_by_path() -> None:
    values = parse_assignments(["jtraj.tmax=5", " a.b.gain = [1 2]", "note.text='x=y'"])
    assert values == {"jtraj.tmax": 5.0, "a.b.gain": [1.0, 2.0], "note.text": "x=y"}


@pytest.mark.parametrize("text", ["tmax=5", "jtraj.tmax", "=5", ".tmax=5", "jtraj.=5", ""])
def test_an_assignment_without_block_and_parameter_is_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"is not of the form block.parameter=value.*--set jtraj.tmax=5"):
        parse_assignments([text])


def test_a_parameter_that_is_set_twice_is_refused() -> None:
    with pytest.raises(InputError, match=r"'jtraj.tmax' is set twice"):
        parse_assignments(["jtraj.tmax=5", "jtraj.tmax = 6"])

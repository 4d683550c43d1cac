"""The grammar of ``--set``: what it reads, and what it refuses in which words."""

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
def test_a_value_is_read(text: str, value: object) -> None:
    found = parse_value(text)
    assert found == value
    assert isinstance(found, type(value) | int)


def test_a_whole_number_stays_one() -> None:
    # Counts, such as the inputs of a Mux, are refused as 2.0 by the block.
    assert isinstance(parse_value("2"), int)
    assert isinstance(parse_value("2.0"), float)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_comes_back_to_the_last_bit(number: float) -> None:
    assert parse_value(repr(number)) == number


@given(st.text())
def test_any_text_gives_a_value_or_a_refusal(text: str) -> None:
    try:
        parse_value(text)
    except InputError as error:
        assert error.allowed


def test_not_a_number_reaches_the_check_of_the_parameter() -> None:
    # The block's own check refuses it, and can say what the parameter may be.
    value = parse_value("nan")
    assert isinstance(value, float)
    assert math.isnan(value)


@pytest.mark.parametrize("text", ["__import__('os')", "٣", "2pi", "", "{}", "a b", "2*k", "u.v*2"])
def test_what_the_grammar_does_not_know_is_no_value(text: str) -> None:
    with pytest.raises(
        InputError, match=r"--set: .*'.*Allowed: a number, a vector.*correct it, or put quotes around a text"
    ):
        parse_value(text)


def test_a_vector_says_which_entry_is_no_number() -> None:
    with pytest.raises(InputError, match="there is no name named 'x'"):
        parse_value("[1 x 3]")


def test_a_vector_says_that_a_number_is_missing() -> None:
    with pytest.raises(InputError, match="a number is missing before a comma"):
        parse_value("1,,3")


def test_rows_of_a_matrix_have_one_length() -> None:
    with pytest.raises(InputError, match="the rows of an array have 2, 1 numbers"):
        parse_value("[1 2; 3]")


def test_assignments_are_collected_by_path() -> None:
    values = parse_assignments(["jtraj.tmax=5", " a.b.gain = [1 2]", "note.text='x=y'"])
    assert values == {"jtraj.tmax": 5.0, "a.b.gain": [1.0, 2.0], "note.text": "x=y"}


@pytest.mark.parametrize("text", ["tmax=5", "jtraj.tmax", "=5", ".tmax=5", "jtraj.=5", ""])
def test_an_assignment_names_block_and_parameter(text: str) -> None:
    with pytest.raises(InputError, match=r"is not of the form block.parameter=value.*--set jtraj.tmax=5"):
        parse_assignments([text])


def test_a_parameter_is_set_once() -> None:
    with pytest.raises(InputError, match=r"'jtraj.tmax' is set twice"):
        parse_assignments(["jtraj.tmax=5", "jtraj.tmax = 6"])

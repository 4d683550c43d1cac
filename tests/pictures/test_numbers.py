"""Formatting of numbers, tick marks and text widths."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from armblocks.pictures.numbers import axis_number, nice_step, nice_ticks, si_prefix, table_number
from armblocks.pictures.text_width import shorten, text_width
from armblocks.report.page_tables import value_cell


@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e6), st.integers(2, 10))
def test_ticks_are_in_the_range_and_about_as_many_as_requested(low: float, span: float, count: int) -> None:
    ticks = nice_ticks(low, low + span, count)
    slack = 1e-6 * span + 4.0 * np.spacing(abs(low) + span)
    assert all(low - slack <= tick <= low + span + slack for tick in ticks)
    assert count / 2.5 - 1 <= len(ticks) <= 2.5 * count + 1


def test_ticks_of_wide_angle_ranges_divide_a_full_turn() -> None:
    assert nice_ticks(-190, 190, 4, degrees=True) == [-180.0, -90.0, 0.0, 90.0, 180.0]


@pytest.mark.parametrize("rough", [0.0, -1.0, math.nan, math.inf])
def test_the_tick_step_of_an_invalid_range_is_one(rough: float) -> None:
    assert nice_step(rough) == 1.0


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (-0.0, "0"),
        (-1.25, "−1.25"),
        (1e-7, "1e−7"),
        (123456.0, "123\u202f456"),
        (-12345.0, "−12\u202f345"),
        (1500.0, "1500"),
        (math.inf, "∞"),
        (-math.inf, "−∞"),
        (math.nan, "not a number"),
    ],
)
def test_axis_numbers_are_formatted(value: float, text: str) -> None:
    assert axis_number(value) == text


def test_table_numbers_have_the_requested_digits() -> None:
    assert table_number(-2.949278739196, 9) == "−2.94927874"
    assert table_number(1234567.0, 3) == "1.23e6"


@pytest.mark.parametrize(
    ("largest", "prefix"), [(2819.0, "k"), (0.004, "m"), (3.0, ""), (0.0, ""), (1e30, "T")]
)
def test_si_prefixes_fit_the_largest_number(largest: float, prefix: str) -> None:
    assert si_prefix(largest)[1] == prefix


def test_text_is_shortened_to_a_given_width() -> None:
    assert shorten("short", 10, 100) == "short"
    shortened = shorten("a very long name of a block", 10, 60)
    assert shortened.endswith("…") and text_width(shortened, 10) <= 60
    assert text_width("機械", 10) == 20.0


def test_long_arrays_are_shown_as_a_range() -> None:
    assert value_cell(np.linspace(-1.5, 2.5, 1000)) == "1000 numbers, −1.5 … 2.5"
    assert value_cell(np.array([1.0, 2.0])).count("<td") == 2

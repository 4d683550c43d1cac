"""Canonical JSON: strict reading, and equal bytes for equal content when written."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from armblocks.errors import FormatError
from armblocks.formats.canonical_json import canonical_bytes
from armblocks.formats.json_document import (
    MAX_DEPTH,
    Node,
    closed_members,
    path_text,
    read_document,
    split_members,
)

SCALARS = (
    st.none()
    | st.booleans()
    | st.integers(-(10**18) + 1, 10**18 - 1)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(st.characters(exclude_categories=["Cs"]), max_size=5)
)
DOCUMENTS = st.recursive(
    SCALARS,
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.text(st.characters(exclude_categories=["Cs"]), max_size=4), inner, max_size=4)
    ),
    max_leaves=20,
)


def read(text: str | bytes) -> Node:
    return read_document(text.encode() if isinstance(text, str) else text, "a.json", 1000)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(DOCUMENTS)
def test_reading_a_written_value_gives_the_same_value(value: object) -> None:
    data = canonical_bytes(value)
    reread = read_document(data, "a.json", 10**6).value
    assert reread == value
    assert canonical_bytes(reread) == data
    assert json.loads(data) == value, "the standard JSON reader gives the same value"


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.floats(allow_nan=False, allow_infinity=False))
def test_floats_keep_their_bits(number: float) -> None:
    reread = read(canonical_bytes([number])).elements()[0].number()
    assert math.copysign(1, reread) == math.copysign(1, number)
    assert reread == number


def test_rows_of_numbers_stay_on_one_line() -> None:
    text = canonical_bytes(
        {"b": [[1.0, 2.5], [-0.0, 1e-7]], "a": {"z": [], "y": {}}, "c": ["x", "y"]}
    ).decode()
    assert text == (
        '{\n  "a": {\n    "y": {},\n    "z": []\n  },\n'
        '  "b": [\n    [1, 2.5],\n    [-0.0, 1e-07]\n  ],\n'
        '  "c": [\n    "x",\n    "y"\n  ]\n}\n'
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", r"a\.json:1: the file is not valid JSON: "),
        ('{"a": 1,\n "b" 2}', r"a\.json:2: the file is not valid JSON: Expecting ':' delimiter \(column 6\)"),
        ("\n[NaN]", r"a\.json:2: NaN is not a JSON number"),
        ("[-Infinity]", "-Infinity is not a JSON number"),
        ("[1e999]", "the number 1e999 is too large"),
        ("[" + "1" * 5000 + "]", "too large"),
        ("[" + "1" * 30 + "]", "the integer 1+ is too long"),
        ('{"a": 1,\n"a": 2}', r"a\.json:2: the key 'a' occurs twice in one object"),
        ('{"a":\n "\\ud800"}', r"a\.json:2, a: a string is not valid Unicode"),
        ('{"\\udfff": 1}', "a string is not valid Unicode"),
        ("[" * 70 + "]" * 70, "objects and arrays are nested too deeply. Allowed: 64 levels"),
        ("[" * 900, "objects and arrays are nested too deeply"),
        (b"\n\xff", r"a\.json:2: the file is not UTF-8 text"),
        ("1 2", "not valid JSON"),
        ("", "not valid JSON"),
        ("[1_000]", "not valid JSON"),
        ("[\u0661]", "not valid JSON"),
        ("[.5]", "not valid JSON"),
    ],
)
def test_json_that_is_not_strict_is_refused(text: str | bytes, message: str) -> None:
    with pytest.raises(FormatError, match=message):
        read(text)


def test_byte_order_mark_is_tolerated() -> None:
    assert read(b"\xef\xbb\xbf[1]").elements()[0].number() == 1


def test_a_document_above_the_size_limit_is_refused() -> None:
    with pytest.raises(FormatError, match="the document is too large"):
        read(" " * 1001)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ({"a": math.nan}, "a: the number nan cannot be written"),
        ([math.inf], r"\[0\]: the number inf cannot be written"),
        ({1: 2}, "a key is not text"),
        ({"a": object()}, "a object cannot be written"),
        ("\ud800", "a string cannot be written, as it is not valid Unicode"),
    ],
)
def test_values_without_a_json_form_are_refused(value: object, message: str) -> None:
    with pytest.raises(FormatError, match=message):
        canonical_bytes(value)


def test_a_too_deeply_nested_value_is_refused() -> None:
    value: list[object] = []
    for _ in range(MAX_DEPTH + 1):
        value = [value]
    with pytest.raises(FormatError, match="objects and arrays are nested too deeply"):
        canonical_bytes(value)


def test_error_locations_have_the_line_of_the_value() -> None:
    root = read('{"a": {"x": 1,\n "b c":\n [1, {"d":\n 2}]}, "x": "a\\nb",\n"y": 5}')
    a = root.members()["a"].members()
    assert a["b c"].elements()[1].members()["d"].where == 'a.json:4, a."b c"[1].d'
    assert a["x"].where == "a.json:1, a.x"
    assert root.members()["y"].where == "a.json:5, y"
    assert root.where == "a.json:1"
    assert path_text(("layout", "XY Graph", 0)) == 'layout."XY Graph"[0]'


def test_type_errors_name_the_expected_type() -> None:
    root = read('{"n": null, "t": "x", "b": true, "f": false, "i": 3, "l": [1], "o": {}}').members()
    for key, words in {
        "n": "the value is null. Allowed: a number",
        "t": "the value is the text 'x'",
        "b": "the value is true",
        "f": "the value is false",
        "l": "the value is an array of 1 element",
        "o": "the value is an object",
    }.items():
        with pytest.raises(FormatError, match=words):
            root[key].number()
    with pytest.raises(FormatError, match=r"the value is the number 3. Allowed: text"):
        root["i"].text()
    with pytest.raises(FormatError, match="Allowed: true or false"):
        root["i"].boolean()
    with pytest.raises(FormatError, match=r"Allowed: an object \{…\}"):
        root["i"].members()
    with pytest.raises(FormatError, match=r"Allowed: an array \[…\]"):
        root["i"].elements()
    with pytest.raises(FormatError, match=r"1 number is given. Allowed: 3 numbers"):
        root["l"].numbers(3)
    with pytest.raises(FormatError, match=r"'x' is not known here. Allowed: xy, z. Fix: did you mean 'xy'"):
        root["t"].choice(["xy", "z"])


def test_unknown_keys_are_kept_unless_they_are_misspelt_known_keys() -> None:
    members, extra = split_members(read('{"name": 1, "vendor": {"a": [1]}}'), ("name", "layout"))
    assert (list(members), extra) == (["name"], {"vendor": {"a": [1]}})
    with pytest.raises(FormatError, match=r"the key 'nmae' is not known here.*did you mean 'name'"):
        split_members(read('{"nmae": 1}'), ("name", "layout"))


def test_closed_objects_refuse_unknown_and_missing_keys() -> None:
    with pytest.raises(FormatError, match=r"the key 'y' is not known here. Allowed: x. Fix: remove 'y'"):
        closed_members(read('{"y": 1}'), ("x",))
    with pytest.raises(FormatError, match="the key 'x' is missing"):
        closed_members(read("{}"), ("x",), required=("x",))


@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.text(alphabet='{}[]",:0123456789.eE-+\\ \nabntrufslNI', max_size=30))
def test_random_text_is_read_or_refused(text: str) -> None:
    try:
        read(text)
    except FormatError as error:
        assert error.where.startswith("a.json")


@pytest.mark.parametrize("text", ['{"a": NaN}', '{"a": 1e999}', '{"a": 1, "a": 2}', f'{{"a": {"1" * 30}}}'])
def test_the_message_for_a_refused_value_has_its_line_and_a_fix(text: str) -> None:
    with pytest.raises(FormatError, match=r"d.json:1: .*Fix: correct this line\."):
        read_document(text.encode(), "d.json", 1000)

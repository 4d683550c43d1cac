"""The MATLAB subset: expressions have the same values as in MATLAB."""

from __future__ import annotations

import math
import sys

import numpy as np
import pytest

from armblocks.formats import read_script


def value(text: str) -> object:
    """The variable x after a script."""
    return read_script(text.encode(), "test.m").variables["x"]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("x = 12", [[12]]),
        ("x = .5", [[0.5]]),
        ("x = 5.", [[5]]),
        ("x = 1.8e-3", [[1.8e-3]]),
        ("x = 1d2", [[100]]),
        ("x = 2 + 3*4", [[14]]),
        ("x = -2^2", [[-4]]),
        ("x = 2^-1", [[0.5]]),
        ("x = 2^3^2", [[64]]),  # left-associative in MATLAB
        ("x = --2", [[2]]),
        ("x = -0", [[0]]),
        ("x = (1 + 2)*3", [[9]]),
        ("x = 1/4", [[0.25]]),
        ("x = 4\\1", [[0.25]]),
        ("x = 8/2/2", [[2]]),
        ("x = [1 -2]", [[1, -2]]),
        ("x = [1 - 2]", [[-1]]),
        ("x = [1 -2 + 3]", [[1, 1]]),
        ("x = [1 , -2]", [[1, -2]]),
        ("x = [ -1, 2 ]", [[-1, 2]]),
        ("x = [1-2]", [[-1]]),
        ("x = [(1 - 2) (3 -4)]", [[-1, -1]]),
        ("x = [1 2; 3 4]", [[1, 2], [3, 4]]),
        ("x = [1 2\n3 4]", [[1, 2], [3, 4]]),
        ("x = [1 2 % one\n\n3 4]", [[1, 2], [3, 4]]),
        ("x = [1 2 ...\n3 4]", [[1, 2, 3, 4]]),
        ("x = [1 2 ... the rest is comment\n3 4];", [[1, 2, 3, 4]]),
        ("x = [1 2;];", [[1, 2]]),
        ("x = []", np.zeros((0, 0))),
        ("x = [[1 2]; [3 4]]", [[1, 2], [3, 4]]),
        ("x = [[1;2] [3;4]]", [[1, 3], [2, 4]]),
        ("x = [1 2]'", [[1], [2]]),
        ("x = [1 2].'", [[1], [2]]),
        ("a = [1 2]; x = [a' a']", [[1, 1], [2, 2]]),
        ("a = 2; x = a'*3", [[6]]),
        ("x = [1 2; 3 4]*[1; 1]", [[3], [7]]),
        ("x = [1 2].*[3 4]", [[3, 8]]),
        ("x = [1 2]./[2 4]", [[0.5, 0.5]]),
        ("x = [1 2].^2", [[1, 4]]),
        ("x = [2 4].\\[1 2]", [[0.5, 0.5]]),
        ("x = 1./[1 2]", [[1, 0.5]]),
        ("x = [1 1; 0 1]^3", [[1, 3], [0, 1]]),
        ("x = [1 2; 3 4]/[1 0; 0 2]", [[1, 1], [3, 2]]),
        ("x = [1 0; 0 2]\\[1; 2]", [[1], [1]]),
        ("x = 1:4", [[1, 2, 3, 4]]),
        ("x = 0:0.25:1", [[0, 0.25, 0.5, 0.75, 1]]),
        ("x = 0:0.1:1", [[k * 0.1 for k in range(11)]]),
        ("x = 3:-1:1", [[3, 2, 1]]),
        ("x = 3:1", np.zeros((1, 0))),
        ("x = pi/2", [[math.pi / 2]]),
        ("x = 90*pi/180", [[90 * math.pi / 180]]),
        ("x = deg2rad(90)", [[math.pi / 2]]),
        ("x = rad2deg(pi)", [[180]]),
        ("x = sqrt(4) + abs(-1) + exp(0)", [[4]]),
        ("x = [sin(0) cos(0) tan(0)]", [[0, 1, 0]]),
        ("x = [asin(1) acos(1) atan(0) atan2(1, 1)]", [[math.pi / 2, 0, 0, math.pi / 4]]),
        ("x = zeros(1, 3)", [[0, 0, 0]]),
        ("x = ones(2)", [[1, 1], [1, 1]]),
        ("x = zeros", [[0]]),
        ("x = eye(2)", [[1, 0], [0, 1]]),
        ("x = zeros([1 2])", [[0, 0]]),
        ("x = diag([1 2])", [[1, 0], [0, 2]]),
        ("x = diag([1 2; 3 4])", [[1], [4]]),
        ("x = length([1 2 3]) + numel([1 2; 3 4])", [[7]]),
        ("x = length('abc')", [[3]]),
        ("L{3} = link([0 1 0 0]); x = length(L)", [[3]]),
        ("L(2) = Link([0 1 0 0]); M = L; x = length(M)", [[2]]),
        ("c = {1 2 3}; x = c{1, 3}", [[3]]),
        ("a = link([0 7 0 0]); x = a(1).A", [[7]]),
        ("x = eye'", [[1]]),
        ("'text'; x = 1", [[1]]),
        ("x = linspace(0, 1, 3)", [[0, 0.5, 1]]),
        ("x = transl(transl(1, 2, 3))", [[1], [2], [3]]),
        ("x = SE3() * SE3(eye(4)) * SE3(0, 0, 0)", np.eye(4)),
        ("x = trotx(90, 'deg')*trotx(-pi/2)", np.eye(4)),
        ("a = [4 5 6]; x = a(2)", [[5]]),
        ("a = [4 5; 6 7]; x = a(2)", [[6]]),  # columns first
        ("a = [4 5; 6 7]; x = a(1, 2)", [[5]]),
        ("a = [4 5 6]; x = a([3 1])", [[6, 4]]),
        ("a = [4; 5; 6]; x = a(1:2)", [[4], [5]]),
        ("a = [4 5; 6 7]; x = a(1:2, 2)", [[5], [7]]),
        ("x(3) = 7", [[0, 0, 7]]),
        ("x = [1 2]; x(1) = 9", [[9, 2]]),
        ("x = [1; 2]; x(3) = 9", [[1], [2], [9]]),
        ("x = [1 2; 3 4]; x(2) = 9", [[1, 2], [9, 4]]),
        ("x = eye(2); x(1, 3) = 5", [[1, 0, 5], [0, 1, 0]]),
        ("x = 1, y = 2; z = 3", [[1]]),
        ("x = 1 % comment", [[1]]),
        ("%{\nx = 1\n%{\nnested\n%}\n%}\nx = 2", [[2]]),
        ("y = 1; x = ...\n 3", [[3]]),
        ("x = 1; clear y", [[1]]),
        ("x = 1; clear x; x = 2", [[2]]),
        ("y = 1; clear all; x = 2; clc; close all; format long; more off", [[2]]),
        ("y = 1; clear; x = 2; clc(); close('all'); clear('y')", [[2]]),
        ("pi = 3; x = pi", [[3]]),
        ("x = 4; disp('hello'); disp(x); x", [[4]]),
        ("clear = 3; x = clear", [[3]]),
        ("x = 3; 4 + 5; x = ans", [[9]]),
        ("x = [1 2 3] >= 2 & [1 1 0]", [[0, 1, 0]]),
        ("x = if(2 > 1, 3, 4) + ~[0 2]", [[4, 3]]),
        ("a = [4 5 6]; x = a(end) + a(end - 1)", [[11]]),
        ("L{2} = link([0 7 0 0]); L{1} = L{end}; x = L{1}.A", [[7]]),
        ("a = [4 5; 6 7]; x = a(:, end)", [[5], [7]]),
        ("a = [4 5; 6 7]; x = a(:)", [[4], [6], [5], [7]]),
        ("a = [4 5; 6 7]; x = a([1; 2])", [[4], [6]]),
        ("a = [1 2]; a(end + 1) = 3; x = a", [[1, 2, 3]]),
        ("x = [[1 2][3 4]]", [[1, 2, 3, 4]]),
        ("x = norm([3 4]) + max([1 5 2]) + mod(-1, 3) + sum([1 2; 3 4])", [[16, 18]]),
        ("length = 2; x = length(1)", [[2]]),
    ],
)
def test_expression_has_matlabs_value(text: str, expected: object) -> None:
    actual = value(text)
    assert isinstance(actual, np.ndarray)
    np.testing.assert_allclose(actual, np.asarray(expected, dtype=float), rtol=1e-15, atol=1e-15)
    assert actual.shape == np.shape(expected)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("x = 'params of 8/95'", "params of 8/95"),
        ("x = 'it''s'", "it's"),
        ('x = "say ""hi"""', 'say "hi"'),
        ("x = ['KR' '180']", "KR180"),
        ("x = 'no % comment'", "no % comment"),
        ("x = 'a...b'", "a...b"),
    ],
)
def test_strings_have_the_same_value_as_in_matlab(text: str, expected: str) -> None:
    assert value(text) == expected


@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"])
def test_line_ends_of_every_system_are_read(ending: str) -> None:
    assert value(ending.join(["% one", "y = 1", "x = [1", "2];"]))[1, 0] == 2  # type: ignore[index]


def test_byte_order_mark_and_old_encodings_are_read() -> None:
    assert read_script(b"\xef\xbb\xbfx = 1", "a.m").variables["x"] == 1
    latin = "% masa po segmentima \u010di \xe9\nx = 'Unimation \xe9'".encode("latin-1", "replace")
    assert read_script(latin, "a.m").variables["x"] == "Unimation \xe9"


def test_an_incomplete_statement_continues_on_the_next_line() -> None:
    variables = read_script(b"x =\n2 +\n3; y\n= 4; z = [\n5 6];", "a.m").variables
    assert (variables["x"], variables["y"]) == (5, 4)
    np.testing.assert_array_equal(variables["z"], [[5, 6]])


def test_a_long_chain_needs_no_deep_recursion() -> None:
    length = 4 * sys.getrecursionlimit()
    assert value("x = 0" + "+1" * length) == length
    assert value("x = " + "-" * length + "1") == 1
    assert value("x = 1" + "'" * length) == 1

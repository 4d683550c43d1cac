"""Unsupported script code is an error with file, line, text and the supported subset."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from armblocks.errors import ArmblocksError, FormatError
from armblocks.formats import read_script

ONE_LINK = "L{1} = link([0 1 0 0 0]); "
ONE_ROBOT = ONE_LINK + "r = robot(L); "
NEW_LINK = "L(1) = Link([0 0 1 0]); "
NEW_ROBOT = NEW_LINK + "r = SerialLink(L); "

INVALID_SCRIPTS = [
    # the language
    ("for i = 1:3", "'for' is not supported"),
    ("if x", "'if' is not supported"),
    ("function r = f()", "'function' is not supported"),
    ("x = end", "'end' is not supported here"),
    ("x = 1 < 2 < 3", "comparisons cannot be chained"),
    ("x = [1 2] & [1 2 3]", "'&' of a 1x2 matrix and a 1x3 matrix"),
    ("x = ~'a'", "the operand of '~' is text"),
    ("x = 2:3:4:5", "':' is not allowed here"),
    ("x = 2*not 3", "'not' needs brackets here"),
    ("x = 2i", "'2i' is an imaginary number"),
    ("x = :", "':' is not allowed here"),
    ("f = @(x) x", "function handles"),
    ("x = 3 ? 4", "the character '\\?' is not allowed"),
    ("x = 2abc", "'2abc' is not a number"),
    ("x = 1__000", "'1__000' is not a number"),
    ("x = \u0663", "is not allowed in MATLAB"),
    ("x = 1e400", "'1e400' is too large a number"),
    ("x = 'abc", "the string that ' starts is not closed"),
    ("x = [1 2", "'\\[' is never closed"),
    ("x = (1 + 2", "'\\(' is not closed on its line"),
    ("x = f(1,\n", "'\\(' is never closed"),
    ("x = 1)", "'\\)' closes no bracket"),
    ("x = [1)", "'\\)' closes no bracket"),
    ("%{\nx = 1", "the block comment is never closed"),
    ("clear L*", "the command 'clear L\\*' is not supported"),
    ("clear('a b')", "'a b' cannot be cleared"),
    ("[a, b] = 3", "assignment to several variables"),
    ("3 = x", "the left side of '=' is not a variable"),
    ("x' = 3", "a transpose cannot be assigned to"),
    ("x = L.(1)", "'\\(' is not allowed here, expected the name of a field"),
    (ONE_LINK + "x = L{1} + 1", "the left operand of '\\+' is a link"),
    (ONE_ROBOT + "x = r + 1", "the left operand of '\\+' is a robot"),
    (ONE_ROBOT + "r.base = transl(1/0, 0, 0)", "robot 'noname': base is inf"),
    ("x = 1 = 2", "two '=' in one statement"),
    ("x = 1 2", "'2' is not allowed here"),
    ("x = )", "'\\)' closes no bracket"),
    ("x = *", "'\\*' is not allowed here, expected a value"),
    ("x = ", "the statement ends where a value is expected"),
    ("x = [1,,2]", "',' is not allowed here"),
    ("x = f(1 2)", "'2' is not allowed here, expected ','"),
    (ONE_LINK + "L{1}.3", "not allowed here"),
    ("x = " + "(" * 80 + "1" + ")" * 80, "brackets are nested too deeply"),
    ("x = " + "[" * 80 + "1" + "]" * 80, "brackets are nested too deeply"),
    ("x = {1 2; 3 4}", "a cell array with several rows"),
    ("x = {{1}}", "a cell array inside a cell array"),
    ("c{1} = 1; d{1} = c", "a cell array inside a cell array"),
    # values
    ("x = y", "'y' is neither a variable nor a supported function"),
    ("x = sni(1)", "did you mean 'sin'"),
    ("x = plot(1)", "'plot' is neither"),
    ("x = sin(1, 2)", "sin is called with 2 arguments"),
    ("x = 'a' + 1", "the left operand of '\\+' is text"),
    ("x = 1 + {1}", "the right operand of '\\+' is a cell array"),
    ("x = -'a'", "the operand of '-' is text"),
    ("x = 'a''", "is not closed"),
    ("y = 'a'; x = y'", "the operand of the transpose is text"),
    ("x = [1 2] + [1 2 3]", "'\\+' of a 1x2 matrix and a 1x3 matrix"),
    ("x = [1 2]*[3 4]", "'\\*' of a 1x2 matrix and a 1x2 matrix"),
    ("x = [1 2]/[3 4]", "division by a"),
    ("x = eye(2)/zeros(2)", "division by a singular matrix"),
    ("x = [1 2]^2", "'\\^' of a 1x2 matrix and a number"),
    ("x = (-1)^0.5", "a root of a negative number is complex"),
    ("x = sqrt(-1)", "sqrt has a complex value here"),
    ("x = asin(2)", "asin has a complex value here"),
    ("x = [1 2; 3]", "the rows of the matrix have 2, 1 elements"),
    ("x = [[1;2] 3]", "the elements of a row differ in height"),
    ("x = [1 'a']", "an element of a matrix is text"),
    ("x = zeros(1e3)", "zeros: an array would have 1e\\+06 elements"),
    ("x = zeros(1.5)", "zeros: 1.5 is not a number of elements"),
    ("x = zeros(1, 2, 3)", "zeros is called with 3 arguments"),
    ("x = zeros([1 2 3])", "zeros: 3 numbers are given as a size"),
    ("x = zeros('a')", "the argument of zeros is text"),
    ("x = diag(ones(1, 1000))", "a matrix would have 1000x1000"),
    ("x = ones(1000, 1)*ones(1, 1000)", "a matrix would have 1000x1000"),
    ("x = 1:1e9", "a range: an array would have 1e\\+09 elements"),
    ("x = 1:Inf", "a range: the number of steps is not finite"),
    ("x = 0:1e-320:1", "a range: the number of steps is not finite"),
    ("x = 1:'a'", "an end of a range is text"),
    ("x = transl(1, 2)", "transl: 2 arguments with 2 elements in all: no translation; allowed are x, y, z"),
    ("x = transl([1 2])", "transl: 1 argument with 2 elements in all: no translation"),
    ("x = trotx(1, 'rad')", "the option of trotx is not known"),
    ("x = trotx([1 2])", "the angle of trotx is not one number"),
    ("x = atan2([1 2], [1 2 3])", "the arguments of atan2 are a 1x2 matrix and a 1x3 matrix"),
    ("x = cross([1 2], [1 2])", "the arguments of cross are not vectors of 3 numbers"),
    ("x = dot([1 2], [1 2 3])", "the arguments of dot are not vectors of equal length"),
    ("x = trace([1 2])", "a 1 x 2 matrix has no trace"),
    ("x = inv([1 2])", "a 1 x 2 matrix has no inverse"),
    ("x = inv([1 1; 1 1])", "a singular matrix has no inverse"),
    ("x = max([])", "max: the array is empty"),
    ("x = norm([1 2; 3 4])", "norm: the argument is a matrix, whose norm\\(A\\) would be its largest"),
    ("x = norm([1 2], 'inf')", "norm: the option is not known; allowed is 'fro'"),
    ("x = sin", "the function 'sin' is called without arguments"),
    ("a = 'b'; x = a(end)", "the value with the index 'end' is text"),
    ("a(:) = 1", "assignment to several elements at once"),
    ("a = [1 2]; x = a(3)", "the index 3 is not possible here"),
    ("a = [1 2]; x = a(0)", "the index 0 is not possible here"),
    ("a = [1 2]; x = a(1.5)", "the index 1.5 is not possible"),
    ("a = [1 2]; x = a(1, 1, 1)", "3 indices are given"),
    ("a = []; x = a(1)", "an element of an empty matrix"),
    ("a = []; x = a(1, 1)", "an element of an empty matrix"),
    ("a = 'text'; x = a(1)", "\\(\\) is used on text"),
    ("a = 'text'; a(1) = 2", "\\(\\) is used on text"),
    ("a = [1 2; 3 4]; a(9) = 1", "the matrix has no element 9"),
    ("a(1e6) = 1", "the index 1e\\+06 is not possible"),
    ("a(1, 1, 1) = 1", "3 indices are given"),
    ("a(1) = 'b'", "the value assigned to an element is text"),
    ("a = 1; x = a{1}", "{} is used on a number"),
    ("a = 1; a{1} = 2", "{} is used on a number"),
    ("c{2} = 1; x = c{1}", "element 1 of the cell array is not set"),
    ("c{1, 2, 3} = 1", "3 indices are given"),
    ("c{1e9} = 1", "the index 1e\\+09 is not possible"),
    ("x.m = 3", "'x' is not defined, so it has no fields"),
    ("x = 1; x.m = 3", "a number has no field 'm'"),
    ("x = 1; y = x.m", "a number has no field 'm'"),
    ("c{1}.m = 3", "an element that is not set has no field 'm'"),
    (
        "".join(f"a{i} = ones(300, 300);" for i in range(300)),
        "exceeds the computation limit of robot scripts",
    ),
    # links
    ("x = link()", "link is called with 0 arguments"),
    ("x = link([0 0 0 0], 'mod', 3)", "link is called with 3 arguments"),
    ("x = link('a')", "link is called with text"),
    ("x = link([0 0 0])", "a row of 3 numbers is not a link"),
    ("x = link([0 0 0 0 0 0 0])", "a row of 7 numbers is not a link"),
    ("x = link(zeros(1, 19))", "a row of 19 numbers is not a link"),
    ("x = link([0 0 0 0], 'craig')", "'craig' is not a D-H convention"),
    ("x = link([0 NaN 0 0])", "A is nan|a is nan"),
    ("x = link([0 0/0 0 0])", "A is nan|a is nan"),
    (ONE_LINK + "L{1}.mass = 3", "a link has no field 'mass'"),
    (ONE_LINK + "x = L{1}.mass", "a link has no field or method 'mass'"),
    (ONE_LINK + "L{1}.m = [1 2]", "m is a 1x2 matrix"),
    (ONE_LINK + "L{1}.m = -1", "m is -1"),
    (ONE_LINK + "L{1}.m = Inf", "m is inf"),
    (ONE_LINK + "L{1}.Jm = -1", "Jm is -1"),
    (ONE_LINK + "L{1}.r = [1 2]", "r is a 1x2 matrix"),
    (ONE_LINK + "L{1}.r = [1 2 Inf]", "r holds numbers that are not finite"),
    (ONE_LINK + "L{1}.I = [0 .35]", "I is a 1x2 matrix"),
    (ONE_LINK + "L{1}.I = [1 2 3 4]", "I is a 1x4 matrix"),
    (ONE_LINK + "L{1}.I = [1 2 Inf]", "I holds numbers that are not finite"),
    (ONE_LINK + "L{1}.I = [1 2 3; 0 1 0; 0 0 1]", "I is invalid: the matrix is not symmetric"),
    (ONE_LINK + "L{1}.I = [1 2 3\n4 5\n6]", "the rows of the matrix have 3, 2, 1 elements"),
    (ONE_LINK + "L{1}.G = 0", "G is 0, so the motor cannot move the joint"),
    (ONE_LINK + "L{1}.Tc = [1 2 3]", "Tc is a 1x3 matrix"),
    (ONE_LINK + "L{1}.Tc = [-1 1]", "Tc has -1 before 1"),
    (ONE_LINK + "L{1}.qlim = [1 -1]", "qlim goes from 1 to -1"),
    (ONE_LINK + "L{1}.qlim = [1 Inf]", "qlim holds numbers that are not finite"),
    (ONE_LINK + "L{1}.sigma = 'X'", "sigma is 'X'"),
    (
        ONE_LINK + "L{1}(0.5) = 3",
        "the index 0.5 is not possible|is assigned to an element of an array of links",
    ),
    (ONE_LINK + "L{1}(2)", "link 2 of the array is not set"),
    (NEW_LINK + "L(1) = 3", "a number is assigned to an element of an array of links"),
    (NEW_LINK + "L(3) = Link([0 0 1 0]); x = L(2)", "link 2 of the array is not set"),
    ("x = [Link([0 0 1 0]) 3]", "a number is an element of an array of links"),
    ("x = Link('d')", "'d' of Link has no value"),
    ("x = Link('d', 1, 'theta', 2)", "Link is given both 'd' and 'theta'"),
    ("x = Link('size', 1)", "Link has no parameter 'size'"),
    ("x = Link([0 0 1 0], 'standard', 2)", "and 2 more"),
    ("x = Link('sym')", "Link has no parameter 'sym'"),
    ("x = Link('d', 1, 2)", "argument 3 of Link is a number"),
    ("x = Prismatic('d', 1)", "'d' is the variable of this joint"),
    ("x = Revolute('theta', 1)", "'theta' is the variable of this joint"),
    # robots
    ("r = robot()", "robot is called with 0 arguments"),
    ("r = robot('a')", "robot is called with text"),
    (NEW_LINK + "r = robot(L)", "robot is called with an array of links"),
    ("c = {1}; r = robot(c)", "element 1 of the links is a number"),
    ("L{2} = link([0 1 0 0]); r = robot(L)", "element 1 of the links is an element that is not set"),
    ("c = {}; r = robot(c)", "the robot has no links"),
    (ONE_LINK + "L{2} = link([0 1 0 0], 'mod'); r = robot(L)", "standard and modified D-H links are mixed"),
    (ONE_LINK + "r = robot(L, 3)", "name is a number"),
    (ONE_ROBOT + "r.nmae = 'x'", "a robot has no field 'nmae'"),
    (ONE_ROBOT + "r.plot([0])", "a robot has no field or method 'plot'"),
    (ONE_ROBOT + "r.offset = 1", "releases up to 8 ignore an assignment to 'offset'"),
    (ONE_ROBOT + "r.gravity = 9.81", "gravity is a number"),
    (ONE_ROBOT + "r.base = eye(3)", "base is invalid: a transform has shape"),
    (ONE_ROBOT + "r.tool = 2*eye(4)", "tool is invalid: "),
    (ONE_ROBOT + "r.links = 3", "the links of a robot are a number"),
    (NEW_ROBOT + "r.qlim = [1 2 3]", "qlim is a 1x3 matrix"),
    ("r = SerialLink()", "SerialLink is called without links"),
    ("r = SerialLink('a')", "SerialLink is called with text"),
    (NEW_LINK + "r = SerialLink(L, 'name')", "'name' of SerialLink has no value"),
    (NEW_LINK + "r = SerialLink(L, 'colour', 1)", "a robot has no field 'colour'"),
    (NEW_LINK + "r = SerialLink(L, 3, 1)", "argument 2 of SerialLink is a number"),
    ("r = SerialLink(zeros(2000, 4))", "the robot has 2000 links"),
    ("L = Link([0 0 1 0]); L = [" + "L " * 1001 + "]", "1001 links in one array"),
    ("c = {" + "1 " * 1001 + "}", "1001 elements in one cell array"),
]


@pytest.mark.parametrize(
    ("text", "message"), INVALID_SCRIPTS, ids=[str(i) for i in range(len(INVALID_SCRIPTS))]
)
def test_unsupported_code_is_refused_with_file_line_and_text(text: str, message: str) -> None:
    with pytest.raises(FormatError, match=message) as caught:
        read_script(("% first line\n" + text).encode(), "arm.m")
    line = int(caught.value.where.removeprefix("arm.m:"))
    assert 2 <= line <= 2 + text.count("\n") + 1
    assert caught.value.allowed
    assert len(caught.value.what) < 300


def test_binary_file_is_refused() -> None:
    with pytest.raises(FormatError, match=r"a\.m:2: the file is not text \(it contains a NUL byte\)"):
        read_script(b"x = 1\n\x00\x01", "a.m")


def test_the_message_quotes_the_line_and_lists_the_supported_syntax() -> None:
    with pytest.raises(FormatError) as caught:
        read_script(b"x = 1;\n\nfor i = 1:6, L{i}.m = 1; end\n", "loop.m")
    text = str(caught.value)
    assert text.startswith("loop.m:3: 'for' is not supported, in column 1: »for i = 1:6, L{i}.m = 1; end")
    assert "Allowed: straight-line scripts of the Robotics Toolbox" in text


def test_a_long_line_is_shortened_in_the_message() -> None:
    with pytest.raises(FormatError, match="…"):
        read_script(("x = [" + "1 " * 500 + "; 2]").encode(), "a.m")


def test_the_error_for_an_inconsistent_robot_names_its_line() -> None:
    links = "; ".join(f"L{{{i}}} = link([0 1 0 0])" for i in (1, 2))
    script = f"{links};\nr = robot(L);\nr.links{{2}}.m = 1e400;"
    with pytest.raises(
        FormatError, match=r"a\.m:3: '1e400' is too large a number, in column 16: .*= »1e400;"
    ):
        read_script(script.encode(), "a.m")


SCRIPT = (
    b"L{1} = link([ pi/2 0.35 0 0.75 0], 'standard');\nL{1}.m = 2; L{1}.I = [ 0 .35 0 0 0 0];\n"
    b"L{2} = link([0 1 0 0]); % two\nk = robot(L, 'A', 'B', \"C\"); k.base = transl(1, 2, 3)*trotx(0.1);\n"
    b"q = [0 -1\n2 3]'; x(2) = q(1)^2:3; clear x\n"
)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(st.lists(st.tuples(st.integers(0, len(SCRIPT)), st.binary(max_size=3), st.integers(0, 3)), max_size=6))
def test_mutated_script_is_read_or_refused(changes: list[tuple[int, bytes, int]]) -> None:
    data = SCRIPT
    for index, new, removed in changes:
        data = data[:index] + new + data[index + removed :]
    _read_or_refuse(data)


FRAGMENTS = (
    *(
        "L",
        "{",
        "}",
        "(",
        ")",
        "[",
        "]",
        "=",
        ";",
        ",",
        "\n",
        " ",
        "'",
        '"',
        "%",
        "...",
        ".",
        ".m",
        ".I",
        ".'",
    ),
    *("1", "2e3", "-", "+", "*", "/", "\\", "^", ":", "link", "robot", "Link", "SerialLink", "pi", "clear"),
    *(
        "'mod'",
        "zeros",
        "[0 1 0 0]",
        "L{1}",
        "%{\n",
        "%}\n",
        "transl",
        "Inf",
        "end",
        "<",
        "==",
        "~",
        "&&",
        "|",
    ),
    *("not", "and", "max", "(:)", "if(", "SE3"),
)


@settings(max_examples=250, deadline=None, derandomize=True)
@given(st.lists(st.sampled_from(FRAGMENTS), max_size=25))
def test_random_tokens_are_read_or_refused(pieces: list[str]) -> None:
    _read_or_refuse("".join(pieces).encode())


def _read_or_refuse(data: bytes) -> None:
    with np.errstate(all="raise"):
        try:
            read_script(data, "fuzz.m")
        except FormatError as error:
            assert error.where.startswith("fuzz.m")
        except Warning:
            pass  # warnings about joined lines and driving friction
        except ArmblocksError as error:
            pytest.fail(f"not located: {error}")

"""Arms in symbols: the forms of textbooks, and the numbers of the compiled functions."""

from __future__ import annotations

import pickle
from dataclasses import replace
from math import pi

import numpy as np
import pytest
import sympy
from casadi import SX, Function, erf
from numpy.testing import assert_allclose

import armblocks as ab
from armblocks.algebra import arithmetic
from armblocks.algebra.sums import Sum
from armblocks.errors import InputError, RobotError, UnknownNameError
from armblocks.robot import Coupling, Robot
from mechanisms_for_tests import four_bar
from robots_for_tests import MIXED_ROBOTS, build_random_tree, evaluate, random_states

METHODS = {
    "fkine": 1,
    "jacob0": 1,
    "jacobe": 1,
    "inertia": 1,
    "coriolis": 2,
    "gravload": 1,
    "rne": 3,
    "kinetic_energy": 2,
    "potential_energy": 1,
}
TWO_LINKS = [
    {"a": "l1", "mass": "m1", "centre_of_mass": ("r1 - l1", 0, 0), "inertia": (0, 0, "I1")},
    {"a": "l2", "mass": "m2", "centre_of_mass": ("r2 - l2", 0, 0), "inertia": (0, 0, "I2")},
]


def planar() -> ab.SymbolicArm:
    return ab.symbolic_dh(TWO_LINKS, gravity=(0, "-g", 0))


def puma() -> ab.SymbolicArm:
    """The Puma 560 of Craig, Introduction to Robotics, section 3.7."""
    rows = [
        {},
        {"alpha": -pi / 2},
        {"a": "a2", "d": "d3"},
        {"alpha": -pi / 2, "a": "a3", "d": "d4"},
        {"alpha": pi / 2},
        {"alpha": -pi / 2},
    ]
    return ab.symbolic_dh(rows, convention="modified")


def coupled() -> Robot:
    robot = build_random_tree(5, count=4, chain=True)
    names = [link.name for link in robot.tree_links]
    gear = Coupling(name="gear", terms=((names[2], 1.0), (names[0], -2.0)), constant=0.4)
    return replace(robot, constraints=(gear,))


def values_of(arm: ab.SymbolicArm, expression: ab.SymbolicExpression, *arguments: np.ndarray) -> np.ndarray:
    sizes = (arm.robot.nq, arm.robot.n, arm.robot.n)
    given = [*arguments, *(np.zeros(size) for size in sizes[len(arguments) :])]
    function = Function("f", list(arm.inputs), [expression.casadi])
    return np.asarray(function(*given, np.zeros(arm.symbols.numel())).full())


@pytest.mark.parametrize(
    "robot", [MIXED_ROBOTS[0], build_random_tree(2), coupled(), ab.load_robot("irb460").robot]
)
def test_casadi_expressions_are_the_compiled_functions(robot: Robot) -> None:
    arm = ab.Arm(robot)
    for state in random_states(robot, 2):
        for name, count in METHODS.items():
            arguments = [np.asarray(value, float) for value in state[:count]]
            expected = evaluate(robot, name, *arguments)
            expression = getattr(arm.symbolic, name)()
            assert expression.shape == np.shape(expected)
            value = values_of(arm.symbolic, expression, *arguments).reshape(expression.shape)
            assert_allclose(value, expected, rtol=1e-9, atol=1e-9 * max(1.0, np.abs(expected).max()))


@pytest.mark.parametrize("name", ["puma560", "stanford", "kr180", "cobra600", "ur5", "twolink"])
def test_simplified_expressions_have_the_same_values(name: str) -> None:
    arm = ab.load_robot(name)
    q = np.random.default_rng(3).uniform(-2, 2, arm.n)
    symbols = {sympy.Symbol(joint, real=True): value for joint, value in zip(arm.symbolic.names, q)}
    for method in ("fkine", "jacob0", "gravload"):
        expression = getattr(arm.symbolic, method)()
        expected = evaluate(arm.robot, method, q)
        value = np.array(expression.to_sympy().subs(symbols), float).reshape(expected.shape)
        assert_allclose(value, expected, rtol=1e-11, atol=1e-11 * max(1.0, np.abs(expected).max()))


def test_text_is_python() -> None:
    arm = ab.load_robot("cobra600")
    q = np.array((0.3, -0.8, 0.1, 0.7))
    names = {sympy.Symbol(name): value for name, value in zip(arm.symbolic.names, q)}
    T = arm.symbolic.fkine()
    texts = [[T[i, j].text() for j in range(4)] for i in range(4)]
    values = [[float(sympy.sympify(text).subs(names)) for text in row] for row in texts]
    assert_allclose(values, evaluate(arm.robot, "fkine", q), atol=1e-12)


def test_a_planar_arm_has_the_form_of_textbooks() -> None:
    arm = planar()
    assert str(arm.fkine()[:3, 3]) == "l1 c1 + l2 c12\nl1 s1 + l2 s12\n0"
    assert str(arm.jacob0()[:2]) == "-l1 s1 - l2 s12  -l2 s12\nl1 c1 + l2 c12   l2 c12"
    assert str(arm.jacobe()[:2]) == "l1 s2       0\nl1 c2 + l2  l2"
    assert str(arm.inertia()[0, 0]) == "I1 + I2 + m1 r1^2 + m2 (2 l1 r2 c2 + l1^2 + r2^2)"
    assert str(arm.coriolis()[0]) == "-l1 m2 r2 qd2 s2\n-l1 m2 r2 s2 (qd1 + qd2)"
    assert str(arm.gravload()[1]) == "g m2 r2 c12"
    assert str(arm.potential_energy()) == "g (s1 (l1 m2 + m1 r1) + m2 r2 s12)"
    assert arm.fkine()[0, 3].latex(short=True) == r"l_{1} \, c_{1} + l_{2} \, c_{12}"
    assert arm.fkine()[0, 3].text() == "l1*cos(q1) + l2*cos(q1 + q2)"
    assert arm.rne()[1]._repr_latex_() == (
        r"$\displaystyle I_{2} \, \left(\ddot{q_{1}} + \ddot{q_{2}}\right) + "
        r"m_{2} \, r_{2} \, \left(g \, c_{12} + "
        r"l_{1} \, \left(\ddot{q_{1}} \, c_{2} + \dot{q_{1}}^{2} \, s_{2}\right) + "
        r"r_{2} \, \left(\ddot{q_{1}} + \ddot{q_{2}}\right)\right)$"
    )


def test_torques_in_symbols_are_those_of_a_robot_with_the_numbers() -> None:
    numbers = {
        "l1": 0.4,
        "l2": 0.3,
        "m1": 3.0,
        "m2": 1.5,
        "r1": 0.15,
        "r2": 0.1,
        "I1": 0.02,
        "I2": 0.01,
        "g": 9.81,
    }
    links = [
        ab.standard_dh("q1", a=0.4, mass=3.0, centre_of_mass=(-0.25, 0, 0), inertia=(0, 0, 0.02)),
        ab.standard_dh("q2", parent="q1", a=0.3, mass=1.5, centre_of_mass=(-0.2, 0, 0), inertia=(0, 0, 0.01)),
    ]
    robot = Robot(name="numbers", links=tuple(links), gravity=(0, -9.81, 0))
    motion = np.random.default_rng(1).uniform(-2, 2, (3, 2))
    arm = planar()
    for name, count in METHODS.items():
        expression = getattr(arm, name)()
        inputs = [*motion, [numbers[symbol] for symbol in arm.names[6:]]]
        value = Function("f", list(arm.inputs), [expression.casadi])(*inputs).full()
        expected = evaluate(robot, name, *motion[:count])
        assert_allclose(value.reshape(expected.shape), expected, atol=1e-12)
        symbols = {sympy.Symbol(k, real=True): v for k, v in zip(arm.names, np.concatenate(inputs))}
        simplified = np.array(sympy.Matrix([expression.to_sympy()]).subs(symbols), float)
        assert_allclose(simplified.reshape(expected.shape), expected, atol=1e-12)


def test_a_scara_adds_the_angles_of_its_parallel_axes() -> None:
    arm = ab.symbolic_dh([{"a": "l1"}, {"a": "l2", "alpha": pi}, {"sigma": 1, "name": "d3"}, {"d": "d4"}])
    T = arm.fkine()
    assert T.text() == (
        "cos(q1 + q2 - q4)  sin(q1 + q2 - q4)   0   l1*cos(q1) + l2*cos(q1 + q2)\n"
        "sin(q1 + q2 - q4)  -cos(q1 + q2 - q4)  0   l1*sin(q1) + l2*sin(q1 + q2)\n"
        "0                  0                   -1  -d4 - d3\n"
        "0                  0                   0   1"
    )


def test_the_puma_has_the_form_of_craig() -> None:
    T = puma().fkine()
    assert str(T[0, 0]).startswith("c1 (c23 (c4 c5 c6 - s4 s6) - s23 s5 c6) + s1 (c4 s6 + s4 c5 c6)")
    assert str(T[0, 2]) == "-c1 (c23 c4 s5 + s23 c5) - s1 s4 s5"
    assert str(T[0, 3]) == "c1 (a2 c2 + a3 c23 - d4 s23) - d3 s1"
    assert str(T[1, 3]) == "d3 c1 + s1 (a2 c2 + a3 c23 - d4 s23)"
    assert str(T[2]) == (
        "s23 (s4 s6 - c4 c5 c6) - c23 s5 c6\nc23 s5 s6 + s23 (c4 c5 s6 + s4 c6)\ns23 c4 s5 - c23 c5\n"
        "-a2 s2 - d4 c23 - a3 s23"
    )


def test_the_stanford_arm_has_the_form_of_textbooks() -> None:
    rows = [
        {"alpha": -pi / 2},
        {"alpha": pi / 2, "d": "d2"},
        {"sigma": 1, "name": "q3"},
        {"alpha": -pi / 2},
        {"alpha": pi / 2},
        {"d": "d6"},
    ]
    T = ab.symbolic_dh(rows).fkine()
    # Spong, Hutchinson, Vidyasagar, Robot Modeling and Control, example 3.5.
    assert str(T[2, 2]) == "c2 c5 - s2 c4 s5"
    q, d2, d6 = (
        [sympy.Symbol(f"q{k}", real=True) for k in range(1, 7)],
        *(sympy.Symbol(name, real=True) for name in ("d2", "d6")),
    )
    c, s = [sympy.cos(x) for x in q], [sympy.sin(x) for x in q]
    dx = (
        c[0] * s[1] * q[2]
        - s[0] * d2
        + d6 * (c[0] * c[1] * c[3] * s[4] + c[0] * c[4] * s[1] - s[0] * s[3] * s[4])
    )
    assert sympy.expand(T[0, 3].to_sympy() - dx) == 0


def test_constants_are_exact() -> None:
    arm = ab.load_robot("puma560")
    text = arm.symbolic.fkine().text()
    assert "e-1" not in text
    offset = ab.symbolic_dh([{"a": "l", "offset": pi / 3}, {"a": 0.5, "offset": -pi / 2}])
    assert offset.fkine()[0, 0].text() == "sin(q1 + q2 + pi/3)"
    angle = sympy.Symbol("q1", real=True) + sympy.Symbol("q2", real=True) + sympy.pi / 3
    assert offset.fkine()[0, 0].to_sympy() == sympy.sin(angle)
    assert offset.fkine()[1, 1].latex() == r"\sin\left(q_{1} + q_{2} + \frac{\pi}{3}\right)"
    assert ab.symbolic_dh([{"a": 1e-9}]).fkine()[0, 3].latex() == r"1 \cdot 10^{-9} \, \cos\left(q_{1}\right)"


def test_numbers_of_a_robot_become_symbols() -> None:
    arm = ab.load_robot("twolink").symbolic
    named = arm.with_symbols({"link1": {"a": "a1"}}).with_symbols(
        {"link2": {"a": "2*b"}}, gravity=(0, 0, "-g")
    )
    assert str(named.fkine()[0, 3]).startswith("a1 c1 + 2 b c12")
    assert named.names[6:] == ("a1", "b", "g")
    assert "symbols a1, b, g" in repr(named)
    assert (named.q.numel(), named.qd.numel(), named.qdd.numel(), named.symbols.numel()) == (2, 2, 2, 3)
    copy = pickle.loads(pickle.dumps(named.fkine()[0, 3]))
    assert copy.text() == named.fkine()[0, 3].text()
    friction = ab.symbolic_dh([{"a": 1.0, "motor": ab.Motor(gear_ratio=2.0, coulomb_friction=(0.5, -0.25))}])
    assert friction.rne()[0].text() == "(0 < qd1) - 0.5*(qd1 < 0)"
    assert friction.rne()[0].latex() == (
        r"\left[0 < \dot{q_{1}}\right] - 0.5 \, \left[\dot{q_{1}} < 0\right]"
    )
    values = {sympy.Symbol("qd1", real=True): -1.0}
    assert friction.rne()[0].to_sympy().subs(values) == sympy.Rational(-1, 2)


def test_frames_have_symbolic_poses() -> None:
    arm = ab.load_robot("puma560")
    q = np.linspace(-1, 1, 6)
    assert_allclose(
        values_of(arm.symbolic, arm.symbolic.fkine("link3"), q), arm.fkine(q, frame="link3"), atol=1e-12
    )
    assert_allclose(
        values_of(arm.symbolic, arm.symbolic.jacobe("link5"), q), arm.jacobe(q, frame="link5"), atol=1e-12
    )
    assert "at link3" in repr(arm.symbolic.fkine("link3"))
    with pytest.raises(UnknownNameError, match="there is no frame named 'nowhere'"):
        arm.symbolic.fkine("nowhere")


def test_long_expressions_have_no_text() -> None:
    long = ab.load_robot("puma560").symbolic.rne()
    with pytest.raises(InputError, match=r"the expression has 8\d\d terms.*Fix: take one entry"):
        long.text()
    assert long._repr_latex_() is None and str(long) == repr(long)


def test_expressions_beyond_the_budget_are_not_simplified(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(arithmetic, "MAX_PRODUCTS", 5)
    arm = ab.load_robot("twolink")
    inertia = arm.symbolic.inertia()
    with pytest.raises(InputError, match="the expression has very many terms"):
        inertia.latex()
    assert "too many terms for text" in str(inertia)
    symbols = {sympy.Symbol(name, real=True): value for name, value in zip(arm.symbolic.names, (0.3, 0.4))}
    value = np.array(inertia.to_sympy().subs(symbols), float)
    assert_allclose(value, evaluate(arm.robot, "inertia", np.array((0.3, 0.4))), atol=1e-12)


def test_what_has_no_symbolic_form_is_refused() -> None:
    robot = four_bar().with_link("crank", motor=ab.Motor(inertia=0.01))
    arm = ab.Arm(robot).symbolic
    assert arm.fkine().shape == (4, 4)
    for method in (arm.rne, arm.gravload):
        with pytest.raises(RobotError, match="with closed loops is the solution of equations"):
            method()
    x = SX.sym("x")
    with pytest.raises(InputError, match=r"the operation OP_ERF, which has no form in text"):
        arithmetic.sums_of(Function("f", [x], [erf(x)]), [[Sum.number(1.0)]], "here")


def test_wrong_symbols_are_refused() -> None:
    arm = ab.load_robot("stanford").symbolic
    with pytest.raises(UnknownNameError, match=r"no field with symbols named 'alpha'"):
        arm.with_symbols({"link1": {"alpha": "x"}})
    with pytest.raises(InputError, match="link 'link3' has a prismatic joint, whose d is its coordinate"):
        arm.with_symbols({"link3": {"d": "x"}})
    with pytest.raises(InputError, match="link 'link4' has no D-H row"):
        ab.Arm(build_random_tree(2)).symbolic.with_symbols(
            {ab.Arm(build_random_tree(2)).robot.links[0].name: {"a": "l"}}
        )
    with pytest.raises(InputError, match="two symbols have the name 'link2'"):
        arm.with_symbols({"link1": {"mass": "link2"}})
    with pytest.raises(InputError, match=r"2 values are given.*Allowed: 3 numbers or formulas"):
        arm.with_symbols({"link1": {"centre_of_mass": (0, "x")}})
    with pytest.raises(InputError, match="neither a number nor a string"):
        arm.with_symbols({"link1": {"mass": None}})
    with pytest.raises(InputError, match=r"the formula '\[1 2\]' has 2 values"):
        arm.with_symbols({"link1": {"mass": "[1 2]"}}).inertia()
    with pytest.raises(UnknownNameError, match="there is no D-H convention named 'craig'"):
        ab.symbolic_dh([{"a": 1.0}], convention="craig")
    with pytest.raises(InputError, match=r"the index is \(0, 9\)"):
        arm.fkine()[0, 9]
    with pytest.raises(InputError, match="has no entries"):
        arm.fkine()[0:0]
    with pytest.raises(InputError, match="is already the part"):
        arm.fkine()[0][1]

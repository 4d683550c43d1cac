"""Acceptance tests of stiff systems, loops, arms, analysis and structure, with independent references."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq

import armblocks as ab
from armblocks import blocks as bl
from armblocks.robot import serial_chain

Array = NDArray[np.float64]


def system_of(name: str, rates: Sequence[str], start: Sequence[float]) -> ab.Diagram:
    """Build one integrator and one formula in ``u1, u2, …`` and ``t`` for every state ``y1, y2, …``."""
    builder = ab.DiagramBuilder(name)
    states = [builder.add(f"y{i + 1}", bl.Integrator(initial=value)) for i, value in enumerate(start)]
    for i, formula in enumerate(rates):
        inputs = {"u": states[0]} if len(states) == 1 else {f"u{j + 1}": y for j, y in enumerate(states)}
        rate = builder.add(f"rate{i + 1}", bl.Expression(formula=formula, inputs=len(states)), **inputs)
        builder.connect(rate, states[i]["u"])
    return builder.build()


def ends(result: ab.SimulationResult, count: int) -> Array:
    return np.array([result[f"y{i + 1}"][-1] for i in range(count)])


# -- stiff -------------------------------------------------------------------------------------------------

HIRES = (
    "-1.71*u1 + 0.43*u2 + 8.32*u3 + 0.0007",
    "1.71*u1 - 8.75*u2",
    "-10.03*u3 + 0.43*u4 + 0.035*u5",
    "8.32*u2 + 1.71*u3 - 1.12*u4",
    "-1.745*u5 + 0.43*u6 + 0.43*u7",
    "-280*u6*u8 + 0.69*u4 + 1.71*u5 - 0.43*u6 + 0.69*u7",
    "280*u6*u8 - 1.81*u7",
    "-280*u6*u8 + 1.81*u7",
)
# Mazzia, Magherini, Test Set for IVP Solvers, 2008: at 321.8122 s
HIRES_END = (
    0.7371312573325668e-3,
    0.1442485726316185e-3,
    0.5888729740967575e-4,
    0.1175651343283149e-2,
    0.2386356198831331e-2,
    0.6238968252742796e-2,
    0.2849998395185769e-2,
    0.2850001604814231e-2,
)
OREGONATOR = (
    "77.27*(u2 + u1*(1 - 8.375e-6*u1 - u2))",
    "(u3 - (1 + u1)*u2)/77.27",
    "0.161*(u1 - u3)",
)
OREGONATOR_END = (
    0.1000814870318523e1,
    0.1228178521549917e4,
    0.1320554942846706e3,
)  # at 360 s, from the same source


@pytest.mark.parametrize("solver", ["auto", "rodas5p"])
def test_hires_agrees_with_the_published_end_values(solver: str, tmp_path: Path) -> None:
    diagram = system_of("hires", HIRES, (1, 0, 0, 0, 0, 0, 0, 0.0057))
    settings = {"stop_time": 321.8122, "solver": solver, "rtol": 1e-8, "atol": 1e-12}
    result = ab.simulate(diagram, **settings)
    np.testing.assert_allclose(ends(result, 8), HIRES_END, rtol=2e-6)
    ab.save_diagram(diagram, tmp_path / "hires.json")
    reloaded = ab.simulate(ab.load_diagram(tmp_path / "hires.json"), **settings)
    assert ends(reloaded, 8).tolist() == ends(result, 8).tolist()


@pytest.mark.parametrize("solver", ["auto", "rodas5p"])
def test_the_oregonator_agrees_with_the_published_end_values(solver: str) -> None:
    diagram = system_of("oregonator", OREGONATOR, (1.0, 2.0, 3.0))
    result = ab.simulate(diagram, stop_time=360.0, solver=solver, rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(ends(result, 3), OREGONATOR_END, rtol=2e-6)


def test_a_diode_rectifier_agrees_with_scipy() -> None:
    """C v' = Is (exp((sin(w t) 5 - v)/Ut) - 1) - v/R: rates from 1e3 to more than 1e7 1/s."""
    formula = "(1e-9*(exp((5*sin(314.159265358979*t) - u)/0.0259) - 1) - u/1000)/1e-5"
    diagram = system_of("rectifier", (formula,), (0.0,))
    result = ab.simulate(diagram, stop_time=0.04, solver="auto", rtol=1e-8, atol=1e-10)

    def rate(t: float, v: Array) -> Array:
        return (1e-9 * (np.exp((5 * np.sin(314.159265358979 * t) - v) / 0.0259) - 1) - v / 1000) / 1e-5

    expected = solve_ivp(rate, (0, 0.04), [0.0], "Radau", t_eval=result.time, rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(result["y1"], expected.y[0], atol=2e-6)
    assert result["y1"].max() > 4.0


def test_a_brusselator_of_two_vectors_agrees_with_scipy() -> None:
    """u' = 1 + u^2 v - 4 u + D u, v' = 3 u - u^2 v + D v on 20 points with fixed boundary values."""
    n, diffusion = 20, 0.02 * 21**2
    D = diffusion * (np.diag(np.full(n, -2.0)) + np.diag(np.ones(n - 1), 1) + np.diag(np.ones(n - 1), -1))
    position = np.arange(1, n + 1) / (n + 1)
    edge = diffusion * (np.arange(n) % (n - 1) == 0)
    builder = ab.DiagramBuilder("brusselator")
    u = builder.add("u", bl.Integrator(initial=1.0 + np.sin(2 * np.pi * position)))
    v = builder.add("v", bl.Integrator(initial=np.full(n, 3.0)))
    for name, state, reaction, boundary_value in (
        ("du", u, "1 + u1^2*u2 - 4*u1", 1.0),
        ("dv", v, "3*u1 - u1^2*u2", 3.0),
    ):
        reaction_rate = builder.add(f"{name} reaction", bl.Expression(formula=reaction, inputs=2), u, v)
        diffusion_rate = builder.add(f"{name} diffusion", bl.MatrixGain(gain=D), state)
        boundary = builder.add(f"{name} boundary", bl.Constant(value=boundary_value * edge))
        builder.connect(
            builder.add(name, bl.Sum(signs="+++"), reaction_rate, diffusion_rate, boundary), state["u"]
        )
    result = ab.simulate(builder.build(), stop_time=10.0, solver="rodas5p", rtol=1e-8, atol=1e-10)

    def rate(_: float, y: Array) -> Array:
        a, b = y[:n], y[n:]
        return np.concatenate([1 + a * a * b - 4 * a + D @ a + edge, 3 * a - a * a * b + D @ b + 3 * edge])

    y0 = np.concatenate([1.0 + np.sin(2 * np.pi * position), np.full(n, 3.0)])
    expected = solve_ivp(rate, (0, 10), y0, "Radau", rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(result["u"][-1], expected.y[:n, -1], rtol=1e-6)


# -- loops -------------------------------------------------------------------------------------------------

RUNS = pytest.mark.parametrize(
    "settings",
    [
        {"solver": "rk4", "step": 0.01},
        {"solver": "rk45", "rtol": 1e-10, "atol": 1e-12},
        {"solver": "rodas5p", "rtol": 1e-9, "atol": 1e-11},
    ],
    ids=["fixed", "adaptive", "stiff"],
)


@RUNS
def test_the_solution_of_a_loop_with_three_solutions_stays_on_its_branch(
    settings: Mapping[str, object],
) -> None:
    """w = 0.9 tanh(3 w) + 0.3 + 0.05 sin t: the branch nearest to 0, compared with a bracketing method."""
    builder = ab.DiagramBuilder("branches")
    drive = builder.add("drive", bl.SineWave(amplitude=0.05))
    loop = builder.add("loop", bl.Expression(formula="0.9*tanh(3*u1) + u2 + 0.3", inputs=2), u2=drive)
    builder.connect(loop, loop["u1"])
    builder.add("area", bl.Integrator(), loop)
    result = ab.simulate(builder.build(), stop_time=6.0, sample_time=0.1, **settings)

    def root(t: float) -> float:
        return brentq(lambda w: w - 0.9 * math.tanh(3 * w) - 0.05 * math.sin(t) - 0.3, -0.4, 0.0, xtol=1e-15)

    expected = np.array([root(t) for t in result.time])
    np.testing.assert_allclose(result["loop"], expected, atol=1e-12)


@RUNS
def test_a_vector_loop_through_a_matrix_solve_agrees_with_its_closed_form(
    settings: Mapping[str, object],
) -> None:
    """A w = b - 0.3 w with b = (cos t, sin t): a linear loop, whose integral has a closed form."""
    A = np.array([[3.0, 1.0], [-1.0, 2.0]])
    builder = ab.DiagramBuilder("solve")
    b = builder.add(
        "b",
        bl.Mux(inputs=2),
        builder.add("cos", bl.SineWave(phase=math.pi / 2)),
        builder.add("sin", bl.SineWave()),
    )
    rest = builder.add("rest", bl.Sum(signs="+-"), b)
    solve = builder.add("solve", bl.LinearSolve(), builder.add("A", bl.Constant(value=A)), rest)
    builder.connect(builder.add("part", bl.Gain(gain=0.3), solve), rest["u2"])
    builder.add("integral", bl.Integrator(initial=np.zeros(2)), solve)
    result = ab.simulate(builder.build(), stop_time=3.0, sample_time=0.1, **settings)
    t = result.time
    inverse = np.linalg.inv(A + 0.3 * np.eye(2))
    expected = np.stack([np.cos(t), np.sin(t)], axis=1) @ inverse.T
    np.testing.assert_allclose(result["solve"].reshape(-1, 2), expected, atol=1e-13)
    area = np.stack([np.sin(t), 1 - np.cos(t)], axis=1) @ inverse.T
    np.testing.assert_allclose(result["integral"].reshape(-1, 2), area, atol=1e-9)


def test_a_loop_whose_solution_ceases_to_exist_is_reported_at_that_time() -> None:
    """w^2 + w/2 = 1 - t has a root until 1 1/16 s, and none later."""
    builder = ab.DiagramBuilder("fold")
    x = builder.add("x", bl.Integrator(), builder.add("one", bl.Constant(value=1.0)))
    fold = builder.add("fold", bl.Expression(formula="0.5*u1 - u1^2 + 1 - u2", inputs=2), u2=x)
    builder.connect(fold, fold["u1"])
    with pytest.raises(
        ab.errors.SimulationError,
        match="found no solution of the implicit equations of the loop through 'fold'",
    ) as error:
        ab.simulate(builder.build(), stop_time=2.0)
    assert len(str(error.value)) < 400
    assert error.value.partial.time[-1] == pytest.approx(1.0625, abs=0.01)


@RUNS
def test_a_loop_with_a_singular_initial_guess_is_solved(settings: Mapping[str, object]) -> None:
    """w^2 = 1 + t: the derivative is 0 at the guess w = 0; the positive root is found from there."""
    builder = ab.DiagramBuilder("root")
    time = builder.add("time", bl.Clock())
    loop = builder.add("loop", bl.Expression(formula="u1 - u1^2 + 1 + u2", inputs=2), u2=time)
    builder.connect(loop, loop["u1"])
    builder.add("area", bl.Integrator(), loop)
    result = ab.simulate(builder.build(), stop_time=3.0, sample_time=0.1, **settings)
    np.testing.assert_allclose(result["loop"], np.sqrt(1 + result.time), atol=1e-12)
    np.testing.assert_allclose(result["area"], ((1 + result.time) ** 1.5 - 1) * 2 / 3, atol=3e-9)


# -- analysis ----------------------------------------------------------------------------------------------


def cart() -> ab.Diagram:
    """A pendulum (m, l) on a cart (M) with a force: states p, a, v, w; a = 0 is upright."""
    M, m, length, g = 2.0, 0.5, 0.8, 9.81
    den = f"({M} + {m}*sin(u2)^2)"
    push = f"(u5 + {m}*sin(u2)*({length}*u4^2 - {g}*cos(u2)))"
    turn = f"(-u5*cos(u2) - {m}*{length}*u4^2*cos(u2)*sin(u2) + {M + m}*{g}*sin(u2))"
    builder = ab.DiagramBuilder("cart")
    states = {name: builder.add(name, bl.Integrator()) for name in ("p", "a", "v", "w")}
    force = builder.add("force", bl.Constant(value=0.0))
    builder.connect(states["v"], states["p"]["u"])
    builder.connect(states["w"], states["a"]["u"])
    for name, formula in (("v", f"{push}/{den}"), ("w", f"{turn}/({length}*{den})")):
        rate = builder.add(f"{name}'", bl.Expression(formula=formula, inputs=5), *states.values(), force)
        builder.connect(rate, states[name]["u"])
    return builder.build()


def test_a_pendulum_on_a_cart_is_trimmed_and_linearised() -> None:
    """Upright: A and B of the textbook; the unstable pole is sqrt((M + m) g / (M l))."""
    diagram = cart()
    point = ab.trim(diagram, free=["force.value"], guess={"a": 0.2}, states={"p": 0.0})
    system = ab.linearize(diagram, "force", ["p", "a"], at=point.point)
    M, m, length, g = 2.0, 0.5, 0.8, 9.81
    poles = np.sort(np.asarray(system.poles()).real)
    edge = math.sqrt((M + m) * g / (M * length))
    np.testing.assert_allclose(poles[[0, -1]], [-edge, edge], rtol=1e-9)
    w = 3.0
    response = np.asarray(system.frequency_response([w])).reshape(2)
    angle = -1 / (M * length) / (-(w**2) - edge**2)
    np.testing.assert_allclose(response[1], angle, rtol=1e-9)


def planar() -> ab.Robot:
    """Two uniform rods in a vertical plane: lengths 1 and 0.7 m, masses 2 and 1.5 kg."""
    rods = ((1.0, 2.0), (0.7, 1.5))
    links = tuple(
        ab.standard_dh(
            f"rod{i + 1}",
            a=length,
            mass=mass,
            centre_of_mass=(-length / 2, 0.0, 0.0),
            inertia=np.diag([0.0, mass * length**2 / 12, mass * length**2 / 12]),
        )
        for i, (length, mass) in enumerate(rods)
    )
    return ab.Robot(name="planar", links=serial_chain(links), gravity=(0.0, -9.81, 0.0))


def planar_acceleration(q: Array, qd: Array, tau: Array, payload: float = 0.0) -> Array:
    """Lagrange's equations derived by hand; a payload is a point mass at the tip."""
    l1, l2, m1, m2, g = 1.0, 0.7, 2.0, 1.5, 9.81
    c1, c2, i1, i2 = l1 / 2, l2 / 2, m1 * l1**2 / 12, m2 * l2**2 / 12
    cos = math.cos(q[1])
    h = (m2 * l1 * c2 + payload * l1 * l2) * math.sin(q[1])
    m22 = i2 + m2 * c2**2 + payload * l2**2
    m12 = m22 + (m2 * l1 * c2 + payload * l1 * l2) * cos
    m11 = i1 + m1 * c1**2 + (m2 + payload) * l1**2 + m22 + 2 * (m2 * l1 * c2 + payload * l1 * l2) * cos
    g2 = (m2 * c2 + payload * l2) * g * math.cos(q[0] + q[1])
    g1 = (m1 * c1 + (m2 + payload) * l1) * g * math.cos(q[0]) + g2
    bias = np.array([-h * (2 * qd[0] * qd[1] + qd[1] ** 2) + g1, h * qd[0] ** 2 + g2])
    return np.linalg.solve([[m11, m12], [m12, m22]], tau - bias)


@RUNS
def test_the_motion_of_a_planar_arm_agrees_with_lagranges_equations(settings: Mapping[str, object]) -> None:
    builder = ab.DiagramBuilder("fall")
    torque = builder.add("torque", bl.Constant(value=(1.0, -0.5)))
    builder.add("arm", bl.ForwardDynamics(robot=planar(), q0=(0.4, -0.9)), torque)
    finer = {**settings, "step": 0.002} if "step" in settings else settings
    result = ab.simulate(builder.build(), stop_time=1.5, sample_time=0.05, **finer)

    def rate(_: float, y: Array) -> Array:
        return np.concatenate([y[2:], planar_acceleration(y[:2], y[2:], np.array([1.0, -0.5]))])

    expected = solve_ivp(
        rate, (0, 1.5), [0.4, -0.9, 0, 0], "DOP853", t_eval=result.time, rtol=1e-12, atol=1e-13
    )
    np.testing.assert_allclose(result["arm/q"], expected.y[:2].T, atol=2e-7)


def test_the_torque_with_a_payload_agrees_with_lagranges_equations() -> None:
    q, qd, qdd = np.array([0.3, -1.1]), np.array([0.7, -0.2]), np.array([1.0, 2.0])
    free = planar_acceleration(q, qd, np.zeros(2), 0.8)
    inverse = [planar_acceleration(q, qd, unit, 0.8) - free for unit in np.eye(2)]
    tau = np.linalg.solve(np.array(inverse).T, qdd - free)
    actual = ab.Arm(planar()).rne(q, qd, qdd, payload=ab.Payload(mass=0.8))
    np.testing.assert_allclose(actual, tau, rtol=1e-12)


def test_the_linearised_arm_agrees_with_differences_of_lagranges_equations() -> None:
    builder = ab.DiagramBuilder("linear")
    torque = builder.add("torque", bl.Constant(value=(0.0, 0.0)))
    builder.add("arm", bl.ForwardDynamics(robot=planar(), q0=(0.4, -0.9), qd0=(0.5, -0.3)), torque)
    system = ab.linearize(builder.build(), "torque", "arm/qdd")
    q, qd = np.array([0.4, -0.9]), np.array([0.5, -0.3])
    steps = 1e-6 * np.eye(4)

    def qdd(y: Array) -> Array:
        return planar_acceleration(y[:2], y[2:], np.zeros(2))

    y = np.concatenate([q, qd])
    slopes = np.array([(qdd(y + d) - qdd(y - d)) / 2e-6 for d in steps]).T
    np.testing.assert_allclose(system.A[2:], slopes, atol=1e-7)
    unit = [planar_acceleration(q, qd, np.eye(2)[i]) - qdd(y) for i in range(2)]
    np.testing.assert_allclose(system.B[2:], np.array(unit).T, rtol=1e-9)


# -- structure ---------------------------------------------------------------------------------------------


@RUNS
def test_two_tanks_on_a_bus_agree_with_the_matrix_exponential(
    settings: Mapping[str, object], tmp_path: Path
) -> None:
    """Lags of 1 s and 0.5 s in series, connected by tags and a bus, compared with the matrix exponential."""

    def tank(rate: float) -> ab.Diagram:
        inner = ab.DiagramBuilder("tank")
        level = inner.add("level", bl.Integrator())
        flow = inner.add("flow", bl.Sum(signs="+-"), inner.input("in"), level)
        inner.connect(inner.add("rate", bl.Gain(gain=rate), flow), level["u"])
        inner.output("out", level)
        return inner.build()

    builder = ab.DiagramBuilder("tanks")
    inflow = builder.add("inflow", bl.Step(time=0.5, final=2.0))
    first = builder.add("first", bl.Subsystem(diagram=tank(1.0)), inflow)
    builder.add("send", bl.Goto(tag="upper"), first)
    received = builder.add("receive", bl.From(tag="upper"))
    second = builder.add("second", bl.Subsystem(diagram=tank(2.0)), received)
    bus = builder.add("bus", bl.BusCreator(names="upper, lower"), first, second)
    chosen = builder.add("chosen", bl.BusSelector(elements="lower"), bus)
    builder.add("total", bl.Integrator(), chosen)
    diagram = builder.build()
    result = ab.simulate(diagram, stop_time=4.0, sample_time=0.1, **settings)
    A = np.array([[-1.0, 0.0, 0.0, 1.0], [2.0, -2.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0] * 4])
    expected = np.array([expm(A * max(t - 0.5, 0.0)) @ [0, 0, 0, 2.0] for t in result.time])
    np.testing.assert_allclose(result["total"], expected[:, 2], atol=3e-8)
    np.testing.assert_allclose(result["second/level"], expected[:, 1], atol=3e-8)
    ab.save_diagram(diagram, tmp_path / "tanks.json")
    reloaded = ab.simulate(
        ab.load_diagram(tmp_path / "tanks.json"), stop_time=4.0, sample_time=0.1, **settings
    )
    assert np.array_equal(reloaded["total"], result["total"])

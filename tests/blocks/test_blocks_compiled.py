"""Stateless blocks: native code agrees with CasADi's interpreter, and files keep all parameters."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from armblocks.blocks import (
    BLOCKS,
    Assignment,
    CombinatorialLogic,
    Constant,
    CTraj,
    Demux,
    Determinant,
    Expression,
    Extremum,
    FromTable,
    LinearSolve,
    LookupTableND,
    MathFunction,
    MatrixPower,
    Modulo,
    MultiportSwitch,
    MultiSegment,
    Mux,
    Norm,
    Rounding,
    Rpy2T,
    SineWave,
    T2AngleAxis,
    T2eul,
    T2Quaternion,
    T2rpy,
    Trapezoidal,
    Trigonometry,
)
from armblocks.diagram import Diagram, DiagramBuilder, trace_diagram
from armblocks.formats import read_diagram, write_diagram
from armblocks.integration.system import compile_system


@pytest.fixture(scope="module")
def diagram() -> Diagram:
    """Blocks of each family with inputs that cross zero and pass table segments and singular poses."""
    random = np.random.default_rng(31)
    b = DiagramBuilder("stateless blocks")
    u = b.add("u", SineWave(amplitude=[2.0, 1.5, 1.0], frequency=[1.0, 3.0, 2.0], phase=[0.1, 1.0, 2.0]))
    one, two = (b.add(f"u{k}", Expression(formula=f"u[{k}]"), u) for k in (1, 2))
    for name, function in (("mod", "mod"), ("rem", "rem")):
        b.add(name, Modulo(function=function), u, two)
    for function in ("floor", "ceil", "round", "fix"):
        b.add(function, Rounding(function=function), u)
    for function in ("cbrt", "expm1", "10^u"):
        b.add(f"f{function}", MathFunction(function=function), u)
    b.add("asinh", Trigonometry(function="asinh"), u)
    b.add("norm", Norm(norm="inf"), u)
    b.add("least", Extremum(), u)
    b.add("assign", Assignment(indices=[2]), u, one)
    b.add("choose", MultiportSwitch(inputs=2), two, u, one)
    first = b.add("first", Demux(parts=3), u)["y1"]
    pair = b.add("pair", Expression(formula="u > k", names="k", values=0.5), first)
    b.add("table", CombinatorialLogic(), b.add("both", Mux(), pair, pair))
    b.add("formula", Expression(formula="if(u[1] > 0 && u[2] < 1, sin(u[1])^2, -k * t)", names="k"), u)
    axes = np.sort(random.uniform(-2, 2, (2, 4)), axis=1)
    for method in ("linear", "nearest", "flat", "cubic"):
        surface = LookupTableND(positions=axes.ravel(), table=random.normal(size=(4, 4)), method=method)
        b.add(f"surface {method}", surface, one, two)
    solid = LookupTableND(positions=[0, 1] * 3, table=random.normal(size=(2, 2, 2)), extrapolation="linear")
    b.add("solid", solid, one, two, one)
    b.add("course", FromTable(times=[0, 1, 3, 4], values=random.normal(size=(4, 2)), method="cubic"))
    T = b.add("T", Rpy2T(), one, two, one)
    for name, block in (("rpy", T2rpy()), ("eul", T2eul()), ("q", T2Quaternion()), ("aa", T2AngleAxis())):
        b.add(name, block, T)
    b.add("way", CTraj(tmax=4.0), b.add("T0", Constant(value=np.eye(4))), T)
    b.add("det", Determinant(), T)
    b.add("solve", LinearSolve(), T, b.add("B", Constant(value=[1.0, 2.0, 3.0, 4.0])))
    b.add("power", MatrixPower(exponent=-2), T)
    b.add("lspb", Trapezoidal(tmax=4.0))
    b.add("mstraj", MultiSegment())
    return b.build()


def test_native_code_agrees_with_the_interpreter(diagram: Diagram) -> None:
    system = trace_diagram(diagram)
    compiled = compile_system(system)
    times, p = np.linspace(0.0, 5.0, 101), system.parameter_values
    modes = np.random.default_rng(5).integers(0, 2, system.discrete.size).astype(float)
    no_states = np.zeros((101, 0))
    native = compiled.evaluate_signals(times, no_states, np.tile(modes, (101, 1)), no_states, p)
    interpreted = np.array([system.signals(t, (), modes, (), p)[0] for t in times]).T
    # The operations are the same. Multiply-adds may be fused, and elementary functions differ by up to two
    # units in the last place.
    assert native == pytest.approx(interpreted, rel=1e-11, abs=1e-12)


def test_a_file_keeps_a_diagram_with_three_dimensional_tables(diagram: Diagram, tmp_path: Path) -> None:
    path = tmp_path / "diagram.json"
    write_diagram(path, diagram)
    assert read_diagram(path, BLOCKS).blocks == diagram.blocks

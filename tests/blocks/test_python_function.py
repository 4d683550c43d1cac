"""Blocks whose equation is a Python function: traced, compiled, differentiated, saved in files."""

from __future__ import annotations

from pathlib import Path

import casadi
import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import Clock, Constant, Derivative, Expression, Integrator, PythonFunction, SineWave
from armblocks.diagram import Block, Diagram, DiagramBuilder, trace_diagram
from armblocks.equations import SimulationOptions
from armblocks.errors import DiagramError, FormatError, InputError
from armblocks.simulation import SimulationResult, simulate
from compiled_diagrams import compiled

CODE = """
import numpy as np

def law(u, t, gain=2.0):
    return gain * np.sin(u) + t

number = 3
"""


def diagram_with_sources(block: Block, *sources: Block) -> Diagram:
    builder = DiagramBuilder("d")
    feeds = [builder.add(f"u{k}", source) for k, source in enumerate(sources)]
    builder.add("f", block, *feeds)
    return builder.build()


def run(diagram: Diagram, solver: str = "auto", step: float | None = None) -> SimulationResult:
    options = SimulationOptions(
        stop_time=2.0, sample_time=0.1, solver=solver, step=step, rtol=1e-10, atol=1e-12
    )
    return simulate(compiled(diagram), options)


def test_a_function_of_scalars_vectors_and_the_time_agrees_with_numpy() -> None:
    def law(q, k, t):  # type: ignore[no-untyped-def]
        return k * np.sin(q) + q[::-1] * t

    q = SineWave(amplitude=[1.0, 2.0, 0.5], frequency=3.0)
    result = run(diagram_with_sources(PythonFunction(function=law), q, Clock()))
    t, q = result.time[:, None], result["u0/y"]
    np.testing.assert_allclose(result["f/y"], t * np.sin(q) + q[:, ::-1] * t, rtol=1e-13, atol=1e-15)


def test_a_function_of_matrices_with_several_results_agrees_with_numpy() -> None:
    def both(A, b):  # type: ignore[no-untyped-def]
        return A @ b, b @ A @ b, A.T

    A, b = np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([0.5, -1.0])
    result = run(
        diagram_with_sources(
            PythonFunction(function=both, results="x, s, B"), Constant(value=A), Constant(value=b)
        )
    )
    np.testing.assert_allclose(result["f/x"][0], A @ b)
    np.testing.assert_allclose(result["f/s"][0], b @ A @ b)
    np.testing.assert_allclose(result["f/B"][0], A.T)


@pytest.mark.parametrize(("solver", "step"), [("rk45", None), ("rk4", 0.01)])
def test_a_python_function_agrees_with_the_equal_expression(solver: str, step: float | None) -> None:
    def rate(u):  # type: ignore[no-untyped-def]
        return casadi.if_else(u > 0.5, u**2, casadi.fabs(u) / (1 + np.exp(-u)))

    def diagram(block: Block) -> Diagram:
        builder = DiagramBuilder("d")
        block_handle = builder.add("f", block, builder.add("u", SineWave(frequency=2.0)))
        builder.add("x", Integrator(), block_handle)
        builder.add("d", Derivative(), block_handle)
        return builder.build()

    one = run(diagram(PythonFunction(function=rate)), solver, step)
    other = run(diagram(Expression(formula="if(u > 0.5, u^2, abs(u) / (1 + exp(-u)))")), solver, step)
    for name in ("f/y", "x/y", "d/y"):
        np.testing.assert_array_equal(one[name], other[name])


def test_a_file_names_the_function_and_needs_trust(tmp_path: Path) -> None:
    (tmp_path / "control.py").write_text(CODE)
    document = ab.save_diagram(diagram_with_sources(PythonFunction(), SineWave()), tmp_path / "d.json")
    text = document.read_text()
    assert '"function": ""' in text
    document.write_text(text.replace('"function": ""', '"function": "control.py:law"'))
    with pytest.raises(
        FormatError,
        match=r"d\.json:\d+.*'control\.py:law' is Python code, which is run only for a trusted diagram",
    ):
        ab.load_diagram(document)
    diagram = ab.load_diagram(document, trust=True)
    result = run(diagram)
    expected = 2.0 * np.sin(np.sin(result.time)) + result.time
    np.testing.assert_allclose(result["f/y"], expected, atol=1e-14)
    # saved again: the same text and the same diagram
    saved = ab.save_diagram(diagram, tmp_path / "e.json")
    assert '"function": "control.py:law"' in saved.read_text()
    assert ab.load_diagram(saved, trust=True) == diagram


@pytest.mark.parametrize(
    ("reference", "message"),
    [
        ("control.py:missing", r"control\.py has no function named 'missing'"),
        ("control.py:number", r"control\.py has no function named 'number'"),
        ("other.py:law", "is not a function of a file"),
        ("broken.py:law", r"the code of broken\.py, line 1, fails: ZeroDivisionError"),
    ],
)
def test_invalid_references_to_functions_are_refused(reference: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "control.py").write_text(CODE)
    (tmp_path / "broken.py").write_text("1 / 0\n")
    document = ab.save_diagram(diagram_with_sources(PythonFunction(), SineWave()), tmp_path / "d.json")
    document.write_text(document.read_text().replace('"function": ""', f'"function": "{reference}"'))
    with pytest.raises(FormatError, match=message):
        ab.load_diagram(document, trust=True)


def test_a_function_of_a_session_cannot_be_saved(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"<lambda> is not defined in a file.*move it to a file"):
        ab.save_diagram(
            diagram_with_sources(PythonFunction(function=lambda u: 2 * u), SineWave()), tmp_path / "d.json"
        )
    from armblocks.formats import diagram_to_python

    with pytest.raises(FormatError, match=r"<lambda> cannot be written into a Python program"):
        diagram_to_python(diagram_with_sources(PythonFunction(function=lambda u: 2 * u), SineWave()))


def test_functions_that_cannot_be_traced_are_refused() -> None:
    def decides(u):  # type: ignore[no-untyped-def]
        return u if u > 0 else 0.0

    with pytest.raises(
        DiagramError,
        match=r"the function decides cannot be traced: RuntimeError[\s\S]*replace 'if' by casadi\.if_else",
    ):
        trace_diagram(diagram_with_sources(PythonFunction(function=decides), SineWave()))
    with pytest.raises(DiagramError, match="returns 3 values for the results a, b"):
        trace_diagram(
            diagram_with_sources(PythonFunction(function=lambda u: (u, u, u), results="a b"), SineWave())
        )
    with pytest.raises(InputError, match=r"the results are 'u'.*choose other names"):
        PythonFunction(results="u")
    with pytest.raises(
        InputError, match=r"the arguments of law cannot be listed.*write a function around it"
    ):

        def law(*u):  # type: ignore[no-untyped-def]
            return u

        PythonFunction(function=law)
    with pytest.raises(InputError, match=r"the value is 3.*a Python function"):
        PythonFunction(function=3)

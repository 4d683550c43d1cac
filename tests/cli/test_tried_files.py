"""Diagram files for ``armblocks run``: invalid ones are refused, valid ones agree with closed forms."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from typer.testing import Result

Signals = dict[str, NDArray[np.float64]]

# -- bad files -----------------------------------------------------------------------------------------------


def document(blocks: dict[str, Any], *wires: str, **more: Any) -> str:
    """The text of a diagram file."""
    return json.dumps({"format": 1, "name": "tried", "blocks": blocks, "connections": list(wires), **more})


def block(kind: str, **parameters: Any) -> dict[str, Any]:
    return {"type": kind, "parameters": parameters}


DRIVEN_INTEGRATOR = {"c": block("Constant", value=1.0), "x": block("Integrator")}

INVALID_FILES: dict[str, tuple[str | bytes, str]] = {
    "nothing": ("", "tried.json"),
    "a list": ("[1, 2, 3]", "tried.json:1"),
    "another alphabet": (document(DRIVEN_INTEGRATOR, "c/y -> x/u").encode("utf-16"), "not UTF-8"),
    "a key twice": ('{"format": 1, "format": 1, "name": "a", "blocks": {}}', "'format'"),
    "not a number": (document({"c": block("Constant", value=math.nan)}), "NaN"),
    "too large a number": (
        '{"format": 1, "name": "a", "blocks": {"c": {"type": "Constant", "parameters": {"value": 1e999}}}}',
        "1e999",
    ),
    "brackets without end": ("[" * 100_000, "levels"),
    "blocks as a list": (json.dumps({"format": 1, "name": "a", "blocks": [1]}), "blocks"),
    "a later format version": (json.dumps({"format": 99, "name": "a", "blocks": {}}), "99"),
    "a parameter that does not exist": (
        document({"c": block("Constant", valeu=1.0)}),
        "did you mean 'value'?",
    ),
    "text in place of a number": (document({"c": block("Constant", value="one")}), "c"),
    "a connection without an arrow": (document(DRIVEN_INTEGRATOR, "c/y to x/u"), "c/y to x/u"),
    "a connection to an unknown port": (document(DRIVEN_INTEGRATOR, "c/y -> x/v"), "'v'"),
    "a connection to an unknown block": (document(DRIVEN_INTEGRATOR, "c/y -> z/u"), "'z'"),
    "a name with a slash": (document({"a/b": block("Constant")}), "'/'"),
    "code in a formula": (
        document({"c": block("Clock"), "f": block("Expression", formula="open('x','w')")}, "c/y -> f/u"),
        "no function named 'open'",
    ),
    "a Python function in a file": (
        document({"c": block("Clock"), "f": block("PythonFunction", function="evil.py:f")}, "c/y -> f/u"),
        "--trust",
    ),
    "a system file as robot": (
        document(
            {"q": block("Constant", value=[0, 0]), "f": block("Fkine", robot="/etc/passwd")}, "q/y -> f/q"
        ),
        "passwd",
    ),
    "a file outside the folder": (
        document({"c": block("Clock"), "f": block("ToFile", file="../../stolen.csv")}, "c/y -> f/u"),
        "stolen.csv",
    ),
    "an infinite stop time": (
        document(DRIVEN_INTEGRATOR, "c/y -> x/u", settings={"stop_time": "inf"}),
        "stop_time",
    ),
    "a tolerance of zero": (document(DRIVEN_INTEGRATOR, "c/y -> x/u", settings={"rtol": 0}), "rtol"),
}


@pytest.mark.parametrize(("content", "words"), INVALID_FILES.values(), ids=INVALID_FILES.keys())
def test_a_bad_file_is_refused_with_one_message_and_writes_nothing(
    content: str | bytes, words: str, invoke: Callable[..., Result], tmp_path: Path
) -> None:
    (tmp_path / "evil.py").write_text("open('stolen', 'w')\ndef f(u): return u\n", encoding="utf-8")
    data = content if isinstance(content, bytes) else content.encode()
    (tmp_path / "tried.json").write_bytes(data)
    result = invoke("run", "tried.json", "--out", "kept", "--no-figures", "--no-jumps")
    text = " ".join(result.stderr.split())
    assert result.exit_code == 2, result.output
    assert text.startswith("error: ")
    assert text.count("error: ") == 1
    assert "Traceback" not in result.output
    assert words in text
    assert len(text) < 500
    assert sorted(path.name for path in tmp_path.iterdir()) == ["evil.py", "tried.json"]


# -- good files ----------------------------------------------------------------------------------------------


SAMPLES = {"stop_time": 5.0, "sample_time": 0.25}

VALID_FILES: dict[
    str, tuple[str, Callable[[Signals], tuple[NDArray[np.float64], NDArray[np.float64]]], float]
] = {
    "the integral of a sine": (
        document({"s": block("SineWave"), "x": block("Integrator")}, "s/y -> x/u", settings=SAMPLES),
        lambda s: (s["x/y"], 1 - np.cos(s["time"])),
        1e-5,
    ),
    "an oscillator": (
        document(
            {"v": block("Integrator"), "x": block("Integrator", initial=1.0), "k": block("Gain", gain=-4.0)},
            "k/y -> v/u",
            "v/y -> x/u",
            "x/y -> k/u",
            settings=SAMPLES,
        ),
        lambda s: (s["x/y"], np.cos(2 * s["time"])),
        1e-5,
    ),
    "a lag behind a step": (
        document(
            {"u": block("Step", time=1.0), "g": block("TransferFunction", numerator=[3], denominator=[2, 1])},
            "u/y -> g/u",
            settings=SAMPLES,
        ),
        lambda s: (s["g/y"], 3 * (1 - np.exp(-np.maximum(s["time"] - 1, 0) / 2))),
        1e-5,
    ),
    "a sampled loop": (
        document(
            {
                "one": block("Constant"),
                "sum": block("Sum"),
                "half": block("Gain", gain=0.5),
                "z": block("UnitDelay", sample_time=0.25),
            },
            "one/y -> sum/u1",
            "half/y -> sum/u2",
            "sum/y -> z/u",
            "z/y -> half/u",
            settings=SAMPLES,
        ),
        lambda s: (s["z/y"], 2 * (1 - 0.5 ** np.round(s["time"] / 0.25))),
        1e-14,
    ),
    "a linear loop": (
        document(
            {"one": block("Constant"), "sum": block("Sum", signs="+-"), "k": block("Gain", gain=0.5)},
            "one/y -> sum/u1",
            "sum/y -> k/u",
            "k/y -> sum/u2",
            settings=SAMPLES,
        ),
        lambda s: (s["sum/y"], np.full(s["time"].size, 2 / 3)),
        1e-14,
    ),
    "y = cos y": (
        document(
            {"f": block("Expression", formula="cos(u)"), "g": block("Gain")},
            "f/y -> g/u",
            "g/y -> f/u",
            settings=SAMPLES,
        ),
        lambda s: (s["f/y"], np.full(s["time"].size, 0.7390851332151607)),
        1e-9,
    ),
    "a delayed signal": (
        document(
            {"t": block("Clock"), "d": block("TransportDelay", delay=1.5, initial=-1.0)},
            "t/y -> d/u",
            settings=SAMPLES,
        ),
        lambda s: (
            s["d/y"][s["time"] != 1.5],
            np.where(s["time"] < 1.5, -1, s["time"] - 1.5)[s["time"] != 1.5],
        ),
        1e-9,
    ),
    "the integral of |sin|": (
        document(
            {"s": block("SineWave"), "a": block("Abs"), "x": block("Integrator")},
            "s/y -> a/u",
            "a/y -> x/u",
            settings={"stop_time": 4 * math.pi, "sample_time": math.pi},
        ),
        lambda s: (s["x/y"], 2 * np.arange(5.0)),
        1e-5,
    ),
    "a stiff lag": (
        document(
            {
                "t": block("Clock"),
                "x": block("Integrator", initial=1.0),
                "f": block("Expression", formula="-1e6*(u[1] - cos(u[2])) - sin(u[2])"),
                "m": block("Mux"),
            },
            "x/y -> m/u1",
            "t/y -> m/u2",
            "m/y -> f/u",
            "f/y -> x/u",
            settings=SAMPLES,
        ),
        lambda s: (s["x/y"], np.cos(s["time"])),
        1e-6,
    ),
    "a subsystem with a parameter": (
        document(
            {
                "one": block("Constant"),
                "s": {
                    "type": "Subsystem",
                    "parameters": {"k": 3.0},
                    "diagram": {
                        "mask": [{"name": "k", "kind": "number", "default": 1.0}],
                        "blocks": {
                            "u": block("Inport", port=1),
                            "g": {"type": "Gain", "formulas": {"gain": "2^k^2"}},
                            "y": block("Outport", port=1),
                        },
                        "connections": ["g/y -> y/u", "u/y -> g/u"],
                    },
                },
                "x": block("Integrator"),
            },
            "one/y -> s/u",
            "s/y -> x/u",
            settings=SAMPLES,
        ),
        lambda s: (s["x/y"], 64 * s["time"]),
        1e-8,
    ),
    "a vector": (
        document(
            {"v": block("Constant", value=[1, -2]), "x": block("Integrator", initial=[0, 5])},
            "v/y -> x/u",
            settings=SAMPLES,
        ),
        lambda s: (s["x/y[1]"], 5 - 2 * s["time"]),
        1e-8,
    ),
}


@pytest.mark.parametrize(("content", "compare", "error"), VALID_FILES.values(), ids=VALID_FILES.keys())
def test_the_run_of_a_good_file_agrees_with_its_closed_form(
    content: str, compare: Any, error: float, invoke: Callable[..., Result], tmp_path: Path
) -> None:
    (tmp_path / "tried.json").write_text(content, encoding="utf-8")
    result = invoke("run", "tried.json", "--out", "kept", "--no-figures", "--no-jumps")
    assert result.exit_code == 0, result.output
    with (tmp_path / "kept" / "data.csv").open(encoding="utf-8", newline="") as stream:
        names, *rows = csv.reader(stream)
    columns = np.array(rows, dtype=float).T
    actual, expected = compare(dict(zip(names, columns)))
    # The tolerance is 1e-6 per step; the accumulated error of the run stays below this bound.
    assert actual == pytest.approx(expected, rel=error, abs=error)
    assert actual.size >= 5

"""Output, files and exit codes of ``armblocks identify`` and ``armblocks fit``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import Result

import armblocks as ab
from armblocks.blocks import Gain, Integrator, Step, Sum

Invoke = Callable[..., Result]


@pytest.fixture
def log(tmp_path: Path) -> str:
    """A log of the two-link arm with other masses than its description."""
    t = np.linspace(0.0, 6.0, 400)
    rates, sizes = np.array([1.3, 2.1]), np.array([1.0, 1.4])
    q = sizes * np.sin(rates * t[:, None])
    qd, qdd = sizes * rates * np.cos(rates * t[:, None]), -rates * rates * q
    tau = 1.2 * ab.load_robot("twolink").rne(q, qd, qdd)
    tau += np.random.default_rng(0).normal(0.0, 0.05, tau.shape)
    heads = ["t", *(f"{name}{k}" for name in ("q", "qd", "qdd", "tau") for k in (1, 2))]
    path = tmp_path / "log.csv"
    rows = np.column_stack([t, q, qd, qdd, tau])
    np.savetxt(path, rows, delimiter=",", header=",".join(heads), comments="")
    return str(path)


def test_identify_prints_parameters_and_writes_robot_and_figure(
    invoke: Invoke, log: str, tmp_path: Path
) -> None:
    arguments = ("identify", "twolink", log, "--friction", "none", "--no-rotor-inertia")
    result = invoke(*arguments, "--save", "found.json", "--plot", "found.svg", "--validate", log)
    assert result.exit_code == 0, result.output
    assert "Two link: 6 base parameters from 400 samples" in result.stdout
    assert "in the other log" in result.stdout and "condition number" in result.stdout
    assert " sum" not in result.stdout, "too wide for 80 columns"
    assert all(len(line) <= 80 for line in result.stdout.splitlines())
    found = ab.load_robot(str(tmp_path / "found.json"))
    torque = 1.2 * ab.load_robot("twolink").gravload([0.3, 0.4])
    np.testing.assert_allclose(found.gravload([0.3, 0.4]), torque, rtol=0.01)
    assert (tmp_path / "found.svg").read_text(encoding="utf-8").endswith("</svg>\n")
    wide = invoke(*arguments, columns=120)
    assert " sum" in wide.stdout and "link1.mx + link1.m" in wide.stdout
    assert all(len(line) <= 120 for line in wide.stdout.splitlines())


def test_identify_exits_with_1_for_parameters_without_motion(invoke: Invoke, log: str) -> None:
    rows = np.genfromtxt(log, delimiter=",", names=True)
    names = list(rows.dtype.names)
    table = np.array([list(row) for row in rows])
    table[:, [names.index(name) for name in ("q2", "qd2", "qdd2")]] = 0.0
    np.savetxt("still.csv", table, delimiter=",", header=",".join(names), comments="")
    result = invoke("identify", "twolink", "still.csv")
    assert result.exit_code == 1, result.output
    assert "not identified, because the motion does not excite them" in " ".join(result.stdout.split())


def test_identify_refuses_unsuitable_data(refusal: Callable[..., str], log: str) -> None:
    assert "there is no kind of friction named 'dry'" in refusal(
        "identify", "twolink", log, "--friction", "dry"
    )
    assert "there is no link named 'link9'" in refusal("identify", "twolink", log, "--link", "link9")
    assert "has the shape (400, 2)" in refusal("identify", "puma560", log)


@pytest.fixture
def drive(tmp_path: Path) -> tuple[str, str]:
    """A diagram and measurements of another gain and time constant."""

    def diagram(gain: float, rate: float) -> ab.Diagram:
        builder = ab.DiagramBuilder("drive")
        volts = builder.add("volts", Gain(gain=gain), builder.add("u", Step(time=0.5)))
        difference = builder.add("difference", Sum(signs="+-"), volts)
        speed = builder.add("speed", Integrator(), builder.add("rate", Gain(gain=rate), difference))
        builder.connect(speed, difference["u2"])
        return builder.build()

    path, data = tmp_path / "drive.json", tmp_path / "data.csv"
    ab.save_diagram(diagram(1.0, 5.0), path)
    run = ab.simulate(diagram(2.0, 2.5), stop_time=3.0, sample_time=0.02)
    y = run["speed"].ravel() + np.random.default_rng(0).normal(0.0, 0.01, len(run.time))
    np.savetxt(data, np.column_stack([run.time, y]), delimiter=",", header="t,speed", comments="")
    return str(path), str(data)


def test_fit_prints_values_and_writes_diagram_and_figure(
    invoke: Invoke, drive: tuple[str, str], tmp_path: Path
) -> None:
    result = invoke(
        *("fit", *drive, "-p", "volts.gain=1.5", "--parameter", "rate.gain"),
        *("--bounds", "rate.gain=0.01:", "--save", "found.json", "--plot", "found.png"),
    )
    assert result.exit_code == 0, result.output
    assert "rate.gain" in result.stdout and "upper 95 %" in result.stdout
    assert all(len(line) <= 80 for line in result.stdout.splitlines())
    found = ab.load_diagram(tmp_path / "found.json")
    assert abs(found.block("volts").gain - 2.0) < 0.01  # pyright: ignore[reportAttributeAccessIssue]
    assert abs(found.block("rate").gain - 2.5) < 0.05  # pyright: ignore[reportAttributeAccessIssue]
    assert (tmp_path / "found.png").read_bytes().startswith(b"\x89PNG")
    few = invoke("fit", *drive, "-p", "volts.gain", "--evaluations", "1")
    assert few.exit_code == 1 and "the search ended early" in " ".join(few.stdout.split())


def test_fit_refuses_unsuitable_options(refusal: Callable[..., str], drive: tuple[str, str]) -> None:
    def refused(*arguments: str) -> str:
        return refusal("fit", *drive, "-p", "volts.gain", *arguments)

    assert "'volts.gain' occurs twice" in refused("-p", "volts.gain=2")
    assert "is not of the form block.parameter=low:high" in refused("--bounds", "volts.gain=1")
    assert "is not of the form signal=deviation" in refused("--noise", "speed")
    assert "'x' is not a number" in refused("--bounds", "volts.gain=x:2")
    assert "there is no fitted parameter named 'motor.mass'" in refused("--bounds", "motor.mass=1:2")

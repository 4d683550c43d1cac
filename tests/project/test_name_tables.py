"""All armblocks names in the tables for users of Simulink and of the Robotics Toolbox exist."""

import ast
import contextlib
import inspect
import io
import re
import warnings
import webbrowser
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from typer.main import get_command

import armblocks as ab
from armblocks import spatial
from armblocks.blocks import BLOCKS
from armblocks.cli.main import app
from armblocks.errors import ArmblocksWarning
from armblocks.simulation.tableaux import TABLEAUX

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGES = ("from-simulink", "from-robotics-toolbox")
OBJECTS: dict[str, object] = {
    "ab": ab,
    "np": np,
    "f": lambda t: 0.0 * t,
    "list": list,
    "print": print,
    "spatial": spatial,
    "arm": ab.Arm,
    "builder": ab.DiagramBuilder,
    "result": ab.SimulationResult,
    "robot": ab.Robot,
    "run": ab.DiagramRun,
}
"""Objects to which the variable names in the tables refer."""


def names_here(page: str) -> Iterator[str]:
    """The code in the last column of every table of a page."""
    for line in (DOCS / f"{page}.md").read_text(encoding="utf-8").splitlines():
        if line.startswith("| ") and not line.endswith("| armblocks |"):
            cell = re.sub(r"\{\w+\}`[^`]*`", "", line.split("|")[-2])  # without links to pages
            yield from re.findall(r"`([^`]+)`", cell)


def check(node: ast.expr) -> object:
    """Resolve an expression; raise if a name, an attribute or an argument does not exist."""
    match node:
        case ast.Name(id=name):
            return OBJECTS[name] if name in OBJECTS else BLOCKS[name]
        case ast.Attribute(value=value, attr=name):
            return getattr(check(value), name)
        case ast.Subscript(value=value):
            return check(value)
        case ast.Call(func=function, keywords=keywords, args=arguments):
            called = check(function)
            for argument in [*arguments, *(keyword.value for keyword in keywords)]:
                if isinstance(argument, ast.Call):
                    check(argument)
            if inspect.isclass(called) and hasattr(called, "__dataclass_fields__"):
                known = set(called.__dataclass_fields__)
            elif inspect.isfunction(called):
                known = set(inspect.signature(called).parameters)
            else:
                return called
            assert {keyword.arg for keyword in keywords} <= known, ast.unparse(node)
            return called
        case _:
            raise AssertionError(ast.unparse(node))


@pytest.mark.parametrize("page", PAGES)
def test_every_name_of_the_tables_exists(page: str) -> None:
    commands = set(get_command(app).commands)  # pyright: ignore[reportAttributeAccessIssue]
    names = list(names_here(page))
    assert len(names) > 50
    for code in names:
        if code.startswith("armblocks "):
            assert code.split()[1] in commands, code
        else:
            check(ast.parse(code, mode="eval").body)


def test_every_expression_for_users_of_the_toolbox_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(webbrowser, "open", lambda link: True)
    arm = ab.load_robot("puma560")
    q, T = np.array([0.1, 0.4, -2.0, 0.3, 0.5, 0.2]), arm.fkine([0.1, 0.4, -2.0, 0.3, 0.5, 0.2])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ArmblocksWarning)
        ab.save_robot(arm, "arm.urdf")
    motion = {"q": q, "qf": q, "q0": np.zeros(6), "points": np.stack([np.zeros(6), q])}
    rates = {name: np.ones(6) for name in ("qd", "qdd", "tau", "w", "S")} | {"qd0": np.zeros(6)}
    poses = {"T": T, "T0": T, "T1": np.eye(4), "R": T[:3, :3], "p": T[:3, 3]}
    times = {"t": np.linspace(0, 1, 5), "dt": 0.05, "N": 4, "s": 0.5, "qdmax": 1.0, "tacc": 0.2}
    frames = {"links": arm.robot.links, "base": ab.Transform(), "tool": ab.Transform()}
    modules = {"ab": ab, "np": np, "spatial": spatial, "arm": arm, "robot": arm.robot}
    law = {"f": lambda t: np.zeros(6)}
    variables: dict[str, object] = {**motion, **rates, **poses, **times, **frames, **modules, **law}
    count = 0
    for code in names_here("from-robotics-toolbox"):
        if code.startswith("armblocks ") or code in BLOCKS or not ("(" in code or "." in code):
            continue
        if code == 'arm.animate(q, dt, save="arm.mp4")':
            variables["q"] = np.stack([q, q])
        with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
            warnings.simplefilter("ignore", ArmblocksWarning)
            value = eval(code, dict(variables))  # noqa: S307
        assert value is not None or code.startswith("print"), code
        variables["q"] = q
        count += 1
    assert count > 90


def test_the_check_detects_a_missing_name() -> None:
    for code in ("ab.simulatte(x)", "Gian", "Gain(gian=2)", "arm.fkin(q)", "ab.Robot(grav=1)"):
        with pytest.raises((AttributeError, ab.errors.UnknownNameError, AssertionError)):
            check(ast.parse(code, mode="eval").body)


def test_solvers_are_found_by_their_simulink_names() -> None:
    text = (DOCS / "from-simulink.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`(ode\w+)`", text)) | {"ode2", "ode3", "ode4"}
    assert named == {alias for tableau in TABLEAUX for alias in tableau.aliases if alias.startswith("ode")}


def test_every_block_of_the_families_of_simulink_is_in_its_table() -> None:
    page = (DOCS / "from-simulink.md").read_text(encoding="utf-8")
    own = {"CumulativeSum", "DegreesToRadians", "RadiansToDegrees", "CartesianToPolar", "PolarToCartesian"}
    own |= {"AngleDifference", "Norm", "FirstOrderLag", "SecondOrderLag", "LeadLag", "Pulse", "Counter"}
    families = ("sources", "maths", "continuous", "discrete", "discontinuities", "routing", "structure")
    families += ("sinks", "logic", "lookup", "functions")
    for family in families:
        for kind in BLOCKS.families[family]:
            assert kind.type_name() in own or f"`{kind.type_name()}" in page, kind.type_name()

"""Wrong arguments of public constructors and functions raise errors of the package."""

import copy
import importlib
import inspect
import pickle
import re
import types
import warnings
from collections.abc import Callable
from enum import Enum
from pathlib import Path

import numpy as np
import pytest

import armblocks as ab
from armblocks.argument_errors import ArgumentErrors
from armblocks.blocks import BLOCKS
from armblocks.diagram import Block
from armblocks.errors import ArgumentError, ArmblocksWarning, UnknownArgumentError, UnknownNameError, counted
from armblocks.robot import Joint
from armblocks.robot.constraints import Constraint
from armblocks.robot.springs import Spring

DOCS = Path(__file__).resolve().parents[1] / "docs"


def documented_names() -> dict[str, Callable[..., object]]:
    """All constructors and functions of the Python reference, by name."""
    found: dict[str, Callable[..., object]] = {}
    for page in sorted(DOCS.glob("python*.md")):
        module = ""
        pattern = r"^\.\. (currentmodule|autofunction|autoclass):: (\S+)"
        for directive, name in re.findall(pattern, page.read_text(encoding="utf-8"), re.MULTILINE):
            if directive == "currentmodule":
                module = name
            else:
                path = name if name.startswith("armblocks.") else f"{module}.{name}"
                home, _, last = path.rpartition(".")
                found[path] = getattr(importlib.import_module(home), last)
    return found


def public_calls() -> dict[str, Callable[..., object]]:
    """Documented and exported constructors and functions, and all blocks; an Enum has no constructor."""
    exported = {f"armblocks.{name}": getattr(ab, name) for name in ab.__all__}
    names = {**documented_names(), **exported, **BLOCKS}
    return {
        name: value
        for name, value in names.items()
        if callable(value) and not (inspect.isclass(value) and issubclass(value, Enum))
    }


PUBLIC = public_calls()


def public_methods() -> dict[str, Callable[..., object]]:
    """The methods of all public classes, except classes whose methods only the package calls."""
    classes = {
        base
        for value in PUBLIC.values()
        if inspect.isclass(value) and not issubclass(value, (Block, Joint, Constraint, Spring, Exception))
        for base in value.__mro__
        if base.__module__.startswith("armblocks.")
    }
    return {
        f"{cls.__name__}.{name}": getattr(cls, name) if isinstance(member, classmethod) else member
        for cls in sorted(classes, key=lambda cls: (cls.__module__, cls.__name__))
        for name, member in vars(cls).items()
        if not name.startswith("_") and isinstance(member, types.FunctionType | classmethod)
    }


METHODS = public_methods()


def test_the_reference_and_the_exports_are_found() -> None:
    assert {"armblocks.simulate", "armblocks.Diagram", "armblocks.robot.palletiser.palletiser"} <= set(PUBLIC)
    assert len(PUBLIC) > 280


@pytest.mark.parametrize("name", METHODS)
def test_arguments_of_methods_that_do_not_fit_raise_an_argument_error(name: str) -> None:
    method, short_name = METHODS[name], name.rpartition(".")[2]
    of_instance = () if inspect.ismethod(method) else (object(),)
    kinds = {entry.kind for entry in inspect.signature(method).parameters.values()}
    if inspect.Parameter.VAR_KEYWORD not in kinds:
        message = f"^{short_name}: there is no argument named 'no_such'"
        with pytest.raises(UnknownArgumentError, match=message):
            method(*of_instance, no_such=1)
    if inspect.Parameter.VAR_POSITIONAL not in kinds:
        with pytest.raises(ArgumentError, match=f"^{short_name}: 99 arguments are given without names"):
            method(*of_instance, *[None] * 99)


@pytest.mark.parametrize("name", PUBLIC)
def test_arguments_that_do_not_fit_raise_an_argument_error(name: str) -> None:
    call = PUBLIC[name]
    required = [
        argument
        for argument, entry in inspect.signature(call).parameters.items()
        if entry.default is entry.empty and entry.kind not in (entry.VAR_POSITIONAL, entry.VAR_KEYWORD)
    ]
    with pytest.raises(UnknownArgumentError, match=f"^{call.__name__}: there is no argument named 'no_such'"):
        call(no_such=1)
    with pytest.raises(
        ArgumentError, match=r"99 arguments are given without names. Allowed: .*\. Fix: write"
    ):
        call(*[None] * 99)
    if required:
        count = counted(len(required), "argument is", "arguments are")
        with pytest.raises(
            ArgumentError, match=f"^{call.__name__}: {count} missing: {required[0]}"
        ) as caught:
            call()
        assert len(str(caught.value)) < 400
        assert f"{call.__name__}({required[0]}=…" in caught.value.fix


def test_the_error_names_the_nearest_the_missing_or_the_repeated_argument() -> None:
    with pytest.raises(UnknownNameError, match=r"^Transform: .*'trans'.*did you mean 'translation'\?$"):
        ab.Transform(trans=(0, 0, 1))  # pyright: ignore
    with pytest.raises(TypeError, match=r"^LinearSystem: 2 arguments are missing: C, D\. Allowed: by posi"):
        ab.LinearSystem(1, 2)  # pyright: ignore
    with pytest.raises(
        ArgumentError, match=r"^ArmPlant: 1 argument is missing: robot\. .*ArmPlant\(robot=…\)"
    ):
        ab.blocks.ArmPlant()  # pyright: ignore
    with pytest.raises(ArgumentError, match=r"^DiagramBuilder: the argument 'name' is given twice"):
        ab.DiagramBuilder("a", name="b")  # pyright: ignore


def test_a_type_error_inside_a_call_is_not_replaced() -> None:
    class Faulty(metaclass=ArgumentErrors):
        def __init__(self, number: int) -> None:
            self.number = number + ""  # type: ignore[operator]

    with pytest.raises(TypeError, match="unsupported operand") as caught:
        Faulty(3)
    assert not isinstance(caught.value, ArgumentError)
    with pytest.raises(TypeError, match="abstract class Joint"):
        Joint()  # pyright: ignore


def test_signatures_copies_and_pickles_of_public_names_are_unchanged() -> None:
    assert list(inspect.signature(ab.Robot).parameters)[:2] == ["name", "links"]
    assert list(inspect.signature(ab.jtraj).parameters) == ["q0", "qf", "t", "qd0", "qd1"]
    assert pickle.loads(pickle.dumps(ab.jtraj)) is ab.jtraj
    link = ab.Link(name="x", mass=2.0)
    assert copy.copy(link) == copy.deepcopy(link) == pickle.loads(pickle.dumps(link)) == link


def test_a_warning_points_to_the_line_that_called_the_package(tmp_path: Path) -> None:
    limits = ab.JointLimits(position=(-90.0, 90.0))
    robot = ab.Robot(name="x", links=(ab.Link(name="a", mass=1.0, joint=ab.Revolute(limits=limits)),))
    ab.save_robot(robot, tmp_path / "r.json")
    motor = ab.Motor(viscous_friction=-1.0)
    calls: dict[str, Callable[[], object]] = {
        "in degrees": lambda: ab.jtraj([0.0], [90.0], 5),
        "turns from -90": lambda: ab.load_robot(tmp_path / "r.json"),
        "accelerates": lambda: ab.Robot(name="x", links=(ab.Link(name="a", mass=1.0, motor=motor),)),
        "Coulomb": lambda: ab.save_robot(ab.load_robot("puma560"), tmp_path / "r.urdf"),
    }
    for words, call in calls.items():
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            call()
        issued = [entry for entry in caught if issubclass(entry.category, ArmblocksWarning)]
        assert words in str(issued[0].message)
        assert {entry.filename for entry in issued} == {__file__}


def test_counts_agree_with_their_nouns() -> None:
    assert [counted(k, "state") for k in (0, 1, 2)] == ["0 states", "1 state", "2 states"]
    assert counted(1, "index", "indices") == "1 index"
    assert counted(np.int64(3), "index", "indices") == "3 indices"

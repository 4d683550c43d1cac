"""Public values are pickled, copied and sent to other processes with the same bits."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import math
import multiprocessing
import pickle
import traceback
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import armblocks as ab
from armblocks import errors, formats
from armblocks.blocks import BLOCKS, FromFile, Gain, Integrator, PythonFunction, Scope, SineWave
from armblocks.diagram import UserFunction, content_key
from armblocks.robot import CONSTRAINT_TYPES, Closure
from armblocks.simulation import Samples
from armblocks.simulation.jumps import Jumps

COPY_FUNCTIONS: dict[str, Callable[[Any], Any]] = {
    "pickle": lambda value: pickle.loads(pickle.dumps(value)),
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
}


def half(u: float) -> float:
    return 0.5 * u


def diagram_with(function: Callable[..., object]) -> ab.Diagram:
    builder = ab.DiagramBuilder("user function")
    sine = builder.add("sine", SineWave())
    builder.add("scope", Scope(), builder.add("half", PythonFunction(function=function), sine))
    return builder.build()


def small_builder() -> ab.DiagramBuilder:
    builder = ab.DiagramBuilder("small")
    builder.parameter("k", 2.0)
    sine = builder.add("sine", SineWave())
    gain = builder.add("gain", Gain(gain=ab.formula("2*k")), sine)
    builder.add("scope", Scope(), builder.add("integrator", Integrator(), gain))
    return builder


def random_log(arm: ab.Arm) -> dict[str, np.ndarray]:
    """Return 50 samples of a motion with the torques of the arm."""
    q, qd, qdd = np.random.default_rng(1).normal(size=(3, 50, arm.n))
    return {"t": np.arange(50.0), "q": q, "qd": qd, "qdd": qdd, "tau": arm.rne(q, qd, qdd)}


@cache
def examples() -> Mapping[str, Any]:
    """Return one value of every public type, and of some other types, by the name of the type."""
    arm, diagram = ab.load_robot("twolink"), small_builder().build()
    robot, compiled = arm.robot, ab.CompiledDiagram(diagram)
    result = ab.simulate(compiled, stop_time=1.0)
    system = ab.linearize(diagram, "gain.gain", "integrator", at=0.5)
    drive = ab.Drive(name="a", gear_ratio=20.0, stall_torque=1.0, max_speed=300.0)
    report = ab.trajectory_report(arm, ab.jtraj([0, 0], [1, 1], 5), speed=1.0)
    sizing = ab.size_drives(arm, ab.jtraj([0, 0], [1, 1], 5), [drive])
    fitted = ab.fit(diagram, "k", {"t": [0.0, 0.5, 1.0], "gain": [0.0, 1.0, 1.5]})
    best = ab.optimise(diagram, {"k": (0.0, 9.0)}, "(final(gain) - 2)^2", "final(gain) <= 1.5", stop_time=1.0)
    phase = ab.CyclePhase(name="grip", start=0.0, end=1.0, loaded=True)
    cycle = ab.PickAndPlaceCycle(trajectory=ab.jtraj([0, 0], [1, 1], 5), phases=(phase,))
    region = ab.workspace(arm, 50)
    obstacles = (
        ab.Box(size=(1, 1, 1)),
        ab.Sphere(radius=1),
        ab.Cylinder(radius=1, length=1),
        ab.Plane(point=(0, 0, -9)),
    )
    contacts = ab.collisions(arm, [0.0, 0.0], obstacles)
    indices: dict[str, Any] = {"runs": 6, "measures": {"p": "peak(integrator)"}, "stop_time": 1.0}
    values = [
        *(contacts, contacts.pairs[0], *obstacles),
        *(region, region.maps["manipulability"], region.slice("y")),
        *(arm, robot, robot.links[0], ab.Motor(inertia=1.0), ab.Revolute(), ab.Prismatic(), ab.Fixed()),
        *(
            kind(name="c", first=ab.Attachment(), second=ab.Attachment(link="a"), **more)
            for kind in CONSTRAINT_TYPES
            if issubclass(kind, Closure)
            for more in ([{"length": 1.0}] if kind is ab.Rod else [{}])
        ),
        *(
            ab.NamedFrame(name="camera"),
            ab.Attachment(),
            ab.JointSpring(name="s", joint="a", stiffness=1.0),
            ab.LineSpring(
                name="s", first=ab.Attachment(), second=ab.Attachment(link="a"), stiffness=1.0, length=0.2
            ),
            ab.Coupling(name="c", terms=(("a", 1.0), ("b", 2.0))),
            ab.PrescribedMotion(name="c", joint="a"),
            arm.assemble(),
            arm.parametric(["link1"]),
            arm.symbolic,
            arm.symbolic.fkine()[0, 3],
            arm.ikine(arm.fkine([0.1, 0.2])),
            arm.ikine_all(arm.fkine([0.1, 0.2])),
        ),
        *(ab.Cylindrical(), ab.Universal(), ab.Planar(), ab.Spherical(), ab.Free(), ab.Screw(pitch=0.1)),
        *(ab.FrictionModel.RELEASE_6, ab.JointLimits(speed=1.0), ab.standard_dh("one", a=1.0).dh),
        *(ab.Payload(mass=2.0), ab.Transform(), ab.jtraj([0, 0], [1, 1], 5)),
        *(report, report.binding[0]),
        *(cycle, cycle.phases[0]),
        *(sizing, sizing.loads[0], sizing.loads[0].drive),
        *(
            ab.Measure("peak", "integrator"),
            ab.uniform(0, 1),
            ab.sweep(compiled, {"k": [1.0]}, stop_time=1.0),
            ab.sweep(compiled, {"k": ab.uniform(0, 1)}, design="saltelli", **indices).sobol("p"),
            ab.sweep(compiled, {"k": ab.uniform(0, 1)}, design="morris", **indices).morris("p"),
        ),
        *(diagram, small_builder(), compiled, ab.SimulationOptions(step=0.1), ab.formula("2*k")),
        *(result, result.final_state, system, system.point, system.margins(), system.transfer_function()),
        ab.diagram_difference(diagram, ab.load_diagram("kr180model")),
        ab.sensitivity(diagram, "gain.gain", "integrator", stop_time=1.0),
        ab.identify(arm, random_log(arm)),
        ab.excitation(arm, evaluations=2),
        *(best, best.constraints[0], best.solutions[0]),
        *(fitted, fitted.signals[0], ab.Experiment(data={"t": [0.0, 1.0]})),
        ab.trim("van_der_pol_pid"),
        FromFile(data=[[0.0, 1.0], [1.0, 2.0]]),
        FromFile(data=[[0.0, 1.0], [1.0, 2.0]]).data,
        UserFunction(half),
    ]
    return {type(value).__name__: value for value in values}


def content(value: Any) -> object:
    """Return the whole content of a value, with the bytes of arrays."""
    if isinstance(value, np.ndarray):
        texts = value.dtype.hasobject  # the bytes of such an array are addresses
        return str(value.dtype), value.shape, value.tolist() if texts else value.tobytes()
    if isinstance(value, Mapping):
        return {key: content(entry) for key, entry in value.items()}
    if isinstance(value, tuple | list | set | frozenset):
        return [type(value), *map(content, value)]
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = [entry.name for entry in dataclasses.fields(value) if not entry.name.startswith("_")]
        return type(value), {name: content(getattr(value, name)) for name in fields}
    if isinstance(value, ab.Arm):
        return ab.Arm, content(value.robot)
    if isinstance(value, ab.ParametricArm):
        return ab.ParametricArm, content(value.robot), value.links
    if isinstance(value, ab.SymbolicArm):
        return ab.SymbolicArm, content(value.robot), value.names
    if isinstance(value, ab.SymbolicExpression):
        return ab.SymbolicExpression, repr(value), value.text()
    if isinstance(value, ab.CompiledDiagram):
        return ab.CompiledDiagram, content(value.diagram)
    if isinstance(value, ab.DiagramBuilder):
        return ab.DiagramBuilder, content(value.build())
    if isinstance(value, Jumps):
        return Jumps, content(value.table)
    if isinstance(value, errors.ArmblocksError):
        return type(value), str(value), content(vars(value))
    return repr(value) if isinstance(value, float) and math.isnan(value) else value


def test_every_public_type_is_among_the_examples() -> None:
    types = {name for name in ab.__all__ if isinstance(getattr(ab, name), type)}
    assert types - {"DiagramRun"} <= examples().keys()


@pytest.mark.parametrize("method", COPY_FUNCTIONS)
def test_a_copy_has_the_content_of_the_original(method: str) -> None:
    for name, value in examples().items():
        assert content(COPY_FUNCTIONS[method](value)) == content(value), name


@pytest.mark.parametrize("method", COPY_FUNCTIONS)
def test_arrays_of_copies_are_read_only(method: str) -> None:
    payload, system, table = (examples()[name] for name in ("Payload", "LinearSystem", "TimeTable"))
    assert payload.numbers.sum() == 2.0  # computed and cached before the copy
    copies = [COPY_FUNCTIONS[method](value) for value in (payload, system, table)]
    assert not any(array.flags.writeable for array in (copies[0].numbers, copies[1].A, copies[2].rows))


@pytest.mark.parametrize("method", COPY_FUNCTIONS)
def test_a_copy_computes_the_same_bits(method: str) -> None:
    arm, diagram = ab.load_robot("puma560"), ab.load_diagram("kr180model")
    q = np.linspace(-1, 1, 6)
    assert COPY_FUNCTIONS[method](arm).rne(q, q, q).tobytes() == arm.rne(q, q, q).tobytes()
    for model in (diagram, ab.compile_diagram(diagram)):
        copied = ab.simulate(COPY_FUNCTIONS[method](model), stop_time=0.5)
        assert copied.signals.tobytes() == ab.simulate(diagram, stop_time=0.5).signals.tobytes()


@pytest.mark.filterwarnings("ignore::armblocks.errors.ArmblocksWarning")
def test_shipped_robots_and_examples_are_pickled() -> None:
    for name in ab.list_robots():
        arm = ab.load_robot(name)
        assert content(pickle.loads(pickle.dumps(arm))) == content(arm)
    for name in ab.list_examples():
        diagram = formats.load_diagram(name, BLOCKS, draft=True)
        copied = pickle.loads(pickle.dumps(diagram))
        assert copied == diagram and content(copied) == content(diagram)
        # With an equal key, the copy loads the code of the original from the cache.
        assert content_key(copied) == content_key(diagram)


def constructed_error(kind: type[errors.ArmblocksError]) -> errors.ArmblocksError:
    """Construct an error of this type with texts, or lists, for its required arguments."""
    lists = {"known": ["gain"], "loop": ["a/y", "b/y"]}
    required = [name for name, p in inspect.signature(kind).parameters.items() if p.default is p.empty]
    error = kind(*(lists.get(name, f"the {name}") for name in required), where="here")
    if isinstance(error, errors.SimulationError):
        error.partial = examples()["SimulationResult"]
    return error


@pytest.mark.parametrize("method", COPY_FUNCTIONS)
def test_copies_of_errors_have_the_same_text_and_attributes(method: str) -> None:
    kinds = [kind for kind in vars(errors).values() if isinstance(kind, type)]
    for kind in kinds:
        if issubclass(kind, errors.ArmblocksError):
            assert content(COPY_FUNCTIONS[method](constructed_error(kind))) == content(
                constructed_error(kind)
            )


def test_a_python_function_is_pickled_by_its_name(tmp_path: Path) -> None:
    diagram = diagram_with(half)
    copied = pickle.loads(pickle.dumps(diagram))
    assert copied == diagram
    assert b"co_code" not in pickle.dumps(diagram)
    file = tmp_path / "laws.py"
    file.write_text("def twice(u):\n    return 2.0 * u\n", encoding="utf-8")
    ab.save_diagram(diagram_with(half), tmp_path / "model.json")
    text = (tmp_path / "model.json").read_text(encoding="utf-8")
    reference = next(part for part in text.split('"') if part.endswith(":half"))
    (tmp_path / "model.json").write_text(text.replace(reference, "laws.py:twice"), encoding="utf-8")
    trusted = ab.load_diagram(tmp_path / "model.json", trust=True)
    assert pickle.loads(pickle.dumps(trusted)) == trusted
    file.unlink()
    with pytest.raises(errors.FormatError, match=r"laws\.py:twice' is not a function of a file"):
        pickle.loads(pickle.dumps(trusted))


def test_a_local_function_or_lambda_cannot_be_pickled() -> None:
    factor = 2.0

    def scaled(u: float) -> float:
        return factor * u

    for function in (scaled, lambda u: 2.0 * u):
        diagram = diagram_with(function)
        with pytest.raises(errors.InputError, match=r"cannot be pickled.*Fix: define it with def at the top"):
            pickle.dumps(diagram)
        assert copy.deepcopy(diagram) == diagram  # a copy in the same process refers to the function itself


def test_a_run_in_progress_cannot_be_pickled() -> None:
    run = ab.begin("van_der_pol_pid")
    for method in COPY_FUNCTIONS.values():
        with pytest.raises(errors.InputError, match=r"a run in progress cannot be copied.*initial_state"):
            method(run)
    with pytest.raises(errors.InputError, match=r"native code cannot be pickled"):
        pickle.dumps(ab.load_robot("twolink")._code.kernel("fkine").entry)
    assert isinstance(pickle.loads(pickle.dumps(run.samples())), Samples)


def compute_and_send(received: Mapping[str, Any], connection: Any) -> None:
    """Compute with the received values in a child process; send the bytes of the results, then an error."""
    try:
        q = np.linspace(-1, 1, 6)
        bits = {
            "fkine": received["fkine"](q).tobytes(),
            "rne": received["rne"](q, q, q, payload=2.0).tobytes(),
            "arm": received["arm"].inertia(q=q).tobytes(),
            "compiled": received["compiled"].simulate().signals.tobytes(),
            "function": ab.simulate(received["function"], stop_time=1.0).signals.tobytes(),
        }
        connection.send((bits, None))
        ab.simulate(received["compiled"], solver="rk54")
    except errors.ArmblocksError as error:
        connection.send((None, error))
    except BaseException:
        connection.send((traceback.format_exc(), None))
        raise


def test_values_sent_to_another_process_give_the_same_results() -> None:
    arm = ab.load_robot("puma560")
    compiled = ab.compile_diagram(ab.load_diagram("van_der_pol_pid"))
    function = diagram_with(half)
    sent = {"arm": arm, "fkine": arm.fkine, "rne": arm.rne, "compiled": compiled, "function": function}
    context = multiprocessing.get_context("spawn")
    parent, child = context.Pipe()
    process = context.Process(target=compute_and_send, args=(sent, child))
    process.start()
    child.close()
    bits, _ = parent.recv()
    _, error = parent.recv()
    process.join()
    q = np.linspace(-1, 1, 6)
    assert bits == {
        "fkine": arm.fkine(q).tobytes(),
        "rne": arm.rne(q, q, q, payload=ab.Payload(mass=2.0)).tobytes(),
        "arm": arm.inertia(q).tobytes(),
        "compiled": compiled.simulate().signals.tobytes(),
        "function": ab.simulate(function, stop_time=1.0).signals.tobytes(),
    }
    assert isinstance(error, errors.UnknownNameError)
    assert error.name == "rk54"

"""Contract tests of all blocks of the library; a new block is tested automatically."""

from __future__ import annotations

import dataclasses
import itertools
import math
import pickle
import runpy
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from casadi import SX, Function, vertcat, vertsplit

from armblocks import blocks
from armblocks.blocks import BLOCKS, FAMILIES, Constant, Derivative
from armblocks.diagram import (
    Block,
    DiagramBuilder,
    ParameterKind,
    Shapes,
    block_equations,
    shape_of,
    trace_diagram,
)
from armblocks.diagram.block_equations import BlockEquations, Group
from armblocks.diagram.features import Arguments, SlotKind, features_of
from armblocks.diagram.flat_values import broadcast_column, named_values, tunable_slots
from armblocks.diagram.implicit import has_discontinuity
from armblocks.equations import Slot
from armblocks.errors import InputError
from armblocks.face.model import compile_diagram
from armblocks.package_folder import classes_in
from armblocks.robot import Robot, serial_chain, standard_dh
from armblocks.spatial import Transform
from worked_examples import worked_example

ROBOT = Robot(
    name="pair",
    base=Transform(translation=(0.1, 0.2, 0.3)),
    links=serial_chain(
        [
            standard_dh(
                "one", alpha=1.0, a=0.7, mass=2.0, centre_of_mass=(-0.2, 0.1, 0), inertia=(1, 2, 2.5)
            ),
            standard_dh("two", d=0.3, a=0.5, mass=1.0, centre_of_mass=(-0.1, 0, 0.2), inertia=(1, 1, 1)),
        ]
    ),
)

CLOSED_FORM = Robot(
    name="parallel pair", links=serial_chain([standard_dh("one", a=0.7), standard_dh("two", a=0.5)])
)
"""A robot with a closed form of the inverse kinematics."""

BLOCK_TYPES = list(BLOCKS.values())
each_block_type = pytest.mark.parametrize("kind", BLOCK_TYPES, ids=BLOCKS)
"""Parametrizes slow tests by block type; fast tests loop over all block types in one test."""


def make(kind: type[Block], **values: object) -> Block:
    """Return a block with default parameters, and with ``ROBOT`` for parameters that are robots."""
    robot = CLOSED_FORM if kind.__name__ == "Ikine" else ROBOT
    robots = {rule.name: robot for rule in kind.parameters() if rule.kind is ParameterKind.ROBOT}
    return kind(**(robots | values))


def test_every_block_is_pickled() -> None:
    for kind in BLOCK_TYPES:
        block = make(kind)
        assert pickle.loads(pickle.dumps(block)) == block, kind.type_name()


def fitting_shapes(block: Block) -> Iterator[Shapes]:
    """Yield the candidate input shapes that the block accepts; one set if all ports have fixed shapes."""
    ports = block.input_ports()
    is_open = any(port.shape is None for port in ports)
    lengths: list[int] = []
    for open_shape in ((), (2,), (4,), (3, 3)) if is_open else ((),):
        shapes = {port.name: open_shape if port.shape is None else port.shape for port in ports}
        if len(open_shape) == 1 and lengths:
            continue  # one vector length is enough
        try:
            block.output_shapes(shapes)
        except InputError:
            continue
        lengths += open_shape[:1] if len(open_shape) == 1 else ()
        yield shapes


def all_equations(block: Block, shapes: Shapes) -> Function:
    """Return all values of the block's equations as a function of t, x, u, e and p."""
    features = features_of(block, shapes)
    states = (*features.states, *features.discrete, *features.modes, *features.conditions, *features.delays)
    rates = [Slot(f"{name}'", shapes[name.rstrip("'")]) for name in features.differentiated_inputs]
    arguments = [
        [Slot(state.name, state.shape) for state in states],
        [Slot(name, shape) for name, shape in shapes.items()] + rates,
        [Slot(guard.name, guard.shape) for guard in features.guards],
        list(tunable_slots(block)),
    ]
    t, *symbols = SX.sym("t"), *(SX.sym("s", sum(slot.size for slot in slots)) for slots in arguments)
    x, u, e, p = (dict(named_values(slots, symbol)) for slots, symbol in zip(arguments, symbols))
    if block.sampled:
        p["T"] = SX(0.1)
        if block.reads_next_period:
            p["T_next"] = SX(0.1)
    results = [
        equation(Arguments(t, x, u, p, e))
        for kind, equation in features.equations.items()
        if kind is not SlotKind.RESET or features.guards
    ]
    results += [features.initial_states(p), features.initial_history(p)]
    results += [features.initial_outputs(p), features.initial_guesses(p)]
    results += [{name: bound[k] for name, bound in features.delay_bounds(p).items()} for k in (0, 1)]
    results += [dict(enumerate(map(SX, features.breakpoints(p))))]
    return Function("f", [t, *symbols], [SX(value) for group in results for value in group.values()])


def evaluated(equations: Function, block: Block, minimum: float = 0.1) -> list[np.ndarray]:
    """Evaluate equations at t = 0.37, fixed pseudo-random x, u and e, and the parameters of ``block``.

    States, inputs and events lie between ``minimum`` and ``minimum + 0.8``.
    """
    random = np.random.default_rng(1)
    tunables = [np.ravel(block.parameter_value(rule.name)) for rule in block.inputs_of_the_run()]
    points = [0.37, *(random.uniform(minimum, minimum + 0.8, equations.numel_in(k)) for k in (1, 2, 3))]
    points.append(np.concatenate([*tunables, []]))
    return [np.asarray(value) for value in equations.call([np.asarray(point) for point in points])]


def test_every_block_has_a_title_and_a_summary_of_one_line() -> None:
    for kind in BLOCK_TYPES:
        assert kind.summary().endswith((".", "…")), kind
        assert "\n" not in kind.summary(), kind
        assert kind.title, kind
        assert BLOCKS[kind.type_name()] is kind


def test_every_block_is_exported_by_its_name() -> None:
    for kind in BLOCK_TYPES:
        assert kind.type_name() in blocks.__all__
        assert getattr(blocks, kind.type_name()) is kind


def test_the_type_stub_lists_all_block_names() -> None:
    script = runpy.run_path(str(Path(__file__).parents[2] / "scripts" / "block_names.py"))
    assert script["STUB"].read_text(encoding="utf-8") == script["stub"](), "run scripts/block_names.py"


def test_the_library_finds_every_class_with_a_title_without_importing_it() -> None:
    for family in FAMILIES:
        package = f"armblocks.blocks.{family}"
        titled = {kind for kind in classes_in(package, Block) if "title" in vars(kind)}
        assert titled == {kind for kind in BLOCKS.families[family] if kind.__module__.startswith(package)}


def test_the_folder_of_every_block_is_its_family() -> None:
    for kind in BLOCK_TYPES:
        if kind.__module__.startswith("armblocks.blocks."):
            assert kind.__module__.split(".")[2] == BLOCKS.family_of(kind)
    folders = {path.parent.name for path in Path(blocks.__file__).parent.glob("*/__init__.py")}
    assert folders == set(BLOCKS.families)


def test_every_block_is_immutable_and_has_no_subclasses() -> None:
    # A block type derives from Block, or from one common base class of several types in one file.
    for kind in BLOCK_TYPES:
        (base,) = kind.__bases__
        assert base is Block or (base.__bases__ == (Block,) and base not in BLOCK_TYPES), kind
        assert [sub for sub in kind.__subclasses__() if sub.__module__.startswith("armblocks")] == [], kind
        block = make(kind)
        with pytest.raises(dataclasses.FrozenInstanceError):
            block.anything = 1  # pyright: ignore[reportAttributeAccessIssue]


def test_blocks_with_equal_parameters_are_equal_and_have_equal_hashes() -> None:
    for kind in BLOCK_TYPES:
        one, other = make(kind), make(kind)
        assert one == other
        assert hash(one) == hash(other)
        assert dataclasses.replace(one) == one


def test_ports_and_parameters_of_every_block_are_documented() -> None:
    for kind in BLOCK_TYPES:
        block = make(kind)
        for ports in (block.input_ports(), (*block.output_ports(), *block.record_ports())):
            names = [port.name for port in ports]
            assert len(names) == len(set(names)), kind
            assert all(port.doc and not set(port.name) & set("/. ") for port in ports), kind
        assert all(rule.doc for rule in kind.parameters()), kind
        assert all(port.shape is not None for port in block.record_ports()), kind


def test_a_block_built_from_its_parameter_values_is_equal() -> None:
    for kind in BLOCK_TYPES:
        block = make(kind)
        values = {rule.name: block.parameter_value(rule.name) for rule in kind.parameters()}
        assert kind(**values) == block


@each_block_type
def test_equations_have_the_inferred_shapes(kind: type[Block]) -> None:
    block = make(kind)
    candidates = list(fitting_shapes(block))
    assert candidates, "no input shapes fit"
    if kind.virtual:  # a virtual block has no equations; diagram/test_hierarchy.py tests its connections
        assert evaluated(all_equations(block, candidates[0]), block) == []
        return
    for shapes in candidates:
        equations = block_equations(block, shapes)
        declared = {port.name: port.shape for port in block.output_ports() if port.shape is not None}
        inferred = {**declared, **block.output_shapes(shapes)}
        assert set(inferred) == {port.name for port in block.output_ports()}
        traced = {
            slot.name: slot.shape
            for group in equations.groups
            for slot in group.slots
            if slot.kind is SlotKind.OUTPUT
        }
        assert traced == {name: inferred[name] for name in inferred if name not in block.time_derivatives}


@each_block_type
def test_equations_are_pure_and_read_tunable_parameters_only_from_p(kind: type[Block]) -> None:
    block = make(kind)
    other = make(
        kind,
        **{
            rule.name: np.clip(
                np.asarray(block.parameter_value(rule.name)) * 1.5 + 0.25, rule.minimum, rule.maximum
            )
            for rule in kind.parameters()
            if rule.tunable
        },
    )
    for shapes in fitting_shapes(block):
        first = evaluated(all_equations(block, shapes), block)
        for repeated in (block, other):
            for one, two in zip(first, evaluated(all_equations(repeated, shapes), block), strict=True):
                assert np.array_equal(one, two, equal_nan=True)


@each_block_type
def test_initial_values_have_the_shapes_of_the_states(kind: type[Block]) -> None:
    block = make(kind)
    slots = list(tunable_slots(block))
    p = named_values(slots, SX.sym("p", sum(slot.size for slot in slots)))
    for shapes in fitting_shapes(block):
        states = (*block.states(shapes), *block.discrete_states(shapes))
        start = block.initial_states(p)
        assert set(start) == {state.name for state in states}
        for state in states:
            assert broadcast_column(SX(start[state.name]), state.shape).numel() == Slot("", state.shape).size
            assert state.doc


@each_block_type
def test_every_choice_of_a_parameter_has_finite_equations(kind: type[Block]) -> None:
    for rule in kind.parameters():
        for choice in rule.choices:
            block = make(kind, **{rule.name: choice})
            for shapes in fitting_shapes(block):
                # acosh is not defined below 1, asin not above
                equations = all_equations(block, shapes)
                results = (evaluated(equations, block, minimum) for minimum in (0.1, 1.1))
                assert any(all(np.isfinite(value).all() for value in values) for values in results)


WITHOUT_JUMPS = {
    "MathFunction": "the cube root, sign(u) abs(u)^(1/3), is continuous",
    "Sqrt": "the signed root, sign(u) sqrt(abs(u)), is continuous",
    "T2AngleAxis": "every choice of the largest diagonal entry gives the same angle and axis",
    "T2Quaternion": "every choice of the largest entry gives the same quaternion",
    "T2eul": "selects one of two sets of angles where the middle angle is 0",
    "T2rpy": "selects one of two sets of angles where the middle angle is 90 degrees",
    "Ikine": "whole turns are chosen half a turn from q0, and a branch ends where it does not exist",
    "DifferentialIkine": "the rotation vector of the error is continuous up to half a turn",
    "JacobianInverse": "every choice of the pivot gives the same solution",
    "InterpolationUsingPrelookup": "its indices change at events of Prelookup",
    "VariableTransportDelay": "a transit time that is not above 0 ends the run",
}
"""Blocks without events whose equations contain comparisons, and the reason why no jump results."""


@each_block_type
def test_comparisons_in_outputs_change_only_at_events_or_breakpoints(kind: type[Block]) -> None:
    """The integrator would step across a jump without an event, and the error would not be reported."""
    if (
        kind.breakpoints is not Block.breakpoints
        or kind.sampled
        or kind.virtual
        or kind.__name__ in WITHOUT_JUMPS
    ):
        return
    choices = [{rule.name: choice} for rule in kind.parameters() for choice in rule.choices]
    for block in (make(kind, **chosen) for chosen in choices or [{}]):
        for shapes in itertools.islice(fitting_shapes(block), 1):
            equations = block_equations(block, shapes)
            if not equations.guards:
                assert not any(compares_variables(group, equations, shapes) for group in equations.groups), (
                    block
                )


def compares_variables(group: Group, equations: BlockEquations, shapes: Shapes) -> bool:
    """Return whether outputs or derivatives depend on a comparison of time, states or inputs."""
    if not {slot.kind for slot in group.slots} & {SlotKind.OUTPUT, SlotKind.DERIVATIVE}:
        return False
    sizes = {state.name: math.prod(state.shape) for state in (*equations.states, *equations.discrete)}
    sizes |= {
        f"{name}{prime}": math.prod(shape) for name, shape in shapes.items() for prime in ("", "'", "''")
    }
    names = (*group.states, *group.discrete, *group.inputs, *group.events)
    offsets = [0, *itertools.accumulate(sizes[name] for name in names)]
    parts = dict(zip(names, vertsplit(group.z, offsets))) if names else {}
    return has_discontinuity(
        group.expression, vertcat(group.t, *map(parts.get, (*group.states, *group.inputs)))
    )


def test_views_of_every_block_show_existing_signals() -> None:
    for block in map(make, BLOCK_TYPES):
        ports = (*block.input_ports(), *block.output_ports(), *block.record_ports())
        for view in block.views():
            assert view.signals, block
            assert set(view.signals) <= {port.name for port in ports}, block
            assert not view.labels or len(view.labels) == len(view.signals), block


@pytest.mark.parametrize("kind", [kind for kind in BLOCK_TYPES if kind.output_rates])
def test_declared_derivatives_of_outputs_equal_the_computed_derivatives(
    kind: type[Block], monkeypatch: pytest.MonkeyPatch
) -> None:
    declared, block, random = kind.output_rates, make(kind), np.random.default_rng(2)
    monkeypatch.setattr(kind, "output_rates", {})  # so that the derivative is computed
    for port, rate in declared.items():
        builder = DiagramBuilder("d")
        shapes = next(fitting_shapes(block))
        sources = [
            builder.add(name, Constant(value=random.uniform(0.1, 0.9, shape)))
            for name, shape in shapes.items()
        ]
        builder.add("derivative", Derivative(), builder.add("block", block, *sources)[port])
        system = trace_diagram(builder.build())
        x = random.uniform(0.1, 0.9, system.states.size)
        z = np.zeros(system.discrete.size)  # tables: the row before the time
        (y,) = system.signals(0.37, x, z, (), system.parameter_values)
        signals = system.signals_layout.unpack(y)
        # the same quantity with another order of operations
        assert signals["derivative/y"] == pytest.approx(signals[f"block/{rate}"], rel=1e-13)


def test_default_values_have_the_shapes_of_their_symbols() -> None:
    for block in map(make, BLOCK_TYPES):
        for slot in tunable_slots(block):
            assert slot.shape == shape_of(block.parameter_value(slot.name)), block


@pytest.mark.parametrize(
    "kind", [kind for kind in BLOCKS.values() if kind.breakpoints is not Block.breakpoints]
)
def test_signals_at_a_breakpoint_equal_those_just_after_it(kind: type[Block]) -> None:
    """The breakpoint and the condition in the outputs use the same rounded number for all parameter values.

    A run continues from a breakpoint with the values at that time, and sensitivities use the jump
    of the signals there.
    """
    system = compile_diagram(worked_example(kind)).compiled
    random, distance = np.random.default_rng(3), 2.0**-46
    x, z, w = (np.zeros((4, slots.size)) for slots in (system.states, system.discrete, system.algebraic))
    for _ in range(40):
        p = system.parameter_values * random.uniform(0.9, 1.1, system.parameter_values.shape)
        instants = system.breakpoints(p)
        for t in instants[np.isfinite(instants) & (instants > 0.0)]:
            times = np.array([np.nextafter(t, 0.0), t * (1.0 - distance), t, t * (1.0 + distance)])
            before, earlier, at, after = system.evaluate_signals(times, x, z, w, p).T
            np.testing.assert_allclose(before, earlier, rtol=1e-9, atol=1e-9)
            np.testing.assert_allclose(at, after, rtol=1e-9, atol=1e-9)

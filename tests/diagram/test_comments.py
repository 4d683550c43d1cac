"""Blocks commented out equal zeros; blocks commented through equal connections from input to output."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from random_diagrams import random_recipe

import armblocks as ab
from armblocks.blocks import (
    Abs,
    BusCreator,
    BusSelector,
    Constant,
    EnabledSubsystem,
    Gain,
    Goto,
    If,
    Integrator,
    Mux,
    Scope,
    SineWave,
    StopSimulation,
    Sum,
    Switch,
    UnitDelay,
)
from armblocks.diagram import (
    ActionSubsystem,
    Connection,
    Diagram,
    DiagramBuilder,
    Inport,
    Merge,
    Outport,
    PortRef,
    content_key,
    diagram_difference,
    diagram_views,
    flatten_hierarchy,
    infer_shapes,
    with_comments,
)
from armblocks.diagram.grounded import Grounded
from armblocks.diagram.mask_tuning import tunable_parameters
from armblocks.errors import ArmblocksError, DiagramError, UnknownNameError

SEEDS = range(12)


def with_zeros(diagram: Diagram, name: str) -> Diagram:
    """The diagram with a block deleted and a Constant 0 of the same shape at every output."""
    shapes = infer_shapes(diagram).outputs
    contents = flatten_hierarchy(diagram).contents
    blocks = {key: block for key, block in diagram.blocks.items() if key != name}
    wires = [wire for wire in diagram.connections if name not in (wire.source.block, wire.target.block)]
    for port in diagram.blocks[name].output_ports():
        source = contents.get(PortRef(name, port.name), PortRef(name, port.name))
        assert isinstance(source, PortRef)
        zero = f"{name} {port.name} zero"
        blocks[zero] = Constant(value=np.zeros(shapes[source.block][source.port]))
        wires += [
            Connection(PortRef(zero, "y"), wire.target)
            for wire in diagram.connections
            if wire.source == PortRef(name, port.name) and wire.target.block != name
        ]
    return dataclasses.replace(diagram, blocks=blocks, connections=tuple(wires), layout={})


def with_connections(diagram: Diagram, name: str) -> Diagram:
    """The diagram with a block replaced by connections from its inputs to its outputs."""
    block = diagram.blocks[name]
    into = {out.name: port.name for port, out in zip(block.input_ports(), block.output_ports())}

    def before(source: PortRef) -> PortRef:
        while source.block == name:
            source = diagram.drivers[PortRef(name, into[source.port])]
        return source

    wires = tuple(
        Connection(before(wire.source), wire.target)
        for wire in diagram.connections
        if wire.target.block != name
    )
    blocks = {key: other for key, other in diagram.blocks.items() if key != name}
    return dataclasses.replace(diagram, blocks=blocks, connections=wires, layout={})


def content(diagram: Diagram, name: str) -> tuple[object, ...]:
    """The flat blocks, connections, gates, shapes and views, with the zeros of one block under its name."""
    form = flatten_hierarchy(diagram)
    flat = form.diagram

    def zero(ref: PortRef) -> PortRef:
        if ref.block.startswith(f"{name} ") and ref.block.endswith(" zero"):
            return PortRef(name, ref.block.removeprefix(f"{name} ").removesuffix(" zero"))
        return ref

    blocks = {key: block for key, block in flat.blocks.items() if zero(PortRef(key, "")).block != name}
    wires = {(zero(wire.source), wire.target) for wire in flat.connections if wire.target.block in blocks}
    shapes = {key: shape for key, shape in infer_shapes(diagram).inputs.items() if key in blocks}
    views = [(key, view) for key, view in diagram_views(diagram) if key != name]
    return blocks, wires, dict(flat.gates), shapes, views


def outcome(make: Callable[[], object]) -> object:
    """The result, or the type of the error."""
    try:
        return make()
    except ArmblocksError as error:
        return type(error)


@pytest.mark.parametrize("seed", SEEDS)
def test_commenting_out_equals_zeros_and_commenting_through_equals_connections(seed: int) -> None:
    """Every block of a random diagram; a diagram that is refused is refused in both forms."""
    diagram = random_recipe(seed).diagram()
    shapes = infer_shapes(diagram)
    compared = 0
    for name, block in diagram.blocks.items():
        if isinstance(block, Inport | Outport):
            continue
        out = dataclasses.replace(diagram, commented={name: "out"})
        one = outcome(lambda: content(out, name))  # noqa: B023
        other = outcome(lambda: content(with_zeros(diagram, name), name))  # noqa: B023
        merged = any(
            wire.source.block == name and isinstance(diagram.blocks[wire.target.block], Merge)
            for wire in diagram.connections
        )
        # A Merge takes no Constant, but ignores a subsystem that is commented out.
        assert one == other or (merged and other is DiagramError), name
        compared += not isinstance(one, type)
        ends = zip(block.input_ports(), block.output_ports())
        flat = name in shapes.inputs
        if not flat or len(block.input_ports()) < len(block.output_ports()) or not block.output_ports():
            continue
        fits = all(shapes.inputs[name][a.name] == shapes.outputs[name][b.name] for a, b in ends)
        through = dataclasses.replace(diagram, commented={name: "through"})
        one = outcome(lambda: content(through, name))  # noqa: B023
        if fits:
            assert one == outcome(lambda: content(with_connections(diagram, name), name)), name  # noqa: B023
        else:
            assert one is DiagramError or all(
                np.prod(shapes.inputs[name][a.name]) == np.prod(shapes.outputs[name][b.name]) == 1
                for a, b in zip(block.input_ports(), block.output_ports())
            )
    assert compared > len(diagram.blocks) / 2


def run(diagram: Diagram, **settings: Any) -> ab.SimulationResult:
    return ab.simulate(diagram, stop_time=1.0, sample_time=0.125, **settings)


@pytest.mark.parametrize("seed", [1, 4])
def test_runs_of_both_forms_agree(seed: int) -> None:
    diagram = random_recipe(seed).diagram()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name, block in list(diagram.blocks.items())[:3]:
            one = run(dataclasses.replace(diagram, commented={name: "out"}))
            other = run(with_zeros(diagram, name))
            for path in set(one.names) & set(other.names):
                np.testing.assert_allclose(one[path], other[path], rtol=1e-6, atol=1e-9)
            for port in block.output_ports():
                if f"{name}/{port.name}" in one.names:
                    assert not one[f"{name}/{port.name}"].any()


def model(*, open_input: bool = False) -> Diagram:
    """A vector through a gain, an integrator, a subsystem and an enabled subsystem, with logged signals."""
    builder = DiagramBuilder("commented")
    sine = builder.add("sine", SineWave(amplitude=[1.0, 2.0, 3.0]))
    gain = builder.add("gain", Gain(gain=2.0), sine)
    integrator = builder.add("integrator", Integrator(), gain)
    with builder.subsystem("filter", integrator) as inside:
        kp = inside.parameter("kp", 3.0)
        y = inside.add("k", Gain(gain=kp), inside.input("u"))
        inside.add("scope", Scope(), y)
        inside.log(y)
        inside.output("y", inside.add("delay", UnitDelay(sample_time=0.1), y))
    inner = DiagramBuilder("inner")
    inner.output("y", inner.add("state", Integrator(), inner.input("u")))
    on = builder.add("on", Constant(value=1.0))
    enabled = builder.add("enabled", EnabledSubsystem(diagram=inner.build()), gain, enable=on)
    builder.add("scope", Scope(inputs=2), builder["filter"], enabled)
    builder.log(gain)
    return builder.draft() if open_input else builder.build()


@pytest.mark.parametrize(
    ("comments", "removed", "zeros"),
    [
        ({"gain": "out"}, [], ["gain/y", "integrator/y", "filter/y"]),
        ({"integrator": "out"}, ["integrator/initial"], ["integrator/y", "filter/y"]),
        ({"filter": "out"}, ["filter/k/y", "filter/delay/y", "filter/scope/u"], ["filter/y"]),
        ({"enabled": "out"}, ["enabled/state/y", "enabled/enable/on"], ["enabled/y"]),
        ({"filter/k": "out"}, [], ["filter/k/y", "filter/y"]),
        ({"scope": "out"}, ["scope/u1"], []),
    ],
)
def test_a_block_that_is_commented_out_is_removed_from_the_flat_diagram(
    comments: dict[str, Any], removed: list[str], zeros: list[str]
) -> None:
    result = run(with_comments(model(), comments))
    assert not [name for name in removed if name in result]
    for name in zeros:
        assert result[name].shape == (9, 3)
        assert not result[name].any()
    views = [name for name, _ in diagram_views(with_comments(model(), comments))]
    assert not set(comments) & set(views)


def test_views_logged_signals_and_tunable_parameters_of_commented_blocks_are_hidden() -> None:
    plain = model()
    assert [(name, view.title) for name, view in diagram_views(plain)][-2:] == [
        ("gain", "gain/y"),
        ("filter/k", "filter/k/y"),
    ]
    hidden = with_comments(plain, {"filter": "out", "gain": "out"})
    assert [name for name, _ in diagram_views(hidden)] == ["scope"]
    assert {"filter.kp", "gain.gain"} <= {path for path, _, _ in tunable_parameters(plain)}
    assert {path for path, _, _ in tunable_parameters(hidden)} & {"filter.kp", "gain.gain"} == set()
    assert with_comments(hidden, {"filter": None, "gain": None}) == plain


@pytest.mark.parametrize("name", ["gain", "integrator", "filter", "enabled"])
def test_a_block_that_is_commented_through_is_a_connection(name: str) -> None:
    result = run(with_comments(model(), {name: "through"}))
    block = model().blocks[name]
    assert np.array_equal(result[f"{name}/y"], result[f"{name}/{block.input_ports()[0].name}"])
    assert name not in {path.split("/")[0] for path in result.names}


def test_buses_keep_their_elements() -> None:
    builder = DiagramBuilder("buses")
    first, second = (
        builder.add("first", Constant(value=[1.0, 2.0])),
        builder.add("second", Constant(value=3.0)),
    )
    bus = builder.add("bus", BusCreator(names="a, b"), first, second)
    switch = builder.add("switch", Switch(), bus, second, bus)
    chosen = builder.add("chosen", BusSelector(elements="a"), switch)
    builder.add("scope", Scope(), chosen)
    plain = builder.build()
    for name in ("bus", "switch"):
        assert np.array_equal(run(with_comments(plain, {name: "out"}))["chosen/a"][-1], [0.0, 0.0])
    assert np.array_equal(run(with_comments(plain, {"switch": "through"}))["chosen/a"][-1], [1.0, 2.0])
    with pytest.raises(DiagramError, match=r"input 'a' is of shape .* output 'bus' is a bus with a, b"):
        with_comments(plain, {"bus": "through"})


def test_a_merge_ignores_a_subsystem_that_is_commented_out() -> None:
    builder = DiagramBuilder("merge")
    sine = builder.add("sine", SineWave())
    decision = builder.add("if", If(), sine)
    inner = DiagramBuilder("inner")
    inner.output("y", inner.add("abs", Abs(), inner.input("u")))
    first = builder.add("first", ActionSubsystem(diagram=inner.build()), sine, action=decision["if1"])
    second = builder.add("second", ActionSubsystem(diagram=inner.build()), sine, action=decision["else"])
    builder.add("merge", Merge(), first, second)
    result = ab.simulate(with_comments(builder.build(), {"second": "out"}), stop_time=6.0, sample_time=0.5)
    positive = result["sine"] > 0
    assert np.allclose(result["merge"][positive], result["sine"][positive])
    held = result["merge"][result.time > 3.5]
    assert np.ptp(held) == 0.0


def test_unconnected_inputs_of_commented_blocks_need_no_driver() -> None:
    builder = DiagramBuilder("open")
    sine = builder.add("sine", SineWave(amplitude=[1.0, 2.0]))
    total = builder.add("sum", Sum(signs="++"), sine)
    with pytest.raises(DiagramError, match="1 unconnected input: sum/u2"):
        builder.build()
    builder.add("scope", Scope(), total)
    builder.comment_out(total)
    assert run(builder.build())["scope/u"].shape == (9, 2)
    builder.comment_through("sum")
    result = run(builder.build())
    assert np.array_equal(result["scope/u"], result["sine"])
    empty = DiagramBuilder("empty")
    gain = empty.add("gain", Gain(gain=[1.0, 2.0]))
    empty.comment_through(gain)
    with pytest.raises(DiagramError, match="unconnected input: gain/u"):
        empty.build()


def test_zeros_have_the_shape_of_the_driven_input_if_the_model_has_an_error() -> None:
    """Two Goto blocks with one tag: without comments, no shape is known."""
    builder = DiagramBuilder("broken")
    one = builder.add("one", Mux(inputs=2), *[builder.add(f"c{k}", Constant()) for k in range(2)])
    arm = builder.add("arm", ab.block_example("Fkine").blocks["fkine"], one)
    total = builder.add("sum", Sum(signs="++"), builder.add("x", Constant(value=[1.0, 2.0])))
    builder.connect(total, builder.add("t1", Goto(tag="A"))["u"])
    with builder.subsystem("s", total) as inside:
        inside.add("t2", Goto(tag="A", visibility="global"), inside.input("u"))
        inside.add("t3", Goto(tag="A", visibility="global"), inside["u"])
    builder.connect(builder["x"], total["u2"])
    builder.comment_out("s")
    builder.comment_out("one")
    diagram = builder.build()
    assert infer_shapes(diagram).outputs["one"]["y"] == (2,)
    assert arm.name in flatten_hierarchy(diagram).diagram.blocks


def test_a_stop_block_that_is_commented_out_does_not_stop_the_run() -> None:
    builder = DiagramBuilder("stop")
    builder.add("stop", StopSimulation(), builder.add("on", Constant(value=1.0)))
    assert run(builder.build()).time[-1] < 1.0
    assert run(with_comments(builder.build(), {"stop": "out"})).time[-1] == 1.0


@pytest.mark.parametrize(
    ("comments", "message"),
    [
        ({"scope": "through"}, "a block with 2 inputs and 0 outputs is commented through"),
        ({"sine": "through"}, "a block with 0 inputs and 1 output is commented through"),
        ({"filter/u": "out"}, "a port of a subsystem is commented"),
        ({"mux": "through"}, r"its input 'u1' is of shape \(3,\) and its output 'y' is of shape \(6,\)"),
        ({"gain": "away"}, "the comment is 'away'"),
    ],
)
def test_invalid_comments_are_refused(comments: dict[str, Any], message: str) -> None:
    diagram = model()
    blocks = {**diagram.blocks, "mux": Mux(inputs=2)}
    ends = [Connection(PortRef("gain", "y"), PortRef("mux", port)) for port in ("u1", "u2")]
    wider = dataclasses.replace(diagram, blocks=blocks, connections=(*diagram.connections, *ends))
    with pytest.raises(DiagramError, match=message):
        with_comments(wider, comments)
    with pytest.raises(UnknownNameError, match=r"no block named 'gian'.*'gain'"):
        with_comments(diagram, {"gian": "out"})


def test_the_key_of_the_cache_the_difference_and_copies_contain_comments() -> None:
    plain = model()
    out = with_comments(plain, {"gain": "out", "filter/k": "through"})
    keys = {content_key(plain), content_key(out), content_key(with_comments(plain, {"gain": "through"}))}
    assert len(keys) == 3
    comments = diagram_difference(plain, out).comments
    assert [(entry.path, entry.before, entry.after) for entry in comments] == [
        ("filter/k", None, "through"),
        ("gain", None, "out"),
    ]
    assert dataclasses.replace(out, blocks={}, connections=()).commented == {}


def test_files_and_exported_programs_keep_comments() -> None:
    out = with_comments(model(), {"gain": "out", "filter": "through", "filter/k": "through"})
    namespace: dict[str, Any] = {}
    program = ab.to_python(out)
    assert "builder.comment_out(gain)" in program
    assert ".comment_through(k)" in program
    exec(program.rpartition("result = ")[0], namespace)  # noqa: S102 - the generated program
    assert not diagram_difference(namespace["diagram"], out)


def test_grounded_blocks_are_found_at_the_original_block() -> None:
    builder = DiagramBuilder("names")
    with builder.subsystem("two", builder.add("x", Constant())) as two:
        two.input("u")
        bus = two.add("bus", BusCreator(names="a, b"), *[two.add(n, Constant()) for n in ("one", "other")])
        two.output("bus out", bus)
        two.output("plain", two["one"])
    builder.add("scope", Scope(inputs=2), builder["two"]["bus out"], builder["two"]["plain"])
    form = flatten_hierarchy(with_comments(builder.build(), {"two": "out"}))
    zeros = {path for path, block in form.diagram.blocks.items() if isinstance(block, Grounded)}
    assert zeros == {"two.bus out.a", "two.bus out.b", "two.plain"}
    assert {form.origins[path] for path in zeros} == {"two"}

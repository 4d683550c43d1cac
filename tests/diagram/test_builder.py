"""The diagram builder: accepted input, and the message for each error."""

from __future__ import annotations

import unicodedata

import pytest

from armblocks.blocks import Clock, Constant, Demux, Gain, Integrator, JTraj, Scope, Sum, XYGraph
from armblocks.diagram import BlockLibrary, Diagram, DiagramBuilder, Placement, PortRef, with_parameters
from armblocks.equations import SimulationOptions
from armblocks.errors import DiagramError, InputError, UnknownNameError


def oscillator(order: tuple[str, ...] = ("force", "speed", "angle")) -> Diagram:
    """Build x'' = -x with the blocks added in the given order."""
    blocks = {"force": Gain(gain=-1.0), "speed": Integrator(), "angle": Integrator(initial=1.0)}
    builder = DiagramBuilder("oscillator")
    handles = {name: builder.add(name, blocks[name]) for name in order}
    builder.connect(handles["force"], handles["speed"])
    builder.connect(handles["speed"], handles["angle"]["u"])
    builder.connect(handles["angle"]["y"], handles["force"])
    return builder.build()


def test_the_order_of_adding_blocks_does_not_change_the_diagram() -> None:
    assert oscillator() == oscillator(("angle", "force", "speed"))
    assert hash(oscillator()) == hash(oscillator(("speed", "angle", "force")))
    assert list(oscillator().blocks) == ["angle", "force", "speed"]


def test_inputs_are_connected_by_position_by_name_and_by_connect() -> None:
    builder = DiagramBuilder("d")
    one, two = builder.add("one", Constant()), builder.add("two", Constant(value=2.0))
    builder.add("a", Sum(signs="+-"), one, two)
    builder.add("b", Sum(signs="+-"), u2=two, u1=one["y"])
    c = builder.add("c", Sum(signs="+-"), one)
    builder.connect(two, c["u2"])
    diagram = builder.build()
    for name in "abc":
        assert diagram.drivers[PortRef(name, "u1")] == PortRef("one", "y")
        assert diagram.drivers[PortRef(name, "u2")] == PortRef("two", "y")
    assert str(diagram.connections[0]) == "one/y -> a/u1"


def test_a_built_diagram_has_layout_settings_and_unknown_keys() -> None:
    options = SimulationOptions(stop_time=3.0)
    builder = DiagramBuilder("d", settings=options, extras={"colour": "red"})
    clock = builder.add("clock", Clock())
    builder.place(clock, 10, 20)
    builder.place("clock", 30, 40, flipped=True)
    diagram = builder.build()
    assert diagram.settings == options
    assert diagram.layout == {"clock": Placement(x=30, y=40, flipped=True)}
    assert diagram.extras == {"colour": "red"}
    assert repr(clock) == "BlockHandle('clock', Clock)"
    with pytest.raises(TypeError):
        diagram.blocks["new"] = Clock()  # pyright: ignore[reportIndexIssue]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("", "a block has an empty name"),
        (" ", "a block has an empty name"),
        ("a/b", "the block name 'a/b' contains '/'"),
        ("a.b", r"the block name 'a\.b' contains '\.'"),
        ("a\nb", r"the block name 'a\\nb' contains '\\n'"),
        ("a\u202eb", r"contains '\\u202e'"),
        ("n" * 201, "has 201 characters"),
    ],
)
def test_an_invalid_block_name_is_refused(name: str, message: str) -> None:
    with pytest.raises(DiagramError, match=message) as caught:
        DiagramBuilder("d").add(name, Clock())
    assert len(str(caught.value)) < 400
    assert "diagram 'd'" in str(caught.value)


@pytest.mark.parametrize("name", ["Größe", "速度", "tool path <b>'\"", "n" * 200])
def test_other_block_names_are_accepted(name: str) -> None:
    builder = DiagramBuilder("d")
    builder.add(name, Clock())
    assert name in builder.build().blocks


def test_a_repeated_block_name_is_refused() -> None:
    builder = DiagramBuilder("d")
    builder.add("clock", Clock())
    with pytest.raises(DiagramError, match=r"two blocks are named 'clock'.*unique names"):
        builder.add("clock", Clock())


@pytest.mark.parametrize(
    ("first", "second"),
    [("clock", "Clock"), ("é", unicodedata.normalize("NFD", "é")), ("straße", "STRASSE")],
)
def test_names_that_differ_only_in_case_or_encoding_are_refused(first: str, second: str) -> None:
    builder = DiagramBuilder("d")
    builder.add(first, Clock())
    with pytest.raises(DiagramError, match="differs only in case or Unicode encoding"):
        builder.add(second, Clock())


def test_two_drivers_on_one_input_are_refused() -> None:
    builder = DiagramBuilder("d")
    one, two = builder.add("one", Constant()), builder.add("two", Constant())
    gain = builder.add("gain", Gain(), one)
    with pytest.raises(DiagramError, match="input 'gain/u' has two drivers, 'one/y' and 'two/y'"):
        builder.connect(two, gain)


def test_unconnected_inputs_are_all_listed() -> None:
    builder = DiagramBuilder("d")
    builder.add("path", XYGraph())
    with pytest.raises(DiagramError, match=r"diagram 'd': 2 unconnected inputs: path/x, path/y. Allowed"):
        builder.build()


def test_at_most_twenty_unconnected_inputs_are_listed() -> None:
    builder = DiagramBuilder("d")
    builder.add("scope", Scope(inputs=25))
    with pytest.raises(DiagramError, match=r"25 unconnected inputs: scope/u1, .*, scope/u20 and 5 more"):
        builder.build()
    single = DiagramBuilder("d")
    single.add("gain", Gain())
    with pytest.raises(DiagramError, match=r"1 unconnected input: gain/u. "):
        single.build()


def test_an_unknown_port_is_refused_with_the_nearest_name() -> None:
    builder = DiagramBuilder("d")
    traj = builder.add("traj", JTraj())
    with pytest.raises(UnknownNameError, match=r"block 'traj' \(jtraj\): there is no port named 'qdddd'"):
        traj["qdddd"]
    with pytest.raises(UnknownNameError, match=r"there is no input port named 'q'"):
        builder.connect(traj["q"], traj["q"])
    with pytest.raises(UnknownNameError, match=r"there is no output port named 'z'.*Allowed: q, qd, qdd"):
        builder.add("gain", Gain(), PortRef("traj", "z"))
    with pytest.raises(UnknownNameError, match=r"there is no input port named 'v'"):
        builder.add("other", Gain(), v=traj["q"])


def test_an_unknown_block_is_refused_with_the_nearest_name() -> None:
    builder = DiagramBuilder("d")
    gain = builder.add("gain", Gain())
    with pytest.raises(UnknownNameError, match=r"there is no block named 'gian'.*did you mean 'gain'"):
        builder.connect(PortRef("gian", "y"), gain)
    with pytest.raises(UnknownNameError, match=r"there is no block named 'gian'"):
        builder.place("gian", 0, 0)


def test_a_block_with_several_outputs_cannot_be_connected_without_a_port() -> None:
    builder = DiagramBuilder("d")
    traj = builder.add("traj", JTraj())
    with pytest.raises(DiagramError, match=r"the block has 3 outputs, so its name alone is ambiguous"):
        builder.add("gain", Gain(), traj)
    with pytest.raises(DiagramError, match=r"the block has 0 inputs.*Allowed: a block with one"):
        builder.connect(traj["q"], traj)


def test_too_many_inputs_are_refused() -> None:
    builder = DiagramBuilder("d")
    clock = builder.add("clock", Clock())
    with pytest.raises(DiagramError, match=r"block 'gain' \(Gain\): 2 inputs are given. Allowed: 1: u"):
        builder.add("gain", Gain(), clock, clock)
    with pytest.raises(DiagramError, match=r"1 input is given. Allowed: no inputs"):
        builder.add("constant", Constant(), clock)


def test_an_unknown_block_of_a_diagram_is_refused_with_its_name() -> None:
    diagram = oscillator()
    assert diagram.block("speed") == Integrator()
    with pytest.raises(UnknownNameError, match=r"diagram 'oscillator': there is no block named 'sped'"):
        diagram.block("sped")


def test_parameters_can_be_set_by_path() -> None:
    diagram = oscillator()
    changed = with_parameters(diagram, {"force.gain": -4, "angle.initial": 2.0})
    assert changed.block("force") == Gain(gain=-4.0)
    assert changed.block("angle") == Integrator(initial=2.0)
    assert diagram == oscillator()


def test_unknown_parameters_and_wrong_values_are_refused() -> None:
    diagram = oscillator()
    with pytest.raises(UnknownNameError, match=r"there is no block named 'farce'.*did you mean 'force'"):
        with_parameters(diagram, {"farce.gain": 1.0})
    with pytest.raises(UnknownNameError, match=r"block 'force': there is no parameter named 'gian'"):
        with_parameters(diagram, {"force.gian": 1.0})
    with pytest.raises(DiagramError, match=r"block 'force', Gain.gain: the value is nan"):
        with_parameters(diagram, {"force.gain": float("nan")})
    builder = DiagramBuilder("d")
    parts = builder.add("parts", Demux(parts=2), builder.add("pair", Constant(value=[1.0, 2.0])))
    builder.add("sum", Sum(), parts["y1"], parts["y2"])
    with pytest.raises(DiagramError, match=r"'u' has shape \(3,\).*a vector whose length 2 divides"):
        with_parameters(builder.build(), {"pair.value": [1.0, 2.0, 3.0]})


def test_a_block_library_finds_types_families_and_the_nearest_name() -> None:
    library = BlockLibrary({"maths": [Gain], "sources": [Clock, Constant]})
    assert library["Gain"] is Gain
    assert "Clock" in library
    assert len(library) == 3
    assert library.families == {"maths": (Gain,), "sources": (Clock, Constant)}
    assert library.family_of(Clock) == "sources"
    with pytest.raises(UnknownNameError, match="there is no block type named 'Sum'"):
        library.family_of(Sum)
    wider = library.with_kinds("own", [Sum])
    assert wider.family_of(Sum) == "own"
    assert "Sum" not in library
    with pytest.raises(DiagramError, match="there is a block type named 'Gain' already"):
        library.with_kinds("own", [Gain])
    with pytest.raises(UnknownNameError, match=r"there is no block type named 'Gian'.*did you mean 'Gain'"):
        library["Gian"]


def test_inconsistent_parameters_of_a_block_are_refused() -> None:
    with pytest.raises(InputError, match=r"JTraj: q0 has 2 joints and qf has 6"):
        JTraj(q0=[0, 0])

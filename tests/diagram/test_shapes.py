"""Shape inference, including loops; errors name both ends of a connection."""

from __future__ import annotations

import pytest

from armblocks.blocks import (
    Constant,
    Demux,
    Gain,
    Integrator,
    MatrixGain,
    MatrixProduct,
    Mux,
    SineWave,
    Sum,
    T2xyz,
    TransferFunction,
)
from armblocks.diagram import DiagramBuilder, broadcast, infer_shapes
from armblocks.errors import DiagramError, InputError


def test_scalars_are_broadcast_to_any_shape() -> None:
    assert broadcast({"a": (), "b": (3,)}) == (3,)
    assert broadcast({"a": (2, 2), "b": (), "c": (1,)}) == (2, 2)
    assert broadcast({"a": (), "b": (1,)}) == (1,)
    assert broadcast({}) == ()
    with pytest.raises(InputError, match=r"'a' has shape \(3,\) and 'c' has shape \(2,\)"):
        broadcast({"a": (3,), "b": (), "c": (2,)})


def test_an_integrator_takes_the_shape_of_its_loop() -> None:
    builder = DiagramBuilder("d")
    x = builder.add("x", Integrator())
    spring = builder.add("spring", Gain(gain=-2.0), x)
    push = builder.add("push", Constant(value=[1.0, 2.0, 3.0]))
    builder.connect(builder.add("sum", Sum(), spring, push), x)
    shapes = infer_shapes(builder.build())
    assert {name: list(ports.values()) for name, ports in shapes.outputs.items()} == {
        "x": [(3,)],
        "spring": [(3,)],
        "push": [(3,)],
        "sum": [(3,)],
    }


def test_a_matrix_gain_in_a_loop_determines_the_shape() -> None:
    builder = DiagramBuilder("d")
    x = builder.add("x", Integrator(initial=0.0))
    builder.connect(builder.add("A", MatrixGain(gain=[[0.0, 1.0], [-1.0, 0.0]]), x), x)
    assert infer_shapes(builder.build()).inputs["A"] == {"u": (2,)}


def test_scalars_and_vectors_of_one_element_are_interchangeable() -> None:
    builder = DiagramBuilder("d")
    one = builder.add("one", Constant(value=[1.0]))
    builder.add("filter", TransferFunction(), one)
    builder.add("matrix", MatrixGain(gain=[[2.0]]), builder.add("plain", Constant()))
    assert infer_shapes(builder.build()).outputs["matrix"] == {"y": (1,)}


def test_the_error_about_a_shape_mismatch_names_both_ports() -> None:
    builder = DiagramBuilder("d")
    builder.add("xyz", T2xyz(), builder.add("pose", Constant(value=[1.0, 2.0])))
    with pytest.raises(
        DiagramError, match=r"^block 'xyz': 'pose/y' gives shape \(2,\) but 'xyz/T' takes shape \(4, 4\)"
    ):
        builder.build()


def test_the_error_about_inconsistent_inputs_names_their_sources() -> None:
    builder = DiagramBuilder("d")
    two, three = builder.add("two", Constant(value=[1, 2])), builder.add("three", SineWave(bias=[1, 2, 3]))
    builder.add("sum", Sum(), two, three)
    with pytest.raises(
        DiagramError,
        match=r"block 'sum' \(Sum\), inputs 'u1' from 'two/y', 'u2' from 'three/y': "
        r"'u1' has shape \(2,\) and 'u2' has shape \(3,\)",
    ):
        builder.build()


def test_mux_and_demux_refuse_unsuitable_shapes() -> None:
    builder = DiagramBuilder("d")
    builder.add("mux", Mux(), *[builder.add(name, Constant(value=[[1.0]])) for name in "ab"])
    with pytest.raises(DiagramError, match=r"'u1' has shape \(1, 1\). Allowed: scalars and vectors"):
        builder.build()
    builder = DiagramBuilder("d")
    builder.add("demux", Demux(parts=2), builder.add("c", Constant(value=[1, 2, 3])))
    with pytest.raises(DiagramError, match=r"a vector whose length 2 divides"):
        builder.build()


def test_matrices_that_cannot_be_multiplied_are_refused() -> None:
    builder = DiagramBuilder("d")
    a, b = builder.add("a", Constant(value=[[1.0, 2.0]])), builder.add("b", Constant(value=[1.0, 2.0, 3.0]))
    builder.add("product", MatrixProduct(), a, b)
    with pytest.raises(DiagramError, match=r"'A' has shape \(1, 2\) and 'B' has shape \(3,\)"):
        builder.build()


def test_a_loop_whose_width_grows_without_limit_is_refused() -> None:
    builder = DiagramBuilder("d")
    x = builder.add("x", Integrator())
    builder.connect(builder.add("mux", Mux(), x, builder.add("one", Constant())), x)
    with pytest.raises(DiagramError, match=r"is inconsistent: it was \(\d+,\) and becomes \(\d+,\)"):
        builder.build()

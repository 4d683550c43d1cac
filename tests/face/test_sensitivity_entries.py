"""Derivatives of runs with respect to single entries of vector and matrix parameters."""

from __future__ import annotations

import re

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import Constant, Gain, Integrator, MatrixGain
from armblocks.diagram import Block
from armblocks.errors import InputError, UnknownNameError

SETTINGS = {"rtol": 1e-10, "atol": 1e-12, "stop_time": 3.0, "sample_time": 0.1}


@pytest.mark.parametrize(
    ("block", "entries"),
    [
        (Gain(gain=(0.4, -1.2, 0.7)), ("g.gain[1]", "g.gain[2]")),
        (MatrixGain(gain=((0.4, -1.2, 0.1), (0.3, -0.2, 0.5))), ("g.gain[1,2]", "g.gain[0,1]")),
        (Gain(gain=(0.4,)), ("g.gain[0]",)),
    ],
)
def test_the_derivative_by_an_entry_is_a_column_of_that_by_the_parameter(
    block: Block, entries: tuple[str, ...]
) -> None:
    builder = ab.DiagramBuilder("entry")
    state = builder.add("x", Integrator(initial=(1.0, 2.0, -1.0)))
    builder.connect(builder.add("rate", Gain(gain=-0.3), state), state["u"])
    builder.add("y", Integrator(initial=0.0), builder.add("g", block, state))
    whole = ab.sensitivity(builder.build(), "g.gain", "y", **SETTINGS)
    single = ab.sensitivity(builder.build(), entries, "y", **SETTINGS)
    both = ab.sensitivity(builder.build(), [*entries, "g.gain", entries[0]], "y", **SETTINGS)
    shape = np.shape(block.parameter_value("gain"))
    for entry in entries:
        index = tuple(map(int, entry[entry.index("[") + 1 : -1].split(",")))
        column = whole["y", "g.gain"].reshape(*whole["y", entry].shape, *shape)[(..., *index)]
        assert np.abs(column).max() > 0.1
        for result in (single, both):
            assert np.allclose(result["y", entry], column, rtol=0.0, atol=1e-9)
    with pytest.raises(UnknownNameError, match=r"no parameter named 'g.gain'"):
        _ = single["y", "g.gain"]
    out_of_range = f"g.gain[{','.join(map(str, shape))}]"
    with pytest.raises(
        InputError, match=rf"'{re.escape(out_of_range)}' is not an entry of 'g.gain', which has shape"
    ):
        ab.sensitivity(builder.build(), out_of_range, "y")


def test_an_index_out_of_range_is_reported_with_the_range() -> None:
    builder = ab.DiagramBuilder("entry")
    matrix = builder.add("m", MatrixGain(gain=((0.4, -1.2), (0.3, -0.2), (0.0, 1.0))))
    builder.connect(builder.add("x", Constant(value=(1.0, 2.0))), matrix["u"])
    with pytest.raises(InputError, match=r"shape \(3, 2\)\.? .*m\.gain\[0,0\] to m\.gain\[2,1\]"):
        ab.sensitivity(builder.build(), "m.gain[2,2]", "m")
    builder.add("k", Gain(gain=2.0), matrix)
    with pytest.raises(InputError, match=r"'k.gain\[0\]' is not an entry of 'k.gain', which is a scalar"):
        ab.sensitivity(builder.build(), "k.gain[0]", "k")

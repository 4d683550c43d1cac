"""Flat columns of named values: the layout of states, inputs and parameters in the equations."""

from __future__ import annotations

from collections.abc import Sequence

from casadi import SX, densify

from armblocks.diagram.block import Block, Signals
from armblocks.diagram.parameter import shape_of
from armblocks.equations import Shape, Slot, flatten, unflatten


def tunable_slots(block: Block) -> tuple[Slot, ...]:
    """The tunable parameters of a block, in order."""
    return tuple(
        Slot(rule.name, shape_of(block.parameter_value(rule.name)), rule.unit)
        for rule in block.inputs_of_the_run()
    )


def named_values(slots: Sequence[Slot], flat: SX) -> Signals:
    """The values in a flat column by name: scalars 1x1, vectors as columns, matrices unchanged."""
    values: dict[str, SX] = {}
    start = 0
    for slot in slots:
        values[slot.name] = unflatten(flat[start : start + slot.size], slot.shape)
        start += slot.size
    return values


def broadcast_column(value: SX, shape: Shape) -> SX:
    """The flat column of a value; a scalar is broadcast to the shape."""
    slot = Slot("", shape)
    if value.numel() == 1:
        return densify(SX.ones(slot.size) * value)
    return flatten(value, shape)

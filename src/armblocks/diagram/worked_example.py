"""Worked examples of blocks: inputs, parameters and shown signals.

A worked example is a description by names of block types, so that a block need not import other blocks.
:func:`armblocks.block_example` builds its diagram.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True, kw_only=True)
class ExampleBlock:
    """A block of the example, by type name, with its inputs.

    ``inputs`` by port; ``port`` selects one of several outputs; ``name`` is the block's name in the diagram
    (by default its title in lower case).
    """

    type_name: str
    parameters: Mapping[str, Any] = field(default_factory=dict[str, Any])
    inputs: Mapping[str, Driver] = field(default_factory=dict[str, Any])
    port: str = ""
    name: str = ""

    def by(self, **inputs: Driver) -> ExampleBlock:
        """The same block with these inputs: ``driver("Sum", signs="+-").by(u1=driver("Step"), u2="y")``."""
        return dataclasses.replace(self, inputs={**self.inputs, **inputs})

    def at(self, port: str) -> ExampleBlock:
        """The same block with the selected output ``port``."""
        return dataclasses.replace(self, port=port)

    def named(self, name: str) -> ExampleBlock:
        """The same block with an explicit name; equal names mean the same block."""
        return dataclasses.replace(self, name=name)


Driver = ExampleBlock | str
"""The driver of an input: another block, or text: ``"y"``, an output of the example's block; ``"u"``, the
driver of its input u; ``"plant/y"``, an output of a named block."""


def driver(type_name: str, **parameters: Any) -> ExampleBlock:
    """A block of the example by type name and parameters: ``driver("SineWave", amplitude=2.0)``."""
    return ExampleBlock(type_name=type_name, parameters=parameters)


@dataclass(frozen=True, kw_only=True)
class WorkedExample:
    """A small diagram that demonstrates one block.

    - ``shows``: a caption of one or two sentences.
    - ``parameters``: of the block (robots by name).
    - ``inputs``: by port; an omitted port gets a suitable signal.
    - ``shown``: the signals of the scope, by default the inputs and outputs of the block.
    - ``x_axis``, ``y_axis``: the signals of an x-y plot instead.
    - ``extra_blocks``: additional, unconnected blocks.
    - ``lines``: frame lines, pairs of frame ports ``"block/port"``, or ``"port"`` of the example's block.
    - ``stop_time``, ``sample_time``: end of the run and interval of the record, s.
    """

    shows: str = ""
    parameters: Mapping[str, Any] = field(default_factory=dict[str, Any])
    inputs: Mapping[str, Driver] = field(default_factory=dict[str, Any])
    shown: tuple[Driver, ...] = ()
    x_axis: Driver | None = None
    y_axis: Driver | None = None
    extra_blocks: tuple[ExampleBlock, ...] = ()
    lines: tuple[tuple[str, str], ...] = ()
    stop_time: float = 10.0
    sample_time: float | None = None

"""How a block says what shows it at work: what feeds it, with which parameters, and what one sees then.

A worked example is a description only, by the names of block types, so that a block needs to import no other
to have one. :func:`armblocks.block_example` makes the diagram of it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True, kw_only=True)
class Fed:
    """A block of the example, by its type's name, with what feeds it.

    ``inputs`` by port; ``port`` the output that is meant where there are several; ``name`` what the block is
    called in the diagram (its title in small letters where nothing is said).
    """

    type_name: str
    parameters: Mapping[str, Any] = field(default_factory=dict[str, Any])
    inputs: Mapping[str, Feed] = field(default_factory=dict[str, Any])
    port: str = ""
    name: str = ""

    def by(self, **inputs: Feed) -> Fed:
        """The same block with these inputs: ``made("Sum", signs="+-").by(u1=made("Step"), u2="y")``."""
        return dataclasses.replace(self, inputs={**self.inputs, **inputs})

    def at(self, port: str) -> Fed:
        """The same block, of whose outputs ``port`` is meant."""
        return dataclasses.replace(self, port=port)

    def named(self, name: str) -> Fed:
        """The same block under a name of its own; two mentions of one name are one block."""
        return dataclasses.replace(self, name=name)


Feed = Fed | str
"""What feeds an input: a further block, or text: ``"y"``, an output of the block that is shown; ``"u"``, what
feeds its own input u; ``"plant/y"``, an output of a named block."""


def made(type_name: str, **parameters: Any) -> Fed:
    """A block of the example by its type's name and parameters: ``made("SineWave", amplitude=2.0)``."""
    return Fed(type_name=type_name, parameters=parameters)


@dataclass(frozen=True, kw_only=True)
class WorkedExample:
    """A small diagram around one block that shows what it does.

    ``shows`` one or two sentences on what is to be seen. ``parameters`` of the block where the defaults show
    less (robots by name). ``inputs`` by port; a port that is left out gets a signal that fits it. ``shown``:
    the signals of the scope; left out, what feeds the block and what it gives. ``across`` and ``up``: one
    signal over another instead. ``besides``: blocks that no wire leads to. ``stop_time`` and ``sample_time``
    s, of the run and of the record.
    """

    shows: str = ""
    parameters: Mapping[str, Any] = field(default_factory=dict[str, Any])
    inputs: Mapping[str, Feed] = field(default_factory=dict[str, Any])
    shown: tuple[Feed, ...] = ()
    across: Feed | None = None
    up: Feed | None = None
    besides: tuple[Fed, ...] = ()
    stop_time: float = 10.0
    sample_time: float | None = None

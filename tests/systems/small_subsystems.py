"""Diagrams for conditional subsystems."""

from __future__ import annotations

import armblocks as ab
from armblocks.blocks import Gain, Inport, Outport, Sum, UnitDelay
from armblocks.diagram import Diagram


def scaled(gain: float) -> Diagram:
    """A subsystem: its input times ``gain``."""
    inner = ab.DiagramBuilder("scaled")
    inner.add("out", Outport(), inner.add("gain", Gain(gain=gain), inner.add("in", Inport())))
    return inner.build()


def counter() -> Diagram:
    """A subsystem that adds its input to its output at each execution."""
    inner = ab.DiagramBuilder("counter")
    total = inner.add("total", Sum(signs="++"), inner.add("in", Inport()))
    inner.connect(inner.add("delay", UnitDelay(), total), total["u2"])
    inner.add("out", Outport(), total)
    return inner.build()

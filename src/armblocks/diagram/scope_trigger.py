"""The trigger of the scopes of a diagram. It selects the displayed times and does not affect the model."""

from __future__ import annotations

import math
from dataclasses import dataclass

from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import DiagramError

TRIGGER_EDGES = ("rising", "falling", "either")
"""Directions in which the signal crosses the level."""
TRIGGER_MODES = ("normal", "auto", "single")
"""``normal``: the window of the last trigger; ``auto``: the last samples while there is no trigger;
``single``: the window of the first trigger."""
MAX_ELEMENT = 1_000_000
"""Largest index of an element of a signal."""


@dataclass(frozen=True, kw_only=True)
class ScopeTrigger(metaclass=ArgumentErrors):
    """A trigger of the scopes: they show a window about a time at which a signal crosses a level.

    - ``on``: false for a trigger that is switched off and keeps its settings.
    - ``signal``: the path of an output, ``"controller/error/y"``. The signal may be missing: the trigger then
      waits.
    - ``element``: the index of an entry of this signal, from 0.
    - ``level``: in the SI unit of the signal.
    - ``span``: the width of the window, s.
    - ``position``: the part of the window before the trigger, 0 to 1.
    - ``hold_off``: the time after a trigger during which further crossings are ignored, s.

    Raises ``DiagramError``.
    """

    on: bool = True
    signal: str = ""
    element: int = 0
    edge: str = "rising"
    level: float = 0.0
    mode: str = "normal"
    span: float = 1.0
    position: float = 0.5
    hold_off: float = 0.0

    def __post_init__(self) -> None:
        rules = (
            ("edge", self.edge in TRIGGER_EDGES, ", ".join(TRIGGER_EDGES)),
            ("mode", self.mode in TRIGGER_MODES, ", ".join(TRIGGER_MODES)),
            ("element", 0 <= self.element <= MAX_ELEMENT, f"0 to {MAX_ELEMENT}"),
            ("level", math.isfinite(self.level), "a finite number"),
            ("span", 0 < self.span < math.inf, "a number of seconds above 0"),
            ("position", 0 <= self.position <= 1, "0 to 1"),
            ("hold_off", 0 <= self.hold_off < math.inf, "0 s or more"),
        )
        for name, is_valid, allowed in rules:
            if not is_valid:
                raise DiagramError(
                    f"the {name} of the trigger is {getattr(self, name)!r}",
                    where="scope trigger",
                    allowed=allowed,
                    fix="correct this setting of the trigger",
                )

"""The semantics of conditional subsystems in plain Python: controls, held outputs, merged outputs.

These classes replace the blocks of the same names in a flat diagram. They have the same ports and share no
code with the equations of the blocks.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from armblocks.diagram.controls import EnableControl, HeldOutput, MergedOutput, TriggerControl
from armblocks.equations import Shape


class _ControlBlock:
    """The interface that the network requires of every block."""

    clock = None
    period = 0.0
    states = lines = guards = conditions = momentary = captured_when_enabled = ()
    has_events = False
    expressions: Mapping[Any, Any] = {}
    memory: tuple[str, ...] = ()
    sides: tuple[str, ...] = ()

    def __init__(
        self, name: str, block: Any, shapes: Mapping[str, Shape], outputs: Mapping[str, Shape]
    ) -> None:
        self.name, self.block = name, block
        self.gate: dict[str, np.ndarray] = {}
        self.arrays: dict[str, np.ndarray] = {"t": np.zeros(1)}
        self.arrays |= {f"u:{port}": np.zeros(math.prod(shape)) for port, shape in shapes.items()}
        self.output_shapes = outputs
        self.outputs = {port: np.zeros(math.prod(shape)) for port, shape in outputs.items()}
        self.rates: dict[str, np.ndarray] = {}
        self.modes = tuple(_Named(entry) for entry in self.sides)
        self.arrays |= {f"x:{entry}": np.zeros(1) for entry in self.sides}
        self.discrete = tuple(_Named(entry) for entry in self.memory)
        for entry in self.memory:
            self.arrays[f"x:{entry}"] = np.zeros(math.prod(outputs.get("y", ())))
        self.inputs_read = [key[2:] for key in self.arrays if key.startswith("u:")]
        self.begin()

    on, restarts, fires = True, False, False
    ticking = False
    """Whether the present evaluation is part of a tick."""
    was_restarted = False
    """Whether the block has been restarted at this instant."""

    def begin(self) -> None: ...
    def restart(self) -> None: ...

    def remember(self) -> None: ...

    def names(self, kind: str) -> list[str]:
        return ["held"] if kind == "capture" and "held" in self.memory else []

    def side(self) -> float:
        """Return whether the control signal is positive."""
        return float(self.arrays["u:u"][0] > 0.0)

    def update_modes(self) -> bool:
        changed = self.modes_differ()
        self.arrays["x:side"][:] = self.side()
        return changed

    def modes_differ(self) -> bool:
        return bool(self.arrays["x:side"][0] != self.side())

    def followed(self, port: str) -> str | None:
        """Return the input that an output equals now, if there is one."""
        return None

    def inputs_followed(self, port: str) -> list[str]:
        """Return the inputs that an output may equal."""
        return []

    def u(self, port: str, default: float = 1.0) -> float:
        return float(self.arrays[f"u:{port}"][0]) if f"u:{port}" in self.arrays else default

    def needs(self, kind: str, port: str) -> set[str]:
        if kind == "mode":
            return {"u:u"}
        unread = {"u:u"} if self.sides else set[str]()
        return {key for key in self.arrays if key.startswith("u:")} - unread if kind == "out" else set()


class _Named:
    def __init__(self, name: str) -> None:
        self.name = name


class Enable(_ControlBlock):
    """Enabled while u is positive and the outer subsystem is on; states may restart on enabling.

    At events the outputs of the subsystem are updated after the restart.
    """

    memory = ("previous",)
    sides = ("side",)

    def begin(self) -> None:
        self.arrays["x:previous"][:] = -1.0

    def value(self, kind: str, port: str) -> np.ndarray:
        on = self.arrays["x:side"][0] * self.u("outer")
        begins = bool(on and self.arrays["x:previous"][0] == 0.0)
        values = {
            "on": on,
            "running": on if self.ticking else on * (not begins),
            "restart": float((begins and self.block.restarts) or bool(self.u("outer_restart", 0.0))),
        }
        return np.array([values[port]])

    def pending(self) -> bool:
        """Return whether the control is about to act."""
        on, previous = self.value("out", "on")[0], self.arrays["x:previous"][0]
        return bool(previous >= 0.0 and on != previous)

    def act(self, t: float) -> bool:
        on, previous = self.value("out", "on")[0], self.arrays["x:previous"][0]
        self.arrays["x:previous"][:] = on
        return bool(on != previous)


class Trigger(_ControlBlock):
    """Fires when the sign of u has changed in the chosen direction and the outer subsystem is on.

    It does not fire at an instant at which the outer subsystem restarts.
    """

    memory = ("previous", "last")
    sides = ("side",)

    def begin(self) -> None:
        self.arrays["x:previous"][:] = -1.0

    def value(self, kind: str, port: str) -> np.ndarray:
        side, previous = self.arrays["x:side"][0], self.arrays["x:previous"][0]
        rises, falls = side == 1.0 and previous == 0.0, side == 0.0 and previous == 1.0
        fires = {"rising": rises, "falling": falls, "either": rises or falls}[self.block.edge]
        # Signals that become consistent at the start have no edges.
        fires = fires and self.arrays["t"][0] > 0.0
        outer_restarts = bool(self.u("outer_restart", 0.0))
        fires = fires and bool(self.u("outer")) and not outer_restarts and not self.was_restarted
        values = {
            "fire": float(fires),
            "restart": float(fires or outer_restarts),
            "elapsed": self.arrays["t"][0] - self.arrays["x:last"][0],
        }
        return np.array([values[port]])

    def pending(self) -> bool:
        """Return whether the sign of the trigger has changed."""
        side, previous = self.arrays["x:side"][0], self.arrays["x:previous"][0]
        return bool(previous >= 0.0 and side != previous)

    def act(self, t: float) -> bool:
        side, previous = self.arrays["x:side"][0], self.arrays["x:previous"][0]
        if t <= 0.0:
            self.arrays["x:previous"][:] = side
            return False
        if self.value("out", "fire")[0] or self.u("outer_restart", 0.0):
            self.arrays["x:last"][:] = t
        self.was_restarted = self.was_restarted or bool(self.u("outer_restart", 0.0))
        self.arrays["x:previous"][:] = side
        return bool(side != previous)


class Held(_ControlBlock):
    """The output is u while the subsystem executes, otherwise its last value or the initial one.

    When the outer subsystem restarts, the held value becomes the initial one.
    """

    memory = ("held",)

    def begin(self) -> None:
        self.arrays["x:held"][:] = np.ravel(self.block.initial)

    def value(self, kind: str, port: str) -> np.ndarray:
        if self.u("running"):
            return self.arrays["u:u"] + 0.0 * self.arrays["x:held"]
        reset = kind == "out" and not self.block.pulsed and self.block.when_off == "reset"
        if reset or self.u("outer_restart", 0.0):
            return np.zeros_like(self.arrays["x:held"]) + np.ravel(self.block.initial)
        return self.arrays["x:held"]

    def followed(self, port: str) -> str | None:
        return "u" if self.u("running") else None

    def inputs_followed(self, port: str) -> list[str]:
        return ["u"]

    def names(self, kind: str) -> list[str]:
        return ["held"] if kind == "capture" and not self.block.pulsed else []

    def act(self, t: float) -> bool:
        if self.u("outer_restart", 0.0):
            self.arrays["x:held"][:] = np.ravel(self.block.initial)
        if self.block.pulsed and self.u("running"):
            self.arrays["x:held"][:] = self.arrays["u:u"]
        return False


class Merged(_ControlBlock):
    """The output is the first input whose subsystem executes, otherwise the last value.

    When the outer subsystem restarts, the last value becomes the initial one.
    """

    memory = ("held",)

    def begin(self) -> None:
        self.arrays["x:held"][:] = np.ravel(self.block.initial)

    def inputs_followed(self, port: str) -> list[str]:
        return [f"u{number}" for number in range(1, self.block.inputs + 1)]

    def followed(self, port: str) -> str | None:
        return next((u for u in self.inputs_followed(port) if self.u(f"running{u[1:]}")), None)

    def value(self, kind: str, port: str) -> np.ndarray:
        source = self.followed(port)
        if source is not None:
            return self.arrays[f"u:{source}"] + 0.0 * self.arrays["x:held"]
        if self.u("outer_restart", 0.0):
            return np.zeros_like(self.arrays["x:held"]) + np.ravel(self.block.initial)
        return self.arrays["x:held"]

    def act(self, t: float) -> bool:
        self.arrays["x:held"][:] = self.value("out", "y")
        return False


CONTROLS = {EnableControl: Enable, TriggerControl: Trigger, HeldOutput: Held, MergedOutput: Merged}

"""The names that ``armblocks trim`` accepts for a diagram, and example commands."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from armblocks.cli.terminal import STRONG, table

if TYPE_CHECKING:
    from armblocks.analysis.operating_point import OperatingPoint
    from armblocks.equations import HybridSystem, Signature

MAX_ROWS = 24
"""Maximum number of rows of each table."""

MAX_NUMBERS = 8
"""Maximum number of entries of a vector that a row shows."""


def print_trimmable(system: HybridSystem, start: OperatingPoint, model: str, console: Console) -> None:
    """Print tables of the names with their values at the ``start``, and example commands."""
    console.print(f"{system.name}: names for trim", style=STRONG)
    if not system.states.size:
        console.print("There are no states and therefore no equilibrium conditions.")
    _print_slots("state", "--fix, --moving, --guess, --bound", system.states, start.states, console)
    _print_slots("parameter", "--free, --guess, --bound", system.parameters, start.parameters, console)
    _print_slots("signal", "--output", system.signals_layout, start.signals, console)
    console.print()
    console.print("for example:", style=STRONG)
    for line in example_lines(system, model):
        console.print(f"  {line}", soft_wrap=True)


def example_lines(system: HybridSystem, model: str) -> list[str]:
    """Example commands with names of this diagram."""
    command = f"armblocks trim {shlex.quote(model)}"
    lines: list[str] = []
    if system.states.size:
        state = system.states.names[0]
        lines.append(f"{command} --guess {shlex.quote(f'{state}=0.5')}")
        if system.parameters.size:
            free = shlex.quote(system.parameters.names[0])
            lines.append(f"{command} --free {free} --fix {shlex.quote(f'{state}=0.5')}")
    elif system.parameters.size and system.signals_layout.size:
        signal = shlex.quote(f"{system.signals_layout.names[-1]}=0.5")
        lines.append(f"{command} --free {shlex.quote(system.parameters.names[0])} --output {signal}")
    return lines


def _print_slots(
    kind: str, options: str, layout: Signature, starts: Mapping[str, NDArray[np.float64]], console: Console
) -> None:
    if not layout.size:
        return
    rows = table((kind, "left"), ("size", "left"), ("unit", "left"), ("at the start", "left"))
    slots = list(layout)
    for slot in slots[:MAX_ROWS]:
        size = "x".join(str(length) for length in slot.shape) or "1"
        numbers = np.ravel(starts[slot.name]).tolist()
        text = " ".join(f"{number:.6g}" for number in numbers[:MAX_NUMBERS])
        rows.add_row(slot.name, size, slot.unit, text + (" …" if len(numbers) > MAX_NUMBERS else ""))
    console.print()
    console.print(f"{kind}s, for {options}:")
    console.print(rows)
    if len(slots) > MAX_ROWS:
        console.print(f"and {len(slots) - MAX_ROWS} more")

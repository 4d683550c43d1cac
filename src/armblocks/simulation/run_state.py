"""The state of a run, from which another run continues, in memory or as a file.

A run shortens its last step to end at its stop time. A longer run would take the full step. Besides the
values at the end, a state therefore contains the arrays of the native loop before the last step. A run that
continues with the same solver, settings and parameters repeats the step with its full length, and its samples
are identical to the samples of the uninterrupted run. With other settings or parameters, or changed values, a
run restarts from the values at ``time``.
"""

from __future__ import annotations

import io
import json
import zipfile
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armblocks.equations import Signature
from armblocks.errors import FormatError, InputError
from armblocks.files import read_bounded, write_atomically
from armblocks.integration.run_point import Checkpoint, is_history
from armblocks.integration.system import CompiledSystem
from armblocks.integration.workspace import Count, Scalar

Array = NDArray[np.float64]

FORMAT = "armblocks run state 1"
"""Name and version of the file format."""
MAX_FILE_SIZE = 1 << 30
"""Maximum size of a file, bytes."""
_PARTS = ("states", "discrete", "algebraic")


@dataclass(frozen=True, kw_only=True, eq=False)
class RunState:
    """State of a run of system ``name`` at ``time`` (s), after the ticks and events at that time.

    ``states (nx,)``, ``discrete (nz,)`` and ``algebraic (nw,)`` are flat; ``names`` has the slot names of
    each. ``settings`` are the method and the numbers with which a run can continue from ``checkpoint``. Both
    are internal data of the integrator.
    """

    name: str
    time: float
    states: Array
    discrete: Array
    algebraic: Array
    names: tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]
    settings: str = ""
    checkpoint: Checkpoint | None = None
    past: Array = field(default_factory=lambda: np.empty(0))
    """The history of delayed signals in the integrator's form. If empty, the signals had their initial values
    before ``time``."""

    def save(self, path: str | PathLike[str]) -> None:
        """Write a file of NumPy's ``.npz`` format, atomically. Raises ``FormatError``."""
        description = {
            "format": FORMAT,
            "name": self.name,
            "names": self.names,
            "settings": self.settings,
            "method": "" if self.checkpoint is None else self.checkpoint.method,
        }
        arrays: dict[str, NDArray[Any]] = {
            "description": np.array(json.dumps(description)),
            "time": np.array(self.time),
            "states": self.states,
            "discrete": self.discrete,
            "algebraic": self.algebraic,
            "past": self.past,
        }
        if self.checkpoint is not None:
            arrays |= {"reals": self.checkpoint.reals, "counts": self.checkpoint.counts}
        buffer = io.BytesIO()
        np.savez(buffer, allow_pickle=False, **arrays)
        write_atomically(Path(path), buffer.getvalue())

    @classmethod
    def load(cls, path: str | PathLike[str]) -> RunState:
        """Inverse of :meth:`save`, bitwise exact. Raises ``FormatError`` for any other file."""
        data = read_bounded(Path(path), MAX_FILE_SIZE)
        try:
            with np.load(io.BytesIO(data), allow_pickle=False) as stored:
                arrays: dict[str, NDArray[Any]] = {name: stored[name] for name in stored.files}
            description = json.loads(str(arrays["description"]))
            if description["format"] != FORMAT:
                raise ValueError("another format")
            states, discrete, algebraic = (
                np.ascontiguousarray(arrays[part], dtype=np.float64).reshape(-1) for part in _PARTS
            )
            checkpoint = None
            if "reals" in arrays:
                checkpoint = Checkpoint(
                    reals=np.ascontiguousarray(arrays["reals"], dtype=np.float64).reshape(-1),
                    counts=np.ascontiguousarray(arrays["counts"], dtype=np.int64).reshape(-1),
                    method=str(description["method"]),
                )
            first, second, third = (tuple(map(str, part)) for part in description["names"])
            return cls(
                name=str(description["name"]),
                time=float(arrays["time"]),
                states=states,
                discrete=discrete,
                algebraic=algebraic,
                names=(first, second, third),
                settings=str(description["settings"]),
                checkpoint=checkpoint,
                past=np.ascontiguousarray(arrays.get("past", np.empty(0)), dtype=np.float64).reshape(-1),
            )
        except (ValueError, KeyError, TypeError, OSError, zipfile.BadZipFile, EOFError) as error:
            raise FormatError(
                "this file contains no run state",
                where=str(path),
                allowed="a file written by RunState.save",
                fix="save the state again: result.final_state.save(path)",
            ) from error


def slot_names(system: CompiledSystem) -> tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    """Names of the states, discrete variables and unknowns of implicit equations."""
    return system.states.names, system.discrete.names, system.algebraic.names


def check_state(system: CompiledSystem, state: RunState) -> None:
    """Raise ``InputError`` if a state has other variables or sizes than a system, values that are not finite,
    or damaged arrays."""
    layouts: tuple[Signature, ...] = (system.states, system.discrete, system.algebraic)
    for layout, names, values in zip(layouts, state.names, (state.states, state.discrete, state.algebraic)):
        other = sorted(set(layout.names) ^ set(names))
        if other or layout.names != names or values.shape != (layout.size,):
            difference = f"'{other[0]}' is only in one of them" if other else "their variables differ"
            raise InputError(
                f"the state of '{state.name}' at {state.time:g} s belongs to another system: {difference}",
                where=system.name,
                allowed="a state of the same diagram",
                fix="start a new run, or load the diagram that the state belongs to",
            )
        if not (np.isfinite(values).all() and np.isfinite(state.past).all()):
            raise InputError(
                f"the state of '{state.name}' at {state.time:g} s has values that are not finite",
                where=system.name,
                fix="use the state of a run that did not fail",
            )
    if state.past.size and not is_history(state.past, 2 + 2 * len(system.sizes.delays)):
        raise damaged_state(state, system.name)


def damaged_state(state: RunState, where: str) -> InputError:
    """The error for a state whose arrays do not have the sizes of the system ``where``."""
    return InputError(
        f"the state of '{state.name}' at {state.time:g} s is damaged: its arrays have other sizes or indices",
        where=where,
        allowed="the final_state of a result, or a state from RunState.load",
        fix="save the state again: result.final_state.save(path)",
    )


def settings_text(key: tuple[str, ...], numbers: tuple[float, ...], p: Array) -> str:
    """The settings that must be equal for two runs to take the same steps, as text."""
    import hashlib

    layout = (*Count.__members__, *Scalar.__members__)
    content = repr((layout, key, [float(number).hex() for number in numbers], p.tobytes()))
    return hashlib.sha256(content.encode()).hexdigest()

"""Export of linear systems to files and to python-control."""

from __future__ import annotations

import io
import json
from os import PathLike
from pathlib import Path
from typing import Any

from armblocks.analysis.state_space import StateSpaceModel
from armblocks.errors import InputError, UnknownNameError
from armblocks.extras import from_extra
from armblocks.files import write_atomically

FORMAT = "armblocks linear system 1"


def to_control(system: StateSpaceModel) -> Any:
    """A ``control.StateSpace`` with the same matrices and names.

    Raises ``InputError`` if python-control is not installed.
    """
    import importlib

    try:
        control: Any = importlib.import_module("control")
    except ImportError:
        raise InputError(
            "python-control is not installed",
            where="LinearSystem.to_control",
            allowed="an environment that has the package 'control'",
            fix="pip install control",
        ) from None

    def without_separators(names: tuple[str, ...]) -> list[str]:
        # In python-control, dots and brackets in names have a special meaning.
        return [name.replace(".", "_").replace("[", "_").replace("]", "").replace(",", "_") for name in names]

    return control.StateSpace(
        system.A,
        system.B,
        system.C,
        system.D,
        system.dt,
        states=without_separators(system.states),
        inputs=without_separators(system.inputs),
        outputs=without_separators(system.outputs),
        remove_useless_states=False,
    )


def save(system: StateSpaceModel, path: str | PathLike[str]) -> None:
    """Write a linear system to a file. The suffix is its format: ``.json``, ``.npz`` or ``.mat``.

    Raises ``UnknownNameError`` for an unsupported suffix, and ``FormatError`` if the file cannot be written.
    """
    target = Path(path)
    writers = {".json": _json, ".npz": _npz, ".mat": _mat}
    if target.suffix not in writers:
        raise UnknownNameError("file format", target.suffix, writers, where=str(path))
    write_atomically(target, writers[target.suffix](system))


def _description(system: StateSpaceModel) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "name": system.name,
        "dt": system.dt,
        "time": None if system.point is None else system.point.time,
        "states": list(system.states),
        "inputs": list(system.inputs),
        "outputs": list(system.outputs),
        "state_units": list(system.state_units),
        "input_units": list(system.input_units),
        "output_units": list(system.output_units),
    }


def _json(system: StateSpaceModel) -> bytes:
    document = {**_description(system), **{letter: getattr(system, letter).tolist() for letter in "ABCD"}}
    return (json.dumps(document, indent=1) + "\n").encode()


def _npz(system: StateSpaceModel) -> bytes:
    import numpy as np

    buffer = io.BytesIO()
    arrays: dict[str, Any] = {letter: getattr(system, letter) for letter in "ABCD"}
    arrays["description"] = np.array(json.dumps(_description(system)))
    np.savez(buffer, allow_pickle=False, **arrays)
    return buffer.getvalue()


def _mat(system: StateSpaceModel) -> bytes:
    """A MAT file with the arguments of MATLAB's ``ss(A, B, C, D, Ts)`` and the names of the signals."""
    import numpy as np

    with from_extra("analysis", "MAT files"):
        from scipy.io import savemat

    buffer = io.BytesIO()
    content: dict[str, Any] = {letter: getattr(system, letter) for letter in "ABCD"}
    content["Ts"] = system.dt
    for kind in ("states", "inputs", "outputs"):
        content[kind] = np.array(getattr(system, kind), dtype=object)
    savemat(buffer, content, oned_as="column")
    return buffer.getvalue()

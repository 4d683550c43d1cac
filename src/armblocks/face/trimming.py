"""Trimming: equilibrium operating points of a diagram."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks import interrupts
from armblocks.analysis.trim import TrimProblem, TrimResult, trim_system
from armblocks.diagram import Diagram
from armblocks.equations import HybridSystem, Signature
from armblocks.equations.evaluation import Point
from armblocks.equations.sensitivity import parameters_read_by_index
from armblocks.errors import InputError, UnknownNameError
from armblocks.face.linearizing import Where, operating_point_at, resolved_diagram
from armblocks.face.model import CompiledDiagram, compile_diagram
from armblocks.face.settings import RunSettings, check_settings, takes_settings

Array = NDArray[np.float64]
Values = Mapping[str, ArrayLike]


@takes_settings
@interrupts.kept()
def trim(
    diagram: Diagram | CompiledDiagram | str | PathLike[str],
    *,
    outputs: Values | None = None,
    states: Values | None = None,
    free: Sequence[str] = (),
    moving: Sequence[str] = (),
    guess: Values | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    at: Where = 0.0,
    parameters: Mapping[str, object] | None = None,
    tolerance: float = 1e-9,
    **settings: Unpack[RunSettings],
) -> TrimResult:
    """Find an equilibrium operating point of a diagram.

    A state is named ``block/state``, or by its block if the block has one state only.

    - ``states``: given values of states; all other states are unknowns.
    - ``moving``: states whose derivatives need not be zero.
    - ``free``: tunable parameters that are also unknowns, ``"torque.value"`` (or ``"torque"`` for a block
      with one tunable parameter), or an entry, ``"map.table[3]"``.
    - ``outputs``: required values of signals; NaN leaves an entry free.
    - ``bounds``: ``(lower, upper)`` of states and free parameters.
    - ``at``, ``guess``: the search starts at the state of the run at time ``at`` (0: its start), with the
      values of ``guess``. Time-dependent signals have their values at that time.

    Sampled blocks are in equilibrium if a tick changes no state. The residual of every equation is below
    ``tolerance`` in the unit of the equation, or below the rounding errors of its terms if these are larger.

    Raises ``SimulationError``, with the equations that are not satisfied, the reason, and the best point
    found as ``partial``; ``UnknownNameError`` and ``InputError`` for invalid names and values.
    """
    check_settings(settings, trim)
    resolved = resolved_diagram(diagram, parameters, "trim")
    system = compile_diagram(resolved).system
    known = operating_point_at(resolved, at, **settings)
    x = system.states.pack(known.states)
    p = system.parameters.pack(known.parameters)
    fixed_states = _values(system.states, states or {}, "state", system)
    x[list(fixed_states)] = list(fixed_states.values())
    indices = _parameter_indices(system, free)
    for name, value in (guess or {}).items():
        layout, slot = _state_or_parameter(system, name)
        kind, vector = ("state", x) if layout is system.states else ("parameter", p)
        guessed = _values(layout, {slot: value}, kind, system)
        vector[list(guessed)] = list(guessed.values())
    moving_states = {index for name in moving for index in _indices(system.states, name, "state", system)}
    rows, targets = _targets(system, outputs or {})
    all_states = range(system.states.size)
    return trim_system(
        TrimProblem(
            system=system,
            start=Point(
                t=known.time,
                x=x,
                z=system.discrete.pack(known.discrete),
                w=system.algebraic.pack(known.algebraic),
                p=p,
            ),
            free_states=np.array([k for k in all_states if k not in fixed_states], dtype=np.intp),
            resting=np.array([k for k in all_states if k not in moving_states], dtype=np.intp),
            free_parameters=np.array(indices, dtype=np.intp),
            rows=np.array(rows, dtype=np.intp),
            targets=np.array(targets, dtype=np.float64),
            bounds=_bounds(system, bounds or {}),
            tolerance=tolerance,
        )
    )


def _slot_name(layout: Signature, name: str, kind: str, system: HybridSystem) -> str:
    """The name of a slot: the given name, or the name of the only slot of the named block."""
    if name in layout.ranges:
        return name
    separator = "." if kind == "parameter" else "/"
    matches = [slot.name for slot in layout if slot.name.rpartition(separator)[0] == name]
    if len(matches) != 1:
        raise UnknownNameError(kind, name, layout.names, where=system.name)
    return matches[0]


def _indices(layout: Signature, name: str, kind: str, system: HybridSystem) -> list[int]:
    """The indices of a whole slot, or of one entry of it: ``table.values[3]``."""
    head, bracket, _ = name.partition("[")
    if bracket and head in layout.ranges and name in layout[head].elements:
        return [layout.ranges[head].start + layout[head].elements.index(name)]
    return list(_span(layout, _slot_name(layout, name, kind, system)))


def _values(layout: Signature, values: Values, kind: str, system: HybridSystem) -> dict[int, float]:
    """Values by index in the flat vector; a number is broadcast to a vector."""
    numbers: dict[int, float] = {}
    for name, value in values.items():
        slot = layout[_slot_name(layout, name, kind, system)]
        indices = _indices(layout, name, kind, system)
        numbers |= dict(zip(indices, _broadcast(value, slot.shape, f"{kind} '{name}'").tolist()))
    return numbers


def _broadcast(value: ArrayLike, shape: tuple[int, ...], subject: str) -> Array:
    array = np.asarray(value, dtype=np.float64)
    if array.ndim and array.shape != shape:
        raise InputError(
            f"{subject} is given values of shape {array.shape}",
            allowed=f"a number, or shape {shape}",
            where="trim",
            fix="give one number for each element, or one for all",
        )
    return np.broadcast_to(array, shape).ravel()


def _span(layout: Signature, slot: str) -> range:
    return range(*layout.ranges[slot].indices(layout.size))


def _parameter_indices(system: HybridSystem, free: Sequence[str]) -> list[int]:
    free_indices: list[int] = []
    tables = parameters_read_by_index(system) if free else frozenset[str]()
    for name in free:
        indices = _indices(system.parameters, name, "parameter", system)
        owner = next(slot for slot in system.parameters.names if indices[0] in _span(system.parameters, slot))
        if owner in tables:
            raise InputError(
                f"the free parameter '{name}' is part of a table that is read by index",
                where=system.name,
                allowed="parameters outside such tables",
                fix="free the input of the table, or a gain after it",
            )
        free_indices += indices
    return free_indices


def _targets(system: HybridSystem, outputs: Values) -> tuple[list[int], list[float]]:
    rows: list[int] = []
    targets: list[float] = []
    layout = system.signals_layout
    for name, value in outputs.items():
        path = system.aliases.get(name, name)
        if path not in layout.ranges:
            raise UnknownNameError("signal", name, [*layout.names, *system.aliases], where=system.name)
        required = _broadcast(value, layout[path].shape, f"signal '{name}'").tolist()
        indices = range(*layout.ranges[path].indices(layout.size))
        entries = [(index, target) for index, target in zip(indices, required) if not np.isnan(target)]
        rows += [index for index, _ in entries]
        targets += [target for _, target in entries]
    return rows, targets


def _bounds(
    system: HybridSystem, bounds: Mapping[str, tuple[float, float]]
) -> dict[str, tuple[float, float]]:
    """The bounds by the name of every scalar."""
    scalar_bounds: dict[str, tuple[float, float]] = {}
    for name, (low, high) in bounds.items():
        layout, slot = _state_or_parameter(system, name)
        if not low <= high:
            raise InputError(
                f"the bounds of '{name}' are {low:g} and {high:g}",
                allowed="the lower number first",
                fix="exchange the two numbers",
                where=system.name,
            )
        scalar_bounds |= dict.fromkeys(layout[slot].elements, (float(low), float(high)))
    return scalar_bounds


def _state_or_parameter(system: HybridSystem, name: str) -> tuple[Signature, str]:
    """The layout and the slot of a name; states take precedence over parameters."""
    try:
        return system.states, _slot_name(system.states, name, "state", system)
    except UnknownNameError:
        valid_names = (*system.states.names, *system.parameters.names)
    try:
        return system.parameters, _slot_name(system.parameters, name, "parameter", system)
    except UnknownNameError:
        raise UnknownNameError("state or parameter", name, valid_names, where=system.name) from None

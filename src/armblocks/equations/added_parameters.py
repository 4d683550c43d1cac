"""A system with added parameters that perturb its own parameters."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from casadi import SX, Function, vertcat, vertsplit

from armblocks.equations.hybrid_system import HybridSystem
from armblocks.equations.signatures import Signature, Slot
from armblocks.equations.symbols import flatten
from armblocks.equations.traced_function import TracedFunction


@dataclass(frozen=True, eq=False, kw_only=True)
class AddedParameters:
    """Added parameters ``symbols`` with the value 0. ``changes`` are the increments of other parameters as
    expressions of all ``symbols``."""

    slots: tuple[Slot, ...]
    symbols: tuple[SX, ...]
    changes: Mapping[str, SX]


def with_added_parameters(system: HybridSystem, added: AddedParameters) -> HybridSystem:
    """The same equations with parameters appended; at 0 they have no effect.

    Changes of parameters that the system does not have are ignored. The derivative with respect to an added
    parameter is the directional derivative along its changes.
    """
    old = system.parameters
    layout = Signature((*old.slots, *added.slots))
    p = SX.sym("p", layout.size)
    columns = vertsplit(p, [0, *np.cumsum([slot.size for slot in layout]).tolist()])
    parts = dict(zip(layout.names, columns))
    changed = {name: parts[name] for name in old.names}
    paths = [path for path in added.changes if path in changed]
    flat = [flatten(added.changes[path], old[path].shape) for path in paths]
    values = [parts[slot.name] for slot in added.slots]
    for path, change in zip(paths, Function("f", list(added.symbols), flat).call(values, True, False)):
        changed[path] = changed[path] + change
    whole = vertcat(*changed.values(), SX(0, 1))

    def extended(traced: TracedFunction) -> TracedFunction:
        if "p" not in traced.inputs.names:
            return traced
        index = traced.inputs.names.index("p")
        values = [whole if k == index else symbol for k, symbol in enumerate(traced.arguments)]
        *results, rounded = Function("f", list(traced.arguments), [*traced.results, traced.rounded]).call(
            values, True, False
        )
        slots = [Slot("p", (layout.size,)) if k == index else slot for k, slot in enumerate(traced.inputs)]
        arguments = tuple(p if k == index else symbol for k, symbol in enumerate(traced.arguments))
        return dataclasses.replace(
            traced,
            inputs=Signature(tuple(slots)),
            arguments=arguments,
            results=tuple(results),
            rounded=rounded,
        )

    delays = system.delays
    return dataclasses.replace(
        system,
        parameters=layout,
        parameter_values=np.concatenate(
            [system.parameter_values, np.zeros(layout.size - old.size, dtype=np.float64)]
        ),
        delays=None
        if delays is None
        else dataclasses.replace(
            delays, **{key: extended(getattr(delays, key)) for key in ("inputs", "times", "bounds")}
        ),
        **{
            field.name: extended(value)
            for field in dataclasses.fields(system)
            if isinstance(value := getattr(system, field.name), TracedFunction)
        },
    )

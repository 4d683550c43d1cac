"""The derivatives of the times of instants, as signals of a system with sensitivities."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from casadi import SX, Function, densify, vertcat

from armblocks.equations.forward_differentiation import directional_derivative
from armblocks.equations.hybrid_system import HybridSystem
from armblocks.equations.sensitivity_layout import PREFIX
from armblocks.equations.signatures import Signature, Slot, signature

INSTANT = PREFIX + "instant"
"""The signal with the time of the latest instant (event, jump of a source, arrival of a delayed jump), s."""


def time_derivative(parameter: str) -> str:
    """The name of the signal with the derivative of the time of the latest instant."""
    return f"{PREFIX}instant by {parameter}"


def rate_name(path: str) -> str:
    """The name of the signal with the time derivative of a signal."""
    return f"{PREFIX}rate of {path}"


def with_instant_times(system: HybridSystem, paths: Sequence[str]) -> HybridSystem:
    """A system of :func:`~armblocks.equations.sensitivity.sensitivity_system` with further signals: the time
    of the latest instant, its derivatives with respect to the parameters, and the time derivatives of the
    signals ``paths``.

    After a tick the signals still describe the instant before it. A system without instants whose times may
    depend on parameters is returned unchanged. Systems with delays have no time derivatives here.
    """
    names = [name for name in system.discrete.names if name == INSTANT or name.startswith(INSTANT + " by ")]
    if not names:
        return system
    old = system.signals
    t, x, z, w, p = old.arguments
    (y,) = old.results
    slots = [Slot(name) for name in names]
    values = [z[system.discrete.ranges[name]] for name in names]
    if system.delays is None:
        flow = Function("f", list(system.derivative.arguments), list(system.derivative.results))
        (xd,) = flow.call([t, x, z, w, p], True, False)
        wd = SX.zeros(w.numel())
        for slot in system.algebraic:
            if slot.name + "'" in system.algebraic.ranges:
                wd[system.algebraic.ranges[slot.name]] = w[system.algebraic.ranges[slot.name + "'"]]
        for path in paths:
            part = y[system.signals_layout.ranges[path]]
            values.append(densify(directional_derivative(part, vertcat(t, x, w), vertcat(1.0, xd, wd))))
            slots.append(Slot(rate_name(path), system.signals_layout[path].shape))
    layout = Signature((*system.signals_layout.slots, *slots))
    return dataclasses.replace(
        system,
        signals_layout=layout,
        signals=dataclasses.replace(
            old, outputs=signature((old.outputs.names[0], (layout.size,))), results=(vertcat(y, *values),)
        ),
    )

"""A whole diagram as equations: the narrow waist between modelling and numerics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from armblocks.equations.signatures import Signature

if TYPE_CHECKING:
    from armblocks.equations.traced_function import TracedFunction


@dataclass(frozen=True, eq=False, kw_only=True)
class HybridSystem:
    """``x' = derivative(t, x, p)``, ``y = signals(t, x, p)``, ``x(0) = initial_states(p)``.

    The flat vectors ``x`` (states), ``p`` (tunable parameters) and ``y`` (signals) are laid out by the three
    signatures. Slot names are paths: a signal is ``block/port``, a state ``block/state``, a parameter
    ``block.parameter``; signals stand in evaluation order, so the first non-finite one is the culprit.

    All four functions have flat ends:
    ``derivative`` and ``signals``: inputs ``t ()``, ``x (nx,)``, ``p (np,)``; one output ``xd (nx,)`` or
    ``y (ny,)``.
    ``initial_states``: input ``p``; output ``x0 (nx,)``.
    ``breakpoints``: input ``p``; output ``times (nb,)``: known instants at which signals jump (a step
    source). A signal is right-continuous there: at the instant itself it has its new value.
    """

    name: str
    states: Signature
    parameters: Signature
    signals_layout: Signature
    parameter_values: NDArray[np.float64]
    derivative: TracedFunction
    signals: TracedFunction
    initial_states: TracedFunction
    breakpoints: TracedFunction
    aliases: Mapping[str, str]
    """Other names of signals: the block's bare name where it has one output, and an input port
    (``scope/u``) for the signal that drives it."""

"""Declarations of the system's functions that the native loop calls. ``emit_function`` of the compiler writes
their code.

The arguments are arrays of the system: ``t`` the time, ``x`` the states, ``z`` the discrete variables with
the delayed values, ``w`` the unknowns of the implicit equations, ``p`` the parameters. The last arrays are
the results.
"""

from __future__ import annotations

from armblocks.routines.memory import Reals
from armblocks.routines.routine import Routine, external


@external
def derivative(r: Routine, t: Reals, x: Reals, z: Reals, w: Reals, p: Reals, xd: Reals) -> None:
    """``xd = f(t, x, z, w, p)``."""


@external
def flow_jacobian(r: Routine, t: Reals, x: Reals, z: Reals, w: Reals, p: Reals, J: Reals, T: Reals) -> None:
    """The entries of the derivatives of ``(f, g)`` with respect to ``(x, w)``, and with respect to
    time."""


@external
def residual(r: Routine, t: Reals, x: Reals, z: Reals, w: Reals, p: Reals, g: Reals) -> None:
    """``g(t, x, z, w, p)``, which is zero at the solution ``w``."""


@external
def residual_jacobian(r: Routine, t: Reals, x: Reals, z: Reals, w: Reals, p: Reals, J: Reals) -> None:
    """The derivatives of ``g`` with respect to ``w``, row by row."""


@external
def update(
    r: Routine, t: Reals, x: Reals, z: Reals, w: Reals, p: Reals, ticking: Reals, new_z: Reals
) -> None:
    """``z`` after the ticks of the clocks whose ``ticking`` is 1."""


@external
def guards(r: Routine, t: Reals, x: Reals, z: Reals, w: Reals, p: Reals, g: Reals) -> None:
    """The values whose sign changes are events, for a system without modes."""


def _guards_and_modes(
    r: Routine, t: Reals, x: Reals, z: Reals, w: Reals, p: Reals, g: Reals, contradictions: Reals
) -> None:
    """The values of the guards, and for each mode a value that is nonzero if the mode is inconsistent."""


guards_and_modes = external(_guards_and_modes, "guards")


@external
def reset(
    r: Routine, t: Reals, x: Reals, z: Reals, w: Reals, p: Reals, fired: Reals, new_x: Reals, new_z: Reals
) -> None:
    """``x`` and ``z`` after events; ``fired`` has 1 for guards that fired upwards, -1 downwards, else 0."""


@external
def delay_bounds(r: Routine, p: Reals, bounds: Reals) -> None:
    """The shortest delay of each delayed signal, then the longest of each, s."""


@external
def delay_times(r: Routine, t: Reals, x: Reals, z: Reals, w: Reals, p: Reals, tau: Reals) -> None:
    """The delay of each delayed signal, s."""


@external
def delay_inputs(
    r: Routine, t: Reals, x: Reals, z: Reals, w: Reals, p: Reals, values: Reals, derivatives: Reals
) -> None:
    """The signals that are delayed, and their time derivatives."""

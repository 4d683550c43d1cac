"""All integrators: the tables in the modules of ``simulation/methods``.

To add an integrator, add a file there. Names are matched without regard to case; Simulink's and SciPy's names
are accepted as aliases.
"""

from __future__ import annotations

from armblocks.errors import UnknownNameError
from armblocks.integration.butcher_tableau import ButcherTableau
from armblocks.integration.rosenbrock_tableau import RosenbrockTableau, Tableau
from armblocks.package_folder import values_in
from armblocks.simulation.methods.rosenbrock import RODAS5P
from armblocks.simulation.methods.runge_kutta import RK45


def _sort_key(tableau: Tableau) -> tuple[bool, bool, int]:
    """Sort key: explicit before implicit, fixed-step before adaptive methods, then ascending order."""
    return isinstance(tableau, RosenbrockTableau), tableau.adaptive, tableau.order


TABLEAUX: tuple[Tableau, ...] = tuple(
    sorted(values_in("armblocks.simulation.methods", (ButcherTableau, RosenbrockTableau)), key=_sort_key)
)
"""All integrators: explicit methods, then methods for stiff systems."""

DEFAULT = RK45
"""The method with which ``auto`` begins for a system with states."""

STIFF = RODAS5P
"""The method with which ``auto`` continues if the system is stiff."""

_BY_NAME = {name.casefold(): tableau for tableau in TABLEAUX for name in (tableau.name, *tableau.aliases)}


def find_tableau(name: str, where: str = "") -> Tableau:
    """The integrator of this name or alias, regardless of case. ``where``: the name of the system.

    Raises ``UnknownNameError`` with the nearest name.
    """
    tableau = _BY_NAME.get(name.casefold())
    if tableau is None:
        raise UnknownNameError("solver", name, ["auto", *_BY_NAME], where=where)
    return tableau
